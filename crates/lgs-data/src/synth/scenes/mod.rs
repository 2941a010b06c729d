//! The catalogue of scenes: bodies, laws and cameras.
//!
//! Constants, starts, shapes, colours and axes are drawn from the seed within the ranges that each scene
//! states (`SceneInfo::drawn`); the seven scenes of `objects.rs` and `room.rs` keep the constants they have
//! always had for seed 0. Cameras are framed so that moving bodies stay in view over [−0.75, 2.25], which a
//! test checks.

mod entry;
mod everyday;
mod fields;
mod flows;
mod free_bodies;
mod hinges;
mod machines;
mod objects;
mod random;
mod room;
mod thrown;
mod unexplained;
mod walls;

pub use entry::SceneInfo;

use super::body::Stage;
use super::draws::Draws;
use super::view::Rig;
use entry::Entry;
use lgs_core::stream;
use rand::RngExt;
use std::f64::consts::TAU;

/// A scene ready to be photographed.
pub(super) struct Scene {
    pub(super) info: SceneInfo,
    pub(super) stage: Stage,
    pub(super) rig: Rig,
}

fn entries() -> impl Iterator<Item = &'static Entry> {
    let groups: [&[Entry]; 12] = [
        &objects::ENTRIES,
        &room::ENTRIES,
        &hinges::ENTRIES,
        &free_bodies::ENTRIES,
        &fields::ENTRIES,
        &everyday::ENTRIES,
        &thrown::ENTRIES,
        &flows::ENTRIES,
        &machines::ENTRIES,
        &walls::ENTRIES,
        &random::ENTRIES,
        &unexplained::ENTRIES,
    ];
    groups.into_iter().flatten()
}

/// All scenes.
#[must_use]
pub fn scenes() -> Vec<SceneInfo> {
    entries().map(|entry| entry.info).collect()
}

/// The scene of a name; the seed draws its constants and shifts its textures.
pub(super) fn scene(name: &str, seed: u64) -> Option<Scene> {
    let entry = entries().find(|entry| entry.info.name == name)?;
    let (mut stage, rig) = (entry.build)(&mut Draws::new(name, seed));
    let mut rng = stream(seed, "synthetic textures", 0);
    let parts = stage.bodies.iter_mut().flat_map(|body| &mut body.parts).chain(&mut stage.fixed);
    parts.for_each(|part| part.texture.phase = rng.random_range(0.0..TAU));
    Some(Scene { info: entry.info, stage, rig })
}
