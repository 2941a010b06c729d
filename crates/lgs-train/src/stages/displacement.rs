//! Displaced bodies, and changes of images with the displacement of a body, by central differences of
//! the parts that it reaches.
//!
//! Differences see what derivatives do not: Gaussians that come to lie before others, and the edges at which
//! they end. The fit of laws needs them to come to its end.

use std::ops::Range;

use super::thresholds::DISPLACEMENT_PROBE;
use glam::DMat3;
use lgs_core::linear::{add, mat_mul, mat_vec, matrix_from_quat, quat_mul, quat_normalize, scale, sub};
use lgs_core::{Camera, GaussianCloud};
use lgs_model::mapped_shape;
use lgs_render::{ImagePart, ImageTangent, Rasterized, Splats, rasterize_part};

/// A small displacement: of the body's centre, a rotation vector about it, and strains xx, yy, zz, yz, xz,
/// xy.
pub(super) type Displacement = [f64; 12];

/// Numbers of a displacement of a body that keeps its shape, which come first.
const RIGID: usize = 6;

/// A body in a cloud of Gaussians.
pub(super) struct Pose {
    pub(super) rows: Range<usize>,
    pub(super) center: [f32; 3],
    /// Root mean square distance from the centre, world units.
    pub(super) radius: f32,
    /// Whether its shape changes.
    pub(super) deforms: bool,
}

impl Pose {
    /// Numbers of a displacement that the body may have, which come first.
    pub(super) fn freedoms(&self) -> usize {
        if self.deforms { Displacement::default().len() } else { RIGID }
    }
}

/// The changes of an image of the cloud with each number of a body's displacement, given how the camera draws
/// it as it is: in the part that the body reaches, from the Gaussians that reach it, too.
pub(super) fn changes_by_differences(
    body: &Pose,
    (cloud, drawn): (&GaussianCloud, &Rasterized),
    camera: &Camera,
    background: [f32; 3],
) -> Vec<ImageTangent> {
    let reached = drawn.part_reached_by(body.rows.clone());
    if reached.pixels() == 0 {
        return Vec::new();
    }
    // A probe moves no pixel by more than this part of the distances within the body, twice over where the
    // body comes nearer, and rounding by less than a pixel on each side.
    let across = (reached.columns.len() + reached.rows.len()) as f64;
    let margin = 2 + (2.0 * DISPLACEMENT_PROBE * across) as usize;
    let part = reached.widened(margin, [drawn.width as usize, drawn.height as usize]);
    let mut near = drawn.gaussians_in(&part);
    near.extend(body.rows.clone());
    near.sort_unstable();
    near.dedup();
    let first = near.partition_point(|&index| index < body.rows.start);
    let body = Pose { rows: first..first + body.rows.len(), ..*body };
    let cloud = cloud.select(&near);
    let draw = |splats: &Splats<'_>| rasterize_part(splats, camera, background, &part);
    (0..body.freedoms()).map(|unknown| change(unknown, &body, &cloud, &part, draw)).collect()
}

/// The change of a part of an image of the cloud with one number of a body's displacement, given how it is
/// drawn.
fn change(
    unknown: usize,
    body: &Pose,
    cloud: &GaussianCloud,
    part: &ImagePart,
    draw: impl Fn(&Splats<'_>) -> Rasterized,
) -> ImageTangent {
    let probe = if unknown < 3 { DISPLACEMENT_PROBE * f64::from(body.radius) } else { DISPLACEMENT_PROBE };
    let [ahead, behind] = [probe, -probe].map(|by| {
        let mut displacement = Displacement::default();
        displacement[unknown] = by;
        draw(&Splats::from(&displaced(cloud, body, &displacement)))
    });
    let rate = (0.5 / probe) as f32;
    let image = ahead.image.iter().zip(&behind.image).map(|(a, b)| scale(sub(*a, *b), rate));
    let transmittance = ahead.transmittance.iter().zip(&behind.transmittance).map(|(a, b)| rate * (a - b));
    ImageTangent { part: part.clone(), image: image.collect(), transmittance: transmittance.collect() }
}

/// Gaussians of which some belong to a displaced body.
pub(super) fn displaced(cloud: &GaussianCloud, body: &Pose, by: &Displacement) -> GaussianCloud {
    let [tx, ty, tz, rx, ry, rz, xx, yy, zz, yz, xz, xy] = by.map(|v| v as f32);
    let turn = quat_normalize([1.0, 0.5 * rx, 0.5 * ry, 0.5 * rz]);
    let stretch = [[1.0 + xx, xy, xz], [xy, 1.0 + yy, yz], [xz, yz, 1.0 + zz]];
    let (matrix, center) = (mat_mul(&matrix_from_quat(turn), &stretch), add(body.center, [tx, ty, tz]));
    let is_stretched = stretch != matrix_from_quat([1.0, 0.0, 0.0, 0.0]);
    let mut moved = cloud.clone();
    moved.turn_harmonics(body.rows.clone(), turn);
    let GaussianCloud { means, rotations, log_scales, .. } = &mut moved;
    let linear = DMat3::from_cols_array_2d(&matrix.map(|row| row.map(f64::from))).transpose();
    for i in body.rows.clone() {
        means[i] = add(center, mat_vec(&matrix, sub(cloud.means[i], body.center)));
        if is_stretched {
            (rotations[i], log_scales[i]) = mapped_shape(&linear, cloud.rotations[i], cloud.log_scales[i]);
        } else {
            rotations[i] = quat_mul(turn, cloud.rotations[i]);
        }
    }
    moved
}
