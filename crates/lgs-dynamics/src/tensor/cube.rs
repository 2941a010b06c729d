//! The operations of [`super::ops`] on devices of CubeCL: left to the processor.

use super::RolloutCall;
use super::ops::{AccelerationCall, AlignCall};
use lgs_tensor::cube::OnProcessor;

impl OnProcessor for AccelerationCall {
    const OPERATION: &'static str = "accelerations";
}

impl OnProcessor for RolloutCall {
    const OPERATION: &'static str = "rollout";
}

impl OnProcessor for AlignCall {
    const OPERATION: &'static str = "alignment";
}
