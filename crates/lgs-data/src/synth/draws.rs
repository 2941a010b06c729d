//! Constants of a scene, drawn from its seed.

use glam::{DMat3, DQuat, DVec3, dvec3};
use lgs_core::{Stream, stream};
use rand::RngExt;
use std::f64::consts::TAU;
use std::ops::Range;

/// Colours of bodies: two that alternate and a wash, far enough apart that every rotation shows.
const PALETTES: [[u32; 3]; 8] = [
    [0xd7263d, 0x1b2a6b, 0xf2a541],
    [0x0b6e4f, 0xf4c095, 0x3d348b],
    [0x264653, 0xe9c46a, 0xd1495b],
    [0x5f0f40, 0x8fd694, 0xf2a65a],
    [0x14532d, 0xf1faee, 0xd00070],
    [0x023047, 0x8ecae6, 0xffb703],
    [0x7b2cbf, 0xff9e00, 0x240046],
    [0x006d77, 0xedf6f9, 0xc1121f],
];

/// The draws of one scene and seed, in a fixed order.
pub(super) struct Draws {
    rng: Stream,
    /// The seed 0 keeps the constants that a scene has always had.
    keeps_usual: bool,
}

impl Draws {
    /// The draws of a scene: scenes differ under the same seed.
    pub(super) fn new(scene: &str, seed: u64) -> Self {
        Self { rng: stream(seed, &format!("synthetic law {scene}"), 0), keeps_usual: seed == 0 }
    }

    /// Whether scenes that had constants before they were drawn keep them.
    pub(super) fn keeps_usual(&self) -> bool {
        self.keeps_usual
    }

    /// A number of a range.
    pub(super) fn within(&mut self, range: Range<f64>) -> f64 {
        self.rng.random_range(range)
    }

    /// The usual number for seed 0, one of the range for any other.
    pub(super) fn usual_or(&mut self, usual: f64, range: Range<f64>) -> f64 {
        let drawn = self.within(range);
        if self.keeps_usual { usual } else { drawn }
    }

    /// The usual vector for seed 0; for any other it is turned about the vertical by up to `turn` radians
    /// either way and scaled by a number of the range.
    pub(super) fn usual_or_turned(&mut self, usual: DVec3, turn: f64, scale: Range<f64>) -> DVec3 {
        let (angle, scale) = (self.within(-turn..turn), self.within(scale));
        if self.keeps_usual { usual } else { DMat3::from_rotation_z(angle) * usual * scale }
    }

    /// A number of a range, of either sign.
    pub(super) fn either_sign(&mut self, range: Range<f64>) -> f64 {
        let sign = if self.happens(0.5) { -1.0 } else { 1.0 };
        sign * self.within(range)
    }

    /// One of `count` numbers from 0 on, each as likely as the others.
    pub(super) fn one_of(&mut self, count: usize) -> usize {
        self.rng.random_range(0..count)
    }

    /// Whether something happens that has a probability.
    pub(super) fn happens(&mut self, probability: f64) -> bool {
        self.within(0.0..1.0) < probability
    }

    /// A horizontal unit vector.
    pub(super) fn horizontal(&mut self) -> DVec3 {
        let azimuth = self.within(0.0..TAU);
        dvec3(azimuth.cos(), azimuth.sin(), 0.0)
    }

    /// A unit vector whose angle to the upward vertical lies in a range, radians.
    pub(super) fn tilted(&mut self, tilt: Range<f64>) -> DVec3 {
        let tilt = self.within(tilt);
        tilt.sin() * self.horizontal() + tilt.cos() * DVec3::Z
    }

    /// A rotation, uniform over all.
    pub(super) fn orientation(&mut self) -> DMat3 {
        let (u, v, w) = (self.within(0.0..1.0), self.within(0.0..TAU), self.within(0.0..TAU));
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        DMat3::from_quat(DQuat::from_xyzw(a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos()))
    }

    /// One of the sets of colours.
    pub(super) fn palette(&mut self) -> [u32; 3] {
        PALETTES[self.one_of(PALETTES.len())]
    }
}
