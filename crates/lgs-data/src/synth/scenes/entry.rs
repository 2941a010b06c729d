//! Entries of the catalogue of scenes, and the parts that several of them share.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::Law;
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::simulation::Simulation;
use super::super::texture::Texture;
use super::super::view::Rig;
use glam::{DVec3, dvec3};
use std::sync::Arc;

/// A scene's name, what moves in it, and what its seed draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneInfo {
    /// Name on the command line.
    pub name: &'static str,
    /// A line that describes the scene.
    pub description: &'static str,
    /// The constants that the seed draws, with ranges in world units and units of time.
    pub drawn: &'static str,
    /// Whether an autonomous law explains the motion. Scenes of which none does have no edited splits.
    pub explained: bool,
}

/// A scene of the catalogue.
pub(super) struct Entry {
    pub(super) info: SceneInfo,
    pub(super) build: fn(&mut Draws) -> (Stage, Rig),
}

impl Entry {
    pub(super) const fn new(
        name: &'static str,
        description: &'static str,
        drawn: &'static str,
        build: fn(&mut Draws) -> (Stage, Rig),
    ) -> Self {
        Self { info: SceneInfo { name, description, drawn, explained: true }, build }
    }

    pub(super) const fn unexplained(self) -> Self {
        Self { info: SceneInfo { explained: false, ..self.info }, build: self.build }
    }
}

/// A textured ball about the body's origin.
pub(super) fn ball(draws: &mut Draws, radius: f64) -> Part {
    let texture = Texture::new(draws.palette(), draws.within(0.4..0.55));
    Part::new(Shape::Ellipsoid(DVec3::splat(radius)), DVec3::ZERO, texture)
}

/// A square floor with its upper side at a height; `half` is half of its side.
pub(super) fn floor(height: f64, half: f64) -> Part {
    let thickness = 0.05;
    Part::new(
        Shape::Cuboid(dvec3(half, half, thickness)),
        dvec3(0.0, 0.0, height - thickness),
        Texture::new([0x8a6a4f, 0xb08968, 0x6f5a48], 0.9).with_contrast(0.7),
    )
}

/// A camera ring of radius `distance` that frames a square of half-side `half` at the target.
pub(super) fn ring(target: DVec3, distance: f64, half: f64) -> Rig {
    Rig::Hemisphere { target, distance, fov: 2.0 * (half / distance).atan() }
}

/// One moving body and nothing else.
pub(super) fn alone(name: &'static str, motion: Motion, center: DVec3, parts: Vec<Part>) -> Stage {
    Stage { bodies: vec![Body { name, motion, parts, center }], fixed: Vec::new() }
}

/// The motions of the first `N` bodies of a law.
pub(super) fn simulated<const N: usize>(law: impl Law + 'static) -> [Motion; N] {
    let simulation = Arc::new(Simulation::new(Box::new(law)));
    std::array::from_fn(|body| Motion::Simulated { simulation: Arc::clone(&simulation), body })
}

/// A stage with cameras that frame its moving bodies at all times of the ground truth: the centres with room
/// for most of the bodies.
pub(super) fn framed(stage: Stage) -> (Stage, Rig) {
    let times = || (-75..=225).step_by(5).map(|i| f64::from(i) / 100.0);
    let center = |body: &Body, t: f64| {
        let pose = body.motion.pose(t);
        pose.linear * body.center + pose.position
    };
    let places = || stage.bodies.iter().flat_map(|body| times().map(move |t| center(body, t)));
    let low = places().fold(DVec3::INFINITY, DVec3::min);
    let high = places().fold(DVec3::NEG_INFINITY, DVec3::max);
    let target = 0.5 * (low + high);
    let reach = places().map(|p| p.distance(target)).fold(0.0, f64::max);
    let radius = stage.bodies.iter().map(|body| body.bound() - body.center.length()).fold(0.0, f64::max);
    let half = 1.1 * reach + 0.8 * radius;
    (stage, ring(target, (3.4 * half).max(3.6), half))
}
