use super::*;
use std::ops::Range;

use lgs_core::{Camera, Exposure, stream};
use lgs_data::dataset::Frame;
use rand::RngExt;

use crate::device::DeviceName;
use crate::driver::Trainer;

const SIZE: u32 = 32;

/// What four cameras see at eight moments: a grey disc or, at some of these, noise that no motion
/// explains.
fn dataset(noisy: Range<usize>) -> Dataset {
    let frame = |index: usize| {
        let (moment, camera_id) = (index / 4, index % 4);
        let angle = std::f32::consts::TAU * camera_id as f32 / 4.0;
        let eye = [4.0 * angle.cos(), 4.0 * angle.sin(), 1.0];
        let camera = Camera::look_at(eye, [0.0; 3], 0.6, SIZE, SIZE);
        let mut random = stream(index as u64, "noise of images", 0);
        let pixel = |p: usize| {
            let at = [p as u32 % SIZE, p as u32 / SIZE].map(|x| x as f32 - 0.5 * SIZE as f32);
            let is_inside = at[0].hypot(at[1]) < 0.4 * SIZE as f32;
            match (noisy.contains(&moment), is_inside) {
                (true, _) => [255 * random.random_range(0..2_u8), 0, 0, 255],
                (false, true) => [90, 90, 90, 255],
                (false, false) => [255; 4],
            }
        };
        let rgba: Vec<u8> = (0..camera.pixels()).map(pixel).collect::<Vec<_>>().into_flattened();
        let (name, exposure) = (format!("{index}"), Exposure::IDENTITY);
        Frame { name, camera_id, camera, time: moment as f32 / 8.0, exposure, pixels: rgba.into() }
    };
    let splits = [("train".to_owned(), (0..32).map(frame).collect())].into();
    Dataset { splits, ..Dataset::none([1.0; 3]) }
}

/// A short schedule whose colours are soon as good as they can be.
fn config() -> SourceConfig {
    let quick = SourceConfig::quick();
    let densify = DensifyConfig { after: 120, before: 400, ..quick.densify };
    let learning_rates = LearningRates { sh: 0.1, while_growing: 1.0, ..quick.learning_rates };
    SourceConfig {
        iterations: 800,
        warmup_iterations: 80,
        window_steps: 4,
        window_interval: 5,
        initial_gaussians: 300,
        learning_rates,
        densify,
        ..quick
    }
}

fn trainer<'a>(dataset: &'a Dataset, config: &SourceConfig) -> SourceTrainer<'a> {
    SourceTrainer::new(dataset, config, 1, &DeviceName::Cpu.device()).expect("a trainer")
}

/// Where the Gaussians are after some steps.
fn trained(trainer: &mut SourceTrainer, steps: usize) -> Vec<[f32; 3]> {
    while !trainer.is_finished() && trainer.step_index() < steps {
        trainer.step();
    }
    trainer.model().positions_at(0.6)
}

/// That a training which is stopped after some steps, and goes on, ends as it does otherwise.
fn assert_resumes(dataset: &Dataset, stops: &[usize], expected: &[[f32; 3]]) {
    for &stopped_at in stops {
        let mut first = trainer(dataset, &config());
        trained(&mut first, stopped_at);
        let file = first.checkpoint();
        let mut second = trainer(dataset, &config());
        second.restore(&file, stopped_at).expect("a checkpoint");
        assert!(trained(&mut second, usize::MAX) == expected, "stopped at {stopped_at}");
    }
}

#[test]
fn what_is_not_followed_is_tried_again_with_a_slower_window_once() {
    let (flickering, still) = (dataset(1..8), dataset(0..0));
    let mut other = trainer(&flickering, &config());
    let expected = trained(&mut other, usize::MAX);
    assert!(other.attempt == Attempt::Slower);
    // Judged after 295 iterations; the window takes 60 iterations instead of 15.
    assert_eq!(other.step_index(), 295 + 845);
    assert_eq!((other.config.window_interval, other.config.densify.before), (20, 445));
    assert_resumes(&flickering, &[100, 295, 400], &expected);
    let mut once = trainer(&still, &config());
    trained(&mut once, usize::MAX);
    assert!(once.attempt == Attempt::First && once.step_index() == 800);
    let following = once.following.expect("until the end");
    let next = |error_of_first| Attempt::Still { error_of_first }.next(&following, &(800..=800));
    assert_eq!((next(0.0), next(1.0)), (Some(Attempt::FirstAgain), None), "the better one stays");
}

#[test]
fn what_is_lost_late_is_tried_again_with_gaussians_that_keep_still() {
    let lost = dataset(7..8);
    let mut other = trainer(&lost, &config());
    let expected = trained(&mut other, usize::MAX);
    assert!(!matches!(other.attempt, Attempt::First | Attempt::Slower), "{:?}", other.attempt);
    assert!(other.step_index() >= 1600 && other.step_index().is_multiple_of(800));
    assert_resumes(&lost, &[800, 1700], &expected);
}
