//! Learned Lagrangian dynamics of particles: a system of potential and force, its rollouts, reversal, edits
//! and local rigid alignment, each with its gradient.
//!
//! ```
//! use lgs_dynamics::{RolloutSpec, State, System, SystemConfig, rollout};
//! let system = System::init(SystemConfig { hidden: 16, ..SystemConfig::paper() }, 7);
//! let start = State::at_start(vec![[0.0, 0.0, 1.0]], vec![[1.0, 0.0, 0.0]]);
//! let states = rollout(&system, &start, &RolloutSpec::new(0.01, 75));
//! assert_eq!(states.len(), 76);
//! ```
//!
//! Invariant: no images, no files, no clock. No function takes a time, so a system can't depend on it. Every
//! fast function `f` on slices has a backward pass `f_vjp` beside it, gives the same bits for any number of
//! threads, and has a plain twin in tensor operations in [`mod@reference`]; [`tensor`] puts the fast ones on
//! the autodiff tape of Burn.

mod align;
mod align_vjp;
mod aligned;
mod aligned_vjp;
mod batch;
mod block;
mod field;
mod kabsch;
mod kabsch_lanes;
mod lanes;
mod moments;
pub mod reference;
mod reversal;
mod rollout;
mod state;
mod structured;
mod supports;
mod system;
pub mod tensor;
pub mod testing;
mod thresholds;
mod twist;

pub use align::{Alignment, align};
pub use align_vjp::{AlignmentVjp, align_vjp};
pub use batch::{AccelerationGradients, acceleration_vjp};
pub use kabsch::{kabsch, kabsch_vjp};
pub use lgs_nn::ParamRange;
pub use reversal::rollout_reversed;
pub use rollout::{rollout, rollout_vjp};
pub use state::{Edit, Reversal, RolloutGradients, RolloutSpec, State, StateCotangents, VelocityPolicy};
pub use supports::{Supports, SupportsError};
pub use system::{DAMPING_SHIFT, ForceKind, Normalisation, PotentialKind, System, SystemConfig};
pub use twist::rigid_velocities;
