use super::*;
use std::path::PathBuf;

fn sample() -> TensorFile {
    let mut file = TensorFile::new("sample/1");
    file.set_metadata("step", "12");
    file.set_metadata("stage", "source");
    file.insert("means", &[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    file.insert_indices("supports", &[2], &[7, 8]);
    file
}

/// The bytes of the sample in a file of a temporary folder.
fn saved() -> (tempfile::TempDir, PathBuf, Vec<u8>) {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sample.safetensors");
    sample().save(&path).expect("save");
    let bytes = std::fs::read(&path).expect("bytes");
    (folder, path, bytes)
}

#[test]
fn a_file_round_trips_and_is_the_same_bytes_every_time() {
    let (_folder, path, first) = saved();
    sample().save(&path).expect("save again");
    assert_eq!(first, std::fs::read(&path).expect("bytes"));
    let back = TensorFile::load(&path, "sample/1").expect("load");
    assert_eq!(back.rows::<3>("means").expect("means"), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert_eq!(back.indices("supports").expect("supports").1, [7, 8]);
    assert_eq!(back.metadata_json::<u32>("step").expect("step"), 12);
}

#[test]
fn a_file_cut_at_any_byte_is_an_error() {
    let (_folder, path, whole) = saved();
    for length in 0..whole.len() {
        std::fs::write(&path, &whole[..length]).expect("cut");
        assert!(TensorFile::load(&path, "sample/1").is_err(), "cut at {length}");
    }
}

#[test]
fn defects_name_the_file_and_the_field() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("bad.safetensors");
    let mut file = sample();
    file.insert("weights", &[1], &[f32::NAN]);
    file.save(&path).expect("save");
    let version = TensorFile::load(&path, "sample/2").expect_err("version").to_string();
    assert!(version.contains("bad.safetensors") && version.contains("sample/1"), "{version}");
    let back = TensorFile::load(&path, "sample/1").expect("load");
    for (error, field) in [
        (back.values("weights").map(|_| ()).expect_err("nan"), "weights"),
        (back.values("absent").map(|_| ()).expect_err("absent"), "absent"),
        (back.rows::<4>("means").map(|_| ()).expect_err("shape"), "means"),
    ] {
        let text = error.to_string();
        assert!(text.contains("bad.safetensors") && text.contains(field), "{text}");
    }
}
