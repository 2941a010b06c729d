//! FreeGave's networks as one operation on slices: Gaussians, a time to deform to and a time to be carried to
//! in, pose rows out.
//!
//! Gaussians run in blocks of fixed size; the weight gradients of a few blocks are kept apart and summed in
//! order, so the result does not depend on the number of threads. Gradients (method §3.2): those of positions
//! pass straight to the deformation, as if the displacement by the velocity field were constant, and the
//! velocity field gets its own through that displacement, as if its start were constant. Positions are
//! constants to the encoding.

use std::ops::Range;

use lgs_nn::NamedLayers;

use super::call::{Bases, BlockKept, Call, Partial};
use super::config::FreeGaveConfig;
use super::input::Advection;
use crate::source::config::DELTAS;
use crate::source::network::{BLOCK, initial_params, partial_sums};
use crate::source::pose_network::{NetworkInput, Networks, PoseGradients, PoseNetwork, PoseRows};

/// The networks with their parameters.
pub type FreeGaveNetworks = Networks<FreeGaveConfig>;

/// The values of a forward pass that the backward pass needs.
#[derive(Debug, Default)]
pub struct Kept {
    blocks: Vec<BlockKept>,
    bases: Bases,
}

impl PoseNetwork for FreeGaveConfig {
    type Time = Advection;
    type Kept = Kept;

    /// Weights and biases uniform in ±1/√fan_in, the heads of deformation and velocity as configured.
    fn fresh(&self, seed: u64) -> Vec<f32> {
        let (layout, random) = (self.layout(), lgs_core::stream(seed, "FreeGave's networks", 0));
        let heads = [&layout.deformation.mlp.head, &layout.velocity.head];
        initial_params(&layout.linears(), &heads, self.deformation.head_init, random)
    }

    fn poses(input: NetworkInput<'_, Self>) -> Vec<[f32; DELTAS]> {
        let call = Call::new(input);
        call.forward(&call.bases(), |_| ()).0
    }

    fn poses_kept(input: NetworkInput<'_, Self>) -> (Vec<[f32; DELTAS]>, Kept) {
        let call = Call::new(input);
        let bases = call.bases();
        let (poses, blocks) = call.forward(&bases, |kept| kept);
        (poses, Kept { blocks, bases })
    }

    fn vjp(input: NetworkInput<'_, Self>, kept: &Kept, v_poses: &PoseRows) -> PoseGradients {
        input.assert_cotangents(v_poses, kept.blocks.len(), BLOCK);
        let call = Call::new(input);
        let mut rows = v_poses.to_vec();
        let zero = || call.partial(&kept.bases);
        let add = |partial: &mut Partial, gaussians: Range<usize>, block: &BlockKept, rows: &mut PoseRows| {
            call.backward((block, &kept.bases), gaussians, rows, partial);
        };
        let partials = partial_sums(&mut rows, &kept.blocks, zero, add);
        PoseGradients::new(call.sum(&kept.bases, &partials), &rows)
    }
}
