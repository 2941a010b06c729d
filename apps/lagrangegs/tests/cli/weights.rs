//! `weights`, and what `eval` makes of them.

use std::path::{Path, PathBuf};

use crate::program::{Done, call, falling, falling_run, folder, lagrangegs_with_weights};
use lagrangegs::lgs_data::testing::{CheckpointEntry, checkpoint};

/// Shapes of AlexNet's convolutions and of its LPIPS weights.
const TRUNK: [(usize, [usize; 4]); 5] = [
    (0, [64, 3, 11, 11]),
    (3, [192, 64, 5, 5]),
    (6, [384, 192, 3, 3]),
    (8, [256, 384, 3, 3]),
    (10, [256, 256, 3, 3]),
];

fn wave(count: usize, scale: f32) -> Vec<f32> {
    (0..count).map(|i| (i as f32 * 0.7).sin() * scale).collect()
}

/// Checkpoints of an AlexNet with made-up weights.
fn alexnet(folder: &Path) -> [PathBuf; 2] {
    let mut trunk = Vec::new();
    let mut linear = Vec::new();
    for (i, (index, shape)) in TRUNK.into_iter().enumerate() {
        let fan_in = (shape[1] * shape[2] * shape[3]) as f32;
        trunk.push((
            format!("features.{index}.weight"),
            shape.to_vec(),
            wave(shape.iter().product(), 2.0 / fan_in.sqrt()),
        ));
        trunk.push((format!("features.{index}.bias"), vec![shape[0]], wave(shape[0], 0.1)));
        linear.push((format!("lin{i}.model.1.weight"), vec![1, shape[0], 1, 1], vec![0.5; shape[0]]));
    }
    [("trunk.pth", trunk), ("linear.pth", linear)].map(|(name, tensors)| {
        let entries: Vec<_> =
            tensors.iter().map(|(n, shape, v)| (n.as_str(), CheckpointEntry::Tensor(shape, v))).collect();
        let path = folder.join(name);
        std::fs::write(&path, checkpoint(&entries)).expect("checkpoint");
        path
    })
}

fn with_weights(words: &[&str], weights: &Path) -> Done {
    lagrangegs_with_weights(words, weights)
}

#[test]
fn imported_weights_give_lpips_and_are_named_in_the_metrics() {
    let dir = folder();
    let weights = dir.path().join("data/weights");
    let [trunk, linear] = alexnet(dir.path());
    let said = with_weights(
        &["weights", "import", &trunk.display().to_string(), &linear.display().to_string()],
        &weights,
    )
    .ok();
    assert!(
        said.contains("alex-trunk") && said.contains("alex-linear") && said.contains("unknown contents"),
        "{said}"
    );
    let listed = with_weights(&["weights", "list"], &weights).ok();
    assert!(
        listed.lines().any(|line| line.contains("vgg-trunk") && line.contains("vgg16-397923af")),
        "{listed}"
    );
    let data = dir.path().join("scene");
    call("synth falling-ball --out {data} --size 40 --views 2 --train-fps 2", &[("data", &data)]).ok();
    let run = falling_run(dir.path(), &data);
    let run_name = run.display().to_string();
    let eval = |more: &[&str]| {
        let words = [&["eval", run_name.as_str(), "--split", "val", "--json"], more].concat();
        with_weights(&words, &weights).json()
    };
    let metrics = eval(&[]);
    let score = &metrics["splits"]["val"]["lagrangian"];
    assert!(score["lpips_alex"].as_f64().is_some_and(|v| v > 0.0), "{score}");
    assert!(score["lpips_vgg"].is_null() && score["lpips_vgg_unnormalised"].is_null(), "there is no VGG");
    assert!(score["psnr_silhouette"].is_f64(), "{score}");
    assert_eq!(metrics["protocol"]["lpips_weights"].as_array().map(Vec::len), Some(2));
    let without = eval(&["--no-lpips", "--half-resolution"]);
    assert!(without["splits"]["val"]["lagrangian"]["lpips_alex"].is_null());
    assert_eq!(without["protocol"]["half_resolution"], true);
    assert_ne!(without["splits"]["val"]["lagrangian"]["psnr"], score["psnr"]);
}

#[test]
fn without_weights_the_columns_say_so() {
    let (_dir, _, run) = falling();
    let table = call("eval {run} --split val", &[("run", &run)]).ok();
    assert!(table.lines().nth(1).is_some_and(|line| line.matches("n/a").count() == 3), "{table}");
}

#[test]
fn files_that_are_no_weights_are_refused() {
    let dir = folder();
    let weights = dir.path().join("weights");
    let [trunk, _] = alexnet(dir.path());
    let whole = std::fs::read(&trunk).expect("bytes");
    let import = |path: &Path| with_weights(&["weights", "import", &path.display().to_string()], &weights);
    std::fs::write(&trunk, &whole[..whole.len() - 9]).expect("cut");
    import(&trunk).fails(&trunk, &["can't read the PyTorch checkpoint"]);
    let calls = dir.path().join("calls.pth");
    std::fs::write(
        &calls,
        checkpoint(&[("features.0.weight", CheckpointEntry::Call("posix", "system", "touch executed"))]),
    )
    .expect("write");
    import(&calls).fails(&calls, &["no tensors"]);
    let picture = dir.path().join("picture.pth");
    std::fs::write(&picture, b"\x89PNG\r\n").expect("write");
    import(&picture).fails(&picture, &["not a PyTorch checkpoint"]);
    let none = dir.path().join("none.pth");
    import(&none).fails(&none, &["No such file"]);
    assert!(!weights.exists());
}
