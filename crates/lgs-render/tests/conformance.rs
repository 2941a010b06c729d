//! Agreement with the independent float64 implementation, as the contract asks: values and gradients.

mod common;

use common::{Vector, vectors};
use lgs_core::Image;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_render::{Splats, psnr, rasterize, rasterize_vjp, ssim, ssim_vjp};

const MAX_ABS: f64 = 2e-4;
const RELATIVE_L2: f64 = 1e-5;

#[test]
fn rasterize_conformance_of_the_slice_kernel() {
    for vector in vectors("rasterize") {
        check_kernel(&vector);
    }
}

fn check_kernel(vector: &Vector) {
    let name = &vector.name;
    let (means, rotations, log_scales) = (vector.rows::<3>("means"), vector.rows::<4>("quats"), vector.rows::<3>("log_scales"));
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

    let v = rasterize_vjp(
        &splats,
        &camera,
        background,
        &drawn,
        &vector.rows::<3>("loss_weight_image"),
        &vector.get("loss_weight_transmittance"),
    );
    let check = |what: &str, found: &[f32]| assert_gradient_close(&format!("{name}: {what}"), found, &vector.get(what));
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
        let image = |name| Image { width: shape[1] as u32, height: shape[0] as u32, pixels: vector.rows::<3>(name) };
        let (a, b) = (image("a"), image("b"));
        let (value, v) = ssim_vjp(&a, &b);
        assert_eq!(value, ssim(&a, &b));
        assert_values_close(&format!("{}: ssim", vector.name), &[value], &vector.get("ssim"), MAX_ABS, RELATIVE_L2);
        assert_values_close(&format!("{}: psnr", vector.name), &[psnr(&a, &b)], &vector.get("psnr"), MAX_ABS, RELATIVE_L2);
        assert_gradient_close(&format!("{}: grad_a", vector.name), v.as_flattened(), &vector.get("grad_a"));
    }
}
