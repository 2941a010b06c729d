//! The interface of networks that move Gaussians: parameters, Gaussians and the time of a call in, pose rows
//! `[x', q', Δs]` out.

use std::fmt::Debug;

use super::config::DELTAS;
use super::input::InputFrame;

/// A row of cotangents per Gaussian of a block.
pub(super) type PoseRows = [[f32; DELTAS]];

/// Sizes and choices of networks that move Gaussians.
pub trait PoseNetwork: Clone + Debug + Send + Sync + 'static {
    /// The time of a call, or its times.
    type Time: Copy + Debug + Send + Sync + 'static;
    /// The values of a forward pass that the backward pass needs.
    type Kept: Debug + Send + Sync + 'static;

    /// Fresh parameters `[P]`.
    fn fresh(&self, seed: u64) -> Vec<f32>;

    /// Pose rows of Gaussians.
    ///
    /// # Panics
    /// If lengths do not fit.
    fn poses(input: NetworkInput<'_, Self>) -> Vec<[f32; DELTAS]>;

    /// The same, with what [`Self::vjp`] needs.
    ///
    /// # Panics
    /// If lengths do not fit.
    fn poses_kept(input: NetworkInput<'_, Self>) -> (Vec<[f32; DELTAS]>, Self::Kept);

    /// Gradients of the pose rows, given those by the rows and what [`Self::poses_kept`] left for the same
    /// input.
    ///
    /// # Panics
    /// If lengths do not fit.
    fn vjp(input: NetworkInput<'_, Self>, kept: &Self::Kept, v_poses: &PoseRows) -> PoseGradients;
}

/// The networks, the Gaussians and the time of a call.
pub struct NetworkInput<'a, N: PoseNetwork> {
    /// Sizes.
    pub config: &'a N,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: &'a [f32],
    /// Canonical centres `[n]`.
    pub means: &'a [[f32; 3]],
    /// Canonical quaternions `[n]`, of any length but zero.
    pub rotations: &'a [[f32; 4]],
    /// The time of the call, or its times.
    pub time: N::Time,
}

// Derived copies would ask for networks that can be copied, and the input only borrows them.
impl<N: PoseNetwork> Copy for NetworkInput<'_, N> {}

impl<N: PoseNetwork> Clone for NetworkInput<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N: PoseNetwork> NetworkInput<'_, N> {
    /// Asserts that cotangents and kept blocks of `block` Gaussians are those of the input.
    pub(super) fn assert_cotangents(&self, v_poses: &PoseRows, blocks: usize, block: usize) {
        let n = self.means.len();
        let found = (self.rotations.len(), v_poses.len(), blocks);
        assert_eq!(found, (n, n, n.div_ceil(block)), "Gaussians and cotangents");
    }
}

/// Networks with their parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Networks<N> {
    /// Sizes.
    pub config: N,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// All parameters, laid out as the `layout` of the sizes says.
    pub params: Vec<f32>,
}

impl<N: PoseNetwork> Networks<N> {
    /// Fresh networks.
    #[must_use]
    pub fn init(config: N, frame: InputFrame, seed: u64) -> Self {
        let params = config.fresh(seed);
        Self { config, frame, params }
    }

    /// A call for Gaussians.
    #[must_use]
    pub fn input<'a>(
        &'a self,
        means: &'a [[f32; 3]],
        rotations: &'a [[f32; 4]],
        time: N::Time,
    ) -> NetworkInput<'a, N> {
        let Self { config, frame, params } = self;
        NetworkInput { config, frame: *frame, params, means, rotations, time }
    }

    /// Pose rows `[x', q', Δs]` of Gaussians at a time.
    #[must_use]
    pub fn poses(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], time: N::Time) -> Vec<[f32; DELTAS]> {
        N::poses(self.input(means, rotations, time))
    }
}

/// Gradients by parameters and canonical Gaussians.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseGradients {
    /// Gradient by the parameters `[P]`.
    pub params: Vec<f32>,
    /// Gradient by the canonical centres, `[n]`; not through the encoding.
    pub means: Vec<[f32; 3]>,
    /// Gradient by the canonical quaternions, `[n]`.
    pub rotations: Vec<[f32; 4]>,
}

impl PoseGradients {
    /// Gradients from rows `[v_x, v_q, unused]` per Gaussian.
    pub(super) fn new(params: Vec<f32>, rows: &PoseRows) -> Self {
        let (means, rotations) = rows.iter().map(|r| ([r[0], r[1], r[2]], [r[3], r[4], r[5], r[6]])).unzip();
        Self { params, means, rotations }
    }
}
