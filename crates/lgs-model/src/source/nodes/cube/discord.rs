//! How much the Gaussians of each node want to move apart, on the device (`super::super::choose::Discord`).
#![allow(clippy::manual_is_multiple_of, reason = "kernels have no such method")]

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, TensorMetadata, backend_extension};
use burn::tensor::{DType, Tensor};
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeBackend, arguments, contiguous, empty, units};

use super::followed::{Followed, followed};
use crate::source::nodes::neighbors::Neighbors;

/// The operation.
#[backend_extension(Cube)]
pub(super) trait DiscordOps: Backend {
    /// Discord `[m]` after an iteration's gradients `[n, 3]`.
    fn add_discord(
        before: FloatTensor<Self>,
        gradients: FloatTensor<Self>,
        neighbors: Neighbors,
    ) -> FloatTensor<Self>;
}

/// Adds the squares of the gradients of a node's first followers, less that of their mean.
#[cube(launch)]
fn add(
    before: &[f32],
    gradients: &[f32],
    begins: &[u32],
    members: &[u32],
    after: &mut [f32],
    #[comptime] row: usize,
) {
    let node = ABSOLUTE_POS;
    if node < after.len() {
        let mut sum = Array::<f32>::new(3usize);
        for axis in 0..3usize {
            sum[axis] = 0.0f32;
        }
        let mut squares = 0.0f32;
        let mut count = 0.0f32;
        for at in begins[node] as usize..begins[node + 1usize] as usize {
            let place = members[at] as usize;
            if place % row == 0usize {
                count += 1.0f32;
                for axis in 0..3usize {
                    let g = gradients[place / row * 3usize + axis];
                    sum[axis] = sum[axis] + g;
                    squares += g * g;
                }
            }
        }
        let mut common = 0.0f32;
        for axis in 0..3usize {
            common += sum[axis] * sum[axis];
        }
        after[node] = before[node] + (squares - common / count.max(1.0f32)).max(0.0f32);
    }
}

impl DiscordOps for CubeBackend {
    fn add_discord(
        before: FloatTensor<Self>,
        gradients: FloatTensor<Self>,
        neighbors: Neighbors,
    ) -> FloatTensor<Self> {
        let m = before.shape()[0];
        if neighbors.row == 0 || m == 0 {
            return before;
        }
        let followed = followed(&neighbors, m, &gradients);
        let (before, gradients) = (contiguous(before), contiguous(gradients));
        let after = empty(&before, [m], DType::F32);
        let (count, dim) = units(&after.client, m);
        let Followed { begins, members, row, .. } = &followed;
        let [from, by, begins, members, to] = arguments([&before, &gradients, begins, members, &after]);
        add::launch(&after.client, count, dim, from, by, begins, members, to, *row);
        after
    }
}

/// Discord `[m]` after an iteration's gradients `[n, 3]` by the centres of Gaussians.
pub(in crate::source::nodes) fn discord(
    before: Tensor<1>,
    gradients: Tensor<2>,
    neighbors: &Neighbors,
) -> Tensor<1> {
    let before = before.into_dispatch();
    Tensor::from_dispatch(<Dispatch as DiscordOps>::add_discord(
        before,
        gradients.into_dispatch(),
        neighbors.clone(),
    ))
}
