use super::*;
use lgs_core::linear::{self, matrix_from_quat};

fn rotation(axis: [f32; 3], angle: f32) -> Mat3 {
    let n = linear::norm(axis);
    let (s, c) = (0.5 * angle).sin_cos();
    matrix_from_quat([c, s * axis[0] / n, s * axis[1] / n, s * axis[2] / n])
}

fn assert_close(a: &Mat3, b: &Mat3, tolerance: f32, what: &str) {
    for (x, y) in a.as_flattened().iter().zip(b.as_flattened()) {
        assert!((x - y).abs() < tolerance, "{what}: {a:?} {b:?}");
    }
}

#[test]
fn rotations_of_every_angle_are_recovered_from_solid_and_flat_supports() {
    for spread in [[1.0, 0.7, 0.4], [1.0, 0.5, 0.0], [1e-3, 2e-3, 1e-4]] {
        for step in 0..32 {
            let r = rotation([0.3, -0.8, 0.5], step as f32 * 0.098);
            let s: Mat3 = [[spread[0], 0.0, 0.0], [0.0, spread[1], 0.0], [0.0, 0.0, spread[2]]];
            assert_close(&kabsch(&linear::mat_mul(&r, &s)), &r, 2e-6, "angle");
        }
    }
}

#[test]
fn a_reflected_set_gets_a_proper_rotation() {
    let a: Mat3 = [[1.0, 0.0, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, -0.3]];
    assert_close(&kabsch(&a), &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e-6, "reflection");
}

#[test]
fn degenerate_supports_take_the_smallest_rotation_and_have_no_gradient() {
    let (r, x) = (rotation([0.0, 0.0, 1.0], 0.4), [1.0, 0.0, 0.0]);
    let turned = linear::mat_vec(&r, x);
    let line: Mat3 = std::array::from_fn(|i| std::array::from_fn(|j| turned[i] * x[j]));
    assert_close(&kabsch(&line), &r, 1e-4, "collinear");
    assert_close(&kabsch(&[[0.0; 3]; 3]), &rotation([1.0, 0.0, 0.0], 0.0), 1e-7, "coincident");
    for a in [line, [[0.0; 3]; 3]] {
        assert_eq!(kabsch_vjp(&a, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]), [[0.0; 3]; 3]);
    }
    assert!(kabsch(&[[f32::NAN; 3]; 3]).as_flattened().iter().all(|v| v.is_finite()));
}

#[test]
fn the_derivative_agrees_with_finite_differences_for_both_signs_of_the_determinant() {
    for sign in [1.0, -1.0] {
        let a: Mat3 = [[1.2, 0.3, -0.2], [0.1, 0.9, 0.25], [-0.3, 0.2, 0.4 * sign]];
        let weight: Mat3 = [[0.3, -0.7, 0.2], [0.9, 0.1, -0.4], [0.5, 0.6, -0.8]];
        let loss = |a: &DMat3| {
            let r = nearest_rotation(a).to_cols_array();
            r.iter().zip(wide(&weight).to_cols_array()).map(|(r, w)| r * w).sum::<f64>()
        };
        let gradient = kabsch_vjp(&a, &weight);
        for (i, row) in gradient.iter().enumerate() {
            for (j, &found) in row.iter().enumerate() {
                let moved = |by: f64| {
                    let mut a = wide(&a);
                    a.col_mut(j)[i] += by;
                    loss(&a)
                };
                let expected = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((f64::from(found) - expected).abs() < 1e-5, "{sign} {i} {j}: {} {expected}", found);
            }
        }
    }
}
