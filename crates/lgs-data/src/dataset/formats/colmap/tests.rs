use crate::dataset::DatasetFormat;
use crate::dataset::testing::{load, refusal};

const CAMERAS: &str = "# ID MODEL W H PARAMS\n1 PINHOLE 6 4 5 5.5 3.1 2\n2 SIMPLE_RADIAL 6 4 5 3 2 0.3\n";
/// Half a turn about the x axis, as the camera sees it, in the first image.
const IMAGES: &str = "# ID Q T CAMERA NAME\n\
    1 0.7071067811865476 0.7071067811865476 0 0 0.5 0 4 1 b/0002.png\n1.5 2.5 -1\n\
    2 1 0 0 0 0 0 4 2 a/0001.png\n\n3 1 0 0 0 0 0 4 2 a/0002.png\n\n4 1 0 0 0 0 0 4 1 b/0001.png\n";
const POINTS: &str = "7 1 2 3 255 0 51 0.5 1 0\n";

fn with_images() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a/0001", "a/0002", "b/0001", "b/0002"] {
        let path = dir.path().join(format!("images/{name}.png"));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        image::RgbImage::from_pixel(6, 4, image::Rgb([9; 3])).save(path).unwrap();
    }
    std::fs::create_dir_all(dir.path().join("sparse/0")).unwrap();
    dir
}

fn text(cameras: &str, images: &str, points: &str) -> tempfile::TempDir {
    let dir = with_images();
    for (name, text) in [("cameras", cameras), ("images", images), ("points3D", points)] {
        std::fs::write(dir.path().join(format!("sparse/0/{name}.txt")), text).unwrap();
    }
    dir
}

/// The same model in binary files, whose bytes `edit` may change.
fn binary(edit: impl Fn(&str, &mut Vec<u8>)) -> tempfile::TempDir {
    let dir = with_images();
    let floats = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let mut cameras = 2_u64.to_le_bytes().to_vec();
    for (id, model, p) in [(1_u32, 1_u32, &[5.0, 5.5, 3.1, 2.0]), (2, 2, &[5.0, 3.0, 2.0, 0.3])] {
        cameras.extend([id.to_le_bytes(), model.to_le_bytes()].concat());
        cameras.extend([6_u64.to_le_bytes(), 4_u64.to_le_bytes()].concat());
        cameras.extend(floats(p));
    }
    let mut images = 4_u64.to_le_bytes().to_vec();
    let half = 0.5_f64.sqrt();
    for (id, q, x, camera, name) in [
        (1_u32, [half, half, 0., 0.], 0.5, 1_u32, "b/0002.png"),
        (2, [1., 0., 0., 0.], 0.0, 2, "a/0001.png"),
        (3, [1., 0., 0., 0.], 0.0, 2, "a/0002.png"),
        (4, [1., 0., 0., 0.], 0.0, 1, "b/0001.png"),
    ] {
        images.extend(id.to_le_bytes());
        images.extend(floats(&q));
        images.extend(floats(&[x, 0.0, 4.0]));
        images.extend(camera.to_le_bytes());
        images.extend([name.as_bytes(), &[0]].concat());
        images.extend(1_u64.to_le_bytes());
        images.extend(floats(&[1.5, 2.5]));
        images.extend((-1_i64).to_le_bytes());
    }
    let mut points = [1_u64.to_le_bytes(), 7_u64.to_le_bytes()].concat();
    points.extend(floats(&[1.0, 2.0, 3.0]));
    points.extend([255, 0, 51]);
    points.extend(floats(&[0.5]));
    points.extend([1_u64.to_le_bytes(), [0; 8]].concat());
    for (name, mut bytes) in [("cameras", cameras), ("images", images), ("points3D", points)] {
        edit(name, &mut bytes);
        std::fs::write(dir.path().join(format!("sparse/0/{name}.bin")), bytes).unwrap();
    }
    dir
}

#[test]
fn text_and_binary_hold_the_same_set() {
    let (text, binary) = (text(CAMERAS, IMAGES, POINTS), binary(|_, _| {}));
    assert_eq!(DatasetFormat::detect(text.path()), Some(DatasetFormat::Colmap));
    crate::dataset::import::tests::assert_round_trip(text.path());
    let (a, b) = (load(&text).unwrap(), load(&binary).unwrap());
    for (a, b) in a.split("train").iter().zip(b.split("train")) {
        assert_eq!((&a.name, a.time, a.camera), (&b.name, b.time, b.camera));
        assert_eq!(a.picture(), b.picture());
    }
    assert_eq!(a.init_points, b.init_points);
    let names: Vec<(&str, f32)> = a.split("train").iter().map(|f| (f.name.as_str(), f.time)).collect();
    let expected = [("images/a/0001.png", 0.0), ("images/a/0002.png", 0.5), ("images/b/0001.png", 0.0)];
    assert_eq!(names[..3], expected);
    let last = &a.split("train")[3];
    assert_eq!([last.camera.fx, last.camera.fy, last.camera.cx], [5.0, 5.5, 3.1]);
    // x = (1, 0, 0), y = (0, 0, −1)… the camera's y axis is the world's −z.
    assert!(last.camera.ray_direction_in_world([3.1, 2.0])[1] > 0.999);
    assert!(!last.pixels.has_mask() && a.split("train")[0].pixels.has_mask());
    assert_eq!(a.init_points.unwrap().colors, [[1.0, 0.0, 0.2]]);
}

#[test]
fn times_come_from_a_table_from_folders_or_are_absent() {
    let dir = text(CAMERAS, IMAGES, POINTS);
    let table = "image,seconds\na/0001.png,3\na/0002.png,5\nb/0001.png,3\nb/0002.png,4\n";
    std::fs::write(dir.path().join("times.csv"), table).unwrap();
    let times: Vec<f32> = load(&dir).unwrap().split("train").iter().map(|f| f.time).collect();
    assert_eq!(times, [0.0, 2.0 / 3.0, 0.0, 1.0 / 3.0]);
    std::fs::write(dir.path().join("times.csv"), "a/0001.png,3\n").unwrap();
    assert!(refusal(&dir, "times.csv").contains("a/0002.png"));
    let half = text(CAMERAS, &IMAGES.replace("a/0001", "a/still"), POINTS);
    assert!(refusal(&half, "images.txt").contains("a/still.png"));
}

#[test]
fn counts_that_do_not_fit_are_refused_before_anything_is_allocated() {
    for (file, name) in [("cameras", "cameras.bin"), ("images", "images.bin"), ("points3D", "points3D.bin")] {
        let huge = binary(|name, bytes| {
            if name == file {
                bytes[..8].copy_from_slice(&u64::MAX.to_le_bytes());
            }
        });
        assert!(refusal(&huge, name).contains("18446744073709551615"));
        let few = binary(|name, bytes| {
            if name == file {
                bytes[0] -= 1;
            }
        });
        assert!(refusal(&few, name).contains("more bytes"));
        let cut = binary(|name, bytes| {
            if name == file {
                bytes.truncate(bytes.len() - 3);
            }
        });
        let message = refusal(&cut, name);
        assert!(message.contains("ends within entry") || message.contains("at most"), "{message}");
    }
    let keypoints = binary(|name, bytes| {
        if name == "images" {
            let at = bytes.len() - 32;
            bytes[at..at + 8].copy_from_slice(&(u64::MAX / 2).to_le_bytes());
        }
    });
    assert!(refusal(&keypoints, "images.bin").contains("entry 3"));
}

#[test]
fn cameras_and_images_that_do_not_fit_each_other_are_named() {
    let unknown = text(&CAMERAS.replace("SIMPLE_RADIAL", "SPHERICAL"), IMAGES, POINTS);
    assert!(refusal(&unknown, "cameras.txt").contains("`SPHERICAL`"));
    let fov = text(&CAMERAS.replace("2 SIMPLE_RADIAL 6 4 5", "2 FOV 6 4 5 5"), IMAGES, POINTS);
    assert!(refusal(&fov, "cameras.txt").contains("camera 2: `model`"));
    let short = text(&CAMERAS.replace("5 5.5 3.1 2", "5 5.5 3.1"), IMAGES, POINTS);
    assert!(refusal(&short, "cameras.txt").contains("4 numbers for PINHOLE"));
    let homeless = text(&CAMERAS.replace("2 SIMPLE", "3 SIMPLE"), IMAGES, POINTS);
    assert!(refusal(&homeless, "images.txt").contains("image `a/0001.png`: `camera id`"));
    for (from, to, expected) in [
        ("2 1 0 0 0", "2 nan 0 0 0", "`rotation`"),
        ("2 1 0 0 0 0 0 4", "2 1 0 0 0 0 inf 4", "`translation`"),
        ("2 1 0 0 0 0 0 4 2", "2 1 0 0 0 0 zero 4 2", "line 4"),
    ] {
        let dir = text(CAMERAS, &IMAGES.replace(from, to), POINTS);
        assert!(refusal(&dir, "images.txt").contains(expected), "{to}");
    }
    assert!(refusal(&text(CAMERAS, "# none\n", POINTS), "images.txt").contains("empty"));
    assert!(refusal(&text(CAMERAS, IMAGES, "7 1 nan 3 1 2 3 0\n"), "points3D.txt").contains("`position`"));
    let spare = text(&format!("{CAMERAS}9 PINHOLE 6 4 5 5 3 2\n"), IMAGES, POINTS);
    std::fs::copy(spare.path().join("images/a/0001.png"), spare.path().join("images/c.png")).unwrap();
    let remarks = load(&spare).unwrap().remarks;
    assert_eq!(remarks, ["1 cameras have no image", "1 images in `images` have no camera"]);
}
