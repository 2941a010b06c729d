//! Colours that turn with a body: its harmonics hold how it looks from each side, which its motion takes
//! along.

use std::ops::Range;

use glam::DQuat;
use lgs_core::geometry::{components, nearest_rotation};
use lgs_mechanics::coordinates::Bodies;

use super::{LagrangianScene, ObjectModel, SceneState};

impl ObjectModel {
    /// The rows of each of its rigid bodies among the scene's dynamic Gaussians: those of its law, in the
    /// order of its coordinates, or all.
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
    /// The bodies whose harmonics turn with them, by their ascending rows among the dynamic Gaussians, and
    /// the rotation of each since t = 0, a quaternion w x y z; none where colours look the same from all
    /// sides.
    #[must_use]
    pub fn turned_bodies(&self, state: &SceneState) -> Vec<(Range<usize>, [f32; 4])> {
        if self.dynamic_gaussians.sh_degree == 0 {
            return Vec::new();
        }
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
        let mut turned: Vec<_> = bodies.map(|(rows, deforms)| turn(rows, deforms)).collect();
        turned.sort_by_key(|(rows, _)| rows.start);
        turned
    }
}

#[cfg(test)]
mod tests {
    use lgs_core::{GaussianCloud, TurnedHarmonics};
    use lgs_dynamics::{Edit, Reversal};
    use lgs_mechanics::Law;
    use lgs_mechanics::bands::Known;
    use lgs_mechanics::coordinates::{Coordinates, Hinge, State};

    use super::*;
    use crate::{Dynamics, GeneralisedDynamics, Motion, MotionConfig};

    /// A static Gaussian, and two that turn by one radian per unit of time about the vertical axis.
    fn turning() -> LagrangianScene {
        let cloud = |means: Vec<[f32; 3]>| {
            let mut cloud =
                GaussianCloud { sh_degree: 1, ..GaussianCloud::isotropic(means, 0.1, [0.5; 3], 0.9) };
            cloud.sh = (0..cloud.len() * 12).map(|i| ((i * 37) % 11) as f32 / 5.0 - 1.0).collect();
            cloud
        };
        let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] });
        let law = Law::new(hinge, Vec::new(), Vec::new(), 0.01).expect("a law");
        let start = State { x: vec![0.0], v: vec![1.0] };
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known: Known::default() };
        let config = MotionConfig { dt: 0.01, time_window: 1.0 };
        LagrangianScene {
            velocities: vec![[0.0; 3]; 2],
            objects: vec![ObjectModel {
                members: 0..2,
                dynamics: Dynamics::Generalised(dynamics),
                recording: None,
            }],
            dynamic_gaussians: cloud(vec![[0.3, 0.0, 0.0], [0.0, 0.4, 0.1]]),
            ..LagrangianScene::still(cloud(vec![[1.0; 3]]), config, [1.0; 3])
        }
    }

    #[test]
    fn colours_of_a_body_turn_with_it_and_those_of_what_is_still_do_not() {
        let scene = turning();
        let state = Motion::new(&scene, Edit::default(), Reversal::default()).state_at(0.5);
        let turn = [0.25_f32.cos(), 0.0, 0.0, 0.25_f32.sin()];
        let [(rows, found)] = &scene.turned_bodies(&state)[..] else { panic!("one body") };
        assert_eq!(*rows, 0..2);
        assert!(found.iter().zip(turn).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
        let drawn = scene.cloud_at(&state, 0.5);
        assert_eq!(drawn.sh[..12], scene.static_gaussians.sh);
        let mut expected = scene.dynamic_gaussians.clone();
        expected.turn_harmonics(0..2, turn);
        assert_ne!(expected.sh, scene.dynamic_gaussians.sh);
        let far = drawn.sh[12..].iter().zip(&expected.sh).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(far < 1e-5, "{far}");
        assert_eq!(TurnedHarmonics::new(turn, 0).matrix(), (0, &[][..]));
    }
}
