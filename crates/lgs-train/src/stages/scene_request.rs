//! What stage 1 of a scene is asked for.

use burn::tensor::Device;
use lgs_data::dataset::Frame;
use lgs_distill::{DistillConfig, PartitionConfig};

use super::motion_options::MotionOptions;

/// What stage 1 needs beside the source.
#[derive(Clone, Copy)]
pub struct InitialSceneRequest<'a> {
    /// Split into static Gaussians and objects.
    pub partition: &'a PartitionConfig,
    /// Distillation settings.
    pub distill: &'a DistillConfig,
    /// Integration settings.
    pub motion: &'a MotionOptions,
    /// End of the captured window, τ_max.
    pub time_window: f32,
    /// What a pixel of the training images spans at the scene, world units; 0 where the trajectories are not
    /// from images.
    pub pixel_size: f32,
    /// Colour behind the Gaussians.
    pub background: [f32; 3],
    /// Training frames, which tell what is seen to move; without any, everything that moves counts.
    pub frames: &'a [Frame],
    /// Distance of the cameras from what they look at, world units.
    pub viewing_distance: f32,
    /// Seed of the run.
    pub seed: u64,
    /// Where the paper's networks are rolled.
    pub device: &'a Device,
}
