use super::*;

#[test]
fn missing_folders_and_files_are_named() {
    let missing =
        Dataset::load(Path::new("no/such/set"), &LoadOptions::default(), &|_, _| {}).unwrap_err().to_string();
    assert!(missing.ends_with("no/such/set"), "{missing}");
    let empty = tempfile::tempdir().unwrap();
    let error = load(&empty).unwrap_err().to_string();
    assert!(error.contains("`transforms_train.json` (blender)"), "{error}");
    let dir = folder(|_, _| {});
    fs::remove_file(dir.path().join("transforms_train.json")).unwrap();
    assert!(refusal(&dir, "transforms_train.json").contains("`train`"));
    let dir = folder(|_, path| fs::remove_file(path.join("b.png")).unwrap());
    refusal(&dir, "b.png");
}

#[test]
fn malformed_json_is_named() {
    let dir = folder(|_, _| {});
    for text in ["", "{", "[]", r#"{"frames": 3}"#, r#"{"frames": [{"file_path": 7}]}"#] {
        fs::write(dir.path().join("transforms_train.json"), text).unwrap();
        let message = refusal(&dir, "transforms_train.json");
        assert!(message.contains("malformed JSON"), "{text}: {message}");
    }
}

#[test]
fn an_empty_split_is_an_error() {
    for frames in [json!([]), Value::Null] {
        let dir = folder(|json, _| {
            if frames.is_null() {
                json.as_object_mut().unwrap().remove("frames");
            } else {
                json["frames"] = frames.clone();
            }
        });
        assert!(refusal(&dir, "transforms_train.json").contains("empty"));
    }
}

#[test]
fn missing_fields_are_named_with_their_frame() {
    for field in ["time", "file_path", "transform_matrix"] {
        let dir = folder(|json, _| {
            json["frames"][1].as_object_mut().unwrap().remove(field);
        });
        let message = refusal(&dir, "transforms_train.json");
        assert!(message.contains("frame 1") && message.contains(&format!("`{field}`")), "{message}");
    }
    let dir = folder(|json, _| {
        json.as_object_mut().unwrap().remove("camera_angle_x");
    });
    assert!(refusal(&dir, "transforms_train.json").contains("`camera_angle_x`"));
}

#[test]
fn poses_that_are_not_finite_or_not_rigid_are_named() {
    let dir = folder(|_, _| {});
    let path = dir.path().join("transforms_train.json");
    let good = fs::read_to_string(&path).unwrap();
    for (bad, expected) in [("NaN", "finite"), ("-Infinity", "finite"), ("1e39", "finite"), ("3.0", "rigid")]
    {
        fs::write(&path, good.replacen("[[1.0,", &format!("[[{bad},"), 1)).unwrap();
        let message = refusal(&dir, "transforms_train.json");
        assert!(
            message.contains("frame 0")
                && message.contains("`transform_matrix`")
                && message.contains(expected),
            "{bad}: {message}"
        );
    }
    let dir = folder(|json, _| json["frames"][1]["transform_matrix"] = json!([[1, 2], [3]]));
    assert!(refusal(&dir, "transforms_train.json").contains("4 x 4"));
    let dir = folder(|json, _| json["frames"][1]["time"] = 1e39.into());
    assert!(refusal(&dir, "transforms_train.json").contains("`time`"));
    // As NaN is read, which JSON does not have.
    for field in ["time", "fl_x", "cx"] {
        let dir = folder(|json, _| json["frames"][1][field] = serde_json::Value::Null);
        let message = refusal(&dir, "transforms_train.json");
        let words = ["frame 1", field, "finite", "NaN"];
        assert!(words.iter().all(|word| message.contains(word)), "{field}: {message}");
    }
}

#[test]
fn strings_that_say_nan_are_left_alone() {
    let dir = folder(|json, path| {
        json["frames"][0]["file_path"] = "NaN \"x\\".into();
        fs::copy(path.join("a.png"), path.join("NaN \"x\\.png")).unwrap();
    });
    let path = dir.path().join("transforms_train.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen('{', "{\"unused\": NaN, ", 1)).unwrap();
    assert_eq!(load(&dir).unwrap().splits["train"][0].name, "NaN \"x\\");
}

#[test]
fn images_that_do_not_decode_or_have_another_size_are_named() {
    for (bytes, what) in [(&b"not an image"[..], "text"), (&[][..], "nothing")] {
        let dir = folder(|_, path| fs::write(path.join("b.png"), bytes).unwrap());
        assert!(refusal(&dir, "b.png").contains("decode"), "{what}");
    }
    let truncated = folder(|_, path| {
        let bytes = fs::read(path.join("b.png")).unwrap();
        fs::write(path.join("b.png"), &bytes[..bytes.len() / 2]).unwrap();
    });
    refusal(&truncated, "b.png");
    let dir = folder(|json, _| json["frames"][1]["w"] = 9.into());
    let message = refusal(&dir, "transforms_train.json");
    assert!(
        message.contains("frame 1") && message.contains("9 x 6") && message.contains("8 x 6"),
        "{message}"
    );
}

#[test]
fn focal_lengths_that_cannot_be_are_named() {
    for value in [0.0, -5.0, 1e300] {
        let dir = folder(|json, _| json["frames"][0]["fl_x"] = value.into());
        assert!(refusal(&dir, "transforms_train.json").contains("`fl_x`"));
    }
}
