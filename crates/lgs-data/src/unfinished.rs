//! What is half-written at the moment, so that an interrupted program can take it away.
//!
//! Whoever writes a file holds a [`Writing`] until all of it is there. Temporary folders are incomplete for
//! longer; they are known by their paths. [`abandon`] waits for the files under way, lets no other one begin,
//! and removes the folders.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, TryLockError};
use std::time::{Duration, Instant};

use crate::thresholds::ABANDON_PATIENCE;

/// Held to read by all who write, to write by who ends that.
static GATE: RwLock<()> = RwLock::new(());
/// Whether writing has ended for good.
static IS_OVER: AtomicBool = AtomicBool::new(false);
/// Temporary folders and files.
static KNOWN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Between two looks at whether others still write.
const PAUSE: Duration = Duration::from_millis(5);

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

/// A temporary file or folder that is known until this is dropped.
#[derive(Debug)]
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes a path known; a relative one is meant from the present folder.
    pub(crate) fn new(path: &Path) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        known().insert(path.clone());
        Self(path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        known().remove(&self.0);
    }
}

fn known() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends all writing of this process: waits for files under way, for ten seconds at most, and removes what is
/// unfinished. Whoever would write after this waits forever, so that the program has to end.
pub fn abandon() {
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
    for path in known().iter() {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    // Nobody may come in any more, also after this call.
    std::mem::forget(gate);
}
