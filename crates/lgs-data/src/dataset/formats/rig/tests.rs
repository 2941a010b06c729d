use crate::cameras::write_cameras_json;
use crate::dataset::testing::load;
use crate::dataset::{AbsentImages, Dataset, DatasetFormat, LoadOptions};
use lgs_core::Camera;

/// A camera as Pose2Sim writes it.
fn camera(section: &str, name: &str, k1: f64, x: f64) -> String {
    format!(
        r#"
[{section}]
name = "{name}"
size = [ 6.0, 4.0]
matrix = [ [ 5.0, 0.0, 2.5], [ 0.0, 5.5, 1.5], [ 0.0, 0.0, 1.0]]
distortions = [ {k1:?}, 0.0, 0.0, 0.0]
rotation = [ 1.5707963267948966, 0.0, 0.0]
translation = [ {x:?}, 0.0, 4.0]
fisheye = false
"#
    )
}

/// Two cameras at four moments, the matrix of the second in whole numbers where they are.
fn calibration() -> String {
    let matrix = "[ [ 5, 0, 2.5], [ 0, 5, 1.5], [ 0, 0, 1]]";
    let second = camera("cam_b", "right", 0.3, -0.5)
        .replace("[ [ 5.0, 0.0, 2.5], [ 0.0, 5.5, 1.5], [ 0.0, 0.0, 1.0]]", matrix);
    camera("cam_a", "left", 0.0, 0.5) + &second + "\n[metadata]\nadjusted = false\n"
}

fn folder(calibration: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for name in ["left", "right"] {
        std::fs::create_dir(dir.path().join(name)).unwrap();
        for moment in 0..4_u8 {
            let image = image::RgbImage::from_pixel(6, 4, image::Rgb([moment, 80, 0]));
            image.save(dir.path().join(format!("{name}/frame_{:03}.png", 7 + moment))).unwrap();
        }
    }
    std::fs::write(dir.path().join("Calib.toml"), calibration).unwrap();
    dir
}

#[test]
fn a_calibration_and_folders_are_a_set() {
    let dir = folder(&calibration());
    assert_eq!(DatasetFormat::detect(dir.path()), Some(DatasetFormat::Rig));
    crate::dataset::import::tests::assert_round_trip(dir.path());
    let set = load(&dir).unwrap();
    assert_eq!((set.splits.len(), set.split("train").len()), (1, 8));
    let frame = &set.split("train")[2];
    assert_eq!((frame.name.as_str(), frame.time), ("left/frame_008.png", 0.25));
    let camera = frame.camera;
    assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [5.0, 5.5, 3.0, 2.0], "centres are at + 0.5");
    // World z is the camera's −y: (−0.5, −4, 0) is the centre, and it looks along +y.
    let center = camera.center_in_world();
    assert!((center[0] + 0.5).abs() < 1e-6 && (center[1] + 4.0).abs() < 1e-5, "{center:?}");
    assert!(camera.ray_direction_in_world([3.0, 2.0])[1] > 0.999);
    assert!(
        !frame.pixels.has_mask() && set.split("train")[3].pixels.has_mask(),
        "one of the lenses distorts"
    );
}

#[test]
fn our_own_cameras_and_times_are_read() {
    let dir = folder("");
    std::fs::remove_file(dir.path().join("Calib.toml")).unwrap();
    let camera = Camera::look_at([0.0, -4.0, 1.0], [0.0; 3], 0.7, 6, 4);
    write_cameras_json(
        &dir.path().join("cameras.json"),
        &[("left".into(), camera), ("right".into(), camera)],
    )
    .unwrap();
    std::fs::write(dir.path().join("times.csv"), "frame,seconds\n7,1.0\n8,1.5\n9,2.5\n10,4.0\n").unwrap();
    let set = load(&dir).unwrap();
    let times: Vec<f32> = set.split("train").iter().step_by(2).map(|f| f.time).collect();
    assert_eq!(times, [0.0, 0.125, 0.375, 0.75]);
    assert_eq!(set.split("train")[0].camera.fx, camera.fx);
    for (csv, expected) in
        [("1\n2\n3\n", "4 times"), ("1\n2\n2\n3\n", "time 2 should be above"), ("1\nx\n3\n4\n", "line 2")]
    {
        std::fs::write(dir.path().join("times.csv"), csv).unwrap();
        let message = load(&dir).unwrap_err().to_string();
        assert!(message.contains(expected) && message.ends_with("times.csv"), "{message}");
    }
}

#[test]
fn a_camera_that_ends_early_is_named_or_skipped() {
    let dir = folder(&calibration());
    std::fs::remove_file(dir.path().join("right/frame_010.png")).unwrap();
    let message = load(&dir).unwrap_err().to_string();
    assert!(message.contains("1 of 8") && message.ends_with("right/frame_010.png"), "{message}");
    let skip = LoadOptions { absent: AbsentImages::Skip, ..LoadOptions::default() };
    let set = Dataset::load(dir.path(), &skip, &|_, _| {}).unwrap();
    assert_eq!((set.split("train").len(), set.absent.len()), (7, 1));
}

#[test]
fn cameras_without_images_and_images_without_cameras_are_named() {
    let dir = folder(&calibration());
    std::fs::create_dir(dir.path().join("spare")).unwrap();
    std::fs::copy(dir.path().join("left/frame_007.png"), dir.path().join("spare/frame_007.png")).unwrap();
    assert!(load(&dir).unwrap().remarks[0].contains("`spare`"));
    std::fs::remove_dir_all(dir.path().join("right")).unwrap();
    let message = load(&dir).unwrap_err().to_string();
    assert!(message.contains("camera `right`") && message.ends_with("Calib.toml"), "{message}");
}

#[test]
fn calibrations_that_cannot_be_are_named() {
    for (from, to, expected) in [
        ("[ 0.0, 5.5, 1.5]", "[ 0.0, nan, 1.5]", "`matrix`"),
        ("[ 5.0, 0.0, 2.5]", "[ 5.0, 0.2, 2.5]", "skew"),
        ("distortions = [ 0.3, 0.0, 0.0, 0.0]", "distortions = [ 0.3, 0.0, 0.0]", "`distortions`"),
        ("translation = [ 0.5, 0.0, 4.0]", "", "`translation`"),
        ("[cam_a]", "[cam_a", "malformed TOML"),
        ("size = [ 6.0, 4.0]\nmatrix = [ [ 5.0", "size = [ 8.0, 4.0]\nmatrix = [ [ 5.0", "8 x 4"),
    ] {
        let dir = folder(&calibration().replace(from, to));
        let options = LoadOptions { format: Some(DatasetFormat::Rig), ..LoadOptions::default() };
        let message = Dataset::load(dir.path(), &options, &|_, _| {}).unwrap_err().to_string();
        assert!(message.contains(expected) && message.ends_with("Calib.toml"), "{message}");
    }
}

#[test]
fn opencv_s_file_storage_is_read() {
    let dir = folder("");
    std::fs::remove_file(dir.path().join("Calib.toml")).unwrap();
    let matrix = |key: &str, data: &str| {
        format!("{key}: !!opencv-matrix\n   rows: 3\n   dt: d\n   data: [ {data} ]\n")
    };
    let intrinsics = ["left", "right"].map(|name| {
        let k = matrix(&format!("K_{name}"), "5., 0., 2.5, 0.,\n 5.5, 1.5, 0., 0., 1.");
        k + &matrix(&format!("dist_{name}"), "0., 0., 0., 0., 0.")
    });
    let poses = matrix("Rot_left", "1., 0., 0., 0., 0., -1., 0., 1., 0.") + &matrix("T_left", "0.5, 0., 4.");
    let other = matrix("R_right", "1.5707963267948966, 0., 0.") + &matrix("T_right", "-0.5, 0., 4.");
    let write = |name: &str, text: &str| {
        std::fs::write(dir.path().join(name), format!("%YAML:1.0\n---\n{text}")).unwrap();
    };
    write("intri.yml", &intrinsics.concat());
    write("extri.yml", &(poses.clone() + &other));
    let set = load(&dir).unwrap();
    let cameras = [0, 1].map(|i| set.split("train")[i].camera);
    assert_eq!([cameras[0].fx, cameras[0].fy, cameras[0].cx, cameras[0].cy], [5.0, 5.5, 3.0, 2.0]);
    let centers = cameras.map(|camera| camera.center_in_world());
    assert!((centers[0][0] + 0.5).abs() < 1e-6 && (centers[1][0] - 0.5).abs() < 1e-6, "{centers:?}");
    assert!(cameras.iter().all(|camera| camera.ray_direction_in_world([3.0, 2.0])[1] > 0.999));
    write("extri.yml", &poses);
    let message = load(&dir).unwrap_err().to_string();
    assert!(message.contains("camera `right`") && message.ends_with("extri.yml"), "{message}");
    write("extri.yml", &(poses.replace("-1.", "1.") + &other));
    assert!(load(&dir).unwrap_err().to_string().contains("reflection"));
    write("intri.yml", "K_left: !!opencv-matrix\n data: [ 1., nan ]\n");
    assert!(load(&dir).unwrap_err().to_string().contains("`nan`"));
}
