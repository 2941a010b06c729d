//! The divergence-free velocity field of six bases and its integration (method §3.2).
//!
//! Mixed, the bases are a rigid twist: `v(p) = u + ω × p` about the world's origin, with `ω = −(a₄, a₅, a₆)`.
//! Integrated by the explicit midpoint rule, along which a Gaussian's twist changes with time only.

use lgs_core::linear::{Mat3, add, cross, mat_mul, norm, quat_mul, quat_normalize, scale, sub};

use crate::source::config::RotationForm;

/// Numbers per twist: `u` (3), and `−ω` (3).
pub const TWIST: usize = 6;

/// Coefficients `a` of the six bases.
pub type Twist = [f32; TWIST];

fn parts(a: &Twist) -> ([f32; 3], [f32; 3]) {
    ([a[0], a[1], a[2]], [a[3], a[4], a[5]])
}

/// Velocity at a point, world units per unit of time.
#[must_use]
pub fn velocity(a: &Twist, p: [f32; 3]) -> [f32; 3] {
    let (u, b) = parts(a);
    sub(u, cross(b, p))
}

/// Cotangents of twist and point, given that of the velocity.
#[must_use]
pub fn velocity_vjp(a: &Twist, p: [f32; 3], v: [f32; 3]) -> (Twist, [f32; 3]) {
    let (_, b) = parts(a);
    let turned = cross(v, p);
    ([v[0], v[1], v[2], turned[0], turned[1], turned[2]], cross(b, v))
}

/// Steps from one time to another: equal ones of at most `longest`, but for the last, which is the remainder
/// (method §3.2). The signed lengths.
#[must_use]
pub fn steps(from: f32, to: f32, longest: f32) -> Vec<f32> {
    let span = (to - from).abs();
    if span == 0.0 {
        return Vec::new();
    }
    // A remainder below a thousandth of a step is rounding.
    let count = ((span / longest) - 1e-3).ceil().max(1.0) as usize;
    let whole = longest.min(span).copysign(to - from);
    (0..count).map(|i| if i + 1 < count { whole } else { (to - from) - whole * i as f32 }).collect()
}

/// Times at which the twists of those steps are needed: the start and the middle of each.
#[must_use]
pub fn twist_times(from: f32, steps: &[f32]) -> Vec<f32> {
    let mut time = from;
    let mut times = Vec::with_capacity(2 * steps.len());
    for h in steps {
        times.extend([time, time + 0.5 * h]);
        time += h;
    }
    times
}

/// Moves a point through the steps, given its twists at [`twist_times`].
#[must_use]
pub fn integrate(steps: &[f32], twists: &[Twist], p: [f32; 3]) -> [f32; 3] {
    let pairs = steps.iter().zip(twists.as_chunks::<2>().0);
    pairs.fold(p, |p, (&h, [start, middle])| add(p, scale(velocity(middle, halfway(p, h, start)), h)))
}

fn halfway(p: [f32; 3], h: f32, start: &Twist) -> [f32; 3] {
    add(p, scale(velocity(start, p), 0.5 * h))
}

/// Cotangents of the twists and of the first point, given that of the last.
#[must_use]
pub fn integrate_vjp(steps: &[f32], twists: &[Twist], p: [f32; 3], v: [f32; 3]) -> (Vec<Twist>, [f32; 3]) {
    let pairs = twists.as_chunks::<2>().0;
    let mut points = vec![p];
    for (i, &h) in steps.iter().enumerate() {
        points.push(integrate(&[h], &pairs[i], points[i]));
    }
    let (mut v_twists, mut v_p) = (vec![[0.0; TWIST]; twists.len()], v);
    for (i, &h) in steps.iter().enumerate().rev() {
        let [start, middle] = &pairs[i];
        let (v_middle, v_halfway) = velocity_vjp(middle, halfway(points[i], h, start), scale(v_p, h));
        let (v_start, v_point) = velocity_vjp(start, points[i], scale(v_halfway, 0.5 * h));
        (v_twists[2 * i], v_twists[2 * i + 1]) = (v_start, v_middle);
        v_p = add(v_p, add(v_halfway, v_point));
    }
    (v_twists, v_p)
}

/// The rotation along the steps as a quaternion, from the angular velocities at their middles. Not of unit
/// length in [`RotationForm::Reference`], and not a number there where the trace of the accumulated matrix
/// has fallen to −1.
#[must_use]
pub fn rotation(form: RotationForm, steps: &[f32], twists: &[Twist]) -> [f32; 4] {
    let turns =
        steps.iter().zip(twists.as_chunks::<2>().0).map(|(&h, [_, middle])| scale(parts(middle).1, -h));
    match form {
        RotationForm::Reference => {
            published_quaternion(&turns.fold(IDENTITY, |m, w| mat_mul(&identity_plus_cross(w), &m)))
        }
        RotationForm::Fixed => {
            turns.fold([1.0, 0.0, 0.0, 0.0], |q, w| quat_normalize(quat_mul(exponential(w), q)))
        }
    }
}

const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// `I + [w]×`.
fn identity_plus_cross(w: [f32; 3]) -> Mat3 {
    [[1.0, -w[2], w[1]], [w[2], 1.0, -w[0]], [-w[1], w[0], 1.0]]
}

/// The published formula: no branch for a small trace, no renormalisation.
fn published_quaternion(m: &Mat3) -> [f32; 4] {
    let w = 0.5 * (1.0 + m[0][0] + m[1][1] + m[2][2]).sqrt();
    [w, (m[2][1] - m[1][2]) / (4.0 * w), (m[0][2] - m[2][0]) / (4.0 * w), (m[1][0] - m[0][1]) / (4.0 * w)]
}

/// The quaternion of a rotation vector.
fn exponential(w: [f32; 3]) -> [f32; 4] {
    let angle = norm(w);
    let (sin, cos) = (0.5 * angle).sin_cos();
    let factor = if angle > 1e-6 { sin / angle } else { 0.5 };
    [cos, factor * w[0], factor * w[1], factor * w[2]]
}

#[cfg(test)]
mod tests {
    use super::super::inflated::drawn_shape;
    use super::*;

    fn length(q: [f32; 4]) -> f32 {
        q.iter().map(|v| v * v).sum::<f32>().sqrt()
    }

    /// Twists of a uniform rotation, `twice` the number of steps.
    fn spin(omega: [f32; 3], count: usize) -> Vec<Twist> {
        vec![[0.0, 0.0, 0.0, -omega[0], -omega[1], -omega[2]]; count]
    }

    #[test]
    fn the_field_is_the_published_sum_of_six_bases_and_a_rigid_twist() {
        let (a, [x, y, z]) = ([0.3, -0.7, 0.2, 0.5, -0.4, 0.9], [0.6, -1.1, 0.8]);
        let bases =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
        let sum: [f32; 3] = std::array::from_fn(|axis| (0..TWIST).map(|i| a[i] * bases[i][axis]).sum());
        let found = velocity(&a, [x, y, z]);
        assert!(sum.iter().zip(found).all(|(s, f)| (s - f).abs() < 1e-6), "{sum:?} {found:?}");
    }

    #[test]
    fn steps_cover_the_span_in_either_direction_with_the_rest_at_the_end() {
        let forward = steps(0.7, 0.75, 1.0 / 60.0);
        assert_eq!(forward.len(), 3);
        assert!((forward.iter().sum::<f32>() - 0.05).abs() < 1e-6);
        let back = steps(0.5, 0.2, 0.08);
        assert_eq!(back.len(), 4);
        assert!(back[..3].iter().all(|h| *h == -0.08) && (back[3] + 0.06).abs() < 1e-6);
        assert_eq!(steps(0.2, 0.9, f32::INFINITY), [0.7]);
        assert!(steps(0.3, 0.3, 0.1).is_empty());
        assert_eq!(twist_times(1.0, &[0.5, 0.25]), [1.0, 1.25, 1.5, 1.625]);
    }

    #[test]
    fn the_midpoint_rule_converges_with_the_third_power_of_the_step_per_step() {
        let end = |count: usize| {
            let h = vec![1.2 / count as f32; count];
            integrate(&h, &spin([0.0, 0.0, 1.0], 2 * count), [1.0, 0.0, 0.3])
        };
        let error = |count| {
            let p = end(count);
            norm(sub(p, [1.2_f32.cos(), 1.2_f32.sin(), 0.3]))
        };
        assert!(error(12) < 4e-3);
        assert!(
            (3.0..5.0).contains(&(error(6) / error(12))),
            "second order over a fixed time: {} {}",
            error(6),
            error(12)
        );
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        let h = [0.1, 0.1, 0.04];
        let twists: Vec<Twist> =
            (0..6).map(|j| std::array::from_fn(|i| ((j * 6 + i) as f32 * 1.7).sin() * 1.5)).collect();
        let (p, weights) = ([0.4, -0.9, 1.3], [0.7, -1.2, 0.5]);
        let loss = |twists: &[Twist], p| lgs_core::linear::dot(integrate(&h, twists, p), weights);
        let (v_twists, v_p) = integrate_vjp(&h, &twists, p, weights);
        const D: f32 = 1e-2;
        for j in 0..6 {
            for i in 0..TWIST {
                let shifted = |d: f32| {
                    let mut twists = twists.clone();
                    twists[j][i] += d;
                    loss(&twists, p)
                };
                let numeric = (shifted(D) - shifted(-D)) / (2.0 * D);
                assert!(
                    (numeric - v_twists[j][i]).abs() < 1e-4,
                    "twist {j} {i}: {numeric} {}",
                    v_twists[j][i]
                );
            }
        }
        for (i, exact) in v_p.into_iter().enumerate() {
            let shifted =
                |d: f32| loss(&twists, std::array::from_fn(|k| if k == i { p[k] + d } else { p[k] }));
            let numeric = (shifted(D) - shifted(-D)) / (2.0 * D);
            assert!((numeric - exact).abs() < 1e-4, "point {i}: {numeric} {exact}");
        }
    }

    #[test]
    fn the_published_rotation_swells_and_fails_near_half_a_turn_and_the_fixed_one_does_not() {
        let after = |form, omega: f32, time: f32| {
            let h = steps(0.0, time, 1.0 / 60.0);
            rotation(form, &h, &spin([0.0, 0.0, omega], 2 * h.len()))
        };
        let pi = std::f32::consts::PI;
        for angle in [0.5, 1.0, 2.0, pi - 0.01, pi, pi + 0.01, 2.0 * pi, 9.0] {
            let q = after(RotationForm::Fixed, angle, 1.0);
            assert!((length(q) - 1.0).abs() < 1e-5, "{angle}: {q:?}");
            let expected = [(0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin()];
            let same = q.iter().zip(expected).map(|(a, b)| a * b).sum::<f32>().abs();
            assert!((same - 1.0).abs() < 1e-4, "{angle}: {q:?}");
        }
        // By what the drawn radius in the plane of rotation grows.
        let swelling = |time| {
            let (_, log_scales) =
                drawn_shape(after(RotationForm::Reference, pi, time), [0.0; 3]).expect("a number");
            log_scales.into_iter().fold(0.0, f32::max).exp()
        };
        assert!(
            (swelling(0.5) - 1.05).abs() < 5e-3 && (swelling(0.75) - 1.48).abs() < 5e-3,
            "{} {}",
            swelling(0.5),
            swelling(0.75)
        );
        assert!(after(RotationForm::Reference, pi, 1.0).iter().any(|v| v.is_nan()));
    }
}
