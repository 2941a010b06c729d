//! A set of images that is made and trained on in seconds.

use std::path::Path;

use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_data::synth::{self, SynthOptions};

/// A ball that falls, filmed twelve times in a unit of time, in a folder.
pub(crate) fn falling_ball(folder: &Path, size: u32, views: usize) -> Dataset {
    let options = SynthOptions { size, views, train_fps: 12, ..SynthOptions::default() };
    let path = folder.join("data");
    synth::generate("falling-ball", &options, &path, &|_, _| {}).expect("synth");
    Dataset::load(&path, &LoadOptions::default(), &|_, _| {}).expect("load")
}
