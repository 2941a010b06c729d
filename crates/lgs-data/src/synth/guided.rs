//! Motions that no autonomous law explains: their paths are functions of time.

use super::draws::Draws;
use super::pose::Pose;
use crate::thresholds::GRAB_DURATION;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Number of waves of a random smooth function.
const WAVES: usize = 4;

/// A random smooth function of time: a sum of waves of different frequencies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wander {
    /// Amplitude, angular frequency, phase.
    waves: [(f64, f64, f64); WAVES],
}

impl Wander {
    /// Draws a function of about the amplitude, with frequencies of 0.3 to 1.8 per unit of time.
    pub(super) fn draw(draws: &mut Draws, amplitude: f64) -> Self {
        let wave = |i: usize, draws: &mut Draws| {
            let low = 0.3 + 0.375 * i as f64;
            let frequency = draws.within(low..low + 0.375);
            let share = draws.within(0.6..1.0) / (1.0 + i as f64).sqrt();
            (0.6 * amplitude * share, TAU * frequency, draws.within(0.0..TAU))
        };
        Self { waves: std::array::from_fn(|i| wave(i, draws)) }
    }

    /// The value at a time, 0 at t = 0.
    pub(super) fn at(&self, t: f64) -> f64 {
        self.waves.iter().map(|&(a, w, phase)| a * ((w * t + phase).sin() - phase.sin())).sum()
    }

    fn slope(&self, t: f64) -> f64 {
        self.waves.iter().map(|&(a, w, phase)| a * w * (w * t + phase).cos()).sum()
    }
}

/// A motion given by time.
#[derive(Clone, Debug)]
pub(super) enum Guided {
    /// A random smooth path, turning about an axis by a random smooth angle.
    Led { start: DVec3, path: [Wander; 3], axis: DVec3, angle: Wander },
    /// Free fall until the body is grabbed, then a random smooth path.
    Grabbed { start: DVec3, velocity: DVec3, gravity: f64, grabbed: f64, path: [Wander; 3] },
    /// A random smooth path until the body is let go, then free fall.
    Released { start: DVec3, path: [Wander; 3], released: f64, gravity: f64 },
    /// A part of a walker: it walks on, bobs and swings about `joint` (walker axes) at a changing cadence.
    Gait { walk: Walk, joint: DVec3, swing: f64, lag: f64 },
}

/// The gait of a walker.
#[derive(Clone, Debug)]
pub(super) struct Walk {
    pub(super) start: DVec3,
    /// Horizontal unit vector.
    pub(super) direction: DVec3,
    pub(super) speed: f64,
    /// Steps per unit of time, on average.
    pub(super) cadence: f64,
    /// Height of the bobbing.
    pub(super) bob: f64,
    /// Change of the gait's phase, radians.
    pub(super) change: Wander,
}

impl Walk {
    fn phase(&self, t: f64) -> f64 {
        TAU * self.cadence * t + self.change.at(t)
    }

    fn position(&self, t: f64) -> DVec3 {
        // The walker goes forward as its gait does: faster where the cadence is.
        let along = self.speed * self.phase(t) / (TAU * self.cadence);
        self.start + along * self.direction + self.bob * (2.0 * self.phase(t)).sin() * DVec3::Z
    }

    fn axes(&self) -> DMat3 {
        DMat3::from_cols(self.direction, DVec3::Z.cross(self.direction), DVec3::Z)
    }
}

impl Guided {
    pub(super) fn pose(&self, t: f64) -> Pose {
        match self {
            Self::Led { start, path, axis, angle } => {
                Pose::rigid(DMat3::from_axis_angle(*axis, angle.at(t)), *start + along(path, t))
            }
            Self::Grabbed { start, velocity, gravity, grabbed, path } => {
                let free = |t: f64| *start + *velocity * t - 0.5 * gravity * t * t * DVec3::Z;
                let since = t - grabbed;
                if since <= 0.0 {
                    return Pose::rigid(DMat3::IDENTITY, free(t));
                }
                let slope = DVec3::from_array(path.each_ref().map(|p| p.slope(0.0)));
                let given_up = *velocity - gravity * grabbed * DVec3::Z - slope;
                let slowed = GRAB_DURATION * (1.0 - (-since / GRAB_DURATION).exp()) * given_up;
                Pose::rigid(DMat3::IDENTITY, free(*grabbed) + slowed + along(path, since))
            }
            Self::Released { start, path, released, gravity } => {
                let since = (t - released).max(0.0);
                let velocity = DVec3::from_array(path.each_ref().map(|p| p.slope(*released)));
                let flown = velocity * since - 0.5 * gravity * since * since * DVec3::Z;
                Pose::rigid(DMat3::IDENTITY, *start + along(path, t.min(*released)) + flown)
            }
            Self::Gait { walk, joint, swing, lag } => {
                let phase = walk.phase(t) + lag;
                let angle = swing * (phase.sin() + 0.35 * (2.0 * phase + 0.8).sin());
                let axes = walk.axes();
                Pose::rigid(axes * DMat3::from_rotation_y(angle), walk.position(t) + axes * *joint)
            }
        }
    }

    pub(super) fn describe(&self) -> Value {
        let (law, constants) = match self {
            Self::Led { axis, path, .. } => {
                ("led along a path", json!({"axis": axis.to_array(), "waves": path.map(|p| p.waves)}))
            }
            Self::Released { gravity, released, .. } => {
                ("led, then free fall", json!({"g": gravity, "released": released}))
            }
            Self::Grabbed { gravity, grabbed, .. } => {
                ("grabbed in flight", json!({"g": gravity, "grabbed_at": grabbed}))
            }
            Self::Gait { walk, swing, .. } => {
                ("gait", json!({"speed": walk.speed, "cadence": walk.cadence, "swing": swing}))
            }
        };
        json!({"law": law, "kind": "function of time", "coordinates": "rigid", "constants": constants})
    }
}

fn along(path: &[Wander; 3], t: f64) -> DVec3 {
    DVec3::from_array(path.each_ref().map(|p| p.at(t)))
}
