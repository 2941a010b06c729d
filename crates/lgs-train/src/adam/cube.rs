//! Adam on devices of CubeCL: one pass over values, moments and gradient.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, ExtensionType, TensorMetadata, backend_extension};
use burn::optim::AdaptiveMomentumState;
use burn::tensor::{DType, Tensor};
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeBackend, contiguous, empty, units};

use crate::thresholds::ADAM_EPSILON;

/// Decay of the first and of the second moment.
const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;

/// What a step changes, and its gradient.
#[derive(Clone, Debug, ExtensionType)]
pub(super) struct Stepped<B: Backend> {
    /// Values.
    pub(super) value: FloatTensor<B>,
    /// First moments.
    pub(super) first: FloatTensor<B>,
    /// Second moments.
    pub(super) second: FloatTensor<B>,
}

/// The numbers of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepSize {
    /// The learning rate, over the bias of the first moments and times the root of that of the second.
    pub(super) rate: f32,
    /// What is added to the roots of the second moments.
    pub(super) epsilon: f32,
}

/// The operation.
#[backend_extension(Cube)]
pub(super) trait AdamOps: Backend {
    /// Values and moments after a step.
    fn adam_step(
        #[extension_type] before: Stepped<Self>,
        gradient: FloatTensor<Self>,
        size: StepSize,
    ) -> Stepped<Self>;
}

#[derive(CubeType, CubeLaunch, Clone, Copy)]
struct Rates {
    rate: f32,
    epsilon: f32,
}

#[cube(launch)]
fn step_values(
    value: &[f32],
    first: &[f32],
    second: &[f32],
    gradient: &[f32],
    value_after: &mut [f32],
    first_after: &mut [f32],
    second_after: &mut [f32],
    rates: Rates,
) {
    let i = ABSOLUTE_POS;
    if i < value.len() {
        let g = gradient[i];
        let m = BETA_1 * first[i] + (1.0 - BETA_1) * g;
        let v = BETA_2 * second[i] + (1.0 - BETA_2) * g * g;
        first_after[i] = m;
        second_after[i] = v;
        value_after[i] = value[i] - rates.rate * (m / (v.sqrt() + rates.epsilon));
    }
}

impl AdamOps for CubeBackend {
    fn adam_step(before: Stepped<Self>, gradient: FloatTensor<Self>, size: StepSize) -> Stepped<Self> {
        let before = [before.value, before.first, before.second, gradient].map(contiguous);
        let (shape, client) = (before[0].shape(), before[0].client.clone());
        let count = shape.num_elements();
        let after = [0; 3].map(|_| empty(&before[0], shape.clone(), DType::F32));
        let (cubes, dim) = units(&client, count);
        let [value, first, second, gradient] = before.map(|tensor| tensor.into_buffer_arg());
        let [value_after, first_after, second_after] = after.clone().map(|tensor| tensor.into_buffer_arg());
        step_values::launch(
            &client,
            cubes,
            dim,
            value,
            first,
            second,
            gradient,
            value_after,
            first_after,
            second_after,
            RatesLaunch::new(size.rate, size.epsilon),
        );
        let [value, first, second] = after;
        Stepped { value, first, second }
    }
}

/// A step at a learning rate; no state is one of zeros.
pub(super) fn step<const D: usize>(
    learning_rate: f64,
    value: Tensor<D>,
    gradient: Tensor<D>,
    state: Option<AdaptiveMomentumState<D>>,
) -> (Tensor<D>, AdaptiveMomentumState<D>) {
    let zeros = || value.zeros_like();
    let (time, first, second) =
        state.map_or_else(|| (0, zeros(), zeros()), |state| (state.time, state.moment_1, state.moment_2));
    let time = time + 1;
    let unbiased = |beta: f32| 1.0 - beta.powi(i32::try_from(time).unwrap_or(i32::MAX));
    let root = unbiased(BETA_2).sqrt();
    let size =
        StepSize { rate: learning_rate as f32 * root / unbiased(BETA_1), epsilon: ADAM_EPSILON * root };
    let before = Stepped::<Dispatch> {
        value: value.into_dispatch(),
        first: first.into_dispatch(),
        second: second.into_dispatch(),
    };
    let after = <Dispatch as AdamOps>::adam_step(before, gradient.into_dispatch(), size);
    let [value, first, second] = [after.value, after.first, after.second].map(Tensor::from_dispatch);
    (value, AdaptiveMomentumState::new(time, first, second))
}
