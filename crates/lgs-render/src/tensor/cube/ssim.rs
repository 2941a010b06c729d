//! Kernels of the photometric loss: a cube of units per square of pixels and channel.
//!
//! A square and the pixels around it that windows reach lie in shared memory; the window runs along rows,
//! then along columns. The first kernel leaves SSIM, absolute differences and the slopes of SSIM by the
//! windowed means of a, a² + b² and ab; the second windows the slopes once more, which gives the gradient.

use cubecl::prelude::*;

use crate::window::RADIUS;

/// Edge of a square, and with what its windows reach.
pub(super) const EDGE: usize = 16;
const REACH: usize = EDGE + 2 * RADIUS;
/// Windowed maps of the first kernel and of the second.
const MEANS: usize = 4;
const SLOPES: usize = 3;
/// `(0.01 L)²` and `(0.03 L)²` for a dynamic range of 1.
const C1: f32 = 1e-4;
const C2: f32 = 9e-4;

/// Width and height of the images, pixels.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
}

/// Place in the images of a value in the neighbourhood of the cube's square; none outside.
#[derive(CubeType, Clone, Copy)]
struct Place {
    at: u32,
    inside: bool,
}

/// Squares of the image along a row.
#[cube]
fn columns(size: &Size) -> u32 {
    (size.width + EDGE as u32 - 1u32) / (EDGE as u32)
}

/// Whether the cube has a square.
#[cube]
fn has_square(size: &Size) -> bool {
    let rows = (size.height + EDGE as u32 - 1u32) / (EDGE as u32);
    (CUBE_POS as u32) < 3u32 * columns(size) * rows
}

/// The place of number `i` in the square's neighbourhood, row by row.
#[cube]
fn neighbour(i: u32, size: &Size) -> Place {
    let square = CUBE_POS as u32 / 3u32;
    // Before the image numbers wrap around, which puts them behind it.
    let x = (square % columns(size)) * (EDGE as u32) + i % (REACH as u32) - RADIUS as u32;
    let y = (square / columns(size)) * (EDGE as u32) + i / (REACH as u32) - RADIUS as u32;
    let inside = x < size.width && y < size.height;
    Place { at: select(inside, 3u32 * (y * size.width + x) + CUBE_POS as u32 % 3u32, 0u32), inside }
}

/// The place of the unit's own pixel.
#[cube]
fn own(size: &Size) -> Place {
    let y = UNIT_POS / (EDGE as u32) + RADIUS as u32;
    neighbour(y * (REACH as u32) + UNIT_POS % (EDGE as u32) + RADIUS as u32, size)
}

/// SSIM and absolute differences `[2, H, W, 3]`, and slopes `[3, H, W, 3]`.
#[cube(launch)]
pub(super) fn compare(
    a: &[f32],
    b: &[f32],
    window: &[f32],
    values: &mut [f32],
    slopes: &mut [f32],
    size: Size,
) {
    let mut pixels = Shared::<[f32]>::new_slice(2usize * REACH * REACH);
    let mut along = Shared::<[f32]>::new_slice(MEANS * REACH * EDGE);
    if has_square(&size) {
        load_pixels(a, b, &mut pixels, &size);
        let here = own(&size);
        sums_along(&pixels, window, &mut along, MEANS);
        if here.inside {
            let means = sums_down(&along, window, MEANS);
            let at = here.at as usize;
            let pixels = a.len();
            values[pixels + at] = (a[at] - b[at]).abs();
            similarity(&means, at, pixels, values, slopes);
        }
    }
}

/// Loads the pixels of both images in the square's neighbourhood, zero outside.
#[cube]
fn load_pixels(a: &[f32], b: &[f32], pixels: &mut [f32], size: &Size) {
    let mut i = UNIT_POS;
    while i < (REACH * REACH) as u32 {
        let from = neighbour(i, size);
        pixels[i as usize] = select(from.inside, a[from.at as usize], 0.0f32);
        pixels[REACH * REACH + i as usize] = select(from.inside, b[from.at as usize], 0.0f32);
        i += (EDGE * EDGE) as u32;
    }
}

/// Loads the slopes in the square's neighbourhood, maps of so many values each, zero outside.
#[cube]
fn load_slopes(slopes: &[f32], values: usize, around: &mut [f32], size: &Size) {
    let mut i = UNIT_POS;
    while i < (REACH * REACH) as u32 {
        let from = neighbour(i, size);
        for map in 0..SLOPES {
            let slope = slopes[map * values + from.at as usize];
            around[map * REACH * REACH + i as usize] = select(from.inside, slope, 0.0f32);
        }
        i += (EDGE * EDGE) as u32;
    }
}

/// The window along all rows of what units have loaded, which later reads find done: means of pixels, or
/// sums of slopes, by the number of maps.
#[cube]
fn sums_along(around: &[f32], window: &[f32], along: &mut [f32], #[comptime] maps: usize) {
    sync_cube();
    let mut i = UNIT_POS;
    while i < (REACH * EDGE) as u32 {
        if comptime!(maps == MEANS) {
            means_along(around, window, i as usize, along);
        } else {
            slopes_along(around, window, i as usize, along);
        }
        i += (EDGE * EDGE) as u32;
    }
    sync_cube();
}

/// The window along a row: sums of a, b, a² + b² and ab.
#[cube]
fn means_along(pixels: &[f32], window: &[f32], i: usize, along: &mut [f32]) {
    let first = i / EDGE * REACH + i % EDGE;
    let mut sum_a = 0.0f32;
    let mut sum_b = 0.0f32;
    let mut squares = 0.0f32;
    let mut products = 0.0f32;
    for tap in 0..(2 * RADIUS + 1) {
        let w = window[tap];
        let x = pixels[first + tap];
        let y = pixels[REACH * REACH + first + tap];
        sum_a += w * x;
        sum_b += w * y;
        squares += w * (x * x + y * y);
        products += w * x * y;
    }
    along[i] = sum_a;
    along[REACH * EDGE + i] = sum_b;
    along[2usize * REACH * EDGE + i] = squares;
    along[3usize * REACH * EDGE + i] = products;
}

/// The window down a column at the unit's pixel, map by map.
#[cube]
fn sums_down(along: &[f32], window: &[f32], #[comptime] maps: usize) -> Array<f32> {
    let mut sums = Array::<f32>::new(maps);
    for map in 0..maps {
        let mut sum = 0.0f32;
        for tap in 0..(2 * RADIUS + 1) {
            sum += window[tap] * along[map * REACH * EDGE + tap * EDGE + UNIT_POS as usize];
        }
        sums[map] = sum;
    }
    sums
}

/// SSIM of a pixel from its windowed means, and its slopes by those of a, a² + b² and ab.
#[cube]
fn similarity(means: &Array<f32>, at: usize, pixels: usize, values: &mut [f32], slopes: &mut [f32]) {
    let (a, b) = (means[0usize], means[1usize]);
    let squares = a * a + b * b;
    let product = a * b;
    let (n1, d1) = (2.0f32 * product + C1, squares + C1);
    let n2 = 2.0f32 * (means[3usize] - product) + C2;
    let d2 = means[2usize] - squares + C2;
    let inverse = 1.0f32 / (d1 * d2);
    let ssim = n1 * n2 * inverse;
    values[at] = ssim;
    slopes[at] = 2.0f32 * b * (n2 - n1) * inverse - 2.0f32 * a * ssim * (d2 - d1) * inverse;
    slopes[pixels + at] = -(ssim / d2);
    slopes[2usize * pixels + at] = 2.0f32 * n1 * inverse;
}

/// Gradient of the loss; `weights` holds the window and, behind it, the weights of absolute differences and
/// of SSIM, each over the number of values.
#[cube(launch)]
pub(super) fn gradient(a: &[f32], b: &[f32], weights: &[f32], slopes: &[f32], out: &mut [f32], size: Size) {
    let mut around = Shared::<[f32]>::new_slice(SLOPES * REACH * REACH);
    let mut along = Shared::<[f32]>::new_slice(SLOPES * REACH * EDGE);
    if has_square(&size) {
        load_slopes(slopes, a.len(), &mut around, &size);
        let here = own(&size);
        sums_along(&around, weights, &mut along, SLOPES);
        if here.inside {
            let sums = sums_down(&along, weights, SLOPES);
            let at = here.at as usize;
            let (x, y) = (a[at], b[at]);
            let by_ssim = sums[0usize] + 2.0f32 * x * sums[1usize] + y * sums[2usize];
            let sign = select(x > y, 1.0f32, select(x < y, -1.0f32, 0.0f32));
            out[at] = weights[2 * RADIUS + 1] * sign + weights[2 * RADIUS + 2] * by_ssim;
        }
    }
}

/// The window along a row: sums of the slopes.
#[cube]
fn slopes_along(around: &[f32], window: &[f32], i: usize, along: &mut [f32]) {
    let first = i / EDGE * REACH + i % EDGE;
    for map in 0..SLOPES {
        let mut sum = 0.0f32;
        for tap in 0..(2 * RADIUS + 1) {
            sum += window[tap] * around[map * REACH * REACH + first + tap];
        }
        along[map * REACH * EDGE + i] = sum;
    }
}
