//! Solids, each centred on its own origin: where a ray enters them, and points spread over their surface.
//! Doubles throughout.

use crate::thresholds::{INSIDE_MARGIN, MIN_RAY_DISTANCE};
use glam::DVec3;
use lgs_core::Stream;
use rand::RngExt;
use std::f64::consts::{PI, TAU};

/// A half-line with a direction of any length; distances are in units of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
}

/// A solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// An ellipsoid by the radii along its axes.
    Ellipsoid(DVec3),
    /// A cuboid by half its edges.
    Cuboid(DVec3),
    /// A cylinder along z by its radius and half its height.
    Cylinder(f64, f64),
    /// The inside walls of a cuboid, by half the edges.
    Interior(DVec3),
}

impl Shape {
    /// Distance along the ray to the first surface met, with the unit normal there.
    pub(super) fn hit(&self, ray: &Ray) -> Option<(f64, DVec3)> {
        match *self {
            Self::Ellipsoid(radii) => hit_ellipsoid(ray, radii),
            Self::Cuboid(half) => hit_cuboid(ray, half, Side::Outside),
            Self::Interior(half) => hit_cuboid(ray, half, Side::Inside),
            Self::Cylinder(radius, half_height) => hit_cylinder(ray, radius, half_height),
        }
    }

    /// Radius of a sphere around the origin that contains the solid.
    pub(super) fn bound(&self) -> f64 {
        match *self {
            Self::Ellipsoid(radii) => radii.max_element(),
            Self::Cuboid(half) | Self::Interior(half) => half.length(),
            Self::Cylinder(radius, half_height) => radius.hypot(half_height),
        }
    }

    /// Whether a point is strictly inside.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        match *self {
            Self::Ellipsoid(radii) => (p / radii).length_squared() < 1.0 - INSIDE_MARGIN,
            Self::Cuboid(half) => (p.abs() - half).max_element() < -INSIDE_MARGIN,
            Self::Interior(_) => false,
            Self::Cylinder(radius, half_height) => {
                p.truncate().length() < radius - INSIDE_MARGIN && p.z.abs() < half_height - INSIDE_MARGIN
            }
        }
    }

    /// Surface area (Thomsen's approximation for ellipsoids, good to 1 %).
    pub(super) fn area(&self) -> f64 {
        match *self {
            Self::Ellipsoid(r) => {
                let p = 1.6075;
                let [a, b, c] = [r.x.powf(p), r.y.powf(p), r.z.powf(p)];
                4.0 * PI * ((a * b + a * c + b * c) / 3.0).powf(1.0 / p)
            }
            Self::Cuboid(h) | Self::Interior(h) => 8.0 * (h.x * h.y + h.y * h.z + h.z * h.x),
            Self::Cylinder(radius, half_height) => TAU * radius * (2.0 * half_height + radius),
        }
    }

    /// A random point of the surface, uniform by area.
    pub(super) fn surface_point(&self, rng: &mut Stream) -> DVec3 {
        match *self {
            Self::Ellipsoid(radii) => ellipsoid_point(radii, rng),
            Self::Cuboid(half) | Self::Interior(half) => cuboid_point(half, rng),
            Self::Cylinder(radius, half_height) => cylinder_point(radius, half_height, rng),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Outside,
    Inside,
}

fn hit_ellipsoid(ray: &Ray, radii: DVec3) -> Option<(f64, DVec3)> {
    let (o, d) = (ray.origin / radii, ray.direction / radii);
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let distance = (-b - discriminant.sqrt()) / a;
    (distance > MIN_RAY_DISTANCE).then(|| (distance, ((o + distance * d) / radii).normalize()))
}

/// Slabs: the ray is inside between the last entry and the first exit.
fn hit_cuboid(ray: &Ray, half: DVec3, side: Side) -> Option<(f64, DVec3)> {
    let inverse = ray.direction.recip();
    let (a, b) = ((-half - ray.origin) * inverse, (half - ray.origin) * inverse);
    let (near, far) = (a.min(b), a.max(b));
    let (enter, leave) = (near.max_element(), far.min_element());
    if enter > leave {
        return None;
    }
    let distance = if side == Side::Outside { enter } else { leave };
    if distance <= MIN_RAY_DISTANCE {
        return None;
    }
    let slabs = if side == Side::Outside { near } else { far };
    let axis = (0..3).find(|&i| slabs[i] == distance)?;
    let mut normal = DVec3::ZERO;
    normal[axis] = -ray.direction[axis].signum();
    Some((distance, normal))
}

fn hit_cylinder(ray: &Ray, radius: f64, half_height: f64) -> Option<(f64, DVec3)> {
    let (o, d) = (ray.origin.truncate(), ray.direction.truncate());
    let mut best: Option<(f64, DVec3)> = None;
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
    let discriminant = b * b - a * c;
    if a > 0.0 && discriminant >= 0.0 {
        let distance = (-b - discriminant.sqrt()) / a;
        let p = ray.origin + distance * ray.direction;
        if distance > MIN_RAY_DISTANCE && p.z.abs() <= half_height {
            best = Some((distance, DVec3::new(p.x, p.y, 0.0) / radius));
        }
    }
    let up = -ray.direction.z.signum();
    let distance = (up * half_height - ray.origin.z) / ray.direction.z;
    let p = ray.origin + distance * ray.direction;
    let on_cap = distance > MIN_RAY_DISTANCE && p.truncate().length_squared() <= radius * radius;
    if on_cap && best.is_none_or(|(side, _)| distance < side) {
        best = Some((distance, DVec3::new(0.0, 0.0, up)));
    }
    best
}

/// A uniform direction, stretched, kept in proportion to the local stretch of area.
fn ellipsoid_point(radii: DVec3, rng: &mut Stream) -> DVec3 {
    let most = radii.min_element().recip();
    loop {
        let z: f64 = rng.random_range(-1.0..1.0);
        let angle: f64 = rng.random_range(0.0..TAU);
        let u = DVec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z);
        if rng.random_range(0.0..1.0) * most < (u / radii).length() {
            return u * radii;
        }
    }
}

fn cuboid_point(half: DVec3, rng: &mut Stream) -> DVec3 {
    let areas = [half.y * half.z, half.z * half.x, half.x * half.y];
    let mut pick = rng.random_range(0.0..areas[0] + areas[1] + areas[2]);
    let mut axis = 0;
    while axis < 2 && pick >= areas[axis] {
        pick -= areas[axis];
        axis += 1;
    }
    let mut p = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    p[axis] = p[axis].signum();
    p * half
}

fn cylinder_point(radius: f64, half_height: f64, rng: &mut Stream) -> DVec3 {
    let angle: f64 = rng.random_range(0.0..TAU);
    if rng.random_range(0.0..2.0 * half_height + radius) < radius {
        let r = radius * rng.random_range(0.0f64..1.0).sqrt();
        let z = if rng.random_range(0.0..1.0) < 0.5 { half_height } else { -half_height };
        return DVec3::new(r * angle.cos(), r * angle.sin(), z);
    }
    DVec3::new(radius * angle.cos(), radius * angle.sin(), rng.random_range(-half_height..half_height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::stream;

    const SOLIDS: [Shape; 3] = [
        Shape::Ellipsoid(DVec3::new(0.5, 0.3, 0.7)),
        Shape::Cuboid(DVec3::new(0.4, 0.2, 0.6)),
        Shape::Cylinder(0.4, 0.3),
    ];

    #[test]
    fn a_ray_at_a_surface_point_from_outside_hits_the_surface_no_later() {
        let mut rng = stream(1, "shape test", 0);
        for shape in SOLIDS {
            for _ in 0..500 {
                let target = shape.surface_point(&mut rng);
                assert!(!shape.contains(target) && shape.contains(0.999 * target), "{shape:?} {target}");
                let origin = 3.0 * DVec3::new(0.5, -0.7, 0.6) + 0.2 * target;
                let (distance, normal) =
                    shape.hit(&Ray { origin, direction: target - origin }).unwrap_or((1.0, origin));
                assert!(distance <= 1.0 + 1e-9, "{shape:?}: {distance}");
                let found = origin + distance * (target - origin);
                assert!(!shape.contains(found) && shape.contains(found * (1.0 - 1e-6)), "{shape:?} {found}");
                assert!(normal.dot(target - origin) <= 1e-9 || distance == 1.0);
            }
        }
    }

    #[test]
    fn surface_points_fill_faces_by_area() {
        let mut rng = stream(2, "shape test", 0);
        let shape = Shape::Cylinder(0.5, 0.25);
        let caps = (0..4000).filter(|_| shape.surface_point(&mut rng).z.abs() == 0.25).count();
        assert!((caps as f64 / 4000.0 - 0.5).abs() < 0.03, "{caps}");
        assert!((shape.area() - TAU * 0.5).abs() < 1e-12);
        assert!((Shape::Ellipsoid(DVec3::splat(0.5)).area() - PI).abs() < 1e-9);
    }

    #[test]
    fn the_inside_of_a_room_is_hit_from_within() {
        let room = Shape::Interior(DVec3::new(2.0, 3.0, 1.0));
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::new(0.0, 1.0, 0.1) };
        assert_eq!(room.hit(&ray), Some((3.0, DVec3::new(0.0, -1.0, 0.0))));
    }
}
