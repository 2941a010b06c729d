//! The deformation network as one operation on slices: Gaussians and one time in, `[x', q', Δs]` per Gaussian
//! out.
//!
//! Gaussians run in blocks of fixed size; the weight gradients of a few blocks are kept apart and summed in
//! order, so the result does not depend on the number of threads. The backward pass uses the activations that
//! the forward pass kept. The encoding sees positions as constants (DefGS detaches them, method §3.1);
//! gradients reach positions and quaternions where the pose is applied to them.

use std::ops::Range;

use lgs_core::Stream;
use lgs_nn::{LinearRange, MlpGradients, NamedLayers, init_uniform};
use rayon::prelude::*;

use super::blocks::{Activations, Block, Pass, encoded};
use super::config::{DELTAS, DeformationConfig, HeadInit};
use super::pose_network::{NetworkInput, Networks, PoseGradients, PoseNetwork, PoseRows};

/// Gaussians per block: activations of a small network stay in the second-level cache.
pub(super) const BLOCK: usize = 256;

/// Blocks whose weight gradients are accumulated together; bounds the memory of the partial sums.
const BLOCKS_PER_PARTIAL: usize = 4;

/// A deformation network with its parameters.
pub type Deformation = Networks<DeformationConfig>;

/// Parameters before training: uniform in ±1/√inputs, the heads as asked.
pub(super) fn initial_params(
    layers: &[(String, &LinearRange)],
    heads: &[&LinearRange],
    head_init: HeadInit,
    mut random: Stream,
) -> Vec<f32> {
    let len = layers.iter().map(|(_, layer)| layer.end()).max().unwrap_or(0);
    let mut params = vec![0.0; len];
    init_uniform(layers.iter().map(|&(_, layer)| layer), &mut params, &mut random);
    let factor = match head_init {
        HeadInit::Uniform => 1.0,
        HeadInit::Small => 0.01,
        HeadInit::Zero => 0.0,
    };
    for head in heads {
        params[head.range()].iter_mut().for_each(|p| *p *= factor);
    }
    params
}

/// The values of a forward pass that the backward pass needs.
#[derive(Debug, Default)]
pub struct Kept {
    /// Activations of each block of Gaussians.
    blocks: Vec<Activations>,
}

impl PoseNetwork for DeformationConfig {
    type Time = f32;
    type Kept = Kept;

    /// Weights and biases uniform in ±1/√fan_in, the head as configured.
    fn fresh(&self, seed: u64) -> Vec<f32> {
        let (layout, random) = (self.layout(), lgs_core::stream(seed, "deformation network", 0));
        initial_params(&layout.linears(), &[&layout.mlp.head], self.head_init, random)
    }

    fn poses(input: NetworkInput<'_, Self>) -> Vec<[f32; DELTAS]> {
        forward(input, |_| ()).0
    }

    fn poses_kept(input: NetworkInput<'_, Self>) -> (Vec<[f32; DELTAS]>, Kept) {
        let (poses, blocks) = forward(input, |activations| activations);
        (poses, Kept { blocks })
    }

    fn vjp(input: NetworkInput<'_, Self>, kept: &Kept, v_poses: &PoseRows) -> PoseGradients {
        input.assert_cotangents(v_poses, kept.blocks.len(), BLOCK);
        let pass = Pass::new(&input);
        let mut rows = v_poses.to_vec();
        let add =
            |partial: &mut MlpGradients, gaussians: Range<usize>, activations: &Activations, rows: &mut _| {
                let means = &input.means[gaussians.clone()];
                let block = Block { means, rotations: &input.rotations[gaussians], codes: &[] };
                pass.backward(activations, block, rows, partial);
            };
        let partials = partial_sums(&mut rows, &kept.blocks, || pass.gradients(), add);
        let mut params = vec![0.0; input.params.len()];
        partials.iter().for_each(|partial| partial.add_to(&mut params));
        pass.finish(&mut params);
        PoseGradients::new(params, &rows)
    }
}

/// Pose rows, and what `keep` makes of every block's activations.
fn forward<T: Send>(
    input: NetworkInput<'_, DeformationConfig>,
    keep: impl Fn(Activations) -> T + Sync,
) -> (Vec<[f32; DELTAS]>, Vec<T>) {
    assert_eq!(input.means.len(), input.rotations.len(), "centres and quaternions");
    assert_eq!(input.params.len(), input.config.layout().len, "parameters of the deformation network");
    let pass = Pass::new(&input);
    let mut poses = vec![[0.0; DELTAS]; input.means.len()];
    let blocks =
        poses.par_chunks_mut(BLOCK).zip(input.means.par_chunks(BLOCK)).zip(input.rotations.par_chunks(BLOCK));
    let kept = blocks
        .map(|((poses, means), rotations)| {
            let encoded = encoded(means, input.frame, input.config);
            keep(pass.forward(Block { means, rotations, codes: &[] }, encoded, poses))
        })
        .collect();
    (poses, kept)
}

/// Runs the blocks of Gaussians backwards, given the rows of cotangents of all Gaussians and the values kept
/// of each block: a few blocks after each other add to one partial sum, and the partial sums come in order.
pub(super) fn partial_sums<K: Sync, P: Send>(
    rows: &mut PoseRows,
    kept: &[K],
    zero: impl Fn() -> P + Sync,
    add: impl Fn(&mut P, Range<usize>, &K, &mut PoseRows) + Sync,
) -> Vec<P> {
    let together = BLOCKS_PER_PARTIAL.min(rows.len().div_ceil(16 * BLOCK).max(1));
    let groups = rows.par_chunks_mut(together * BLOCK).zip(kept.par_chunks(together)).enumerate();
    let sum = |(group, (rows, kept)): (usize, (&mut PoseRows, &[K]))| {
        let mut partial = zero();
        for (block, (rows, kept)) in rows.chunks_mut(BLOCK).zip(kept).enumerate() {
            let first = (group * together + block) * BLOCK;
            add(&mut partial, first..first + rows.len(), kept, rows);
        }
        partial
    };
    groups.map(sum).collect()
}
