//! Changes of images by motions of some Gaussians: against the transpose of the same map, and against
//! images of moved Gaussians.

use lgs_core::linear::{add, cross, mat_vec, quat_mul, sub};
use lgs_core::{Camera, GaussianCloud, PixelFilter, stream};
use lgs_render::{
    AffineMotion, ImageCotangents, ImagePart, ImageTangent, Splats, rasterize, rasterize_jvp, rasterize_part,
    rasterize_vjp,
};
use rand::RngExt;

const BACKGROUND: [f32; 3] = [0.9, 0.5, 0.1];
/// The Gaussians that move: neither the first nor the last ones.
const MEMBERS: std::ops::Range<usize> = 60..140;

/// Gaussians of several sizes that cover each other, some of them behind the camera.
fn cloud() -> GaussianCloud {
    let mut rng = stream(21, "cloud", 0);
    let mut uniform = |low: f32, high: f32| rng.random_range(low..high);
    let mut cloud = GaussianCloud { sh_degree: 2, ..GaussianCloud::default() };
    for _ in 0..200 {
        cloud.means.push([uniform(-0.6, 0.6), uniform(-2.5, 0.6), uniform(-0.6, 0.6)]);
        cloud.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0)));
        cloud.log_scales.push(std::array::from_fn(|_| uniform(-4.0, -1.5)));
        cloud.raw_opacities.push(uniform(-2.0, 6.0));
        cloud.sh.extend((0..27).map(|_| uniform(-0.4, 0.4)));
    }
    cloud
}

fn camera(filter: PixelFilter) -> Camera {
    Camera { filter, ..Camera::look_at([0.1, -2.0, 0.3], [0.0; 3], 0.9, 53, 41) }
}

/// Three shifts, three rotations, and three strains along the axes.
fn motions(center: [f32; 3]) -> Vec<AffineMotion> {
    let unit = |axis: usize| std::array::from_fn(|i| f32::from(u8::from(i == axis)));
    let still = AffineMotion { center, shift: [0.0; 3], linear: [[0.0; 3]; 3] };
    let shift = |axis| AffineMotion { shift: unit(axis), ..still };
    // Rows of the cross product with a unit vector.
    let turn = |axis| {
        let columns: [[f32; 3]; 3] = std::array::from_fn(|i| cross(unit(axis), unit(i)));
        AffineMotion { linear: lgs_core::linear::transpose(&columns), ..still }
    };
    let strain = |axis: usize| {
        let mut linear = [[0.0; 3]; 3];
        linear[axis][axis] = 1.0;
        AffineMotion { linear, ..still }
    };
    (0..3).map(shift).chain((0..3).map(turn)).chain((0..3).map(strain)).collect()
}

/// The product of a tangent with cotangents of all pixels.
fn product(tangent: &ImageTangent, width: usize, v: ImageCotangents<'_>) -> f64 {
    let image = tangent.part.of(v.image, width);
    let transmittance = tangent.part.of(v.transmittance, width);
    let sum = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    sum(image.as_flattened(), tangent.image.as_flattened()) + sum(&transmittance, &tangent.transmittance)
}

/// The product of the change of the members' harmonics with a motion, which turns them, and their gradients.
fn product_of_colors(cloud: &GaussianCloud, v_sh: &[f32], motion: &AffineMotion) -> f64 {
    let probe = 1e-2;
    let [ahead, behind] = [probe, -probe].map(|by| {
        let mut turned = cloud.clone();
        turned.turn_harmonics(MEMBERS, turn(motion, by));
        turned.sh
    });
    let pairs = ahead.iter().zip(&behind).zip(v_sh);
    pairs.map(|((a, b), v)| f64::from((a - b) / (2.0 * probe) * v)).sum()
}

/// The rotation of a part of a motion, a quaternion.
fn turn(motion: &AffineMotion, by: f32) -> [f32; 4] {
    let l = &motion.linear;
    [1.0, 0.5 * by * l[2][1], 0.5 * by * l[0][2], 0.5 * by * l[1][0]]
}

#[test]
fn changes_are_the_transpose_of_gradients() {
    let center = [0.1, 0.0, -0.1];
    for filter in [PixelFilter::Dilation, PixelFilter::Mip] {
        let mut cloud = cloud();
        // Strains along the axes are changes of the scales of what is not turned.
        cloud.rotations[MEMBERS].fill([1.0, 0.0, 0.0, 0.0]);
        let (splats, camera) = (Splats::from(&cloud), camera(filter));
        let drawn = rasterize(&splats, &camera, BACKGROUND);
        let mut rng = stream(22, "weights", 0);
        let image: Vec<[f32; 3]> =
            (0..camera.pixels()).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let transmittance: Vec<f32> = (0..camera.pixels()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let v = ImageCotangents { image: &image, transmittance: &transmittance };
        let gradients = rasterize_vjp(&splats, &camera, &drawn, v);
        let motions = motions(center);
        let found = rasterize_jvp(&splats, &camera, &drawn, (MEMBERS, &motions));
        for (number, (motion, tangent)) in motions.iter().zip(&found).enumerate() {
            let of_colors = product_of_colors(&cloud, &gradients.sh, motion);
            let of_member = |i: usize| {
                let v_mean = add(motion.shift, mat_vec(&motion.linear, sub(cloud.means[i], center)));
                let mut sum = lgs_core::linear::dot(gradients.means[i], v_mean);
                let l = &motion.linear;
                if number >= 6 {
                    sum += (0..3).map(|axis| gradients.log_scales[i][axis] * l[axis][axis]).sum::<f32>();
                } else {
                    let half = [0.0, 0.5 * l[2][1], 0.5 * l[0][2], 0.5 * l[1][0]];
                    let turn = quat_mul(half, cloud.rotations[i]);
                    sum += turn.iter().zip(gradients.rotations[i]).map(|(a, b)| a * b).sum::<f32>();
                }
                f64::from(sum)
            };
            let expected = MEMBERS.map(of_member).sum::<f64>() + of_colors;
            let found = product(tangent, 53, v);
            let scale = tangent.image.as_flattened().iter().map(|x| f64::from(x * x)).sum::<f64>().sqrt();
            assert!(scale > 1.0, "motion {number} changes the image");
            assert!((found - expected).abs() < 2e-4 * scale, "{filter:?} {number}: {found}, not {expected}");
        }
    }
}

#[test]
fn changes_are_those_of_moved_gaussians() {
    // Large, so that no pixel is near a threshold, and apart in depth, so that their order stays.
    let mut cloud = cloud().select(&[0, 1, 2, 3, 4, 5, 6, 7]);
    cloud.log_scales.iter_mut().flatten().for_each(|s| *s = 0.2 * *s + 0.8);
    cloud.raw_opacities.iter_mut().for_each(|o| *o = 0.2 * *o - 0.5);
    cloud.means.iter_mut().zip(0_u8..).for_each(|(mean, i)| mean[1] = 0.1 * f32::from(i));
    let members = 2..6;
    let camera = camera(PixelFilter::Dilation);
    let (center, probe) = ([0.1, 0.0, -0.1], 1e-2);
    let splats = Splats::from(&cloud);
    let drawn = rasterize(&splats, &camera, BACKGROUND);
    let motions = motions(center);
    let found = rasterize_jvp(&splats, &camera, &drawn, (members.clone(), &motions[..6]));
    for (motion, tangent) in motions.iter().zip(&found) {
        let [ahead, behind] = [probe, -probe].map(|by| {
            let mut moved = cloud.clone();
            let turn = turn(motion, by);
            moved.turn_harmonics(members.clone(), turn);
            for i in members.clone() {
                let v_mean = add(motion.shift, mat_vec(&motion.linear, sub(cloud.means[i], center)));
                moved.means[i] = add(cloud.means[i], v_mean.map(|v| by * v));
                moved.rotations[i] = quat_mul(turn, cloud.rotations[i]);
            }
            rasterize(&Splats::from(&moved), &camera, BACKGROUND).image
        });
        assert_eq!(tangent.part, ImagePart { columns: 0..53, rows: 0..41 }, "all is reached");
        let pairs = ahead.as_flattened().iter().zip(behind.as_flattened());
        let expected: Vec<f32> = pairs.map(|(a, b)| (a - b) / (2.0 * probe)).collect();
        let differences = expected.iter().zip(tangent.image.as_flattened()).map(|(a, b)| a - b);
        let (off, all) = (rms(differences), rms(expected.iter().copied()));
        assert!(off < 0.005 * all, "{motion:?}: off by {off} of {all}");
    }
}

fn rms(values: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = values.len() as f32;
    (values.map(|x| x * x).sum::<f32>() / count).sqrt()
}

#[test]
fn what_is_not_seen_changes_nothing() {
    let cloud = GaussianCloud::isotropic(vec![[0.0; 3], [0.0, -9.0, 0.0]], 0.05, [0.2; 3], 0.9);
    let camera = camera(PixelFilter::Dilation);
    let splats = Splats::from(&cloud);
    let drawn = rasterize(&splats, &camera, BACKGROUND);
    let motions = motions([0.0; 3]);
    let behind = rasterize_jvp(&splats, &camera, &drawn, (1..2, &motions));
    assert!(behind.len() == 9 && behind.iter().all(|tangent| tangent.image.is_empty()));
    let seen = &rasterize_jvp(&splats, &camera, &drawn, (0..1, &motions))[0];
    assert!(seen.part.columns.len() <= 48 && seen.part.rows.len() <= 48, "only the tiles that it reaches");
    assert!(rasterize_jvp(&splats, &camera, &drawn, (0..1, &[])).is_empty());
}

#[test]
fn a_part_is_drawn_as_in_the_whole_image() {
    for filter in [PixelFilter::Dilation, PixelFilter::Mip] {
        let (cloud, camera) = (cloud(), camera(filter));
        let whole = rasterize(&Splats::from(&cloud), &camera, BACKGROUND);
        let part = ImagePart { columns: 7..38, rows: 18..41 };
        let near = whole.gaussians_in(&part);
        assert!(!near.is_empty() && near.len() < cloud.len(), "some are elsewhere");
        let drawn = rasterize_part(&Splats::from(&cloud.select(&near)), &camera, BACKGROUND, &part);
        assert_eq!([drawn.width, drawn.height], [31, 23]);
        let expected = part.of(&whole.image, 53);
        for (found, expected) in drawn.image.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-5, "{found}, not {expected}");
        }
    }
}

#[test]
fn gaussians_reach_the_part_around_them() {
    let means = vec![[0.0; 3], [0.25, 0.0, 0.0], [0.0, -9.0, 0.0]];
    let cloud = GaussianCloud::isotropic(means, 0.02, [0.2; 3], 0.9);
    let drawn = rasterize(&Splats::from(&cloud), &camera(PixelFilter::Dilation), BACKGROUND);
    let [first, both] = [0..1, 0..2].map(|members| drawn.part_reached_by(members));
    assert!(first.pixels() > 0 && first.columns.start == both.columns.start);
    assert!(first.columns.end < both.columns.end);
    assert_eq!(drawn.gaussians_in(&first), [0]);
    assert_eq!(drawn.part_reached_by(2..3), ImagePart::default(), "what is behind the camera");
    for (at, pixel) in drawn.image.iter().enumerate() {
        let is_inside = both.columns.contains(&(at % 53)) && both.rows.contains(&(at / 53));
        assert!(is_inside || *pixel == BACKGROUND);
    }
    let wide = first.widened(100, [53, 41]);
    assert_eq!(wide, ImagePart { columns: 0..53, rows: 0..41 });
}
