//! The plainest form of what kernels do, on a device of CubeCL.

use std::time::Instant;

use burn::tensor::{DType, Device, Tensor, TensorData};
use cubecl::prelude::*;
use lgs_render::{ALPHA_MAX, ALPHA_MIN, TRANSMITTANCE_STOP};
use lgs_tensor::cube::product::{Matrix, primitive, product, tensor};
use lgs_tensor::cube::{CubeTensor, arguments, cubes, empty, units};

use crate::Sizes;
use crate::rows::{last_of, wait_for};

/// Edge of a tile, and its pixels.
const EDGE: u32 = 16;
const PIXELS: usize = (EDGE * EDGE) as usize;
/// Gaussians of a tile's list, and numbers of each: centre, factors, log2 of the opacity, colour.
const GAUSSIANS: usize = 64;
const NUMBERS: usize = 9;
/// Tiles that are blended at once: more than a device has places for.
const TILES: usize = 1 << 14;
/// Calls that are timed together, and times that they are.
const CALLS: usize = 10;
const TURNS: usize = 4;

/// The greatest rate of calls of so much work each, the first turn not counted; a call leaves a tensor, and
/// the last is waited for.
fn rate(work: f64, mut call: impl FnMut() -> CubeTensor) -> f64 {
    let mut least = f64::INFINITY;
    for turn in 0..=TURNS {
        let begun = Instant::now();
        wait_for(tensor::<1>(last_of(CALLS, &mut call)).narrow(0, 0, 1));
        if turn > 0 {
            least = least.min(begun.elapsed().as_secs_f64());
        }
    }
    CALLS as f64 * work / least
}

fn ones(count: usize, device: &Device) -> CubeTensor {
    primitive(Tensor::<1>::ones([count], device))
}

/// Multiplications and additions per second in products of square matrices, by the tensor library and by the
/// kernel of this project.
pub(crate) fn products(device: &Device, sizes: &Sizes) -> [f64; 2] {
    let n = sizes.matrix;
    let a = Tensor::<2>::ones([n, n], device) * 0.5;
    let work = 2.0 * (n as f64).powi(3);
    let flat = |result: Tensor<2>| primitive(result.reshape([n * n]));
    let by_library = rate(work, || flat(a.clone().matmul(a.clone())));
    [by_library, rate(work, || flat(product(&Matrix::of(&a), &Matrix::of(&a))))]
}

/// `a = b + s c`.
#[cube(launch)]
fn add(b: &[f32], c: &[f32], a: &mut [f32], s: f32) {
    if ABSOLUTE_POS < a.len() {
        a[ABSOLUTE_POS] = b[ABSOLUTE_POS] + s * c[ABSOLUTE_POS];
    }
}

/// Bytes per second of `a = b + s c`.
pub(crate) fn memory(device: &Device, sizes: &Sizes) -> f64 {
    let [b, c] = [0; 2].map(|_| ones(sizes.array, device));
    let a = empty(&b, [sizes.array], DType::F32);
    let (count, dim) = units(&a.client, sizes.array);
    rate((3 * sizes.array * size_of::<f32>()) as f64, || {
        let [b, c, a_out] = arguments([&b, &c, &a]);
        add::launch(&a.client, count.clone(), dim, b, c, a_out, 3.0);
        a.clone()
    })
}

/// Blends all Gaussians over a tile so many times, each from full transmittance on.
#[cube(launch)]
fn blend(gaussians: &[f32], out: &mut [f32], passes: u32) {
    let mut splats = Shared::<[f32]>::new_slice(GAUSSIANS * NUMBERS);
    let mut i = UNIT_POS as usize;
    while i < GAUSSIANS * NUMBERS {
        splats[i] = gaussians[i];
        i += PIXELS;
    }
    sync_cube();
    let x = UNIT_POS_X as f32 + 0.5f32;
    let y = UNIT_POS_Y as f32 + 0.5f32;
    let mut light = Array::<f32>::new(4usize);
    for channel in 0..4usize {
        light[channel] = 0.0f32;
    }
    for _pass in 0..passes {
        light[3usize] = 1.0f32;
        for g in 0..GAUSSIANS {
            add_gaussian(&splats, g * NUMBERS, x, y, &mut light);
        }
    }
    let at = CUBE_POS * PIXELS + UNIT_POS as usize;
    if at < out.len() {
        out[at] = light[0usize] + light[1usize] + light[2usize] + light[3usize];
    }
}

/// Blends the Gaussian at a place, without control flow.
#[cube]
fn add_gaussian(splats: &[f32], g: usize, x: f32, y: f32, light: &mut Array<f32>) {
    let dy = y - splats[g + 1usize];
    let u = splats[g + 2usize] * (x - splats[g]) + splats[g + 3usize] * dy;
    let w = splats[g + 4usize] * dy;
    let alpha = (splats[g + 5usize] - w * w - u * u).exp();
    let before = light[3usize];
    let weight = alpha.min(ALPHA_MAX) * before;
    let after = before - weight;
    let hit = alpha >= ALPHA_MIN && after >= TRANSMITTANCE_STOP;
    let weight = select(hit, weight, 0.0f32);
    light[0usize] += weight * splats[g + 6usize];
    light[1usize] += weight * splats[g + 7usize];
    light[2usize] += weight * splats[g + 8usize];
    light[3usize] = select(hit, after, before);
}

/// Pairs of pixel and Gaussian per second.
pub(crate) fn pairs(device: &Device, sizes: &Sizes) -> f64 {
    let gaussian = |i: usize| {
        let phase = i as f32;
        let mean = [8.0 + 6.0 * (phase * 0.7).sin(), 8.0 + 6.0 * (phase * 1.3).cos()];
        [mean[0], mean[1], 0.2, 0.03, 0.2, -3.5, 0.8, 0.5, 0.2]
    };
    let numbers: Vec<f32> = (0..GAUSSIANS).flat_map(gaussian).collect();
    let gaussians = Tensor::<1>::from_data(TensorData::new(numbers, [GAUSSIANS * NUMBERS]), device);
    let gaussians = primitive(gaussians);
    let tiles = TILES.min(sizes.array / PIXELS);
    let out = empty(&gaussians, [tiles * PIXELS], DType::F32);
    let work = tiles as f64 * f64::from(sizes.passes) * (PIXELS * GAUSSIANS) as f64;
    rate(work, || {
        let [gaussians, to] = arguments([&gaussians, &out]);
        blend::launch(
            &out.client,
            cubes(&out.client, tiles),
            CubeDim::new_2d(EDGE, EDGE),
            gaussians,
            to,
            sizes.passes,
        );
        out.clone()
    })
}
