//! Motions of bodies: laws in closed form, simulated laws, impacts and motions given by time. Each gives the
//! pose of a body at any time, also before zero, and what the same start would do under an edit.

use super::bounce::Bounce;
use super::collisions::Collisions;
use super::guided::Guided;
use super::pose::Pose;
use super::simulation::Simulation;
use crate::edit::MotionEdit;
use crate::thresholds::PENDULUM_STEP;
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};
use std::sync::Arc;

/// The motion of a body.
///
/// In closed form, α scales every velocity at t = 0, rotation included; β scales gravity, `ω²` of the
/// pendulum and of the harmonic force; γ scales the drag. The axis of a rotor is a constraint and never
/// scaled.
#[derive(Clone, Debug)]
pub(super) enum Motion {
    /// Free flight under gravity along −z, with a constant spin about an axis through the body's origin.
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
    /// One of the bodies of a simulated law.
    Simulated { simulation: Arc<Simulation>, body: usize },
    /// Flights between impacts on a floor.
    Bounce(Bounce),
    /// One of several balls that collide with each other, and may bounce off a floor.
    Colliding { collisions: Arc<Collisions>, ball: usize },
    /// A motion that is given by time and follows no law.
    Guided(Box<Guided>),
}

impl Motion {
    /// The pose at a time.
    pub(super) fn pose(&self, t: f64) -> Pose {
        let still = |position| Pose::rigid(DMat3::IDENTITY, position);
        match *self {
            Self::Ballistic { start, velocity, gravity, spin } => {
                Pose::rigid(turned(spin, t), start + velocity * t - DVec3::Z * (0.5 * gravity * t * t))
            }
            Self::Rotor { center, spin, phase } => {
                Pose::rigid(turned(spin, t + phase / spin.length()), center)
            }
            Self::Pendulum { pivot, axis, amplitude, small_angle_frequency } => {
                Pose::rigid(turned(axis, pendulum_angle(amplitude, small_angle_frequency, t)), pivot)
            }
            Self::Harmonic { center, displacement, velocity, frequency: w } => {
                still(center + displacement * (w * t).cos() + velocity * ((w * t).sin() / w))
            }
            Self::Drag { start, velocity, drag: 0.0 } => still(start + velocity * t),
            Self::Drag { start, velocity, drag } => still(start - velocity * ((-drag * t).exp_m1() / drag)),
            Self::Simulated { ref simulation, body } => simulation.pose(body, t),
            Self::Bounce(ref bounce) => bounce.pose(t),
            Self::Colliding { ref collisions, ball } => collisions.pose(ball, t),
            Self::Guided(ref guided) => guided.pose(t),
        }
    }

    /// The motion with the same start under an edit; nothing for a motion without a law.
    pub(super) fn edited(&self, edit: MotionEdit) -> Option<Self> {
        let (alpha, beta) = (edit.velocity_scale, edit.potential_scale);
        let mut edited = self.clone();
        match &mut edited {
            Self::Ballistic { velocity, gravity, spin, .. } => {
                (*velocity, *gravity, *spin) = (*velocity * alpha, *gravity * beta, *spin * alpha);
            }
            Self::Rotor { spin, .. } => *spin *= alpha,
            Self::Pendulum { small_angle_frequency, .. } => *small_angle_frequency *= beta.sqrt(),
            Self::Harmonic { velocity, frequency, .. } => {
                (*velocity, *frequency) = (*velocity * alpha, *frequency * beta.sqrt());
            }
            Self::Drag { velocity, drag, .. } => {
                (*velocity, *drag) = (*velocity * alpha, *drag * edit.force_scale);
            }
            Self::Simulated { simulation, .. } => {
                *simulation = Arc::new(Simulation::new(simulation.law.edited(edit)));
            }
            Self::Bounce(bounce) => *bounce = bounce.edited(edit),
            Self::Colliding { collisions, .. } => *collisions = Arc::new(collisions.edited(edit)),
            Self::Guided(_) => return None,
        }
        Some(edited)
    }

    /// Name and constants, for `scene.json`.
    ///
    /// `constants` are the numbers that a recovered law is compared with; `kind` says whether the law
    /// conserves, dissipates or drives.
    pub(super) fn describe(&self) -> Value {
        let mut description = self.law();
        if let (Some(all), Some((kind, constants))) = (description.as_object_mut(), self.known_constants()) {
            all.insert("kind".to_owned(), json!(kind));
            all.insert("constants".to_owned(), constants);
        }
        description
    }

    /// Kind and constants of a closed form.
    fn known_constants(&self) -> Option<(&'static str, Value)> {
        Some(match *self {
            Self::Ballistic { gravity, .. } => ("conservative", json!({"g": gravity})),
            Self::Rotor { spin, .. } => ("conservative", json!({"omega": spin.length()})),
            Self::Pendulum { small_angle_frequency: w, .. } => ("conservative", json!({"k_gravity": w * w})),
            Self::Harmonic { frequency: w, .. } => ("conservative", json!({"k": w * w})),
            Self::Drag { drag, .. } => ("dissipative", json!({"drag": drag})),
            _ => return None,
        })
    }

    fn law(&self) -> Value {
        let v = |v: DVec3| json!(v.to_array());
        match *self {
            Self::Ballistic { start, velocity, gravity, spin } => {
                json!({
                    "law": "uniform gravity", "start": v(start), "velocity": v(velocity), "g": gravity,
                    "spin": v(spin)
                })
            }
            Self::Rotor { center, spin, phase } => {
                json!({
                    "law": "uniform rotation", "center": v(center), "axis": v(spin.normalize()),
                    "omega": spin.length(), "phase": phase
                })
            }
            Self::Pendulum { pivot, axis, amplitude, small_angle_frequency } => json!({
                "law": "rigid pendulum", "pivot": v(pivot), "axis": v(axis), "amplitude": amplitude,
                "small_angle_omega": small_angle_frequency
            }),
            Self::Harmonic { center, displacement, velocity, frequency } => json!({
                "law": "isotropic harmonic", "center": v(center), "displacement": v(displacement),
                "velocity": v(velocity),
                "omega": frequency, "k": frequency * frequency
            }),
            Self::Drag { start, velocity, drag } => {
                json!({"law": "linear drag", "start": v(start), "velocity": v(velocity), "drag": drag})
            }
            Self::Simulated { ref simulation, body } => simulation.law.describe(body),
            Self::Bounce(ref bounce) => bounce.describe(),
            Self::Colliding { ref collisions, .. } => collisions.describe(),
            Self::Guided(ref guided) => guided.describe(),
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
        assert!((pose.linear * DVec3::X).abs_diff_eq(DVec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0), 1e-12));
        assert_eq!(pose.position, DVec3::X);
    }
}
