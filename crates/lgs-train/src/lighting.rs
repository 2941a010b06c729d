//! Light that stands still in the world (method §5.11): where bodies turn in it, how bright each Gaussian has
//! been in the captured window tells of it, and it tells how bright it is after that and under edits.

use std::ops::Range;

use glam::{DMat3, DVec3};
use lgs_core::geometry::{narrow, quaternion, solve_positive, wide};
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{Irradiance, LagrangianScene, Light, Motion, Shading, ShadingTimes};
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::thresholds::{LIGHT_RIDGE, SUNS, SUNS_NEAR};

/// Coefficients of a polynomial irradiance over its mean.
const COEFFICIENTS: usize = 8;

/// The scene with a light in which its bodies turn, where that foretells brightness after a part of the
/// window, and before it, better than that it stays as it is. At the times at which brightness is known,
/// colours stay as they are.
pub(crate) fn with_light(scene: LagrangianScene) -> LagrangianScene {
    let Some(shading) = &scene.shading else { return scene };
    let surfaces = surfaces(&scene, shading);
    let Some(irradiance) = irradiance_of(&surfaces, shading.times().count) else { return scene };
    tracing::debug!(?irradiance, "a light that stands still");
    let normals = surfaces.iter().map(|surface| narrow(surface.axis)).collect();
    let shading = Some(beside_light(shading, &surfaces, irradiance, scene.static_gaussians.len()));
    LagrangianScene { shading, light: Some(Light { irradiance, normals }), ..scene }
}

/// The factors of brightness that a light leaves. Before and after the window, those of dynamic Gaussians go
/// to their means within half of its length: the farther away, the more the light tells how bright they are.
fn beside_light(shading: &Shading, surfaces: &[Surface], irradiance: Irradiance, still: usize) -> Shading {
    let ShadingTimes { span: [first, last], count } = shading.times();
    let distance = (last - first) / (count - 1) as f32;
    let steps = (count / 2).max(1);
    let of_row = |(row, known): (usize, &[f32])| {
        let mut log_gains = known.to_vec();
        let surface = row.checked_sub(still).and_then(|row| surfaces.get(row));
        let lit = surface.iter().flat_map(|surface| &surface.normals).map(|&n| irradiance.of(n).ln() as f32);
        log_gains.iter_mut().zip(lit).for_each(|(log_gain, lit)| *log_gain -= lit);
        let mean = log_gains.iter().sum::<f32>() / count as f32;
        let goes = if surface.is_some() { 1.0 } else { 0.0 };
        let beyond = |end: f32, step: usize| end + goes * step as f32 / steps as f32 * (mean - end);
        let before: Vec<f32> = (1..=steps).rev().map(|step| beyond(log_gains[0], step)).collect();
        let after: Vec<f32> = (1..=steps).map(|step| beyond(log_gains[count - 1], step)).collect();
        [before, log_gains, after].concat()
    };
    let reach = steps as f32 * distance;
    let times = ShadingTimes { span: [first - reach, last + reach], count: count + 2 * steps };
    Shading::new(times, shading.log_gains().chunks_exact(count).enumerate().flat_map(of_row).collect())
}

/// A Gaussian whose brightness was learned.
struct Surface {
    /// Its normal at t = 0: the axis along which it is shortest, away from the middle of its object.
    axis: DVec3,
    /// Its opacity times its area.
    weight: f64,
    /// Factors of its colour at the known times.
    gains: Vec<f64>,
    /// Its normals at these.
    normals: Vec<DVec3>,
}

/// The dynamic Gaussians of a scene, in their order.
fn surfaces(scene: &LagrangianScene, shading: &Shading) -> Vec<Surface> {
    let cloud = &scene.dynamic_gaussians;
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let rotations: Vec<Vec<[f32; 4]>> =
        shading.times().all().map(|time| motion.state_at(time).rotation).collect();
    let known = shading.log_gains().chunks_exact(shading.times().count).skip(scene.static_gaussians.len());
    let known: Vec<&[f32]> = known.collect();
    let of_object = |members: &Range<usize>| {
        let middle = cloud.means[members.clone()].iter().map(|&mean| wide(mean)).sum::<DVec3>();
        let middle = middle / members.len().max(1) as f64;
        let surface = |row: usize| {
            let (axis, area) = shortest_axis(cloud.rotations[row], cloud.log_scales[row]);
            let outward = axis.dot(wide(cloud.means[row]) - middle);
            let axis = if outward < 0.0 { -axis } else { axis };
            let turned =
                |rotation: &Vec<[f32; 4]>| quaternion(&rotation[row].map(f64::from)).normalize() * axis;
            Surface {
                axis,
                weight: area * f64::from(cloud.opacity(row)),
                gains: known[row].iter().map(|log_gain| f64::from(log_gain.exp())).collect(),
                normals: rotations.iter().map(turned).collect(),
            }
        };
        members.clone().map(surface).collect::<Vec<Surface>>()
    };
    scene.objects.iter().flat_map(|object| of_object(&object.members)).collect()
}

/// The shortest axis of a Gaussian, and the product of its other scales.
fn shortest_axis(rotation: [f32; 4], log_scales: [f32; 3]) -> (DVec3, f64) {
    let axes = DMat3::from_quat(quaternion(&rotation.map(f64::from)).normalize());
    let log_scales = wide(log_scales);
    let shortest = (0..3).min_by(|&a, &b| log_scales[a].total_cmp(&log_scales[b])).unwrap_or(0);
    (axes.col(shortest), (log_scales.element_sum() - log_scales[shortest]).exp())
}

/// A light of some kind that agrees best with the brightness of surfaces at some of the known times.
type LightOf = fn(&[Surface], Range<usize>) -> Option<Irradiance>;

/// The light of the kind that foretells the brightness of the last third of the known times by that of the
/// others, and of the first third, best; nothing if that it stays as it is foretells it better.
fn irradiance_of(surfaces: &[Surface], count: usize) -> Option<Irradiance> {
    let third = count / 3;
    let ends = [(0..count - third, count - third..count), (third..count, 0..third)];
    let error = |of: LightOf| {
        let of_end = |(seen, hidden): &(Range<usize>, Range<usize>)| {
            Some(error(surfaces, of(surfaces, seen.clone())?, seen, hidden))
        };
        let [last, first] = ends.each_ref().map(of_end);
        Some(last? + first?)
    };
    let staying = error(|_, _| Some(Irradiance::EVEN))?;
    let of_kind = |of: LightOf| Some((error(of)?, of(surfaces, 0..count)?));
    let kinds: [LightOf; 2] = [polynomial, sun];
    let found = kinds.into_iter().filter_map(of_kind).min_by(|a, b| a.0.total_cmp(&b.0));
    tracing::debug!(?found, staying, "squared error of brightness by a light, and by staying as it is");
    found.filter(|(error, _)| third > 0 && *error < staying).map(|(_, irradiance)| irradiance)
}

/// Squared error of hidden brightnesses by a light, from those at the nearest time that was seen.
fn error(surfaces: &[Surface], light: Irradiance, seen: &Range<usize>, hidden: &Range<usize>) -> f64 {
    let nearest = if hidden.start > seen.start { seen.end - 1 } else { seen.start };
    let of_surface = |surface: &Surface| {
        let lit = |k: usize| light.of(surface.normals[k]);
        let albedo = surface.gains[nearest] / lit(nearest);
        let square = hidden.clone().map(|k| (surface.gains[k] - albedo * lit(k)).powi(2)).sum::<f64>();
        surface.weight * square
    };
    surfaces.iter().map(of_surface).sum()
}

impl Surface {
    /// Rows and right sides of linear equations for the coefficients c of polynomials p of its normal,
    /// whatever its colour: where the mean of brightnesses g over times is 1, that of
    /// `g = (1 + p·c) / (1 + p̄·c)` with the means p̄ is `g − 1 = (p − g p̄)·c`.
    fn equations<const N: usize>(
        &self,
        times: Range<usize>,
        of_normal: impl Fn(DVec3) -> [f64; N],
    ) -> impl Iterator<Item = ([f64; N], f64)> {
        let count = times.len() as f64;
        let gain = self.gains[times.clone()].iter().sum::<f64>() / count;
        let values: Vec<[f64; N]> = self.normals[times.clone()].iter().map(|&n| of_normal(n)).collect();
        let mean: [f64; N] = std::array::from_fn(|i| values.iter().map(|p| p[i]).sum::<f64>() / count);
        values.into_iter().zip(&self.gains[times]).map(move |(p, of_time)| {
            let relative = of_time / gain;
            (std::array::from_fn(|i| p[i] - relative * mean[i]), relative - 1.0)
        })
    }
}

/// A light from everywhere, as a polynomial of the normal.
fn polynomial(surfaces: &[Surface], times: Range<usize>) -> Option<Irradiance> {
    let mut gram = DMatrix::zeros(COEFFICIENTS, COEFFICIENTS);
    let mut moment = DMatrix::zeros(COEFFICIENTS, 1);
    for surface in surfaces {
        for (row, right) in surface.equations(times.clone(), polynomials) {
            for i in 0..COEFFICIENTS {
                moment[i] += surface.weight * row[i] * right;
                (0..COEFFICIENTS).for_each(|j| gram[(i, j)] += surface.weight * row[i] * row[j]);
            }
        }
    }
    let total = surfaces.iter().map(|surface| surface.weight).sum::<f64>() * times.len() as f64;
    (0..COEFFICIENTS).for_each(|i| gram[(i, i)] += LIGHT_RIDGE * total);
    let found = solve_positive(gram, &moment)?;
    let [x, y, z, xx, yy, xy, xz, yz]: [f64; COEFFICIENTS] = std::array::from_fn(|i| found[i]);
    let quadratic = DMat3::from_cols_array_2d(&[[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]]);
    let linear = DVec3::new(x, y, z);
    // One that would be below the least for some normals is as strong as it may be.
    let least = directions(SUNS).map(|n| linear.dot(n) + n.dot(quadratic * n)).fold(0.0, f64::min);
    let part = ((1.0 - Irradiance::LEAST) / least.abs()).min(1.0);
    let is_light = found.iter().all(|coefficient| coefficient.is_finite());
    is_light.then_some(Irradiance { linear: part * linear, quadratic: part * quadratic, ..Irradiance::EVEN })
}

/// The polynomials that coefficients of an irradiance multiply.
fn polynomials(n: DVec3) -> [f64; COEFFICIENTS] {
    let squares = n * n;
    let [x, y] = [squares.x - squares.z, squares.y - squares.z];
    [n.x, n.y, n.z, x, y, 2.0 * n.x * n.y, 2.0 * n.x * n.z, 2.0 * n.y * n.z]
}

/// A sun, and a sky that is the same everywhere.
fn sun(surfaces: &[Surface], times: Range<usize>) -> Option<Irradiance> {
    let towards = |direction: DVec3| {
        let (mut product, mut square) = (0.0, 0.0);
        for surface in surfaces {
            for ([row], right) in surface.equations(times.clone(), |n| [direction.dot(n).max(0.0) - 0.25]) {
                product += surface.weight * row * right;
                square += surface.weight * row * row;
            }
        }
        // What the squared error loses by it, and its strength.
        let is_sun = product > 0.0 && square > 0.0;
        is_sun.then(|| (product * product / square, product / square * direction))
    };
    let best = |tried: Vec<DVec3>| {
        let found: Vec<(f64, DVec3)> = tried.into_par_iter().filter_map(towards).collect();
        found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, sun)| sun)
    };
    let coarse = best(directions(SUNS).collect())?.normalize();
    // A cap of twice the solid angle that each of the coarse directions stands for.
    let near = (1.0 - 4.0 / SUNS as f64).max(0.0);
    let fine = best(directions(SUNS * SUNS_NEAR).filter(|s| s.dot(coarse) > near).collect())?;
    Some(Irradiance { sun: fine.clamp_length_max(4.0 * (1.0 - Irradiance::LEAST)), ..Irradiance::EVEN })
}

/// Directions spread evenly over all, on a spiral.
fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        (1.0 - z * z).sqrt() * DVec3::new(cos, sin, 0.0) + z * DVec3::Z
    })
}

#[cfg(test)]
mod tests;
