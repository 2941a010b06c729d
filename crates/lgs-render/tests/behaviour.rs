//! The rasterizer at the edges of its input: nothing to draw, extreme sizes, values that are not finite.

#[path = "common/random_scene.rs"]
mod random_scene;

use burn::tensor::{Device, Tensor};
use lgs_core::testing::assert_values_close;
use lgs_core::{Camera, DEFAULT_NEAR, GaussianCloud, PixelFilter};
use lgs_render::tensor::{SplatTensors, ViewSpec};
use lgs_render::{ALPHA_MAX, ImageCotangents, RasterizedVjp, SplatGradients, Splats};
use random_scene::{BACKGROUND, camera, cotangents, draw, gradients, random_cloud};

/// At the origin, looking along z, with a field of view of 53°.
fn axis_camera(size: u32) -> Camera {
    let (focal, center) = (size as f32, 0.5 * size as f32);
    let camera_from_world = glam::Mat4::IDENTITY;
    Camera {
        width: size,
        height: size,
        fx: focal,
        fy: focal,
        cx: center,
        cy: center,
        camera_from_world,
        near: DEFAULT_NEAR,
        filter: PixelFilter::Dilation,
    }
}

fn assert_finite(v: &SplatGradients) {
    let arrays = [
        v.means.as_flattened(),
        v.rotations.as_flattened(),
        v.log_scales.as_flattened(),
        &v.raw_opacities,
        &v.sh,
        v.means2d.as_flattened(),
        &v.pose,
    ];
    assert!(arrays.iter().all(|a| a.iter().all(|x| x.is_finite())));
}

#[test]
fn no_gaussians_leave_the_background() {
    let (cloud, camera) = (GaussianCloud::default(), camera(19, 35));
    let drawn = draw(&cloud, &camera);
    assert!(drawn.image.iter().all(|&p| p == BACKGROUND) && drawn.transmittance.iter().all(|&t| t == 1.0));
    assert_eq!(gradients(&cloud, &camera, &drawn), SplatGradients::default());
}

#[test]
fn gaussians_behind_the_camera_or_nearly_transparent_are_not_drawn() {
    let camera = camera(20, 20);
    let behind = GaussianCloud::isotropic(vec![[0.6, -6.4, 2.2], [0.3, -3.1, 1.07]], 0.5, [1.0; 3], 0.9);
    let faint = GaussianCloud::isotropic(vec![[0.0; 3]], 0.5, [1.0; 3], 0.9 / 255.0);
    for cloud in [behind, faint] {
        let drawn = draw(&cloud, &camera);
        assert!(drawn.image.iter().all(|&p| p == BACKGROUND));
        assert!((0..cloud.len()).all(|i| !drawn.is_visible(i)));
        let v = gradients(&cloud, &camera, &drawn);
        assert!(v.means.as_flattened().iter().chain(&v.sh).all(|&x| x == 0.0));
    }
}

#[test]
fn a_huge_gaussian_covers_every_pixel_evenly() {
    let camera = camera(70, 33);
    for log_scale in [3.0, 8.0, 60.0] {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]], 1.0, [0.9, 0.1, 0.4], 0.999_99);
        cloud.log_scales = vec![[log_scale; 3]];
        let drawn = draw(&cloud, &camera);
        assert!(drawn.image.as_flattened().iter().all(|v| v.is_finite()));
        if log_scale < 10.0 {
            assert!(
                drawn.transmittance.iter().all(|&t| (t - (1.0 - ALPHA_MAX)).abs() < 2e-3),
                "scale e^{log_scale}"
            );
        }
        assert_finite(&gradients(&cloud, &camera, &drawn));
    }
}

#[test]
fn a_needle_seen_from_its_side_stays_thin() {
    // 400 px long and 0.5 px wide at 45°: the quadratic form cancels to a part in 10⁶.
    let camera = axis_camera(64);
    let mut cloud = GaussianCloud::isotropic(vec![[0.0, 0.0, 4.0]], 1.0, [1.0; 3], 0.9);
    let half = 0.5_f32.sqrt().acos() / 2.0;
    cloud.rotations = vec![[half.cos(), 0.0, 0.0, half.sin()]];
    cloud.log_scales = vec![[25.0_f32.ln(), 0.001_f32.ln(), 0.001_f32.ln()]];
    let drawn = draw(&cloud, &camera);
    for i in 0..64 {
        let along = drawn.transmittance[i * 64 + i];
        assert!(along < 0.12, "pixel {i} of the diagonal: {along}");
        if i + 4 < 64 {
            assert_eq!(drawn.transmittance[i * 64 + i + 4], 1.0, "pixel {i} beside it");
        }
    }
    assert_finite(&gradients(&cloud, &camera, &drawn));
}

#[test]
fn values_that_are_not_finite_are_not_drawn() {
    let camera = camera(16, 16);
    let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 4], 0.3, [0.5; 3], 0.5);
    let mut broken = cloud.clone();
    broken.means[0][1] = f32::NAN;
    broken.log_scales[1][0] = f32::INFINITY;
    broken.raw_opacities[2] = f32::NAN;
    broken.rotations[3] = [f32::NAN; 4];
    let drawn = draw(&broken, &camera);
    assert!(drawn.image.as_flattened().iter().all(|v| v.is_finite()));
    let v = gradients(&broken, &camera, &drawn);
    assert!(v.means[..3].as_flattened().iter().all(|&x| x == 0.0));
}

#[test]
fn one_pixel_and_sizes_off_the_tile_grid_agree_with_the_reference() {
    let cloud = random_cloud(120, 3);
    let device = Device::flex();
    let floats = |values: &[f32]| Tensor::<1>::from_floats(values, &device);
    let n = cloud.len();
    let tensors = SplatTensors {
        means: floats(cloud.means.as_flattened()).reshape([n, 3]),
        rotations: floats(cloud.rotations.as_flattened()).reshape([n, 4]),
        log_scales: floats(cloud.log_scales.as_flattened()).reshape([n, 3]),
        raw_opacities: floats(&cloud.raw_opacities),
        sh: floats(&cloud.sh).reshape([n, 4, 3]),
        means2d_probe: Tensor::zeros([n, 2], &device),
        pose: Tensor::zeros([6], &device),
    };
    let sizes = [(1, 1), (17, 31), (33, 16), (64, 47)];
    let views =
        sizes.into_iter().flat_map(|size| [PixelFilter::Dilation, PixelFilter::Mip].map(|f| (size, f)));
    for ((width, height), filter) in views {
        let camera = Camera { filter, ..camera(width, height) };
        let drawn = draw(&cloud, &camera);
        let view = ViewSpec { camera, background: BACKGROUND, active_degree: 1 };
        let (image, transmittance) = lgs_render::reference::rasterize(&tensors, view);
        // A pair within a rounding of alpha = 1/255 may be decided either way.
        let check = |found: &[f32], expected: burn::tensor::TensorData| {
            assert_values_close(
                &format!("{width}×{height} {filter:?}"),
                found,
                &expected.try_to_vec::<f32>().expect("f32"),
                5e-3,
                1e-4,
            );
        };
        check(drawn.image.as_flattened(), image.into_data());
        check(&drawn.transmittance, transmittance.into_data());
        assert_finite(&gradients(&cloud, &camera, &drawn));
    }
}

#[test]
fn blending_stops_before_the_gaussian_that_would_exhaust_the_light() {
    let camera = axis_camera(1);
    let mut cloud = GaussianCloud::isotropic(
        vec![[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0], [0.0, 0.0, 4.0]],
        9.0,
        [0.0; 3],
        0.5,
    );
    cloud.raw_opacities =
        vec![(0.98_f32 / 0.02).ln(), (0.98_f32 / 0.02).ln(), (0.98_f32 / 0.02).ln(), (0.1_f32 / 0.9).ln()];
    let drawn = draw(&cloud, &camera);
    // 0.02² = 4e-4; the third would leave 8e-6 and stops the pixel; the faint fourth comes too late although
    // it would fit.
    assert!((drawn.transmittance[0] - 4e-4).abs() < 1e-5, "{}", drawn.transmittance[0]);
    let v = gradients(&cloud, &camera, &drawn);
    assert!(v.raw_opacities[1] != 0.0 && v.raw_opacities[2] == 0.0 && v.raw_opacities[3] == 0.0);
}

#[test]
fn hidden_gaussians_do_not_change_the_image() {
    let camera = camera(40, 40);
    let wall = GaussianCloud::isotropic(
        vec![[0.0; 3], [0.0, 0.02, 0.0], [0.0, 0.04, 0.0]],
        30.0,
        [0.3, 0.6, 0.2],
        0.99,
    );
    let mut with_hidden = wall.clone();
    let hidden = GaussianCloud::isotropic(vec![[0.0, 40.0, -5.0]], 1.0, [1.0, 0.0, 0.0], 0.9);
    with_hidden.means.extend(&hidden.means);
    with_hidden.rotations.extend(&hidden.rotations);
    with_hidden.log_scales.extend(&hidden.log_scales);
    with_hidden.raw_opacities.extend(&hidden.raw_opacities);
    with_hidden.sh.extend(&hidden.sh);
    assert_eq!(draw(&wall, &camera).image, draw(&with_hidden, &camera).image);
}

#[test]
fn what_is_not_beyond_the_near_plane_is_neither_drawn_nor_changed() {
    let cloud = GaussianCloud::isotropic(vec![[0.0, 0.0, 0.8], [0.0, 0.0, 2.0]], 0.1, [0.5; 3], 0.9);
    let far = GaussianCloud::isotropic(vec![[0.0, 0.0, 2.0]], 0.1, [0.5; 3], 0.9);
    let camera = Camera { near: 0.8, ..axis_camera(16) };
    let drawn = draw(&cloud, &camera);
    assert_eq!(drawn.image, draw(&far, &camera).image);
    assert_ne!(drawn.image, draw(&cloud, &axis_camera(16)).image);
    let v = gradients(&cloud, &camera, &drawn);
    assert!(v.raw_opacities[0] == 0.0 && v.raw_opacities[1] != 0.0);
}

#[test]
fn evaluated_pairs_are_a_part_of_those_of_the_tiles() {
    let small = GaussianCloud::isotropic(vec![[0.0; 3]], 0.02, [0.5; 3], 0.9);
    let drawn = draw(&small, &camera(64, 64));
    assert!(drawn.evaluated_pairs() > 0 && drawn.evaluated_pairs() < drawn.listed_pairs());
    let wide = GaussianCloud::isotropic(vec![[0.0; 3]], 40.0, [0.5; 3], 0.9);
    let drawn = draw(&wide, &camera(37, 21));
    assert_eq!((drawn.evaluated_pairs(), drawn.listed_pairs()), (37 * 21, 37 * 21));
}

/// What a small Gaussian of standard deviation 0.02 takes from the background at a depth, in pixels: the mean
/// over places within a pixel.
fn covered(depth: f32, filter: PixelFilter) -> f32 {
    let camera = Camera { filter, ..axis_camera(64) };
    let offset = |part: usize| (part as f32 + 0.5) / 4.0 * depth / 64.0;
    let of_place = |place: usize| {
        let mean = [offset(place % 4), offset(place / 4), depth];
        let drawn = draw(&GaussianCloud::isotropic(vec![mean], 0.02, [1.0; 3], 0.9), &camera);
        drawn.transmittance.iter().map(|t| 1.0 - t).sum::<f32>()
    };
    (0..16).map(of_place).sum::<f32>() / 16.0
}

#[test]
fn the_mip_filter_keeps_the_energy_of_what_is_smaller_than_a_pixel() {
    // On the image its standard deviation is 64 · 0.02 / depth: 0.64 pixels at 2, 0.16 at 8.
    for depth in [2.0_f32, 4.0, 8.0] {
        let peak = 0.9 * std::f32::consts::TAU;
        let true_area = peak * (64.0 * 0.02 / depth).powi(2);
        let (mip, dilated) = (covered(depth, PixelFilter::Mip), covered(depth, PixelFilter::Dilation));
        assert!((mip / true_area - 1.0).abs() < 0.1, "depth {depth}: {mip} of {true_area}");
        assert!(dilated > 0.9 * peak * lgs_render::BLUR, "drawn larger than it is: {dilated}");
    }
}

#[test]
fn the_gradient_by_the_pose_can_be_left_out_and_changes_no_other() {
    let (cloud, camera) = (random_cloud(60, 5), camera(37, 21));
    let splats = Splats::from(&cloud);
    let drawn = draw(&cloud, &camera);
    let whole = gradients(&cloud, &camera, &drawn);
    assert!(whole.pose.iter().all(|v| *v != 0.0));
    let (image, transmittance) = cotangents(&camera);
    let mut without = RasterizedVjp::without_pose();
    let v = ImageCotangents { image: &image, transmittance: &transmittance };
    without.update(&splats, &camera, &drawn, v);
    assert_eq!(without.gradients, SplatGradients { pose: [0.0; 6], ..whole });
}
