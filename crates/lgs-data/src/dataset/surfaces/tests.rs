//! Surfaces of a room with texture are found, and none without.

use super::*;
use lgs_core::{Exposure, Image};

/// Half the edge of a room.
const HALF: f32 = 2.0;

/// Brightness of a place on a wall: random at the corners of a lattice of a fifth of a unit, even in between.
fn texture(p: Vec3) -> f32 {
    let cell = (5.0 * p).floor();
    let part = 5.0 * p - cell;
    let random = |corner: Vec3| (437.5 * (corner.dot(Vec3::new(12.99, 78.23, 37.72))).sin()).fract().abs();
    (0..8).fold(0.0, |sum, i| {
        let corner = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let weight = corner * part + (1.0 - corner) * (1.0 - part);
        sum + random(cell + corner) * weight.x * weight.y * weight.z
    })
}

/// Where a ray from within leaves the room.
fn leaving(eye: Vec3, direction: Vec3) -> Vec3 {
    let far = |e: f32, d: f32| if d.abs() < 1e-9 { f32::INFINITY } else { (HALF * d.signum() - e) / d };
    let distance = (0..3).map(|i| far(eye[i], direction[i])).fold(f32::INFINITY, f32::min);
    eye + direction * distance
}

/// Cameras on a ring that look into the room, each with an exposure of its own.
fn room(shade: fn(Vec3) -> f32) -> Dataset {
    let frame = |i: usize| {
        let angle = 0.35 * i as f32;
        let eye = Vec3::new(1.7 * angle.cos(), 1.7 * angle.sin(), 0.2 * (i % 3) as f32);
        let camera = Camera::look_at(eye.into(), [0.0; 3], 1.1, 160, 120);
        let gain = 0.8 + 0.05 * (i % 5) as f32;
        let color = |at: usize| {
            let pixel = [(at % 160) as f32 + 0.5, (at / 160) as f32 + 0.5];
            let ray = Vec3::from(camera.ray_direction_in_world(pixel));
            [gain * shade(leaving(eye, ray)); 3]
        };
        let image = Image { width: 160, height: 120, pixels: (0..160 * 120).map(color).collect() };
        let byte = |v: f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
        let rgba: Vec<u8> =
            image.pixels.iter().flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
        let (name, exposure) = (i.to_string(), Exposure::IDENTITY);
        Frame { name, camera_id: i, camera, time: 0.0, exposure, pixels: rgba.into() }
    };
    let mut dataset = Dataset::none([1.0; 3]);
    dataset.splits.insert("train".to_owned(), (0..18).map(frame).collect());
    dataset
}

#[test]
fn points_lie_on_walls_and_are_the_same_again() {
    let dataset = room(texture);
    let points = dataset.surface_points(400, 3);
    assert_eq!(points.positions.len(), 400);
    let off = |p: &[f32; 3]| (p.iter().fold(0.0_f32, |most, v| most.max(v.abs())) - HALF).abs();
    let near = points.positions.iter().filter(|p| off(p) < 0.1).count();
    // One patch in eight (50 of 400) fits by chance in mid-air.
    assert!(near > 320, "{near} of 400 points lie on walls");
    assert_eq!(points, dataset.surface_points(400, 3));
    assert_ne!(points, dataset.surface_points(400, 4));
}

#[test]
fn nothing_is_found_without_texture_or_other_cameras() {
    assert!(room(|_| 0.6).surface_points(100, 0).positions.is_empty());
    let mut dataset = room(texture);
    dataset.splits.values_mut().for_each(|frames| frames.truncate(2));
    assert!(dataset.surface_points(100, 0).positions.is_empty());
    assert!(Dataset::none([0.0; 3]).surface_points(100, 0).positions.is_empty());
}
