//! Decoded images within a bound of memory: those that were used last are held, the others lie decoded in one
//! temporary file that nobody else can see and that goes away with the set.
//!
//! As long as all images fit, no file is made. Once they do not, every image is written to the file when it
//! is decoded, so that using a set never writes: a full disk shows while the set is loaded. What an image
//! holds does not depend on where it lay.

use crate::files::FileError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A decoded image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picture {
    /// Pixels `[h, w, 4]`, straight alpha.
    pub rgba: Vec<u8>,
    /// `[h, w]`: 0 where a pixel says nothing of the scene and is to be left out of losses and scores, 255
    /// elsewhere. Without a mask every pixel counts.
    pub mask: Option<Vec<u8>>,
}

impl Picture {
    fn bytes(&self) -> usize {
        self.rgba.len() + self.mask.as_ref().map_or(0, Vec::len)
    }
}

/// The pixels of a frame, wherever they lie.
#[derive(Clone, Debug)]
pub struct Pixels {
    place: Place,
    has_alpha: bool,
    has_mask: bool,
    counted: usize,
}

#[derive(Clone, Debug)]
enum Place {
    Memory(Arc<Picture>),
    Store(Arc<Store>, usize),
}

impl Pixels {
    /// Pixels that stay in memory.
    #[must_use]
    pub fn of(picture: Picture) -> Self {
        let picture = Arc::new(picture);
        Self::at(Place::Memory(Arc::clone(&picture)), &picture)
    }

    fn at(place: Place, picture: &Picture) -> Self {
        let left_out = picture.mask.iter().flatten().filter(|&&m| m == 0).count();
        let counted = picture.rgba.len() / 4 - left_out;
        Self { place, has_alpha: has_alpha(&picture.rgba), has_mask: picture.mask.is_some(), counted }
    }

    /// The image.
    ///
    /// # Panics
    /// If the temporary file that this program made cannot be read any more.
    #[must_use]
    pub fn picture(&self) -> Arc<Picture> {
        match &self.place {
            Place::Memory(picture) => Arc::clone(picture),
            Place::Store(store, key) => match store.picture(*key) {
                Ok(picture) => picture,
                Err(error) => panic!("the temporary file of decoded images is unreadable: {error}"),
            },
        }
    }

    /// Whether any pixel is not fully opaque.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// Whether there is a mask.
    #[must_use]
    pub fn has_mask(&self) -> bool {
        self.has_mask
    }

    /// Number of pixels that no mask leaves out.
    #[must_use]
    pub fn counted(&self) -> usize {
        self.counted
    }
}

impl From<Vec<u8>> for Pixels {
    /// Pixels `[h, w, 4]` in memory, without a mask.
    fn from(rgba: Vec<u8>) -> Self {
        Self::of(Picture { rgba, mask: None })
    }
}

fn has_alpha(rgba: &[u8]) -> bool {
    rgba.as_chunks::<4>().0.iter().any(|p| p[3] < 255)
}

/// All images of a set.
#[derive(Debug)]
pub(super) struct Store {
    /// Most bytes that are held.
    limit: usize,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// Images in memory, each with its last use.
    held: BTreeMap<usize, (Arc<Picture>, u64)>,
    /// Keys by last use.
    uses: BTreeMap<u64, usize>,
    bytes: usize,
    clock: u64,
    /// Where an image lies in the file: offset, bytes of pixels, bytes of the mask.
    written: BTreeMap<usize, (u64, usize, usize)>,
    file: Option<File>,
    end: u64,
    next: usize,
}

impl Store {
    /// A store that holds so many bytes.
    pub(super) fn new(limit: usize) -> Arc<Self> {
        Arc::new(Self { limit, state: Mutex::default() })
    }

    /// Keeps an image.
    pub(super) fn keep(self: &Arc<Self>, picture: Picture) -> Result<Pixels, FileError> {
        let picture = Arc::new(picture);
        let mut state = self.state();
        let key = state.next;
        state.next += 1;
        state
            .insert(key, Arc::clone(&picture), self.limit)
            .map_err(|reason| FileError::new("keep decoded images in", &std::env::temp_dir(), reason))?;
        Ok(Pixels::at(Place::Store(Arc::clone(self), key), &picture))
    }

    fn picture(&self, key: usize) -> io::Result<Arc<Picture>> {
        let mut state = self.state();
        if let Some(picture) = state.used(key) {
            return Ok(picture);
        }
        let picture = Arc::new(state.read(key)?);
        state.hold(key, Arc::clone(&picture), self.limit);
        Ok(picture)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Takes in a new image; the first one that does not fit brings all to the file.
    fn insert(&mut self, key: usize, picture: Arc<Picture>, limit: usize) -> io::Result<()> {
        if self.file.is_none() && self.bytes + picture.bytes() > limit {
            self.file = Some(tempfile::tempfile()?);
            let held: Vec<_> = self.held.iter().map(|(&key, (picture, _))| (key, picture.clone())).collect();
            held.iter().try_for_each(|(key, picture)| self.write(*key, picture))?;
        }
        if self.file.is_some() {
            self.write(key, &picture)?;
        }
        self.hold(key, picture, limit);
        Ok(())
    }

    /// The image if it is in memory, which is a use of it.
    fn used(&mut self, key: usize) -> Option<Arc<Picture>> {
        let (picture, last) = self.held.get_mut(&key)?;
        self.uses.remove(last);
        self.clock += 1;
        *last = self.clock;
        self.uses.insert(self.clock, key);
        Some(Arc::clone(picture))
    }

    /// Holds an image in memory; those that were used longest ago make room.
    fn hold(&mut self, key: usize, picture: Arc<Picture>, limit: usize) {
        self.clock += 1;
        self.bytes += picture.bytes();
        self.held.insert(key, (picture, self.clock));
        self.uses.insert(self.clock, key);
        while self.bytes > limit {
            let Some((_, oldest)) = self.uses.pop_first() else { break };
            self.bytes -= self.held.remove(&oldest).map_or(0, |(picture, _)| picture.bytes());
        }
    }

    fn write(&mut self, key: usize, picture: &Picture) -> io::Result<()> {
        let mask = picture.mask.as_deref().unwrap_or_default();
        if let Some(file) = &mut self.file {
            file.seek(SeekFrom::Start(self.end))?;
            file.write_all(&picture.rgba)?;
            file.write_all(mask)?;
        }
        self.written.insert(key, (self.end, picture.rgba.len(), mask.len()));
        self.end += picture.bytes() as u64;
        Ok(())
    }

    fn read(&mut self, key: usize) -> io::Result<Picture> {
        let absent = || io::Error::new(io::ErrorKind::NotFound, "an image was not written");
        let &(at, pixels, masked) = self.written.get(&key).ok_or_else(absent)?;
        let file = self.file.as_mut().ok_or_else(absent)?;
        file.seek(SeekFrom::Start(at))?;
        let (mut rgba, mut mask) = (vec![0; pixels], vec![0; masked]);
        file.read_exact(&mut rgba)?;
        file.read_exact(&mut mask)?;
        Ok(Picture { rgba, mask: (masked > 0).then_some(mask) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(i: usize) -> Picture {
        Picture {
            rgba: vec![i as u8; 4 * 6],
            mask: i.is_multiple_of(3).then(|| vec![(i % 2) as u8 * 255; 6]),
        }
    }

    fn kept(limit: usize) -> (Arc<Store>, Vec<Pixels>) {
        let store = Store::new(limit);
        let pixels = (0..20).map(|i| store.keep(picture(i)).unwrap()).collect();
        (store, pixels)
    }

    #[test]
    fn images_are_the_same_whatever_the_bound() {
        for limit in [0, 30, 100, 1 << 20] {
            let (store, pixels) = kept(limit);
            for i in (0..20).chain((0..20).rev()).chain([3, 3, 17, 3]) {
                assert_eq!(*pixels[i].picture(), picture(i), "limit {limit}");
                assert_eq!(pixels[i].has_mask(), i.is_multiple_of(3));
                assert!(store.state().bytes <= limit, "limit {limit}");
            }
            assert_eq!(store.state().file.is_some(), limit < 20 * 30, "limit {limit}");
        }
    }

    #[test]
    fn what_was_used_last_stays() {
        let (store, pixels) = kept(4 * 30);
        for i in [5, 6, 7, 5] {
            let _ = pixels[i].picture();
        }
        let _ = pixels[8].picture();
        let _ = pixels[9].picture();
        assert!(store.state().held.contains_key(&5) && !store.state().held.contains_key(&6));
    }
}
