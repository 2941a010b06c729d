//! A cloud distributed as trained ones are: Gaussians on surfaces, flat and elongated, sized by their
//! spacing, most of them faint, a part of them nearly opaque, and a few large faint ones away from any
//! surface.

use glam::{Quat, Vec3};
use lgs_core::{Camera, GaussianCloud, Stream, spatial_order, stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::f32::consts::TAU;

/// Part of the Gaussians that float free of the surfaces.
const FLOATERS: f32 = 0.03;
/// Pixels for each Gaussian: 50,000 on an image of 400².
const PIXELS_PER_GAUSSIAN: f32 = 3.2;

/// Four spheres on a ground disc, `count` Gaussians with spherical harmonics up to degree 3, in spatial order
/// as scenes keep them.
pub(crate) fn trained_scene(count: usize) -> GaussianCloud {
    let cloud = in_no_order(count);
    let order: Vec<usize> = spatial_order(&cloud.means).into_iter().map(|i| i as usize).collect();
    cloud.select(&order)
}

/// The same, as they were drawn.
pub(crate) fn in_no_order(count: usize) -> GaussianCloud {
    let mut rng = stream(1, "trained scene", 0);
    let mut cloud = GaussianCloud { sh_degree: 3, ..GaussianCloud::default() };
    // Mean distance of neighbours on the surfaces, whose area is about 13.
    let spacing = (13.0 / count as f32).sqrt();
    for _ in 0..count {
        if rng.random_range(0.0..1.0) < FLOATERS {
            push_floater(&mut rng, &mut cloud, spacing);
        } else {
            push_on_surface(&mut rng, &mut cloud, spacing);
        }
        cloud.sh.extend((0..48).map(|k| normal(&mut rng) * if k < 3 { 0.8 } else { 0.1 }));
    }
    cloud
}

/// A camera that sees the whole scene, its image scaled so that pixels and Gaussians stay in proportion: the
/// coverage is the same for every count.
pub(crate) fn camera(count: usize) -> Camera {
    let size = (count as f32 * PIXELS_PER_GAUSSIAN).sqrt().round() as u32;
    Camera::look_at([0.9, -3.0, 1.5], [0.0, 0.0, -0.1], 0.75, size, size)
}

fn normal(rng: &mut Stream) -> f32 {
    StandardNormal.sample(rng)
}

fn push_floater(rng: &mut Stream, cloud: &mut GaussianCloud, spacing: f32) {
    cloud.means.push(std::array::from_fn(|_| rng.random_range(-1.2..1.2)));
    cloud.rotations.push(std::array::from_fn(|_| normal(rng)));
    cloud.log_scales.push(std::array::from_fn(|_| (3.0 * spacing).ln() + 0.5 * normal(rng)));
    cloud.raw_opacities.push(-3.0 + 0.8 * normal(rng));
}

fn push_on_surface(rng: &mut Stream, cloud: &mut GaussianCloud, spacing: f32) {
    let (mean, outward) = surface_point(rng);
    let off = 0.2 * spacing * normal(rng);
    cloud.means.push(std::array::from_fn(|i| mean[i] + off * outward[i]));
    // The shortest axis (z) along the normal, any turn about it.
    let upright = Quat::from_rotation_arc(Vec3::Z, outward.into());
    let q = upright * Quat::from_rotation_z(rng.random_range(0.0..TAU));
    cloud.rotations.push([q.w, q.x, q.y, q.z]);
    let size = (0.7 * spacing).ln() + 0.5 * normal(rng);
    let elongation = 0.5 * normal(rng);
    cloud.log_scales.push([size + elongation, size - elongation, size - 1.8 + 0.5 * normal(rng)]);
    // Two kinds: what carries the surface, and what corrects it.
    let raw_opacity =
        if rng.random_range(0.0..1.0) < 0.35 { 2.5 + 1.5 * normal(rng) } else { -1.8 + 1.2 * normal(rng) };
    cloud.raw_opacities.push(raw_opacity);
}

/// A point and its unit normal.
fn surface_point(rng: &mut Stream) -> ([f32; 3], [f32; 3]) {
    const SPHERES: [([f32; 3], f32); 4] = [
        ([-0.4, 0.1, 0.0], 0.6),
        ([0.6, 0.4, -0.2], 0.4),
        ([0.35, -0.5, -0.3], 0.3),
        ([-0.2, -0.7, -0.4], 0.2),
    ];
    let area = rng.random_range(0.0..1.0);
    let direction = loop {
        let d = Vec3::from(std::array::from_fn(|_| normal(rng)));
        if d.length() > 1e-3 {
            break d.normalize();
        }
    };
    let (centre, radius) = match area {
        a if a < 0.35 => SPHERES[0],
        a if a < 0.52 => SPHERES[1],
        a if a < 0.62 => SPHERES[2],
        a if a < 0.66 => SPHERES[3],
        _ => {
            let (turn, r) = (rng.random_range(0.0..TAU), 1.2 * rng.random_range(0.0..1.0_f32).sqrt());
            return ([r * turn.cos(), r * turn.sin(), -0.6], [0.0, 0.0, 1.0]);
        }
    };
    (std::array::from_fn(|i| centre[i] + radius * direction[i]), direction.into())
}
