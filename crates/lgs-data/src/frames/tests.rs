use super::*;
use crate::ply::write_ply;
use lgs_core::GaussianCloud;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, serialize_to_file};
use std::fs;
use std::path::PathBuf;

fn cloud(count: usize, time: f32) -> GaussianCloud {
    let means = (0..count).map(|i| [i as f32 + time, time * time, 0.0]).collect();
    let mut cloud = GaussianCloud::isotropic(means, 0.1, [0.2, 0.4, 0.6], 0.8);
    cloud.raw_opacities[0] = time;
    cloud
}

/// A folder of frames with given names and times.
fn folder(frames: &[(&str, f32)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, time) in frames {
        write_ply(&folder.path().join(name), &cloud(3, *time)).unwrap();
    }
    folder
}

fn refused(path: &Path, ends: &str, words: &[&str]) {
    let text = read_frames(path).unwrap_err().to_string();
    assert!(text.ends_with(ends), "{text}");
    for word in words {
        assert!(text.contains(word), "should contain {word}: {text}");
    }
}

#[test]
fn times_come_from_names_lists_and_the_manifest_of_an_export() {
    let named =
        folder(&[("0001_t+0.5000.ply", 0.5), ("0000_t-0.2500.ply", -0.25), ("0002_t+0.1000.ply", 0.1)]);
    let sequence = read_frames(named.path()).unwrap();
    assert_eq!(sequence.times, [-0.25, 0.1, 0.5]);
    assert_eq!(sequence.positions[2], cloud(3, 0.5).means);
    assert_eq!(sequence.gaussians, cloud(3, 0.1), "appearance is that of the frame nearest to t = 0");
    assert_eq!(sequence.rotations.len(), 3);
    let listed = folder(&[("f2.ply", 0.2), ("f10.ply", 0.4)]);
    for (list, text) in [
        ("times.txt", "0.2\n\n0.4\n"),
        ("times.json", "[0.2, 0.4]"),
        ("times.json", "{\"f10.ply\": 0.4, \"f2.ply\": 0.2}"),
        (
            "frames.json",
            "{\"frames\": [{\"file\": \"f10.ply\", \"time\": 0.4}, {\"file\": \"f2.ply\", \"time\": 0.2}]}",
        ),
    ] {
        let path = listed.path().join(list);
        fs::write(&path, text).unwrap();
        let sequence = read_frames(listed.path()).unwrap();
        assert_eq!(
            (sequence.times.as_slice(), &sequence.positions[1]),
            (&[0.2, 0.4][..], &cloud(3, 0.4).means),
            "{text}"
        );
        fs::remove_file(path).unwrap();
    }
}

#[test]
fn what_is_wrong_with_a_folder_is_named() {
    let frames = folder(&[("t0.0.ply", 0.0), ("t0.1.ply", 0.1)]);
    let other = frames.path().join("t0.2.ply");
    write_ply(&other, &cloud(4, 0.2)).unwrap();
    refused(frames.path(), "t0.2.ply", &["expected 3 Gaussians", "found 4"]);
    let mut bytes = Vec::new();
    write_ply(&other, &cloud(3, 0.2)).unwrap();
    bytes.extend(fs::read(&other).unwrap());
    let at = bytes.len() - 4 * 17;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&other, bytes).unwrap();
    refused(frames.path(), "t0.2.ply", &["not finite", "`x` of vertex 2"]);
    fs::rename(&other, frames.path().join("shot3.ply")).unwrap();
    let end = frames.path().display().to_string();
    refused(frames.path(), &end, &["`shot3.ply` has no time"]);
    let times = frames.path().join("times.txt");
    fs::write(&times, "0.1\n0.2").unwrap();
    refused(frames.path(), "times.txt", &["each of 3 frames, found 2"]);
    fs::write(&times, "0.1\nsoon\n0.3").unwrap();
    refused(frames.path(), "times.txt", &["`soon`"]);
    let list = frames.path().join("times.json");
    fs::write(&list, "{\"t0.0.ply\": 0}").unwrap();
    refused(frames.path(), "times.json", &["no time"]);
    fs::write(frames.path().join("frames.json"), "{\"frames\": [{\"file\": \"../x.ply\", \"time\": 0}]}")
        .unwrap();
    refused(frames.path(), "frames.json", &["malformed"]);
    let same = folder(&[("a_t0.1.ply", 0.1), ("b_t0.1.ply", 0.1)]);
    refused(same.path(), &same.path().display().to_string(), &["strictly ascending"]);
    let single = folder(&[("t0.1.ply", 0.1)]);
    refused(single.path(), &single.path().display().to_string(), &["at least 2 frames"]);
    let empty = folder(&[]);
    refused(empty.path(), &empty.path().display().to_string(), &["found none"]);
    refused(&empty.path().join("absent"), "absent", &["read file"]);
}

type Named<'a> = (&'a str, &'a [usize], Vec<f32>);

fn write_tensors(path: &Path, tensors: &[Named<'_>]) {
    let bytes: Vec<Vec<u8>> =
        tensors.iter().map(|(.., v)| v.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let view = |(i, (name, shape, _)): (usize, &Named<'_>)| {
        ((*name).to_owned(), TensorView::new(Dtype::F32, shape.to_vec(), &bytes[i]).unwrap())
    };
    let views: Vec<(String, TensorView<'_>)> = tensors.iter().enumerate().map(view).collect();
    serialize_to_file(views, None, path).unwrap();
}

fn sample<'a>() -> Vec<Named<'a>> {
    vec![
        ("times", &[3], vec![0.0, 0.1, 0.3]),
        ("positions", &[3, 2, 3], (0..18).map(|v| v as f32).collect()),
        ("rotations", &[2, 4], [1.0, 0.0, 0.0, 0.0].repeat(2)),
        ("log_scales", &[2, 3], vec![-3.0; 6]),
        ("raw_opacities", &[2], vec![1.0; 2]),
        ("sh", &[2, 4, 3], vec![0.1; 24]),
    ]
}

fn tensor_file(folder: &Path, tensors: &[Named<'_>]) -> PathBuf {
    let path = folder.join("paths.safetensors");
    write_tensors(&path, tensors);
    path
}

#[test]
fn tensors_are_read_with_constant_or_changing_rotations() {
    let dir = tempfile::tempdir().unwrap();
    let path = tensor_file(dir.path(), &sample());
    let sequence = read_frames(&path).unwrap();
    assert_eq!((sequence.times.len(), sequence.rotations.len(), sequence.gaussians.sh_degree), (3, 1, 1));
    assert_eq!(sequence.positions[1][1], [9.0, 10.0, 11.0]);
    let mut turning = sample();
    turning[2] = ("rotations", &[3, 2, 4], (1..25).map(|v| v as f32).collect());
    let sequence = read_frames(&tensor_file(dir.path(), &turning)).unwrap();
    assert_eq!(sequence.rotations[2][1], [21.0, 22.0, 23.0, 24.0]);
    assert_eq!(sequence.gaussians.rotations[1], [5.0, 6.0, 7.0, 8.0]);
}

#[test]
fn what_is_wrong_with_tensors_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let broken: [(usize, Option<Named<'_>>, &str); 6] = [
        (1, None, "`positions`"),
        (
            1,
            Some(("positions", &[2, 3, 3], vec![0.0; 18])),
            "`positions`: expected 32-bit floats of shape [3, n, 3]",
        ),
        (1, Some(("positions", &[3, 2, 3], vec![f32::NAN; 18])), "NaN at index 0"),
        (0, Some(("times", &[3], vec![0.0, 0.2, 0.2])), "strictly ascending"),
        (2, Some(("rotations", &[2, 4], vec![0.0; 8])), "Gaussian 0 in frame 0 is zero"),
        (5, Some(("sh", &[2, 5, 3], vec![0.1; 30])), "`sh`"),
    ];
    for (index, replacement, word) in broken {
        let mut tensors = sample();
        tensors.remove(index);
        tensors.extend(replacement);
        refused(&tensor_file(dir.path(), &tensors), "paths.safetensors", &[word]);
    }
    let path = tensor_file(dir.path(), &sample());
    let whole = fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(7) {
        fs::write(&path, &whole[..length]).unwrap();
        refused(&path, "paths.safetensors", &["safetensors"]);
    }
}

#[test]
fn numbered_frames_of_other_programs_span_the_recording() {
    for names in [
        ["frame0001.ply", "frame0002.ply", "frame0010.ply"],
        ["1.ply", "2.ply", "10.ply"],
        ["point_cloud_1.ply", "point_cloud_2.ply", "point_cloud_10.ply"],
        ["time_00001.ply", "time_00002.ply", "time_00010.ply"],
    ] {
        let frames = folder(&[(names[2], 0.9), (names[0], 0.0), (names[1], 0.1)]);
        let sequence = read_frames(frames.path()).unwrap();
        assert_eq!(sequence.times, [0.0, 0.1, 0.9], "{names:?}");
        assert_eq!(sequence.positions[2], cloud(3, 0.9).means, "in the order of their numbers");
        write_ply(&frames.path().join(names[1]), &cloud(4, 0.2)).unwrap();
        refused(frames.path(), names[1], &["expected 3 Gaussians as in the first frame, found 4"]);
    }
    let two = folder(&[("a1.ply", 0.0), ("b2.ply", 0.1)]);
    refused(two.path(), &two.path().display().to_string(), &["`a1.ply` has no time", "`frame0001.ply`"]);
}

#[test]
fn bare_points_become_grey_gaussians() {
    let dir = tempfile::tempdir().unwrap();
    let bare = read_frames(&tensor_file(dir.path(), &sample()[..2])).unwrap();
    let csv = dir.path().join("tracks.csv");
    let text = "time,x1 (cm),y1 (cm),z1 (cm),x2 (cm),y2 (cm),z2 (cm)\n\
                7,0,100,200,300,400,500\n7.1,600,700,800,900,1000,1100\n7.3,1200,1300,1400,1500,1600,1700\n";
    fs::write(&csv, text).unwrap();
    let tracks = read_frames(&csv).unwrap();
    for sequence in [&bare, &tracks] {
        let distance = 27.0_f32.sqrt();
        assert_eq!(
            (sequence.gaussians.len(), sequence.gaussians.sh_degree, sequence.rotations.len()),
            (2, 0, 1)
        );
        assert!((sequence.gaussians.log_scales[1][0].exp() - 0.25 * distance).abs() < 1e-5);
        assert!(sequence.gaussians.validate().is_ok());
    }
    assert_eq!(tracks.positions, bare.positions);
    assert!((tracks.times[2] - 0.3).abs() < 1e-6);
    fs::write(&csv, "time,x1,y1,z1\n0,1,2,3\n1,,,\n2,1,2,3\n").unwrap();
    refused(&csv, "tracks.csv", &["a gap of more than 0.1", "found none of 1"]);
}
