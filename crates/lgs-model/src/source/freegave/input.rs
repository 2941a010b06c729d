//! The times between which FreeGave's networks carry Gaussians, and what learns.

use super::config::FreeGaveConfig;

/// The parameters that receive gradients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Learns {
    /// All networks and the Gaussians.
    #[default]
    All,
    /// The parameters of the velocity field; the deformation and the Gaussians are constants.
    Velocity,
}

/// The times between which a call carries Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advection {
    /// Time that the deformation network is asked for.
    pub from: f32,
    /// Time that the velocity field carries to; `from`: it is not asked.
    pub to: f32,
    /// Longest step of the integration; infinite: a single one.
    pub longest_step: f32,
    /// Whether Gaussians also turn while they are carried.
    pub turns: bool,
    /// The parameters that gradients reach.
    pub learns: Learns,
}

impl Advection {
    /// The deformation alone.
    #[must_use]
    pub fn none(time: f32) -> Self {
        Self { from: time, to: time, longest_step: f32::INFINITY, turns: false, learns: Learns::All }
    }

    /// The render step (method §3.2): the deformation up to T*, then the velocity field with rotations.
    #[must_use]
    pub fn to_draw(config: &FreeGaveConfig, time: f32) -> Self {
        let velocity = &config.velocity;
        Self {
            from: time.min(velocity.max_time),
            to: time,
            longest_step: 1.0 / velocity.fps,
            turns: true,
            learns: Learns::All,
        }
    }
}
