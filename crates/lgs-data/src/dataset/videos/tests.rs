//! Who decodes a video, and what is said where nobody can.

use super::*;
use lgs_video::testing::h264_in_mp4;
use std::os::unix::fs::PermissionsExt;

/// A program that does as a script says.
fn program(folder: &Path, script: &str) -> PathBuf {
    let path = folder.join("fake-ffmpeg");
    std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

#[test]
fn a_video_is_decoded_once() {
    let dir = tempfile::tempdir().unwrap();
    let (video, cache) = (dir.path().join("cam00.mp4"), dir.path().join("cache"));
    std::fs::write(&video, "pictures").unwrap();
    // An older program, which knows only one of the two ways; the last argument is the pattern.
    let script = r#"case "$*" in *-fps_mode*) echo "Unrecognized option 'fps_mode'" >&2; exit 1;; esac
        for last; do :; done; folder=$(dirname "$last")
        cp "$5" "$folder/000000.png"; cp "$5" "$folder/000001.png""#;
    let fake = program(dir.path(), script);
    let folder = decoded(&video, &cache, &Decoder::BuiltInOr(fake.clone())).unwrap();
    assert_eq!(std::fs::read(folder.join("000001.png")).unwrap(), b"pictures");
    let none = PathBuf::from("no-such-program");
    assert_eq!(decoded(&video, &cache, &Decoder::BuiltInOr(none.clone())).unwrap(), folder);
    assert!(decoded(&video, &cache, &Decoder::Named(none)).is_err(), "a program that is named decodes again");
    assert_ne!(decoded(&video, &cache, &Decoder::Named(fake)).unwrap(), folder);
}

#[test]
fn without_a_program_or_frames_the_reason_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let (video, cache) = (dir.path().join("cam00.mp4"), dir.path().join("cache"));
    std::fs::write(&video, "x").unwrap();
    let message = |program: PathBuf| {
        let message = decoded(&video, &cache, &Decoder::Named(program)).unwrap_err().to_string();
        assert!(message.ends_with("cam00.mp4"), "{message}");
        message
    };
    assert!(message("no-such-program".into()).contains("install ffmpeg"));
    assert!(message(program(dir.path(), "echo 'moov atom not found' >&2; exit 1")).contains("moov atom"));
    assert!(message(program(dir.path(), "exit 0")).contains("no frame"));
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 0, "nothing half-written");
}

/// An MP4 file whose codec has a name, and nothing in its frame.
fn mp4_of(codec: &[u8; 4]) -> Vec<u8> {
    let frame = [&[0, 0, 1, 0x67, 66, 0, 30][..], &[0, 0, 1, 0x68, 1], &[0, 0, 1, 0x65, 1]].concat();
    let mut file = h264_in_mp4([64, 48], &[frame], [1, 0, 0, 1]).unwrap();
    // The name stands in the list of brands, and then where the codec is described.
    let place = file.windows(4).rposition(|bytes| bytes == b"avc1").unwrap();
    file[place..place + 4].copy_from_slice(codec);
    file
}

#[test]
fn other_codecs_are_for_the_program_and_named_where_there_is_none() {
    let dir = tempfile::tempdir().unwrap();
    let (video, cache) = (dir.path().join("cam00.mov"), dir.path().join("cache"));
    std::fs::write(&video, mp4_of(b"hvc1")).unwrap();
    let error =
        decoded(&video, &cache, &Decoder::BuiltInOr("no-such-program".into())).unwrap_err().to_string();
    for words in ["`hvc1`", "H.264 in MP4 and MOV", "`no-such-program` is not there", "install ffmpeg"] {
        assert!(error.contains(words) && error.ends_with("cam00.mov"), "{error}");
    }
    let fake = program(dir.path(), r#"for last; do :; done; echo frame > "$(dirname "$last")/000000.png""#);
    let folder = decoded(&video, &cache, &Decoder::BuiltInOr(fake)).unwrap();
    assert_eq!(std::fs::read(folder.join("000000.png")).unwrap(), b"frame\n");
}

#[test]
fn damaged_videos_are_for_no_program() {
    let dir = tempfile::tempdir().unwrap();
    let (video, cache) = (dir.path().join("cam00.mp4"), dir.path().join("cache"));
    let fake =
        || program(dir.path(), r#"for last; do :; done; echo frame > "$(dirname "$last")/000000.png""#);
    let whole = mp4_of(b"avc1");
    for (file, words) in [(&whole[..100], "cut off"), (&whole, "parameter set"), (&whole[..36], "is missing")]
    {
        std::fs::write(&video, file).unwrap();
        let error = decoded(&video, &cache, &Decoder::BuiltInOr(fake())).unwrap_err().to_string();
        assert!(error.contains(words) && error.ends_with("cam00.mp4"), "{error}");
    }
}
