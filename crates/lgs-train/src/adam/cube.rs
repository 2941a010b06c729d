//! Adam on devices of CubeCL: one pass over values, moments and gradients of all groups.

use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::optim::{AdamState, AdaptiveMomentumState};
use burn::tensor::{DType, Tensor, TensorData};
use cubecl::prelude::*;
use lgs_tensor::cube::product::{primitive, tensor};
use lgs_tensor::cube::{CubeBackend, CubeTensor, empty, units};

use super::AdamGroup;
use crate::thresholds::{ADAM_BETAS, ADAM_EPSILON};

const BETA_1: f32 = ADAM_BETAS[0];
const BETA_2: f32 = ADAM_BETAS[1];
/// Buffers of a group: values and gradient are read, moments changed, and new values written.
const BUFFERS: usize = 5;

/// A group before its step.
pub(super) struct Before {
    value: CubeTensor,
    first: CubeTensor,
    second: CubeTensor,
    gradient: CubeTensor,
    /// The learning rate, over the bias of the first moments and times the root of that of the second.
    rate: f32,
    /// What is added to the roots of the second moments.
    epsilon: f32,
    time: usize,
}

/// A group after its step.
pub(super) struct After {
    value: CubeTensor,
    first: CubeTensor,
    second: CubeTensor,
    time: usize,
}

impl Before {
    /// No state is one of zeros.
    pub(super) fn of<const D: usize>(
        group: &mut AdamGroup<D>,
        learning_rate: f64,
        gradient: Tensor<D>,
    ) -> Self {
        let zeros = || group.value.zeros_like();
        let state = group.state.take().map(|state| state.momentum);
        let (time, first, second) =
            state.map_or_else(|| (0, zeros(), zeros()), |state| (state.time, state.moment_1, state.moment_2));
        let time = time + 1;
        let unbiased = |beta: f32| 1.0 - beta.powi(i32::try_from(time).unwrap_or(i32::MAX));
        let root = unbiased(BETA_2).sqrt();
        Self {
            value: primitive(group.value.clone()),
            first: unshared(primitive(first)),
            second: unshared(primitive(second)),
            gradient: primitive(gradient),
            rate: learning_rate as f32 * root / unbiased(BETA_1),
            epsilon: ADAM_EPSILON * root,
            time,
        }
    }
}

/// A tensor whose buffer nothing else reads.
fn unshared(tensor: CubeTensor) -> CubeTensor {
    if tensor.can_mut() { tensor } else { tensor.copy() }
}

impl After {
    pub(super) fn written_to<const D: usize>(self, group: &mut AdamGroup<D>) {
        let moments = AdaptiveMomentumState::new(self.time, tensor(self.first), tensor(self.second));
        group.value = tensor(self.value);
        group.state = Some(AdamState::new(moments));
    }
}

/// The buffers of a group in the kernel.
#[derive(CubeType, CubeLaunch)]
struct Group {
    value: Box<[f32]>,
    first: Box<[f32]>,
    second: Box<[f32]>,
    gradient: Box<[f32]>,
    value_after: Box<[f32]>,
}

/// A unit per place in the largest group, which takes the step of that place in every group; `rates` are the
/// learning rate and the summand of each group. As they change from step to step they are no scalars of the
/// launch: every set of these takes memory of its own.
#[cube(launch)]
fn step_groups(groups: &mut Sequence<Group>, rates: &[f32]) {
    let i = ABSOLUTE_POS;
    #[unroll]
    for index in 0..groups.len() {
        let group = groups.index_mut(index);
        if i < group.value.len() {
            let g = group.gradient[i];
            let m = BETA_1 * group.first[i] + (1.0 - BETA_1) * g;
            let v = BETA_2 * group.second[i] + (1.0 - BETA_2) * g * g;
            group.first[i] = m;
            group.second[i] = v;
            let (rate, epsilon) = (rates[2 * index], rates[2 * index + 1]);
            group.value_after[i] = group.value[i] - rate * (m / (v.sqrt() + epsilon));
        }
    }
}

/// Takes the steps of groups. A launch has as many as the device allows buffers for, all where it allows
/// enough.
pub(super) fn stepped(mut before: Vec<Before>) -> Vec<After> {
    let mut after = Vec::with_capacity(before.len());
    while let Some(group) = before.first() {
        // One buffer has the rates, one what the library tells of each launch.
        let most = group.value.client.properties().hardware.max_bindings.saturating_sub(2);
        let rest = before.split_off(before.len().min((most as usize / BUFFERS).max(1)));
        after.extend(launch(std::mem::replace(&mut before, rest)));
    }
    after
}

/// One launch.
fn launch(before: Vec<Before>) -> Vec<After> {
    let client = before[0].value.client.clone();
    let largest = before.iter().map(|group| group.value.shape().num_elements()).max().unwrap_or(0);
    let (cubes, dim) = units(&client, largest);
    let rates: Vec<f32> = before.iter().flat_map(|group| [group.rate, group.epsilon]).collect();
    let count = rates.len();
    let rates = CubeBackend::float_from_data(TensorData::new(rates, [count]), &before[0].value.device);
    let (mut groups, mut after) = (SequenceArg::<Group>::new(), Vec::with_capacity(before.len()));
    for Before { value, first, second, gradient, time, .. } in before {
        let value_after = empty(&value, value.shape(), DType::F32);
        groups.push(GroupLaunch::new(
            value.into_buffer_arg(),
            first.clone().into_buffer_arg(),
            second.clone().into_buffer_arg(),
            gradient.into_buffer_arg(),
            value_after.clone().into_buffer_arg(),
        ));
        after.push(After { value: value_after, first, second, time });
    }
    step_groups::launch(&client, cubes, dim, groups, rates.into_buffer_arg());
    after
}

#[cfg(test)]
mod tests {
    use crate::adam::{AdamGroup, AdamSteps, values};
    use crate::device::DeviceName;
    use burn::tensor::{Device, Tensor, TensorData};
    use lgs_tensor::cube::device_for_tests;

    /// Five steps of nine groups of many sizes, as the cloud and the network of a source are.
    fn stepped(device: &Device) -> Vec<Vec<f32>> {
        let widths = [3, 4, 3, 1, 3, 45, 16, 12, 700];
        let ramp = |n: usize, by: f32| (0..n).map(|i| by * (i % 17) as f32 - 3.0 * by).collect::<Vec<f32>>();
        let mut groups: Vec<AdamGroup<2>> =
            widths.iter().map(|&width| AdamGroup::new(ramp(7 * width, 0.1), [7, width], device)).collect();
        for step in 1..=5 {
            let mut steps = AdamSteps::default();
            for (index, group) in groups.iter_mut().enumerate() {
                let width = widths[index];
                let by = ramp(7 * width, 1e-3 * (step * (index + 1)) as f32);
                // A group without a gradient stays as it is.
                let gradient =
                    (index != 4).then(|| Tensor::from_data(TensorData::new(by, [7, width]), device));
                steps.add(group, 1e-2 / (index + 1) as f64, gradient);
            }
            steps.take();
        }
        groups.iter().map(|group| values(&group.value())).collect()
    }

    #[test]
    fn one_pass_over_all_groups_takes_the_steps_of_each() {
        let Some(device) = device_for_tests() else { return };
        let pairs = stepped(&device).into_iter().zip(stepped(&DeviceName::Cpu.device()));
        for (group, (found, expected)) in pairs.enumerate() {
            let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-6 && found.len() == expected.len(), "group {group}: {worst}");
        }
    }
}
