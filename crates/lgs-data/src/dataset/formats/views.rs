//! Synchronised cameras: a folder of images or a video for each, with the same frame numbers.

use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::{times, videos};
use crate::files::FileError;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const IMAGES: [&str; 3] = ["png", "jpg", "jpeg"];

/// Whether a path ends with one of some extensions.
pub(super) fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    extension.is_some_and(|e| extensions.contains(&e.as_str()))
}

/// All images in a folder and below.
pub(super) fn images_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            images_below(&path, found);
        } else if has_extension(&path, &IMAGES) {
            found.push(path);
        }
    }
}

/// Where the images of a camera are: `NAME`, `images/NAME` or `videos/NAME`, a folder of images (perhaps in
/// `images` below it) or a video, its ending in small or capital letters; nothing if there is none.
pub(super) fn place_of(root: &Path, name: &str) -> Option<PathBuf> {
    let folders = ["", "images", "videos"].map(|folder| root.join(folder));
    folders.into_iter().find_map(|folder| {
        let own = folder.join(name);
        if !name.is_empty() && own.is_dir() {
            let inner = own.join("images");
            return Some(if inner.is_dir() { inner } else { own });
        }
        let endings = videos::EXTENSIONS.iter().flat_map(|e| [(*e).to_owned(), e.to_ascii_uppercase()]);
        endings.map(|e| folder.join(format!("{name}.{e}"))).find(|path| path.is_file())
    })
}

/// The images of all cameras by moment.
pub(super) struct Views {
    /// Frame numbers, rising.
    pub(super) moments: Vec<u64>,
    /// By camera: its folder or video, and its images by number.
    cameras: Vec<(PathBuf, BTreeMap<u64, PathBuf>)>,
}

impl Views {
    /// Looks for the images of every camera.
    pub(super) fn of(places: &[PathBuf]) -> Result<Self, DatasetError> {
        let mut cameras = Vec::new();
        for place in places {
            let folder = if place.is_file() { videos::frames_of(place)? } else { place.clone() };
            let images = numbered(&folder)?;
            cameras.push((place.clone(), images));
        }
        let moments: BTreeSet<u64> = cameras.iter().flat_map(|(_, images)| images.keys().copied()).collect();
        Ok(Self { moments: moments.into_iter().collect(), cameras })
    }

    /// The image of a camera at a moment. Where there is none this is the path that another camera's name
    /// would have, which is then absent.
    pub(super) fn image(&self, camera: usize, moment: u64) -> PathBuf {
        let (place, images) = &self.cameras[camera];
        let of_others = || {
            let other = self.cameras.iter().find_map(|(_, images)| images.get(&moment)?.file_name());
            place.join(other.unwrap_or_default())
        };
        images.get(&moment).cloned().unwrap_or_else(of_others)
    }
}

/// Images of a folder by the last number in their names, or in order where some name has none.
fn numbered(folder: &Path) -> Result<BTreeMap<u64, PathBuf>, DatasetError> {
    let unreadable = |reason| FileError::new("list folder", folder, reason);
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        paths.push(entry.map_err(unreadable)?.path());
    }
    paths.retain(|path| has_extension(path, &IMAGES));
    paths.sort();
    let number = |path: &PathBuf| times::last_number(path.to_str()?);
    let numbers: Option<Vec<u64>> = paths.iter().map(number).collect();
    let numbers = numbers.unwrap_or_else(|| (0..paths.len() as u64).collect());
    let mut found = BTreeMap::new();
    for (number, path) in numbers.into_iter().zip(paths) {
        if let Some(other) = found.insert(number, path.clone()) {
            let reason =
                format!("two images have the frame number {number}; the other is {}", other.display());
            return Err(DatasetError::new(&path, Problem::Malformed(reason)));
        }
    }
    Ok(found)
}
