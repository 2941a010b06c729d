//! The deformation network as one operation on slices: Gaussians and one time in, `[x', q', Δs]` per Gaussian
//! out.
//!
//! Gaussians run in blocks of fixed size; the weight gradients of a few blocks are kept apart and summed in
//! order, so the result does not depend on the number of threads. Going back uses the activations that going
//! forward kept. What enters the encoding is a constant (DefGS detaches it, §3.2); gradients reach positions
//! and quaternions where the pose is applied to them.

use rand::RngExt;
use rayon::prelude::*;

use super::blocks::{Activations, Block, Pass, encoded};
use super::config::{DeformationConfig, HeadInit};
use super::pose::DELTAS;

/// Gaussians per block: activations of a small network stay in the second-level cache.
pub(super) const BLOCK: usize = 256;

/// Blocks whose weight gradients are accumulated together; bounds the memory of the partial sums.
const BLOCKS_PER_PARTIAL: usize = 4;

/// How many blocks of `n` Gaussians are accumulated together.
pub(super) fn blocks_together(n: usize) -> usize {
    BLOCKS_PER_PARTIAL.min(n.div_ceil(16 * BLOCK).max(1))
}

/// The affine map applied to positions before encoding: `(x − center) / scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputFrame {
    /// World units.
    pub center: [f32; 3],
    /// World units.
    pub scale: f32,
}

impl InputFrame {
    /// Positions as they are.
    pub const IDENTITY: Self = Self { center: [0.0; 3], scale: 1.0 };

    /// Centre and half extent of a box around points (the identity if there are none or they coincide).
    #[must_use]
    pub fn around(points: &[[f32; 3]]) -> Self {
        let low = points.iter().fold([f32::MAX; 3], |a, p| std::array::from_fn(|i| a[i].min(p[i])));
        let high = points.iter().fold([f32::MIN; 3], |a, p| std::array::from_fn(|i| a[i].max(p[i])));
        let scale = (0..3).map(|i| 0.5 * (high[i] - low[i])).fold(0.0, f32::max);
        if scale.is_finite() && scale > 1e-6 {
            Self { center: std::array::from_fn(|i| 0.5 * (low[i] + high[i])), scale }
        } else {
            Self::IDENTITY
        }
    }
}

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
        let mut random = lgs_core::stream(seed, "deformation network", 0);
        let mut params = Vec::with_capacity(layout.len);
        for (_, linear) in layout.linears() {
            let bound = 1.0 / (linear.inputs as f32).sqrt();
            params.extend(
                (0..linear.inputs * linear.outputs + linear.outputs)
                    .map(|_| random.random_range(-bound..bound)),
            );
        }
        let factor = match config.head_init {
            HeadInit::Uniform => 1.0,
            HeadInit::Small => 0.01,
            HeadInit::Zero => 0.0,
        };
        params[layout.head.weight..].iter_mut().for_each(|p| *p *= factor);
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

/// What a call works on.
#[derive(Clone, Copy)]
pub struct DeformInput<'a> {
    /// Sizes.
    pub config: &'a DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: &'a [f32],
    /// Canonical centres `[n]`.
    pub means: &'a [[f32; 3]],
    /// Canonical quaternions `[n]`, of any length but zero.
    pub rotations: &'a [[f32; 4]],
    /// Time of the frame.
    pub time: f32,
}

/// Cotangents of what a gradient reaches.
#[derive(Clone, Debug, PartialEq)]
pub struct DeformGradients {
    /// By the parameters `[P]`.
    pub params: Vec<f32>,
    /// By the canonical centres, `[n]`; not through the encoding.
    pub means: Vec<[f32; 3]>,
    /// By the canonical quaternions, `[n]`.
    pub rotations: Vec<[f32; 4]>,
}

/// What going forward leaves for going back.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// One per block of Gaussians.
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
    let together = blocks_together(n);
    let groups = rows.par_chunks_mut(together * BLOCK).zip(kept.blocks.par_chunks(together)).enumerate();
    let partials: Vec<Vec<f32>> = groups
        .map(|(group, (rows, kept))| {
            let mut v_params = vec![0.0; input.params.len()];
            for (block, (rows, activations)) in rows.chunks_mut(BLOCK).zip(kept).enumerate() {
                let first = (group * together + block) * BLOCK;
                let gaussians = first..first + rows.len();
                let block = Block {
                    means: &input.means[gaussians.clone()],
                    rotations: &input.rotations[gaussians],
                    codes: &[],
                };
                pass.backward(activations, block, rows, &mut v_params);
            }
            v_params
        })
        .collect();
    let mut params = vec![0.0; input.params.len()];
    for partial in &partials {
        params.iter_mut().zip(partial).for_each(|(v, p)| *v += p);
    }
    pass.finish(&mut params);
    let (means, rotations) = rows.iter().map(|r| ([r[0], r[1], r[2]], [r[3], r[4], r[5], r[6]])).unzip();
    DeformGradients { params, means, rotations }
}
