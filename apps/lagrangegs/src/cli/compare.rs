//! `--compare`: what stands beside each frame.

use std::path::Path;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use lgs_core::{Camera, GaussianCloud, Image};
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::Motion;
use lgs_model::source::SourceModel;

use super::run::Run;
use super::thresholds::SAME_POSE;

/// What stands beside each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Compare {
    /// The source model
    Source,
    /// The image of the dataset that is nearest in time, of the camera that `--camera` names
    Truth,
    /// The motion without the edit
    Unedited,
}

/// Where it comes from.
pub(super) enum Other<'a> {
    Nothing,
    Source(Box<dyn SourceModel>),
    /// Frames of one camera.
    Truth(Vec<Frame>, [f32; 3]),
    Unedited(Box<Motion<'a>>),
}

/// What stands beside one frame.
pub(super) enum Beside {
    /// Gaussians to draw.
    Cloud(GaussianCloud),
    /// An image, and its time.
    Image(Image, f32),
}

impl<'a> Other<'a> {
    /// Opens what is to be compared with frames of cameras.
    pub(super) fn open(
        run: &'a Run,
        compare: Option<Compare>,
        cameras: &[Camera],
        data: Option<&Path>,
    ) -> Result<Self> {
        Ok(match compare {
            None => Self::Nothing,
            Some(Compare::Source) => {
                let none = || format!("the run has no source model: {}", run.folder.root().display());
                Self::Source(run.source()?.with_context(none)?)
            }
            Some(Compare::Truth) => Self::Truth(truth(run, cameras, data)?, run.scene.background),
            Some(Compare::Unedited) => {
                Self::Unedited(Box::new(Motion::new(&run.scene, Edit::default(), Reversal::Exact)))
            }
        })
    }

    /// Name over its column; none where there is no column.
    pub(super) fn name(&self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Source(_) => Some("source model"),
            Self::Truth(..) => Some("truth"),
            Self::Unedited(_) => Some("unedited"),
        }
    }

    /// What stands beside the frame of a time.
    pub(super) fn at(&mut self, time: f32) -> Option<Beside> {
        match self {
            Self::Nothing => None,
            Self::Source(source) => Some(Beside::Cloud(source.cloud_at(time))),
            Self::Unedited(motion) => {
                let state = motion.state_at(time);
                Some(Beside::Cloud(motion.scene().cloud_at(&state, time)))
            }
            Self::Truth(frames, background) => {
                let apart = |frame: &&Frame| (frame.time - time).abs();
                let nearest = frames.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
                Some(Beside::Image(nearest.composited(*background), nearest.time))
            }
        }
    }
}

/// All images of the dataset that the one camera took, at any of its times.
fn truth(run: &Run, cameras: &[Camera], data: Option<&Path>) -> Result<Vec<Frame>> {
    let place = run.folder.root().display();
    let Some(root) = run.dataset_path(data)?.filter(|root| root.is_dir()) else {
        bail!("the dataset is not where training found it; name it with --data: {place}");
    };
    let dataset = run.images(&root, None)?;
    let is_edit = |split: &str| split.starts_with("edit-");
    let plain = dataset.splits.into_iter().filter(|(split, _)| !is_edit(split));
    let is_own = |frame: &Frame| cameras.iter().all(|camera| is_same_pose(&frame.camera, camera));
    let frames: Vec<Frame> = plain.flat_map(|(_, frames)| frames).filter(is_own).collect();
    if frames.is_empty() {
        bail!("no image of the dataset is of this camera; `--compare truth` needs `--camera NAME`: {place}");
    }
    Ok(frames)
}

fn is_same_pose(a: &Camera, b: &Camera) -> bool {
    a.camera_from_world.abs_diff_eq(b.camera_from_world, SAME_POSE)
}
