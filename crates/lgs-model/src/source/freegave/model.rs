//! A trained FreeGave model: where its Gaussians are at any time (§4.3 render step, §4.6).

use std::sync::OnceLock;

use lgs_core::GaussianCloud;
use lgs_core::linear::{norm, quat_normalize, sub};

use super::config::RotationForm;
use super::file::to_tensors;
use super::inflated::drawn_shape;
use super::network::{FreeGaveNetworks, Hop, HopInput, carry};
use crate::source::SourceModel;
use crate::source::defgs::compose;
use crate::source::file::SourceKind;
use crate::source::pose::DELTAS;
use crate::tensor_file::TensorFile;

/// Interval of the times at which a Gaussian is asked whether it stays where it is (§4.6).
const STILL_INTERVAL: f32 = 0.01;

/// Opacity logit of what is not drawn.
const NOT_DRAWN: f32 = -30.0;

/// A trained FreeGave model.
#[derive(Clone, Debug)]
pub struct FreeGave {
    /// Gaussians before deformation.
    pub canonical: GaussianCloud,
    /// What moves them.
    pub networks: FreeGaveNetworks,
    /// End of the captured window: what keeps still until then never moves.
    pub time_window: f32,
    /// Poses at t = 0 of the Gaussians that never move; worked out when first asked.
    still: OnceLock<Vec<Option<[f32; DELTAS]>>>,
}

impl FreeGave {
    /// A model of its parts.
    #[must_use]
    pub fn new(canonical: GaussianCloud, networks: FreeGaveNetworks, time_window: f32) -> Self {
        Self { canonical, networks, time_window, still: OnceLock::new() }
    }

    /// Pose rows at a time by the render step alone.
    fn carried(&self, time: f32) -> Vec<[f32; DELTAS]> {
        let FreeGaveNetworks { config, frame, params } = &self.networks;
        let GaussianCloud { means, rotations, .. } = &self.canonical;
        carry(HopInput { config, frame: *frame, params, means, rotations, hop: Hop::to_draw(config, time) })
    }

    /// Pose rows at a time, with those that never move where they are at t = 0.
    fn poses(&self, time: f32) -> Vec<[f32; DELTAS]> {
        let mut poses = self.carried(time);
        poses.iter_mut().zip(self.still()).for_each(|(pose, still)| *pose = still.unwrap_or(*pose));
        poses
    }

    fn still(&self) -> &[Option<[f32; DELTAS]>] {
        self.still.get_or_init(|| {
            let start = self.carried(0.0);
            let within = self.networks.config.velocity.still_within;
            let mut still: Vec<bool> = vec![within > 0.0; start.len()];
            let times = (self.time_window / STILL_INTERVAL - 1e-3).ceil() as usize;
            for i in 1..times {
                let poses = self.carried(i as f32 * STILL_INTERVAL);
                for (still, (a, b)) in still.iter_mut().zip(start.iter().zip(&poses)) {
                    *still &= norm(sub([a[0], a[1], a[2]], [b[0], b[1], b[2]])) < within;
                }
            }
            start.into_iter().zip(still).map(|(pose, still)| still.then_some(pose)).collect()
        })
    }
}

impl SourceModel for FreeGave {
    fn kind(&self) -> SourceKind {
        SourceKind::Freegave
    }

    fn len(&self) -> usize {
        self.canonical.len()
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        let poses = self.poses(time);
        let mut cloud = compose(&self.canonical, &poses, self.networks.config.deformation.scale_mode);
        if self.networks.config.velocity.rotation == RotationForm::Reference {
            for (i, &[_, _, _, w, x, y, z, ..]) in poses.iter().enumerate() {
                match drawn_shape([w, x, y, z], cloud.log_scales[i]) {
                    Some((rotation, log_scales)) => (cloud.rotations[i], cloud.log_scales[i]) = (rotation, log_scales),
                    None => (cloud.rotations[i], cloud.raw_opacities[i]) = (quat_normalize([1.0, 0.0, 0.0, 0.0]), NOT_DRAWN),
                }
            }
        }
        cloud
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        self.poses(time).iter().map(|&[x, y, z, ..]| [x, y, z]).collect()
    }

    fn to_tensors(&self) -> TensorFile {
        to_tensors(self)
    }
}
