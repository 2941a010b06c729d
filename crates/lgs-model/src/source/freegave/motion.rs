//! FreeGave's networks as training learns them (method §3.2).

use std::sync::Arc;

use burn::tensor::{Device, Int, Tensor};
use lgs_core::stream;
use rand::RngExt;

use super::advection::training_advection;
use super::config::FreeGaveConfig;
use super::input::{Advection, Learns};
use super::model::FreeGave;
use super::network::FreeGaveNetworks;
use super::tensor::carry;
use crate::source::config::{AdvectionConfig, ScaleMode};
use crate::source::model::SourceModel;
use crate::source::motion::{Canonical, Captured, Learned, Moment, MotionConfig, SourceMotion};
use crate::source::pose_network::PoseNetwork;
use crate::source::registry::{Imports, Kind, Training};
use crate::source::tensor::NetworkCall;
use crate::thresholds::AGREEMENT_STRIDE;

pub(in crate::source) const KIND: Kind = Kind {
    name: "freegave",
    format: "lagrangegs-freegave/1",
    read: |file, path| Ok(Box::new(FreeGave::from_tensors(file, path)?)),
    imports: Imports::Impossible,
    training: Some(Training { validate, motion }),
};

fn validate(config: &MotionConfig<'_>) -> Result<(), (String, String)> {
    config.without_nodes()?;
    let (Some(velocity), Some(advection)) = (config.velocity, config.advection) else {
        let reason = "the source `freegave` needs `velocity` and `advection`";
        return Err(("kind".to_owned(), reason.to_owned()));
    };
    FreeGaveConfig { deformation: config.deformation.clone(), velocity: velocity.clone() }.validate()?;
    advection.validate().map_err(|(field, reason)| (format!("advection.{field}"), reason))
}

fn motion(config: &MotionConfig<'_>, captured: Captured) -> Box<dyn SourceMotion> {
    let velocity = config.velocity.cloned().unwrap_or_default();
    let advection = config.advection.cloned().unwrap_or_default();
    let config = Arc::new(FreeGaveConfig { deformation: config.deformation.clone(), velocity });
    Box::new(VelocityMotion { config, advection, captured })
}

/// Row numbers as a `[n]` tensor.
fn row_indices(rows: impl IntoIterator<Item = usize>, device: &Device) -> Tensor<1, Int> {
    let rows: Vec<i32> = rows.into_iter().map(|row| row as i32).collect();
    Tensor::from_ints(rows.as_slice(), device)
}

/// The motion of FreeGave: a deformation network and a velocity field.
struct VelocityMotion {
    config: Arc<FreeGaveConfig>,
    advection: AdvectionConfig,
    captured: Captured,
}

impl VelocityMotion {
    fn call(&self, time: Advection) -> NetworkCall<FreeGaveConfig> {
        NetworkCall { config: Arc::clone(&self.config), frame: self.captured.frame, time }
    }
}

impl SourceMotion for VelocityMotion {
    fn init(&self, seed: u64) -> Vec<f32> {
        self.config.fresh(seed)
    }

    fn parameters(&self) -> usize {
        self.config.layout().len
    }

    fn poses(&self, network: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2> {
        let advection = training_advection(&self.config.velocity, &self.advection, at, self.captured.seed);
        carry(network, canonical.means, canonical.rotations, self.call(advection))
    }

    /// Disagreement of velocity field and deformation over an advection step at a random time, for every few
    /// Gaussians.
    fn prior(&self, network: &Tensor<1>, canonical: &Canonical, at: Moment) -> Option<Tensor<1>> {
        let AdvectionConfig { length, longest_step, agreement, .. } = self.advection;
        let last = at.window_end.min(self.config.velocity.max_time) - length;
        if agreement <= 0.0 || last <= 0.0 {
            return None;
        }
        let mut random = stream(self.captured.seed, "agreement", at.iteration as u64);
        let from = random.random_range(0.0..last);
        let chosen =
            (random.random_range(0..AGREEMENT_STRIDE)..canonical.means.dims()[0]).step_by(AGREEMENT_STRIDE);
        let chosen = row_indices(chosen, &canonical.means.device());
        let [means, rotations] =
            [&canonical.means, &canonical.rotations].map(|all| all.clone().select(0, chosen.clone()));
        let position = |network: Tensor<1>, advection| {
            carry(network, means.clone(), rotations.clone(), self.call(advection)).narrow(1, 0, 3)
        };
        let step = if longest_step > 0.0 { longest_step } else { f32::INFINITY };
        let advection =
            Advection { from, to: from + length, longest_step: step, turns: false, learns: Learns::Velocity };
        let carried = position(network.clone(), advection);
        let target = position(
            network.clone(),
            Advection { learns: Learns::Velocity, ..Advection::none(from + length) },
        )
        .detach();
        let velocity = (carried - target) / length;
        Some(velocity.square().sum_dim(1).mean() * agreement)
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.deformation.scale_mode
    }

    fn model(&self, learned: Learned) -> Box<dyn SourceModel> {
        let Learned { cloud: canonical, parameters: params, .. } = learned;
        let networks =
            FreeGaveNetworks { config: (*self.config).clone(), frame: self.captured.frame, params };
        Box::new(FreeGave::new(canonical, networks, self.captured.time_window))
    }
}
