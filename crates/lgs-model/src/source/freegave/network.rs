//! FreeGave's networks as one operation on slices: Gaussians, a time to deform to and a time to be carried to
//! in, pose rows out.
//!
//! Gaussians run in blocks of fixed size; the weight gradients of a few blocks are kept apart and summed in
//! order, so the result does not depend on the number of threads. Gradients (method §3.2): those of positions
//! pass straight to the deformation, as if the displacement by the velocity field were constant, and the
//! velocity field gets its own through that displacement, as if its start were constant. Positions are
//! constants to the encoding.

use std::ops::Range;

use super::call::{Bases, BlockKept, Call, Partial};
use super::config::FreeGaveConfig;
use super::input::AdvectionInput;
use crate::source::config::DELTAS;
use crate::source::input::InputFrame;
use crate::source::network::{BLOCK, DeformGradients, PoseRows, initial_params, partial_sums};

/// The networks with their parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeGaveNetworks {
    /// Sizes.
    pub config: FreeGaveConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// All parameters, laid out as [`FreeGaveConfig::layout`] says.
    pub params: Vec<f32>,
}

impl FreeGaveNetworks {
    /// Fresh networks: weights and biases uniform in ±1/√fan_in, the heads of deformation and velocity as
    /// configured.
    #[must_use]
    pub fn init(config: FreeGaveConfig, frame: InputFrame, seed: u64) -> Self {
        let layout = config.layout();
        let random = lgs_core::stream(seed, "FreeGave's networks", 0);
        let heads = [&layout.deformation.mlp.head, &layout.velocity.head];
        let params = initial_params(&layout.linears(), &heads, config.deformation.head_init, random);
        Self { config, frame, params }
    }
}

/// The values of a forward pass that the backward pass needs.
#[derive(Debug, Default)]
pub struct Kept {
    blocks: Vec<BlockKept>,
    bases: Bases,
}

/// Pose rows `[x', q', Δs]` of Gaussians.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn carry(input: AdvectionInput<'_>) -> Vec<[f32; DELTAS]> {
    let call = Call::new(input);
    call.forward(&call.bases(), |_| ()).0
}

/// The same, with what [`carry_vjp`] needs.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn carry_kept(input: AdvectionInput<'_>) -> (Vec<[f32; DELTAS]>, Kept) {
    let call = Call::new(input);
    let bases = call.bases();
    let (poses, blocks) = call.forward(&bases, |kept| kept);
    (poses, Kept { blocks, bases })
}

/// Gradients of [`carry`], given those by its rows and what [`carry_kept`] left for the same input.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn carry_vjp(input: AdvectionInput<'_>, kept: &Kept, v_poses: &[[f32; DELTAS]]) -> DeformGradients {
    let n = input.means.len();
    assert_eq!(
        (input.rotations.len(), v_poses.len(), kept.blocks.len()),
        (n, n, n.div_ceil(BLOCK)),
        "Gaussians and cotangents"
    );
    let call = Call::new(input);
    let mut rows = v_poses.to_vec();
    let zero = || call.partial(&kept.bases);
    let add = |partial: &mut Partial, gaussians: Range<usize>, block: &BlockKept, rows: &mut PoseRows| {
        call.backward((block, &kept.bases), gaussians, rows, partial);
    };
    let partials = partial_sums(&mut rows, &kept.blocks, zero, add);
    DeformGradients::new(call.sum(&kept.bases, &partials), &rows)
}
