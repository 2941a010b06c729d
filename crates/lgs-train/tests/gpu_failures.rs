//! Failures of a device of Vulkan, Metal or DX12 (feature `gpu`): memory that it does not have, and its loss
//! in the middle of training, after which the processor goes on.
#![cfg(feature = "gpu")]

#[path = "common/tiny.rs"]
mod tiny;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use burn::backend::{CubeDevice, DispatchDevice};
use burn::tensor::{DType, Device, Tensor};
use cubecl::wgpu::{AutoGraphicsApi, RuntimeOptions, init_setup};
use lgs_data::dataset::Dataset;
use lgs_tensor::cube::product::primitive;
use lgs_tensor::cube::{device_for_tests, empty, largest_buffer};
use lgs_train::device::failure;
use lgs_train::{Control, DeviceName, Preset, Progress, RunFolder, Stage, TrainConfig, Trained, train};
use tiny::falling_ball;

/// The words with which some work panics.
fn panic_of(work: impl FnOnce()) -> String {
    let said = Arc::new(Mutex::new(String::new()));
    let (hook, heard) = (std::panic::take_hook(), Arc::clone(&said));
    std::panic::set_hook(Box::new(move |info| *heard.lock().expect("alone") = info.to_string()));
    let done = catch_unwind(AssertUnwindSafe(work));
    std::panic::set_hook(hook);
    assert!(done.is_err(), "no panic");
    said.lock().expect("alone").clone()
}

/// Trains; `watch` is called after every step.
fn trained(run: &Path, dataset: &Dataset, device: &Device, watch: &mut dyn FnMut(Progress)) -> Trained {
    let (run, config) = RunFolder::open(run).expect("a run");
    let stop = AtomicBool::new(false);
    train(&run, dataset, &config, device, &mut Control::new(&stop, watch)).expect("trained")
}

/// Seconds of training with a checkpoint after each.
fn config() -> TrainConfig {
    let settings = [
        "checkpoint_secs=1",
        "source.iterations=40",
        "source.stretch=1",
        "source.warmup_iterations=10",
        "source.initial_gaussians=200",
        "fit_dynamics.steps=1",
        "fit_dynamics.frames=4",
        "refine_gaussians.iterations=2",
        "tune_gaussians.iterations=2",
    ]
    .map(str::to_owned);
    TrainConfig::resolve(Preset::Quick, None, &settings).expect("config")
}

/// Buffers of kernels and of the tensor library that no device has say so, and how large they or those of the
/// device are.
fn assert_too_large_is_out_of_memory(device: &Device) {
    let one = primitive(Tensor::<1>::zeros([1], device));
    let said = failure(&panic_of(|| drop(empty(&one, [1_usize << 40], DType::F32))), None);
    assert!(said.contains("4398.0 GB were asked for at once; lower"), "{said}");
    let most = largest_buffer(device).expect("a device with buffers");
    let later = || {
        let too_many = Tensor::<1>::zeros([most as usize / 4 + 1024], device);
        drop(too_many.narrow(0, 0, 1).into_data().try_to_vec::<f32>());
    };
    let said = failure(&panic_of(later), Some(most));
    assert!(said.starts_with("out of memory: ") && said.contains("; lower"), "{said}");
}

#[test]
fn failures_are_one_line_and_leave_a_run_that_goes_on_elsewhere() {
    let Some(device) = device_for_tests() else { return };
    let DispatchDevice::Cube(CubeDevice::Wgpu(chosen)) = device.as_dispatch() else { panic!("{device:?}") };
    let setup = init_setup::<AutoGraphicsApi>(chosen, RuntimeOptions::default());

    let words = panic_of(|| drop(Tensor::<1>::empty([1_usize << 40], &device).into_data()));
    let said = failure(&words, None);
    assert!(said.contains("GB were asked for at once; lower"), "{said}, from {words}");
    assert_too_large_is_out_of_memory(&device);

    let folder = tempfile::tempdir().expect("a folder");
    let (data, run) = (falling_ball(folder.path(), 24, 3), folder.path().join("run"));
    drop(RunFolder::create(&run, &config(), &data).expect("a folder"));
    let mut lose = |p: Progress| match (p.stage, p.step) {
        // Long enough for a checkpoint after this step.
        (Stage::Source, 20) => std::thread::sleep(Duration::from_millis(1100)),
        (Stage::Source, 25) => setup.device.destroy(),
        _ => {}
    };
    let said = failure(&panic_of(|| drop(trained(&run, &data, &device, &mut lose))), None);
    assert!(said.starts_with("the device was lost"), "{said}");

    let mut first = None;
    trained(&run, &data, &DeviceName::Cpu.device(), &mut |p| {
        first.get_or_insert(p.step);
    });
    assert!(first.is_some_and(|step| (21..=25).contains(&step)), "went on at step {first:?}");
}
