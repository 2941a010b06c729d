//! FreeGave's networks as a Burn operation, differentiable by their parameters and by the Gaussians that they
//! move.

use super::config::FreeGaveConfig;
use crate::source::tensor::NetworkCall;

lgs_tensor::calls! { NetworkCall<FreeGaveConfig>: "networks of FreeGave"; }

lgs_tensor::operations! {
    /// Backends that can run FreeGave's networks: kernels from parameters `[P]`, centres `[n, 3]` and
    /// quaternions `[n, 4]` to pose rows `[n, DELTAS]`.
    pub trait FreeGaveKernels;

    /// The operation of FreeGave's networks on backends with and without gradients.
    pub trait FreeGaveOps;

    /// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, from parameters
    /// `[P]`; differentiable by all three in the way of [`super::network`].
    pub fn carry(params: 1, means: 2, rotations: 2; call: NetworkCall<FreeGaveConfig>) -> 2;
}
