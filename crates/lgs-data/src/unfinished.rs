//! What is half-written at the moment, so that an interrupted program can take it away.
//!
//! Whoever writes a file holds a [`Writing`] until all of it is there. Temporary folders are incomplete for
//! longer; they are known by their paths. [`abandon`] waits for the files under way, lets no other one begin,
//! and removes the folders, but for finished files of a folder whose files are of use one by one: they are
//! moved to where they are found.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, TryLockError};
use std::time::{Duration, Instant};

use crate::thresholds::ABANDON_PATIENCE;

/// Held to read by all who write, to write by who ends that.
static GATE: RwLock<()> = RwLock::new(());
/// Whether writing has ended for good.
static IS_OVER: AtomicBool = AtomicBool::new(false);
/// Temporary folders and files, by their absolute paths.
static KNOWN: Mutex<BTreeMap<PathBuf, Known>> = Mutex::new(BTreeMap::new());

/// Between two looks at whether others still write.
const PAUSE: Duration = Duration::from_millis(5);

/// How the names of temporary files and folders begin.
pub(crate) const PREFIX: &str = ".partial-";
/// Folder of finished files of a set that was not.
const UNFINISHED: &str = "unfinished";

/// The right to write, for as long as it lives; a thread holds one at most.
pub(crate) struct Writing {
    _gate: RwLockReadGuard<'static, ()>,
}

/// Begins to write; never returns once writing was abandoned.
pub(crate) fn writing() -> Writing {
    while IS_OVER.load(Ordering::SeqCst) {
        std::thread::park();
    }
    Writing { _gate: GATE.read().unwrap_or_else(PoisonError::into_inner) }
}

/// What becomes of something unfinished when the program is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It goes.
    Removed,
    /// Its finished files are kept.
    Kept,
}

struct Known {
    destination: PathBuf,
    fate: Fate,
}

/// A temporary file or folder that is known until this is dropped.
#[derive(Debug)]
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes a path known, and where its contents will be; relative paths are meant from the present folder.
    pub(crate) fn new(path: &Path, destination: &Path, fate: Fate) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        known().insert(path.clone(), Known { destination: destination.to_owned(), fate });
        Self(path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        known().remove(&self.0);
    }
}

fn known() -> MutexGuard<'static, BTreeMap<PathBuf, Known>> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The path that a file will have in the end, where it is on its way in a temporary folder; else its own.
#[must_use]
pub fn destination_of(path: &Path) -> PathBuf {
    let known = known();
    for folder in path.ancestors().filter(|_| !known.is_empty()) {
        let absolute = std::path::absolute(folder).unwrap_or_default();
        if let (Some(found), Ok(rest)) = (known.get(&absolute), path.strip_prefix(folder)) {
            let is_whole = rest.as_os_str().is_empty();
            return if is_whole { found.destination.clone() } else { found.destination.join(rest) };
        }
    }
    path.to_owned()
}

/// The reason without the path of a temporary file that the crate `tempfile` adds to it.
pub(crate) fn bare(reason: io::Error) -> io::Error {
    match reason.to_string().split_once(" at path \"") {
        Some((told, path)) if path.contains(PREFIX) => io::Error::new(reason.kind(), told),
        _ => reason,
    }
}

/// Finished files of a set that was not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Where they lie.
    pub folder: PathBuf,
    /// How many they are.
    pub files: usize,
}

/// Moves a temporary folder of finished files to a new name in another, `unfinished` or one with a number;
/// nothing if there are none.
pub(crate) fn keep(temporary: &Path, out: &Path) -> io::Result<Option<Kept>> {
    let mut files = 0;
    for entry in fs::read_dir(temporary)? {
        let entry = entry?;
        if is_temporary(&entry.file_name()) {
            fs::remove_file(entry.path())?;
        } else {
            files += 1;
        }
    }
    if files == 0 {
        return Ok(None);
    }
    let numbered = (2..).map(|number: usize| out.join(format!("{UNFINISHED}-{number}")));
    let mut names = std::iter::once(out.join(UNFINISHED)).chain(numbered);
    let folder = names.find(|name| fs::symlink_metadata(name).is_err());
    let folder = folder.ok_or_else(|| io::Error::other("no name is free"))?;
    fs::rename(temporary, &folder)?;
    Ok(Some(Kept { folder, files }))
}

fn is_temporary(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(PREFIX)
}

/// What was left of all that was unfinished.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Abandoned {
    /// Finished files that are kept.
    pub kept: Vec<Kept>,
    /// What could not be removed.
    pub left: Vec<PathBuf>,
    /// Whether some file was still being written when patience ended.
    pub is_writing: bool,
}

/// Ends all writing of this process: waits for files under way, for ten seconds at most, keeps finished files
/// that are of use by themselves and removes what else is unfinished. Whoever would write after this waits
/// forever, so that the program has to end.
pub fn abandon() -> Abandoned {
    let begun = Instant::now();
    IS_OVER.store(true, Ordering::SeqCst);
    let gate = loop {
        match GATE.try_write() {
            Ok(gate) => break Some(gate),
            Err(TryLockError::Poisoned(gate)) => break Some(gate.into_inner()),
            Err(TryLockError::WouldBlock) if begun.elapsed() > ABANDON_PATIENCE => break None,
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
    };
    let mut abandoned = Abandoned { is_writing: gate.is_none(), ..Abandoned::default() };
    for (path, Known { destination, fate }) in known().iter() {
        let kept = if *fate == Fate::Kept { keep(path, destination) } else { Ok(None) };
        match kept {
            Ok(Some(kept)) => abandoned.kept.push(kept),
            Ok(None) if is_removed(path, begun) => {}
            _ => abandoned.left.push(path.clone()),
        }
    }
    // Nobody may come in any more, also after this call.
    std::mem::forget(gate);
    abandoned
}

/// Removes a file or folder; once more while other programs, such as ffmpeg, put files into it: without their
/// folder they end.
fn is_removed(path: &Path, begun: Instant) -> bool {
    loop {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        let is_gone = fs::symlink_metadata(path).is_err();
        if is_gone || begun.elapsed() > ABANDON_PATIENCE {
            return is_gone;
        }
        std::thread::sleep(PAUSE);
    }
}
