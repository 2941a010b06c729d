//! Observations of the poses of bodies: normal equations of small displacements, from the residuals of
//! images.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{axial, cross_matrix, fit_affine, outer, wide};
use lgs_core::linear::{scale, sub};
use lgs_core::{GaussianCloud, Image};
use lgs_data::dataset::Frame;
use lgs_render::{AffineMotion, ImageTangent, Rasterized, Splats, photometric, rasterize, rasterize_jvp};

use super::displacement::{Displacement, Pose, changes_by_differences};
use super::initial_pose::{mean, spin};
use super::thresholds::SSIM_WEIGHT;

/// Normal equations `A x = b` of a body's displacement, from one image; zero beyond its freedoms.
pub(super) struct Normal {
    pub(super) a: [Displacement; 12],
    pub(super) b: Displacement,
}

impl Normal {
    /// Those of residuals and the changes of the same pixels by every number of the displacement.
    fn new(columns: &[Vec<[f32; 3]>], residuals: &[[f32; 3]]) -> Self {
        let mut normal = Self { a: [Displacement::default(); 12], b: Displacement::default() };
        for (i, column) in columns.iter().enumerate() {
            normal.b[i] = product(column, residuals);
            for (j, other) in columns[..=i].iter().enumerate() {
                normal.a[i][j] = product(column, other);
                normal.a[j][i] = normal.a[i][j];
            }
        }
        normal
    }
}

/// One frame's residuals and what they tell of bodies.
pub(super) struct Observation {
    /// Normal equations by body.
    pub(super) normals: Vec<Normal>,
    /// Squared error of the Gaussians as they are, summed over all values of the image.
    pub(super) squared_error: f64,
    /// Photometric loss of the same.
    pub(super) loss: f32,
}

/// How the change of an image with a body's displacement is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Changes {
    /// By the derivative, in one pass over the tiles that the body reaches.
    Derivatives,
    /// By differences of images, which also see Gaussians that come to lie before others.
    Differences,
}

/// Observes the poses of some bodies in a frame.
pub(super) fn observe(
    frame: &Frame,
    cloud: &GaussianCloud,
    bodies: &[Pose],
    background: [f32; 3],
    changes: Changes,
) -> Observation {
    let truth = truth(frame, background);
    let splats = Splats::from(cloud);
    let forward = rasterize(&splats, &frame.camera, background);
    let drawn = photographed(&forward, frame, background);
    let residuals = difference(&truth.pixels, &drawn);
    let normal = |body: &Pose| {
        let tangents = match changes {
            Changes::Derivatives => {
                let motions = &motions_about(body.center)[..body.freedoms()];
                rasterize_jvp(&splats, &frame.camera, &forward, (body.rows.clone(), motions))
            }
            Changes::Differences => {
                changes_by_differences(body, (cloud, &forward), &frame.camera, background)
            }
        };
        normal(tangents, frame, background, &residuals)
    };
    Observation {
        normals: bodies.iter().map(normal).collect(),
        squared_error: product(&residuals, &residuals),
        loss: photometric(&drawn, &truth.pixels, [truth.width as usize, truth.height as usize], SSIM_WEIGHT),
    }
}

/// The normal equations of a body in a frame, given how the drawn image changes with its displacement.
fn normal(
    tangents: Vec<ImageTangent>,
    frame: &Frame,
    background: [f32; 3],
    residuals: &[[f32; 3]],
) -> Normal {
    let Some(part) = tangents.first().map(|tangent| tangent.part.clone()) else {
        return Normal::new(&[], &[]);
    };
    let width = frame.camera.width as usize;
    let weights = frame.weights().map(|weights| part.of(&weights, width));
    let column = |tangent| photographed_change(tangent, frame, (weights.as_deref(), background));
    Normal::new(&tangents.into_iter().map(column).collect::<Vec<_>>(), &part.of(residuals, width))
}

/// Sum of squared errors of Gaussians in a frame.
pub(super) fn squared_error(frame: &Frame, cloud: &GaussianCloud, background: [f32; 3]) -> f64 {
    let drawn = rasterize(&Splats::from(cloud), &frame.camera, background);
    let residuals = difference(&truth(frame, background).pixels, &photographed(&drawn, frame, background));
    product(&residuals, &residuals)
}

fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<[f32; 3]> {
    a.iter().zip(b).map(|(a, b)| sub(*a, *b)).collect()
}

/// The frame's image; what its mask leaves out is background, as in [`photographed`].
fn truth(frame: &Frame, background: [f32; 3]) -> Image {
    let mut truth = frame.composited(background);
    frame.leave_out(&mut truth.pixels, background);
    truth
}

/// A drawn image as the frame's camera takes it.
fn photographed(drawn: &Rasterized, frame: &Frame, background: [f32; 3]) -> Vec<[f32; 3]> {
    let mut image = drawn.image.clone();
    frame.exposure.expose(&mut image, &drawn.transmittance, background);
    frame.leave_out(&mut image, background);
    image
}

/// The change of a part of an image as the frame's camera takes it, given the weights of its pixels.
fn photographed_change(
    tangent: ImageTangent,
    frame: &Frame,
    (weights, background): (Option<&[f32]>, [f32; 3]),
) -> Vec<[f32; 3]> {
    let ImageTangent { mut image, transmittance, .. } = tangent;
    frame.exposure.expose_change(&mut image, &transmittance, background);
    for (pixel, &weight) in image.iter_mut().zip(weights.unwrap_or_default()) {
        *pixel = scale(*pixel, weight);
    }
    image
}

/// The motions by the numbers of a displacement, one unit of each.
fn motions_about(center: [f32; 3]) -> [AffineMotion; 12] {
    let unit = |number: usize| -> Displacement { std::array::from_fn(|i| f64::from(u8::from(i == number))) };
    std::array::from_fn(|number| {
        let [tx, ty, tz, rx, ry, rz, xx, yy, zz, yz, xz, xy] = unit(number).map(|v| v as f32);
        let linear = [[xx, xy - rz, xz + ry], [xy + rz, yy, yz - rx], [xz - ry, yz + rx, zz]];
        AffineMotion { center, shift: [tx, ty, tz], linear }
    })
}

/// The displacement per unit of time, or of an unknown, of particles at some offsets from their centre, by
/// least squares; with strains if the body deforms.
pub(super) fn displacement_of(offsets: &[[f32; 3]], rates: &[[f32; 3]], deforms: bool) -> Displacement {
    let ([tx, ty, tz], [rx, ry, rz]) = (mean(rates).map(f64::from), spin(offsets, rates).map(f64::from));
    if !deforms {
        return [tx, ty, tz, rx, ry, rz, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    }
    let (mut moment, mut covariance) = (DMat3::ZERO, DMat3::ZERO);
    for (&offset, &rate) in offsets.iter().zip(rates) {
        moment += outer(wide(rate) - DVec3::new(tx, ty, tz), wide(offset));
        covariance += outer(wide(offset), wide(offset));
    }
    let linear = fit_affine(&moment, &covariance, &cross_matrix(DVec3::new(rx, ry, rz)));
    let ([rx, ry, rz], strain) = ((0.5 * axial(&linear)).to_array(), 0.5 * (linear + linear.transpose()));
    let [x, y, z] = [strain.x_axis, strain.y_axis, strain.z_axis];
    [tx, ty, tz, rx, ry, rz, x.x, y.y, z.z, y.z, x.z, x.y]
}

/// The inner product: lanes of 16 terms are summed in single precision within a block, blocks in double.
fn product(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    const BLOCK: usize = 4096;
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let of_block = |(a, b): (&[f32], &[f32])| {
        let mut lanes = [0.0_f32; 16];
        let (a, b) = (a.as_chunks::<16>(), b.as_chunks::<16>());
        for (a, b) in a.0.iter().zip(b.0) {
            (0..16).for_each(|lane| lanes[lane] += a[lane] * b[lane]);
        }
        a.1.iter().zip(b.1).zip(&mut lanes).for_each(|((a, b), lane)| *lane += a * b);
        f64::from(lanes.iter().sum::<f32>())
    };
    a.chunks(BLOCK).zip(b.chunks(BLOCK)).map(of_block).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::displacement::displaced;
    use lgs_core::{Camera, Exposure};
    use lgs_data::dataset::Pixels;
    use nalgebra::DMatrix;

    /// The displacement that images of a body show which are drawn after one.
    fn seen(by: &Displacement, deforms: bool, eyes: &[[f32; 3]], changes: Changes) -> Vec<f64> {
        let means: Vec<[f32; 3]> = (0..18)
            .map(|i| [0.2 * (i % 3) as f32, 0.15 * (i / 9) as f32, 0.2 * (i / 3 % 3) as f32])
            .collect();
        let mut cloud = GaussianCloud::isotropic(means, 0.08, [0.5; 3], 0.9);
        cloud.sh_degree = 1;
        let color = |i: usize| (((i * 37) % 11) as f32 - 5.0) / if i % 12 < 3 { 5.0 } else { 40.0 };
        cloud.sh = (0..18 * cloud.sh_stride()).map(color).collect();
        let body = Pose { rows: 0..18, center: [0.2, 0.07, 0.2], radius: 0.25, deforms };
        let n = body.freedoms();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 1));
        for &eye in eyes {
            let camera = Camera::look_at(eye, body.center, 0.5, 48, 48);
            let pixels = Pixels::from(vec![255; 4 * 48 * 48]);
            let (name, exposure) = (String::new(), Exposure::IDENTITY);
            let mut frame = Frame { name, camera_id: 0, camera, time: 0.0, exposure, pixels };
            let moved = displaced(&cloud, &body, by);
            let drawn = rasterize(&Splats::from(&moved), &frame.camera, [1.0; 3]).image;
            let byte = |v: &f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
            let bytes = |p: &[f32; 3]| [byte(&p[0]), byte(&p[1]), byte(&p[2]), 255];
            frame.pixels = drawn.iter().flat_map(bytes).collect::<Vec<u8>>().into();
            let observed = observe(&frame, &cloud, std::slice::from_ref(&body), [1.0; 3], changes);
            assert_eq!(observed.squared_error, squared_error(&frame, &cloud, [1.0; 3]));
            let normal = &observed.normals[0];
            for i in 0..n {
                b[i] += normal.b[i];
                (0..n).for_each(|j| a[(i, j)] += normal.a[i][j]);
            }
        }
        let found = lgs_core::geometry::solve_positive(a, &b).expect("a body that images show");
        found.as_slice().to_vec()
    }

    fn assert_near(found: &[f64], expected: &Displacement, tolerances: [f64; 2]) {
        for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
            let most = tolerances[usize::from(i >= 3)];
            assert!((found - expected).abs() < most, "{i}: {found} for {expected}");
        }
    }

    #[test]
    fn images_tell_where_a_body_is() {
        let by = [0.004, -0.003, 0.002, 0.01, 0.0, -0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for changes in [Changes::Derivatives, Changes::Differences] {
            let found = seen(&by, false, &[[0.0, -2.5, 0.5], [2.0, 1.0, 1.0]], changes);
            assert_near(&found, &by, [2e-4, 1e-3]);
        }
    }

    #[test]
    fn images_tell_how_a_body_is_stretched() {
        let by = [0.002, -0.001, 0.001, 0.01, 0.0, -0.01, 0.01, -0.01, 0.02, 0.0, 0.005, 0.01];
        for changes in [Changes::Derivatives, Changes::Differences] {
            let found = seen(&by, true, &[[0.0, -2.5, 0.5], [2.0, 1.0, 1.0], [-1.5, 1.0, 2.0]], changes);
            assert_near(&found, &by, [2e-4, 2e-3]);
        }
    }
}
