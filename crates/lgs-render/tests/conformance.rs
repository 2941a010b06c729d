//! Agreement with an independent implementation in double precision: values and gradients.

mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::tensors::{MAX_ABS, RELATIVE_L2, check_tensors, constant, tracked, values};
use common::{Vector, vectors};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_core::{Image, stream};
use lgs_render::{
    ImageCotangents, SplatGradients, Splats, photometric, photometric_vjp, psnr, rasterize, rasterize_vjp,
    ssim, ssim_vjp,
};
use rand::RngExt;

#[test]
fn rasterize_conformance_of_the_slice_kernel() {
    for vector in vectors("rasterize") {
        check_kernel(&vector);
    }
}

fn check_kernel(vector: &Vector) {
    let name = &vector.name;
    let (means, rotations, log_scales) =
        (vector.rows::<3>("means"), vector.rows::<4>("quats"), vector.rows::<3>("log_scales"));
    let (raw_opacities, sh) = (vector.get("opacity_logits"), vector.get("sh"));
    let splats = Splats {
        means: &means,
        rotations: &rotations,
        log_scales: &log_scales,
        raw_opacities: &raw_opacities,
        sh: &sh,
        sh_coefficients: vector.shape("sh")[1],
        active_degree: vector.number("sh_degree") as usize,
    };
    let (camera, background) = (vector.camera(), vector.rows::<3>("background")[0]);
    let drawn = rasterize(&splats, &camera, background);
    let check = |what: &str, found: &[f32], tensor: &str| {
        assert_values_close(&format!("{name}: {what}"), found, &vector.get(tensor), MAX_ABS, RELATIVE_L2);
    };
    check("image", drawn.image.as_flattened(), "image");
    check("transmittance", &drawn.transmittance, "final_transmittance");
    check("means2d", drawn.means2d.as_flattened(), "means2d");

    check_gradients(
        vector,
        &rasterize_vjp(
            &splats,
            &camera,
            &drawn,
            ImageCotangents {
                image: &vector.rows::<3>("loss_weight_image"),
                transmittance: &vector.get("loss_weight_transmittance"),
            },
        ),
    );
}

fn check_gradients(vector: &Vector, v: &SplatGradients) {
    let name = &vector.name;
    let check = |what: &str, found: &[f32]| {
        assert_gradient_close(&format!("{name}: {what}"), found, &vector.get(what))
    };
    check("grad_sh", &v.sh);
    check("grad_opacity_logits", &v.raw_opacities);
    check("grad_means2d", v.means2d.as_flattened());
    check("grad_log_scales", v.log_scales.as_flattened());
    check("grad_quats", v.rotations.as_flattened());
    check("grad_means", v.means.as_flattened());
}

#[test]
fn ssim_conformance_of_the_slice_kernel() {
    for vector in vectors("ssim") {
        let shape = vector.shape("a");
        let image =
            |name| Image { width: shape[1] as u32, height: shape[0] as u32, pixels: vector.rows::<3>(name) };
        let (a, b) = (image("a"), image("b"));
        let (value, v) = ssim_vjp(&a, &b);
        assert_eq!(value, ssim(&a, &b));
        assert_values_close(
            &format!("{}: ssim", vector.name),
            &[value],
            &vector.get("ssim"),
            MAX_ABS,
            RELATIVE_L2,
        );
        assert_values_close(
            &format!("{}: psnr", vector.name),
            &[psnr(&a, &b)],
            &vector.get("psnr"),
            MAX_ABS,
            RELATIVE_L2,
        );
        assert_gradient_close(&format!("{}: grad_a", vector.name), v.as_flattened(), &vector.get("grad_a"));
    }
}

#[test]
fn rasterize_conformance_of_the_tensor_operation() {
    for vector in vectors("rasterize") {
        check_tensors(&vector, &Device::flex().autodiff(), |splats, view| {
            let drawn = lgs_render::tensor::rasterize(splats, view);
            (drawn.image, drawn.transmittance)
        });
    }
}

#[test]
fn the_gradient_by_the_pose_is_that_of_the_reference() {
    for vector in vectors("rasterize") {
        let found = check_tensors(&vector, &Device::flex().autodiff(), |splats, view| {
            let drawn = lgs_render::tensor::rasterize(splats, view);
            (drawn.image, drawn.transmittance)
        });
        let expected = check_tensors(&vector, &Device::flex().autodiff(), lgs_render::reference::rasterize);
        assert_gradient_close(&format!("{}: pose", vector.name), &found, &expected);
    }
}

#[test]
fn rasterize_conformance_of_the_reference() {
    for vector in vectors("rasterize") {
        check_tensors(&vector, &Device::flex().autodiff(), lgs_render::reference::rasterize);
    }
}

#[test]
fn ssim_conformance_of_the_reference_and_of_the_tensor_operation() {
    let device = Device::flex().autodiff();
    for vector in vectors("ssim") {
        let b: Tensor<3> = constant(&vector, "b", &device);
        let check = |what: &str, value: Tensor<1>, a: &Tensor<3>| {
            let name = format!("{}: {what}", vector.name);
            let grads = value.clone().backward();
            assert_values_close(&name, &values(value), &vector.get("ssim"), MAX_ABS, RELATIVE_L2);
            let gradient = values(a.grad(&grads).expect("a gradient"));
            assert_gradient_close(&name, &gradient, &vector.get("grad_a"));
        };
        let a: Tensor<3> = tracked(&vector, "a", &device);
        check("reference", lgs_render::reference::ssim(&a, &b), &a);
        let a: Tensor<3> = tracked(&vector, "a", &device);
        // With λ = 1 the loss is 1 - SSIM.
        check(
            "operation",
            lgs_render::tensor::photometric_loss(a.clone(), b.clone(), 1.0).neg().add_scalar(1.0),
            &a,
        );
    }
}

#[test]
fn the_photometric_loss_of_the_slice_kernel_is_that_of_the_reference_at_any_size() {
    let device = Device::flex().autodiff();
    let mut rng = stream(13, "images", 0);
    // Segments of a row that are short, cut off, whole, and longer than a square.
    for (width, height) in [(1, 7), (3, 3), (29, 20), (80, 11), (100, 17), (112, 9), (131, 60), (200, 5)] {
        let mut image = || -> Vec<[f32; 3]> {
            (0..width * height).map(|_| [0; 3].map(|_| rng.random_range(0.0..1.0))).collect()
        };
        let (rendered, target) = (image(), image());
        let tensor = |image: &[[f32; 3]]| {
            Tensor::<3>::from_data(
                TensorData::new(image.as_flattened().to_vec(), [height, width, 3]),
                &device,
            )
        };
        let a = tensor(&rendered).require_grad();
        let expected = lgs_render::reference::photometric_loss(&a, &tensor(&target), 0.2);
        let grads = expected.clone().backward();
        let (loss, v) = photometric_vjp(&rendered, &target, [width, height], 0.2);
        let name = format!("{width}×{height}");
        assert_values_close(&name, &[loss], &values(expected), 1e-5, RELATIVE_L2);
        assert_eq!(loss, photometric(&rendered, &target, [width, height], 0.2), "{name}");
        assert_gradient_close(&name, v.as_flattened(), &values(a.grad(&grads).expect("a gradient")));
    }
}
