//! The arithmetic floor of blending: what one pixel and one Gaussian cost when nothing else does.
//!
//! The loop is the one of the rasterizer's tiles without lists, bounds, early exit and bookkeeping of stops:
//! a tile of 16×16 pixels, 64 Gaussians that lie in the first-level cache with it, every pixel of every
//! Gaussian evaluated and blended with masks.

use crate::plain::Plain;
use lgs_render::exponential::exp2;
use lgs_render::{ALPHA_MAX, ALPHA_MIN, TRANSMITTANCE_STOP};
use pulp::{Arch, Simd, WithSimd};

/// Edge of a tile, pixels, and the pixels of it.
const EDGE: usize = 16;
const PIXELS: usize = EDGE * EDGE;

/// Gaussians of the list.
const GAUSSIANS: usize = 64;

/// A value per pixel.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Plane([f32; PIXELS]);

/// A Gaussian in the form that the blending loop reads.
#[derive(Clone, Copy)]
struct Gaussian {
    mean: [f32; 2],
    factor: [f32; 3],
    log2_opacity: f32,
    color: [f32; 3],
}

/// A tile and its Gaussians.
pub struct Tile {
    color: [Plane; 3],
    transmittance: Plane,
    gaussians: [Gaussian; GAUSSIANS],
}

impl Plain for Tile {
    /// Pairs of one pass.
    const WORK: f64 = (PIXELS * GAUSSIANS) as f64;

    fn new() -> Self {
        let gaussian = |i: usize| {
            let phase = i as f32;
            Gaussian {
                mean: [8.0 + 6.0 * (phase * 0.7).sin(), 8.0 + 6.0 * (phase * 1.3).cos()],
                factor: [0.2, 0.03, 0.2],
                log2_opacity: -5.0,
                color: [0.8, 0.5, 0.2],
            }
        };
        Self {
            color: [Plane([0.0; PIXELS]); 3],
            transmittance: Plane([1.0; PIXELS]),
            gaussians: std::array::from_fn(gaussian),
        }
    }

    /// Blends all Gaussians over the tile from full transmittance on.
    fn round(&mut self) {
        self.transmittance.0.fill(1.0);
        Arch::new().dispatch(Blend(self));
    }
}

struct Blend<'a>(&'a mut Tile);

impl WithSimd for Blend<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Tile { color: [red, green, blue], transmittance, gaussians } = self.0;
        let (red, green, blue) = (vectors::<S>(red), vectors::<S>(green), vectors::<S>(blue));
        let transmittance = vectors::<S>(transmittance);
        let centres: [f32; EDGE] = std::array::from_fn(|x| x as f32 + 0.5);
        let centres = S::as_simd_f32s(&centres).0;
        let per_row = EDGE / S::F32_LANES;
        let (least, most, stop) = (
            simd.splat_f32s(ALPHA_MIN.log2()),
            simd.splat_f32s(ALPHA_MAX),
            simd.splat_f32s(TRANSMITTANCE_STOP),
        );
        for g in gaussians.iter() {
            let (r, gr, b) =
                (simd.splat_f32s(g.color[0]), simd.splat_f32s(g.color[1]), simd.splat_f32s(g.color[2]));
            for (column, &centre) in centres.iter().enumerate() {
                let along = simd.mul_f32s(
                    simd.splat_f32s(g.factor[0]),
                    simd.sub_f32s(centre, simd.splat_f32s(g.mean[0])),
                );
                for row in 0..EDGE {
                    let at = row * per_row + column;
                    let dy = row as f32 + 0.5 - g.mean[1];
                    let w = g.factor[2] * dy;
                    let u = simd.add_f32s(along, simd.splat_f32s(g.factor[1] * dy));
                    let power =
                        simd.negate_mul_add_f32s(u, u, simd.splat_f32s((-w).mul_add(w, g.log2_opacity)));
                    let seen = simd.greater_than_or_equal_f32s(power, least);
                    let weight = simd.mul_f32s(simd.min_f32s(exp2(simd, power), most), transmittance[at]);
                    let next = simd.sub_f32s(transmittance[at], weight);
                    let hit = simd.and_m32s(seen, simd.greater_than_or_equal_f32s(next, stop));
                    let weight = simd.select_f32s(hit, weight, simd.splat_f32s(0.0));
                    red[at] = simd.mul_add_f32s(weight, r, red[at]);
                    green[at] = simd.mul_add_f32s(weight, gr, green[at]);
                    blue[at] = simd.mul_add_f32s(weight, b, blue[at]);
                    transmittance[at] = simd.select_f32s(hit, next, transmittance[at]);
                }
            }
        }
    }
}

#[inline(always)]
fn vectors<S: Simd>(plane: &mut Plane) -> &mut [S::f32s] {
    S::as_mut_simd_f32s(&mut plane.0).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_blends() {
        let mut tile = Tile::new();
        tile.round();
        let (t, red) = (tile.transmittance.0[100], tile.color[0].0[100]);
        assert!(t > 0.1 && t < 0.9);
        assert!((red - 0.8 * (1.0 - t)).abs() < 1e-4, "one colour under opacity 1 - T");
    }
}
