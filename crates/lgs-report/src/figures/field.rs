//! A potential sampled on a rectangle of a plane: values for a colour map, and forces for arrows.

use std::ops::Range;

use lgs_core::Image;
use lgs_core::geometry::wide;
use lgs_eval::physics::potential::TrueForce;
use lgs_model::Dynamics;
use plotters::style::RGBColor;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

use crate::plane::Plane;
use crate::style::pale;
use crate::thresholds::POTENTIAL_GRID as GRID;

/// Levels of the colour map.
pub(super) const LEVELS: usize = 24;
/// Strength of the map's colours, so that arrows stand out.
const STRENGTH: f64 = 0.55;

/// A force at a place, in the plane's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ForceArrow {
    pub(super) place: [f64; 2],
    /// −∇U.
    pub(super) learned: [f64; 2],
    /// The true force there, where it is known.
    pub(super) truth: Option<[f64; 2]>,
}

/// A potential on a rectangle.
pub(super) struct Field {
    /// U above its minimum on the grid, bottom row first.
    values: Vec<f64>,
    /// The largest of these values.
    pub(super) highest: f64,
    pub(super) arrows: Vec<ForceArrow>,
}

impl Field {
    /// Samples an object's potential on `x` × `y` of a plane, with arrows in so many columns and rows;
    /// nothing if it is not finite there or no function of a place.
    pub(super) fn of(
        dynamics: &Dynamics,
        truth: Option<&TrueForce>,
        (plane, x, y): (&Plane, &Range<f64>, &Range<f64>),
        arrows: [usize; 2],
    ) -> Option<Self> {
        let at = |r: &Range<f64>, part: f64| r.start + (r.end - r.start) * part;
        let on_grid = |i: usize| i as f64 / (GRID - 1) as f64;
        let grid: Vec<[f32; 3]> = (0..GRID * GRID)
            .map(|i| plane.position([at(x, on_grid(i % GRID)), at(y, on_grid(i / GRID))]))
            .collect();
        let values: Vec<f64> = dynamics.potentials_at(&grid)?;
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - lowest;
        if !values.iter().all(|u| u.is_finite()) {
            return None;
        }
        let centred = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let places: Vec<[f64; 2]> = (0..arrows[0] * arrows[1])
            .map(|i| [at(x, centred(i % arrows[0], arrows[0])), at(y, centred(i / arrows[0], arrows[1]))])
            .collect();
        Some(Self {
            values: values.into_iter().map(|u| u - lowest).collect(),
            highest: highest.max(1e-12),
            arrows: force_arrows(dynamics, truth, plane, &places)?,
        })
    }

    /// Length of the longest arrow.
    pub(super) fn strongest(&self) -> f64 {
        let all = self.arrows.iter().flat_map(|a| [Some(a.learned), a.truth]).flatten();
        all.map(|f| f[0].hypot(f[1])).filter(|f| f.is_finite()).fold(0.0, f64::max)
    }

    /// The colour map at a size in pixels.
    pub(super) fn map(&self, width: usize, height: usize) -> Image {
        let mut image = Image::filled(width as u32, height as u32, [1.0; 3]);
        for (row, line) in image.pixels.chunks_exact_mut(width.max(1)).enumerate() {
            let v = 1.0 - (row as f64 + 0.5) / height as f64;
            for (column, pixel) in line.iter_mut().enumerate() {
                let part = self.interpolated((column as f64 + 0.5) / width as f64, v) / self.highest;
                let level = (part * LEVELS as f64).clamp(0.0, LEVELS as f64 - 1.0) as usize;
                let c = level_colour(level);
                *pixel = [c.0, c.1, c.2].map(|b| f32::from(b) / 255.0);
            }
        }
        image
    }

    /// U between grid points, bilinear; `u`, `v` in [0, 1].
    fn interpolated(&self, u: f64, v: f64) -> f64 {
        let [x, y] = [u, v].map(|part| part * (GRID - 1) as f64);
        let [i, j] = [x, y].map(|at| (at as usize).min(GRID - 2));
        let (s, t) = (x - i as f64, y - j as f64);
        let at = |di: usize, dj: usize| self.values[(j + dj) * GRID + i + di];
        (1.0 - t) * ((1.0 - s) * at(0, 0) + s * at(1, 0)) + t * ((1.0 - s) * at(0, 1) + s * at(1, 1))
    }
}

fn force_arrows(
    dynamics: &Dynamics,
    truth: Option<&TrueForce>,
    plane: &Plane,
    places: &[[f64; 2]],
) -> Option<Vec<ForceArrow>> {
    let positions: Vec<[f32; 3]> = places.iter().map(|&p| plane.position(p)).collect();
    let gradients = dynamics.potential_gradients_at(&positions)?;
    let arrow = |((&place, &q), g): ((&[f64; 2], &[f32; 3]), &[f32; 3])| ForceArrow {
        place,
        learned: plane.direction(-wide(*g)),
        truth: truth.map(|t| plane.direction(t.at(wide(q)))),
    };
    Some(places.iter().zip(&positions).zip(&gradients).map(arrow).collect())
}

/// The colour of a level.
pub(super) fn level_colour(level: usize) -> RGBColor {
    pale(ViridisRGB.get_color((level as f64 + 0.5) / LEVELS as f64), STRENGTH)
}
