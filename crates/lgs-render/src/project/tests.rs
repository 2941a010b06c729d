use super::*;
use lgs_core::{Camera, GaussianCloud};

#[test]
fn the_factored_exponent_is_the_quadratic_form() {
    let cloud = GaussianCloud {
        means: vec![[0.1, 0.2, -0.1]],
        rotations: vec![[0.3, -0.5, 0.8, 0.1]],
        log_scales: vec![[-1.0, -2.5, -4.0]],
        raw_opacities: vec![0.3],
        sh: vec![0.1; 3],
        sh_degree: 0,
    };
    let camera = Camera::look_at([0.5, -3.0, 1.0], [0.0; 3], 0.8, 64, 48);
    let (splats, view) = (Splats::from(&cloud), View::from(&camera));
    let (mut out, mut means2d, mut radii) = ([Projected::default()], [[0.0; 2]], [0]);
    let chunk = ProjectChunk {
        splats: &splats,
        view: &view,
        first: 0,
        out: &mut out,
        means2d: &mut means2d,
        radii: &mut radii,
    };
    pulp::Arch::new().dispatch(chunk);
    let g = out[0];
    assert!(g.reach > 0.0 && g.mean == means2d[0]);

    let m = view.chain(&splats, 0).m;
    let inner = |a: [f32; 3], b: [f32; 3]| lgs_core::linear::dot(a, b);
    let (a, b, c) = (inner(m[0], m[0]) + view.blur, inner(m[0], m[1]), inner(m[1], m[1]) + view.blur);
    let d = [3.0, -2.0];
    let exponent = -0.5 * (c * d[0] * d[0] - 2.0 * b * d[0] * d[1] + a * d[1] * d[1]) / (a * c - b * b);
    let (u, w) = (g.factor[0] * d[0] + g.factor[1] * d[1], g.factor[2] * d[1]);
    assert!((-(u * u + w * w) * std::f32::consts::LN_2 - exponent).abs() < 1e-4 * exponent.abs());
    assert!((g.half[0] - (2.0 * std::f32::consts::LN_2 * g.reach * a).sqrt()).abs() < 1e-3 * g.half[0]);
}
