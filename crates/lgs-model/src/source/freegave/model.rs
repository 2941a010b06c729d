//! A trained FreeGave model: where its Gaussians are at any time (method §3.2).

use std::path::Path;
use std::sync::OnceLock;

use lgs_core::GaussianCloud;
use lgs_core::linear::{norm, sub};

use super::file::{from_tensors, to_tensors};
use super::inflated::drawn_shape;
use super::input::Advection;
use super::network::FreeGaveNetworks;
use crate::source::config::{DELTAS, RotationForm};
use crate::source::defgs::{compose, positions};
use crate::source::error::SourceError;
use crate::source::kind::SourceKind;
use crate::source::model::SourceModel;
use crate::tensor_file::TensorFile;

/// Interval of the times at which a Gaussian is asked whether it stays where it is (method §3.2).
const STILL_INTERVAL: f32 = 0.01;

/// Opacity logit of Gaussians that are not drawn.
const NOT_DRAWN: f32 = -30.0;

/// A trained FreeGave model.
#[derive(Clone, Debug)]
pub struct FreeGave {
    /// Gaussians before deformation.
    pub canonical: GaussianCloud,
    /// The networks that move them.
    pub networks: FreeGaveNetworks,
    /// End of the captured window: a Gaussian that keeps still until then never moves.
    pub time_window: f32,
    /// Poses at t = 0 of the Gaussians that never move; worked out when first asked.
    still: OnceLock<Vec<Option<[f32; DELTAS]>>>,
}

impl FreeGave {
    /// A model from its parts.
    #[must_use]
    pub fn new(canonical: GaussianCloud, networks: FreeGaveNetworks, time_window: f32) -> Self {
        Self { canonical, networks, time_window, still: OnceLock::new() }
    }

    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If sizes or arrays are absent, do not fit or are not finite.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        from_tensors(file, path).map(|(canonical, networks, window)| Self::new(canonical, networks, window))
    }

    /// Pose rows at a time by the render step alone.
    fn carried(&self, time: f32) -> Vec<[f32; DELTAS]> {
        let advection = Advection::to_draw(&self.networks.config, time);
        self.networks.poses(&self.canonical.means, &self.canonical.rotations, advection)
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
                    Some((rotation, log_scales)) => {
                        (cloud.rotations[i], cloud.log_scales[i]) = (rotation, log_scales)
                    }
                    None => (cloud.rotations[i], cloud.raw_opacities[i]) = ([1.0, 0.0, 0.0, 0.0], NOT_DRAWN),
                }
            }
        }
        cloud
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        positions(&self.poses(time))
    }

    fn to_tensors(&self) -> TensorFile {
        to_tensors(&self.canonical, &self.networks, self.time_window)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::config::VelocityConfig;
    use crate::source::freegave::FreeGaveConfig;
    use crate::source::input::InputFrame;
    use crate::source::{DeformationConfig, HeadInit, ScaleMode, load_source};

    fn model(rotation: RotationForm) -> FreeGave {
        let means: Vec<[f32; 3]> =
            (0..40).map(|i| [(i as f32).sin(), (i as f32).cos(), i as f32 * 0.02]).collect();
        let mut canonical = GaussianCloud::isotropic(means, 0.05, [0.3, 0.5, 0.7], 0.6);
        canonical.log_scales.iter_mut().for_each(|s| s[0] += 0.5);
        let frame = InputFrame::around(&canonical.means);
        let deformation =
            DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::freegave_quick() };
        let velocity = VelocityConfig { max_time: 0.6, rotation, ..VelocityConfig::quick() };
        FreeGave::new(
            canonical,
            FreeGaveNetworks::init(FreeGaveConfig { deformation, velocity }, frame, 3),
            0.75,
        )
    }

    /// A model whose velocity field is one uniform rotation, and whose deformation does nothing.
    fn spinning(rotation: RotationForm, omega: f32) -> FreeGave {
        let mut model = model(rotation);
        let layout = model.networks.config.layout();
        let params = &mut model.networks.params;
        for head in [&layout.deformation.mlp.head, &layout.segment.head, &layout.velocity.head] {
            params[head.range()].fill(0.0);
        }
        // The first basis alone, of weight one: −ω about z.
        params[layout.segment.head.bias] = 1.0;
        params[layout.velocity.head.bias + 5] = -omega;
        model
    }

    #[test]
    fn the_deformation_ends_where_the_velocity_field_begins() {
        let model = model(RotationForm::Fixed);
        let far = |a: &[[f32; 3]], b: &[[f32; 3]]| {
            a.iter().zip(b).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f32::max)
        };
        let (at, after) = (model.positions_at(0.6), model.positions_at(0.6001));
        assert!(far(&at, &after) < 1e-3);
        assert!(far(&at, &model.positions_at(0.8)) > 1e-3, "what moves goes on moving");
        assert_eq!(model.cloud_at(0.9).means, model.positions_at(0.9));
        assert_eq!(model.networks.config.deformation.scale_mode, ScaleMode::Fixed);
        assert_eq!(model.cloud_at(0.9).log_scales, model.canonical.log_scales);
    }

    #[test]
    fn what_keeps_still_in_the_window_never_moves() {
        let mut model = spinning(RotationForm::Fixed, 0.05);
        let start = model.positions_at(0.0);
        assert_eq!(model.positions_at(1.5), start, "0.05 · 0.15 is below the threshold");
        model.networks.config.velocity.still_within = 0.0;
        assert_ne!(FreeGave::new(model.canonical, model.networks, 0.75).positions_at(1.5), start);
    }

    #[test]
    fn a_fast_spin_swells_and_vanishes_in_the_published_form_and_not_in_the_fixed_one() {
        let pi = std::f32::consts::PI;
        let widest =
            |cloud: &GaussianCloud| cloud.log_scales.as_flattened().iter().copied().fold(f32::MIN, f32::max);
        let (fixed, published) = (spinning(RotationForm::Fixed, pi), spinning(RotationForm::Reference, pi));
        for time in [1.35, 1.6, 2.25] {
            let cloud = fixed.cloud_at(time);
            assert!(cloud.validate().is_ok() && widest(&cloud) == widest(&fixed.canonical));
            assert_eq!(cloud.raw_opacities, fixed.canonical.raw_opacities);
        }
        let swollen = published.cloud_at(1.35);
        assert!(widest(&swollen) > widest(&published.canonical) + 0.2 && swollen.opacity(0) > 0.5);
        let gone = published.cloud_at(1.6);
        assert!(gone.validate().is_ok() && gone.opacity(0) < 1e-6);
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("source.safetensors");
        let saved = model(RotationForm::Reference);
        saved.save(&path).expect("save");
        let loaded = load_source(&path).expect("load");
        assert_eq!((loaded.kind(), loaded.len()), (SourceKind::Freegave, 40));
        assert_eq!(loaded.cloud_at(1.1), saved.cloud_at(1.1));
        assert_eq!(loaded.to_tensors(), saved.to_tensors().clone());
        let mut bad = saved.clone();
        let last = bad.networks.params.len() - 1;
        bad.networks.params[last] = f32::NAN;
        bad.save(&path).expect("save");
        let text = load_source(&path).err().expect("nan").to_string();
        assert!(
            text.contains("source.safetensors") && text.contains("networks.velocity.head.bias"),
            "{text}"
        );
        let mut bad = saved;
        bad.networks.config.velocity.max_time = -1.0;
        bad.save(&path).expect("save");
        let text = load_source(&path).err().expect("time").to_string();
        assert!(text.contains("networks.velocity.max_time"), "{text}");
    }
}
