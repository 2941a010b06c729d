//! The deformation network as one operation on slices: Gaussians and one time in, `[x', q', Δs]` per Gaussian
//! out.
//!
//! Gaussians run in blocks of fixed size; the weight gradients of a few blocks are kept apart and summed in
//! order, so the result does not depend on the number of threads. The backward pass uses the activations that
//! the forward pass kept. The encoding sees positions as constants (DefGS detaches them, method §3.1);
//! gradients reach positions and quaternions where the pose is applied to them.

use std::ops::Range;

use lgs_core::Stream;
use lgs_nn::{LinearRange, MlpGradients, init_uniform};
use rayon::prelude::*;

use super::blocks::{Activations, Block, Pass, encoded};
use super::config::{DELTAS, DeformationConfig, HeadInit};
use super::input::{DeformInput, InputFrame};

/// Gaussians per block: activations of a small network stay in the second-level cache.
pub(super) const BLOCK: usize = 256;

/// Blocks whose weight gradients are accumulated together; bounds the memory of the partial sums.
const BLOCKS_PER_PARTIAL: usize = 4;

/// A deformation network with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    /// Sizes.
    pub config: DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// All parameters, laid out as [`DeformationConfig::layout`] says.
    pub params: Vec<f32>,
}

impl Deformation {
    /// A fresh network: weights and biases uniform in ±1/√fan_in, the head as configured.
    #[must_use]
    pub fn init(config: DeformationConfig, frame: InputFrame, seed: u64) -> Self {
        let layout = config.layout();
        let random = lgs_core::stream(seed, "deformation network", 0);
        let params = initial_params(&layout.linears(), &[&layout.mlp.head], config.head_init, random);
        Self { config, frame, params }
    }

    /// Pose rows `[x', q', Δs]` of Gaussians at a time.
    #[must_use]
    pub fn poses(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], time: f32) -> Vec<[f32; DELTAS]> {
        deform(DeformInput {
            config: &self.config,
            frame: self.frame,
            params: &self.params,
            means,
            rotations,
            time,
        })
    }
}

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

/// Gradients by parameters and canonical Gaussians.
#[derive(Clone, Debug, PartialEq)]
pub struct DeformGradients {
    /// Gradient by the parameters `[P]`.
    pub params: Vec<f32>,
    /// Gradient by the canonical centres, `[n]`; not through the encoding.
    pub means: Vec<[f32; 3]>,
    /// Gradient by the canonical quaternions, `[n]`.
    pub rotations: Vec<[f32; 4]>,
}

impl DeformGradients {
    /// Gradients from rows `[v_x, v_q, unused]` per Gaussian.
    pub(super) fn new(params: Vec<f32>, rows: &PoseRows) -> Self {
        let (means, rotations) = rows.iter().map(|r| ([r[0], r[1], r[2]], [r[3], r[4], r[5], r[6]])).unzip();
        Self { params, means, rotations }
    }
}

/// The values of a forward pass that the backward pass needs.
#[derive(Debug, Default)]
pub struct Kept {
    /// Activations of each block of Gaussians.
    blocks: Vec<Activations>,
}

/// Pose rows `[x', q', Δs]` of Gaussians at a time.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deform(input: DeformInput<'_>) -> Vec<[f32; DELTAS]> {
    forward(input, |_| ()).0
}

/// The same, with what [`deform_vjp`] needs.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deform_kept(input: DeformInput<'_>) -> (Vec<[f32; DELTAS]>, Kept) {
    let (poses, blocks) = forward(input, |activations| activations);
    (poses, Kept { blocks })
}

/// Pose rows, and what `keep` makes of every block's activations.
fn forward<T: Send>(
    input: DeformInput<'_>,
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

/// Gradients of [`deform`], given those by its rows and what [`deform_kept`] left for the same input.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deform_vjp(input: DeformInput<'_>, kept: &Kept, v_poses: &[[f32; DELTAS]]) -> DeformGradients {
    let n = input.means.len();
    assert_eq!(
        (input.rotations.len(), v_poses.len(), kept.blocks.len()),
        (n, n, n.div_ceil(BLOCK)),
        "Gaussians and cotangents"
    );
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
    DeformGradients::new(params, &rows)
}

/// A row of cotangents per Gaussian of a block.
pub(super) type PoseRows = [[f32; DELTAS]];

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
