//! Colours that turn with a body: its harmonics hold how it looks from each side, which its motion takes
//! along.

use std::ops::Range;

use glam::DQuat;
use lgs_core::geometry::{components, nearest_rotation};
use lgs_mechanics::coordinates::Bodies;

use super::{LagrangianScene, ObjectModel, SceneState};

impl ObjectModel {
    /// The rows of each of its rigid bodies among the scene's dynamic Gaussians: those of its law, or all.
    #[must_use]
    pub fn bodies(&self) -> Vec<Range<usize>> {
        let Range { start, end } = self.members;
        let ranges = match self.dynamics.generalised() {
            Some(generalised) if self.recording.is_none() => generalised.bodies.ranges(end - start),
            _ => Bodies::default().ranges(end - start),
        };
        ranges.into_iter().map(|rows| start + rows.start..start + rows.end).collect()
    }

    /// Whether its harmonics turn with it: it follows a law of bodies. Particles and recorded motions keep
    /// those of their source, which are fixed in the world.
    fn turns_harmonics(&self) -> bool {
        self.recording.is_none() && self.dynamics.generalised().is_some()
    }
}

impl LagrangianScene {
    /// The bodies whose harmonics turn with them, by their rows among the dynamic Gaussians, and the
    /// rotation of each since t = 0, a quaternion w x y z.
    #[must_use]
    pub fn turned_bodies(&self, state: &SceneState) -> Vec<(Range<usize>, [f32; 4])> {
        let turn = |rows: Range<usize>, deforms: bool| {
            let turn = if deforms {
                let linear = nearest_rotation(&self.linear_map(&rows, state));
                components(DQuat::from_mat3(&linear)).map(|c| c as f32)
            } else {
                state.rotation.get(rows.start).copied().unwrap_or([1.0, 0.0, 0.0, 0.0])
            };
            (rows, turn)
        };
        let objects = self.objects.iter().filter(|object| object.turns_harmonics());
        let bodies = objects.flat_map(|o| o.bodies().into_iter().map(move |rows| (rows, o.deforms())));
        bodies.map(|(rows, deforms)| turn(rows, deforms)).collect()
    }
}
