use super::*;
use crate::dataset::DatasetFormat;
use crate::dataset::testing::load;
use serde_json::json;

/// Four images of two cameras, whose first camera `edit` may change.
fn folder(edit: impl FnOnce(&mut Value)) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, value: &Value| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, value.to_string()).unwrap();
    };
    let names: Vec<String> = (0..4).map(|i| format!("{}_{:05}", i % 2, 20 + i)).collect();
    write("dataset.json", &json!({ "ids": names, "train_ids": names[..3], "val_ids": names[3..] }));
    write("scene.json", &json!({ "scale": 0.5, "center": [0.0, 2.0, 1.0], "near": 0.1, "far": 2.0 }));
    let metadata: Map<String, Value> = (0..4)
        .map(|i| (names[i].clone(), json!({ "warp_id": 3 + i, "appearance_id": 3 + i, "camera_id": i % 2 })))
        .collect();
    write("metadata.json", &Value::Object(metadata));
    let mut first = Some(edit);
    for name in &names {
        let mut camera = json!({ "orientation": [[1., 0., 0.], [0., 0., -1.], [0., 1., 0.]],
            "position": [1.0, -6.0, 3.0], "focal_length": 10.0, "principal_point": [6.5, 4.0], "skew": 0.0,
            "pixel_aspect_ratio": 1.1, "radial_distortion": [0.0, 0.0, 0.0],
            "tangential_distortion": [0.0, 0.0], "image_size": [12, 8] });
        first.take().into_iter().for_each(|edit| edit(&mut camera));
        write(&format!("camera/{name}.json"), &camera);
        std::fs::create_dir_all(dir.path().join("rgb/2x")).unwrap();
        let image = image::RgbImage::from_pixel(6, 4, image::Rgb([7; 3]));
        image.save(dir.path().join(format!("rgb/2x/{name}.png"))).unwrap();
    }
    let points = npy::tests::npy([1, 3], &[2.0, 2.0, 3.0]);
    std::fs::write(dir.path().join("points.npy"), points).unwrap();
    dir
}

#[test]
fn cameras_times_and_points_are_those_of_the_scene() {
    let dir = folder(|_| {});
    assert_eq!(DatasetFormat::detect(dir.path()), Some(DatasetFormat::HyperNerf));
    let set = load(&dir).unwrap();
    let times = |split: &str| set.split(split).iter().map(|f| f.time).collect::<Vec<_>>();
    assert_eq!((times("train"), times("val")), (vec![0.0, 0.25, 0.5], vec![0.75]));
    let frame = &set.split("train")[1];
    assert_eq!(frame.name, "rgb/2x/1_00021.png");
    let camera = frame.camera;
    assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [5.0, 5.5, 3.25, 2.0], "at half the size");
    assert_eq!(camera.center_in_world(), [0.5, -4.0, 1.0]);
    assert_eq!(set.init_points.unwrap().positions, [[1.0, 0.0, 1.0]]);
}

#[test]
fn the_lists_of_dycheck_and_lenses_are_read() {
    let dir = folder(|camera| camera["radial_distortion"] = json!([0.3, 0.0, 0.0]));
    std::fs::create_dir(dir.path().join("splits")).unwrap();
    let list = json!({ "frame_names": ["0_00020", "0_00022"], "camera_ids": [0, 0], "time_ids": [3, 5] });
    std::fs::write(dir.path().join("splits/train.json"), list.to_string()).unwrap();
    crate::dataset::import::tests::assert_round_trip(dir.path());
    let set = load(&dir).unwrap();
    assert_eq!((set.split("train").len(), set.splits.len()), (2, 1));
    assert!(set.split("train")[0].pixels.has_mask() && !set.split("train")[1].pixels.has_mask());
}

#[test]
fn cameras_that_cannot_be_and_images_without_a_time_are_named() {
    let message = |edit: fn(&mut Value)| {
        let message = load(&folder(edit)).unwrap_err().to_string();
        assert!(message.ends_with("camera/0_00020.json") && message.contains("frame 0"), "{message}");
        message
    };
    assert!(message(|c| c["orientation"][2] = json!([0., -1., 0.])).contains("reflection"));
    assert!(message(|c| c["position"][1] = Value::Null).contains("`position`"));
    assert!(message(|c| c["focal_length"] = (-3.0).into()).contains("`fl_x`"));
    assert!(message(|c| c["skew"] = 0.1.into()).contains("`skew`"));
    assert!(message(|c| drop(c.as_object_mut().unwrap().remove("image_size"))).contains("`image_size`"));
    let dir = folder(|_| {});
    std::fs::write(dir.path().join("metadata.json"), r#"{"0_00020": {"camera_id": 0}}"#).unwrap();
    let message = load(&dir).unwrap_err().to_string();
    assert!(message.contains("`0_00020`") && message.ends_with("metadata.json"), "{message}");
    std::fs::remove_file(dir.path().join("camera/1_00021.json")).unwrap();
    assert!(load(&dir).unwrap_err().to_string().ends_with(".json"));
}
