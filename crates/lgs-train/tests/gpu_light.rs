//! Light over time on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor. What a step
//! of it reads back is counted with all others in `gpu_training.rs`.
#![cfg(feature = "gpu")]

#[path = "common/tiny.rs"]
mod tiny;

use burn::tensor::Device;
use lgs_data::dataset::Dataset;
use lgs_model::source::SourceKind;
use lgs_tensor::cube::device_for_tests;
use lgs_train::source::SourceTrainer;
use lgs_train::{DeviceName, Preset, TrainConfig, Trainer};
use tiny::falling_ball;

/// Steps in constant colours, and steps with light over time behind them.
const CONSTANT: usize = 4;
const LIT: usize = 6;

/// Losses of all steps, and the factors of all Gaussians' colours at some times afterwards.
fn trained(dataset: &Dataset, device: &Device) -> [Vec<f32>; 2] {
    let settings = [
        "source.stretch=1".to_owned(),
        format!("source.iterations={}", CONSTANT + LIT),
        "source.warmup_iterations=2".to_owned(),
        "source.initial_gaussians=200".to_owned(),
        "source.shading.times=4".to_owned(),
        format!("source.shading.after={CONSTANT}"),
        "source.shading.trial=0".to_owned(),
    ];
    let config = TrainConfig::resolve(Preset::Quick, None, &settings).expect("config");
    assert_eq!(config.source.kind, SourceKind::Defgs);
    let mut trainer = SourceTrainer::new(dataset, &config.source, 0, device).expect("a trainer");
    let losses = (0..CONSTANT + LIT).map(|_| trainer.step().figures().loss).collect();
    let model = trainer.model();
    let shading = model.shading().expect("light over time");
    [losses, [0.1, 0.4, 0.7].iter().flat_map(|&time| shading.gains(time)).collect()]
}

#[test]
fn steps_with_light_over_time_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = falling_ball(folder.path(), 32, 4);
    let [losses, gains] = trained(&dataset, &device);
    let [expected_losses, expected_gains] = trained(&dataset, &DeviceName::Cpu.device());
    for (step, (found, expected)) in losses.iter().zip(&expected_losses).enumerate() {
        assert!((found - expected).abs() < 2e-3 * expected, "step {step}: {found} {expected}");
    }
    let root = |values: &mut dyn Iterator<Item = f32>| values.map(|v| v * v).sum::<f32>().sqrt();
    let learned = root(&mut expected_gains.iter().map(|gain| gain - 1.0));
    let apart = root(&mut gains.iter().zip(&expected_gains).map(|(found, expected)| found - expected));
    assert!(learned > 0.01 && apart < 0.05 * learned, "{apart} apart where {learned} is learned");
}
