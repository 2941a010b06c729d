//! Laws of motion, each in closed form or integrated to rounding error: the pose of a body at any time, also
//! before zero.

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

/// Step of the pendulum's integration; the fourth-order error at time 2.25 is below 1e-9 rad.
const PENDULUM_STEP: f64 = 1e-3;

/// Where a body is: a point `p` of the body lies at `rotation · p + position`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) rotation: DMat3,
    pub(super) position: DVec3,
}

/// How a body moves.
#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    /// Under gravity along −z, with a constant spin about an axis through the body's origin.
    Ballistic { start: DVec3, velocity: DVec3, gravity: f64, spin: DVec3 },
    /// Uniform rotation about an axis through a fixed point, the body's origin.
    Rotor { center: DVec3, spin: DVec3, phase: f64 },
    /// A rigid pendulum from rest: it turns about `axis` (a unit vector) through `pivot`, the body's origin,
    /// and hangs along −z at angle 0.
    Pendulum { pivot: DVec3, axis: DVec3, amplitude: f64, small_angle_frequency: f64 },
    /// Isotropic harmonic force towards a centre: an ellipse, no spin.
    Harmonic { center: DVec3, displacement: DVec3, velocity: DVec3, frequency: f64 },
    /// Sliding straight against a drag proportional to the velocity.
    Drag { start: DVec3, velocity: DVec3, drag: f64 },
}

impl Motion {
    /// The pose at a time.
    pub(super) fn pose(&self, t: f64) -> Pose {
        let still = |position| Pose { rotation: DMat3::IDENTITY, position };
        match *self {
            Self::Ballistic { start, velocity, gravity, spin } => Pose {
                rotation: turned(spin, t),
                position: start + velocity * t - DVec3::Z * (0.5 * gravity * t * t),
            },
            Self::Rotor { center, spin, phase } => {
                Pose { rotation: turned(spin, t + phase / spin.length()), position: center }
            }
            Self::Pendulum { pivot, axis, amplitude, small_angle_frequency } => Pose {
                rotation: turned(axis, pendulum_angle(amplitude, small_angle_frequency, t)),
                position: pivot,
            },
            Self::Harmonic { center, displacement, velocity, frequency: w } => {
                still(center + displacement * (w * t).cos() + velocity * ((w * t).sin() / w))
            }
            Self::Drag { start, velocity, drag } => still(start - velocity * ((-drag * t).exp_m1() / drag)),
        }
    }

    /// Name and constants, for `scene.json`.
    pub(super) fn describe(&self) -> Value {
        let v = |v: DVec3| json!(v.to_array());
        match *self {
            Self::Ballistic { start, velocity, gravity, spin } => {
                json!({"law": "uniform gravity", "start": v(start), "velocity": v(velocity), "g": gravity, "spin": v(spin)})
            }
            Self::Rotor { center, spin, phase } => {
                json!({"law": "uniform rotation", "center": v(center), "axis": v(spin.normalize()), "omega": spin.length(), "phase": phase})
            }
            Self::Pendulum { pivot, axis, amplitude, small_angle_frequency } => json!({
                "law": "rigid pendulum", "pivot": v(pivot), "axis": v(axis), "amplitude": amplitude,
                "small_angle_omega": small_angle_frequency
            }),
            Self::Harmonic { center, displacement, velocity, frequency } => json!({
                "law": "isotropic harmonic", "center": v(center), "displacement": v(displacement), "velocity": v(velocity),
                "omega": frequency, "k": frequency * frequency
            }),
            Self::Drag { start, velocity, drag } => {
                json!({"law": "linear drag", "start": v(start), "velocity": v(velocity), "drag": drag})
            }
        }
    }
}

/// The rotation by `rate · t` (right-handed; its length is the angle).
fn turned(rate: DVec3, t: f64) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(rate * t))
}

/// The angle at `t` of θ'' = −ω² sin θ, released at rest at t = 0: classical Runge–Kutta. Even in t.
fn pendulum_angle(amplitude: f64, frequency: f64, t: f64) -> f64 {
    let steps = (t.abs() / PENDULUM_STEP).ceil().max(1.0);
    let h = t.abs() / steps;
    let force = |angle: f64| -frequency * frequency * angle.sin();
    let (mut angle, mut rate) = (amplitude, 0.0);
    for _ in 0..steps as usize {
        let (a1, r1) = (rate, force(angle));
        let (a2, r2) = (rate + 0.5 * h * r1, force(angle + 0.5 * h * a1));
        let (a3, r3) = (rate + 0.5 * h * r2, force(angle + 0.5 * h * a2));
        let (a4, r4) = (rate + h * r3, force(angle + h * a3));
        angle += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        rate += h / 6.0 * (r1 + 2.0 * r2 + 2.0 * r3 + r4);
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second difference of the origin's path.
    fn acceleration(motion: &Motion, t: f64) -> DVec3 {
        let h = 1e-3;
        let at = |t| motion.pose(t).position;
        (at(t + h) - 2.0 * at(t) + at(t - h)) / (h * h)
    }

    fn velocity(motion: &Motion, t: f64) -> DVec3 {
        let h = 1e-5;
        (motion.pose(t + h).position - motion.pose(t - h).position) / (2.0 * h)
    }

    #[test]
    fn every_translation_obeys_its_law_at_all_times() {
        let (start, push) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, -0.5, 0.4));
        for t in [-0.7, 0.0, 0.4, 2.2] {
            let fall = Motion::Ballistic { start, velocity: push, gravity: 1.1, spin: DVec3::ZERO };
            assert!(acceleration(&fall, t).abs_diff_eq(DVec3::NEG_Z * 1.1, 1e-6));
            let spring =
                Motion::Harmonic { center: start, displacement: push, velocity: DVec3::Y, frequency: 3.0 };
            assert!(acceleration(&spring, t).abs_diff_eq(-9.0 * (spring.pose(t).position - start), 1e-4));
            let sled = Motion::Drag { start, velocity: push, drag: 0.9 };
            assert!(acceleration(&sled, t).abs_diff_eq(-0.9 * velocity(&sled, t), 1e-5));
        }
        assert!(velocity(&Motion::Drag { start, velocity: push, drag: 0.9 }, 0.0).abs_diff_eq(push, 1e-8));
    }

    #[test]
    fn the_pendulum_conserves_energy_and_has_the_period_of_the_elliptic_integral() {
        let (amplitude, w) = (1.0f64, 4.0);
        let angle = |t| pendulum_angle(amplitude, w, t);
        for i in -7..23 {
            let t = f64::from(i) * 0.1;
            let rate = (angle(t + 1e-5) - angle(t - 1e-5)) / 2e-5;
            let energy = 0.5 * rate * rate - w * w * angle(t).cos();
            assert!((energy + w * w * amplitude.cos()).abs() < 1e-6, "t {t}: {energy}");
        }
        // Arithmetic–geometric mean: T = 2π / (ω agm(1, cos(θ₀/2))).
        let (mut a, mut g) = (1.0, (0.5 * amplitude).cos());
        for _ in 0..6 {
            (a, g) = (0.5 * (a + g), (a * g).sqrt());
        }
        let period = std::f64::consts::TAU / (w * a);
        assert!((angle(period) - amplitude).abs() < 1e-9 && (angle(0.5 * period) + amplitude).abs() < 1e-9);
    }

    #[test]
    fn a_rotor_turns_right_handedly_at_its_rate() {
        let rotor = Motion::Rotor { center: DVec3::X, spin: DVec3::Z * 4.0, phase: 0.0 };
        let pose = rotor.pose(0.1);
        assert!((pose.rotation * DVec3::X).abs_diff_eq(DVec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0), 1e-12));
        assert_eq!(pose.position, DVec3::X);
    }
}
