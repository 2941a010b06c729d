//! From the network's raw outputs to a Gaussian's pose at a time, and back.
//!
//! Raw rows are `[a (3), r (4), Δs (3)]`, pose rows `[x', q', Δs]`. With `q̂ = q/‖q‖`:
//! - displacement (DefGS, method §3.1): `x' = x + a`, `q' = q̂ + r`;
//! - turn (FreeGave, method §3.2): `x' = x + a`, `q' = r/‖r‖ ⊗ q̂`;
//! - rigid: `R = exp(r₁..₃)`, `x' = c + R (x − c) + σ a`, `q' = R ⊗ q̂`, about the centre c and in the scale
//!   σ of the input frame (the fourth number of r is unused). A rigid body's Gaussians then all need the same
//!   six numbers.

use lgs_core::linear::{add, cross, dot, quat_conjugate, quat_mul, scale, sub};

use super::config::{DELTAS, MotionHead};
use super::input::InputFrame;

/// Below this squared angle the rotation's coefficients come from their series, whose next term is beyond
/// single precision.
const SMALL_SQUARED_ANGLE: f32 = 1e-3;

/// Splits a row into position, rotation and scale parts.
fn split(row: &[f32; DELTAS]) -> ([f32; 3], [f32; 4], [f32; 3]) {
    let [x, y, z, a, b, c, d, e, f, g] = *row;
    ([x, y, z], [a, b, c, d], [e, f, g])
}

fn join(x: [f32; 3], q: [f32; 4], s: [f32; 3]) -> [f32; DELTAS] {
    [x[0], x[1], x[2], q[0], q[1], q[2], q[3], s[0], s[1], s[2]]
}

fn length4(q: [f32; 4]) -> f32 {
    q.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-12)
}

/// For θ² = |w|²: cos(θ/2), sin(θ/2)/θ and the derivative of the latter by θ, divided by θ.
fn half_angle(squared: f32) -> (f32, f32, f32) {
    if squared < SMALL_SQUARED_ANGLE {
        (1.0 - squared / 8.0, 0.5 - squared / 48.0, -1.0 / 24.0 + squared / 960.0)
    } else {
        let theta = squared.sqrt();
        let (sin, cos) = (0.5 * theta).sin_cos();
        (cos, sin / theta, (0.5 * cos - sin / theta) / squared)
    }
}

/// The quaternion of a rotation vector.
pub(super) fn quat_exp(w: [f32; 3]) -> [f32; 4] {
    let (cos, s, _) = half_angle(dot(w, w));
    [cos, s * w[0], s * w[1], s * w[2]]
}

fn quat_exp_vjp(w: [f32; 3], v_q: [f32; 4]) -> [f32; 3] {
    let (_, s, k) = half_angle(dot(w, w));
    let v_n = [v_q[1], v_q[2], v_q[3]];
    let along = k * dot(w, v_n) - 0.5 * s * v_q[0];
    std::array::from_fn(|i| s * v_n[i] + along * w[i])
}

/// `u` turned by a unit quaternion.
fn rotate(q: [f32; 4], u: [f32; 3]) -> [f32; 3] {
    let n = [q[1], q[2], q[3]];
    let t = scale(cross(n, u), 2.0);
    add(add(u, scale(t, q[0])), cross(n, t))
}

/// A quaternion divided by its length, and that length; without a direction, no rotation.
fn unit_or_none(r: [f32; 4]) -> ([f32; 4], f32) {
    let length = length4(r);
    if length > 1e-12 { (r.map(|v| v / length), length) } else { ([1.0, 0.0, 0.0, 0.0], 1.0) }
}

/// Cotangents of a rotation's quaternion and of the vector turned.
fn rotate_vjp(q: [f32; 4], u: [f32; 3], v: [f32; 3]) -> ([f32; 4], [f32; 3]) {
    let n = [q[1], q[2], q[3]];
    let v_w = 2.0 * dot(v, cross(n, u));
    let turned = scale(cross(u, v), q[0]);
    let v_n: [f32; 3] = std::array::from_fn(|i| {
        2.0 * (turned[i] + v[i] * dot(n, u) + u[i] * dot(v, n) - 2.0 * n[i] * dot(v, u))
    });
    ([v_w, v_n[0], v_n[1], v_n[2]], rotate(quat_conjugate(q), v))
}

/// A Gaussian's pose row from its raw row, centre and quaternion.
#[must_use]
pub fn pose(
    head: MotionHead,
    frame: InputFrame,
    raw: &[f32; DELTAS],
    x: [f32; 3],
    q: [f32; 4],
) -> [f32; DELTAS] {
    let (a, r, s) = split(raw);
    let length = length4(q);
    let unit = q.map(|v| v / length);
    match head {
        MotionHead::Displacement => join(add(x, a), std::array::from_fn(|i| unit[i] + r[i]), s),
        MotionHead::Turn => join(add(x, a), quat_mul(unit_or_none(r).0, unit), s),
        MotionHead::Rigid => {
            let turn = quat_exp([r[0], r[1], r[2]]);
            let from_center = rotate(turn, sub(x, frame.center));
            join(add(add(frame.center, from_center), scale(a, frame.scale)), quat_mul(turn, unit), s)
        }
    }
}

/// Cotangents of raw row, centre and quaternion, given that of the pose row.
#[must_use]
pub fn pose_vjp(
    head: MotionHead,
    frame: InputFrame,
    raw: &[f32; DELTAS],
    (x, q): ([f32; 3], [f32; 4]),
    v_pose: &[f32; DELTAS],
) -> ([f32; DELTAS], [f32; 3], [f32; 4]) {
    let (_, r, _) = split(raw);
    let (v_x, v_q, v_s) = split(v_pose);
    let length = length4(q);
    let unit = q.map(|v| v / length);
    let (v_raw, v_center, v_unit) = match head {
        MotionHead::Displacement => (join(v_x, v_q, v_s), v_x, v_q),
        MotionHead::Turn => {
            let (turn, length) = unit_or_none(r);
            let v_turn = quat_mul(v_q, quat_conjugate(unit));
            let along: f32 = (0..4).map(|i| turn[i] * v_turn[i]).sum();
            let v_r = std::array::from_fn(|i| (v_turn[i] - turn[i] * along) / length);
            (join(v_x, v_r, v_s), v_x, quat_mul(quat_conjugate(turn), v_q))
        }
        MotionHead::Rigid => {
            let w = [r[0], r[1], r[2]];
            let turn = quat_exp(w);
            let (v_turn, v_center) = rotate_vjp(turn, sub(x, frame.center), v_x);
            let from_quat = quat_mul(v_q, quat_conjugate(unit));
            let v_w = quat_exp_vjp(w, std::array::from_fn(|i| v_turn[i] + from_quat[i]));
            let v_r = [v_w[0], v_w[1], v_w[2], 0.0];
            (join(scale(v_x, frame.scale), v_r, v_s), v_center, quat_mul(quat_conjugate(turn), v_q))
        }
    };
    let along: f32 = (0..4).map(|i| unit[i] * v_unit[i]).sum();
    (v_raw, v_center, std::array::from_fn(|i| (v_unit[i] - unit[i] * along) / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(head: MotionHead, angle: f32) {
        let frame = InputFrame { center: [0.3, -0.1, 0.2], scale: 1.7 };
        let raw = [0.1, -0.2, 0.3, 0.6 * angle, -0.48 * angle, 0.64 * angle, 0.05, 0.01, 0.02, -0.03];
        let (x, q) = ([0.5, 0.9, -0.4], [0.9, 0.2, -0.7, 1.1]);
        let weights: [f32; DELTAS] = std::array::from_fn(|i| (i as f32 * 1.3).sin());
        let (v_raw, v_x, v_q) = pose_vjp(head, frame, &raw, (x, q), &weights);
        let loss = |inputs: &[f32; 17]| -> f64 {
            let raw = std::array::from_fn(|i| inputs[i]);
            let out = pose(
                head,
                frame,
                &raw,
                [inputs[10], inputs[11], inputs[12]],
                [inputs[13], inputs[14], inputs[15], inputs[16]],
            );
            out.iter().zip(&weights).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
        };
        let mut inputs = [0.0; 17];
        inputs[..10].copy_from_slice(&raw);
        inputs[10..13].copy_from_slice(&x);
        inputs[13..].copy_from_slice(&q);
        let exact: Vec<f32> = v_raw.into_iter().chain(v_x).chain(v_q).collect();
        for i in 0..17 {
            let shifted = |h: f32| {
                let mut inputs = inputs;
                inputs[i] += h;
                loss(&inputs)
            };
            let numeric = (shifted(4e-3) - shifted(-4e-3)) / 8e-3;
            assert!(
                (numeric - f64::from(exact[i])).abs() < 1e-3,
                "{head:?} angle {angle} input {i}: {numeric} {}",
                exact[i]
            );
        }
    }

    #[test]
    fn gradients_are_those_of_finite_differences_at_every_angle() {
        check(MotionHead::Displacement, 0.5);
        check(MotionHead::Turn, 0.5);
        check(MotionHead::Turn, 3.0);
        for angle in [0.0, 1e-3, 0.02, 0.04, 0.5, 2.0, 3.2, 6.0] {
            check(MotionHead::Rigid, angle);
        }
    }

    #[test]
    fn a_rotation_vector_turns_about_the_frames_centre() {
        let frame = InputFrame { center: [1.0, 0.0, 0.0], scale: 2.0 };
        let quarter = std::f32::consts::FRAC_PI_2;
        let raw = [0.0, 0.0, 0.5, 0.0, 0.0, quarter, 0.0, 0.0, 0.0, 0.0];
        let row = pose(MotionHead::Rigid, frame, &raw, [2.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]);
        let half = 0.5_f32.sqrt();
        let expected = [1.0, 1.0, 1.0, half, 0.0, 0.0, half, 0.0, 0.0, 0.0];
        assert!(row.iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6), "{row:?}");
    }
}
