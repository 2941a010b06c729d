//! Recordings, read back with rerun's own decoder.
#![cfg(feature = "rerun")]

mod playback;
mod reader;
mod training;

use lgs_rerun::{Recorder, RerunError};
use std::path::Path;

use reader::Contents;

#[test]
fn a_name_that_cannot_be_a_recording_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let begin = |path: &Path| Recorder::begin(path, "a", b"").map(drop);
    let name = dir.path().join("a.rdr");
    assert!(matches!(begin(&name), Err(RerunError::Name { path }) if path == name));
    let folder = dir.path().join("b.rrd");
    std::fs::create_dir(&folder).expect("a folder");
    assert!(matches!(begin(&folder), Err(RerunError::File(error)) if error.path() == folder));
    let file = dir.path().join("file");
    std::fs::write(&file, "").expect("a file");
    assert!(matches!(begin(&file.join("c.rrd")), Err(RerunError::File(error)) if error.path() == file));
}

#[test]
fn a_recording_can_be_read_while_it_grows_and_is_gone_if_it_is_dropped() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.rrd");
    let recorder = Recorder::begin(&path, "growing", b"").expect("begun");
    let contents = Contents::read(&dir.path().join("a.part.rrd"));
    assert!(contents.recording.starts_with("growing-"), "{}", contents.recording);
    assert!(!path.exists());
    drop(recorder);
    assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 0);
}
