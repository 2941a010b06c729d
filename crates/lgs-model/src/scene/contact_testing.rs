//! A scene of balls that hit each other, for tests.

use lgs_core::GaussianCloud;
use lgs_mechanics::Law;
use lgs_mechanics::bands::Known;
use lgs_mechanics::contact::Impact;
use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
use lgs_mechanics::mutual_contact::{MutualContact, RoundBody};

use super::{Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ObjectContact, ObjectModel};

/// Three balls in a row, of which the first comes to hit the second at t = 0.4, and that the third at
/// t = 1.4, after the window.
pub(super) fn row() -> LagrangianScene {
    let places = [0.0, 1.0, 2.6];
    let ball = |(index, x): (usize, f64)| {
        let mut law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law");
        let hit = |change: f64| vec![Impact { time: 0.4, change: vec![change, 0.0, 0.0] }];
        law.impulses = vec![hit(-1.0), hit(1.0), Vec::new()].swap_remove(index);
        let speed = if index == 0 { 1.0 } else { 0.0 };
        let start = State { x: vec![x, 0.0, 0.0], v: vec![speed, 0.0, 0.0] };
        let (bodies, known) = (Bodies::default(), Known::default());
        let dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
        ObjectModel { members: index..index + 1, dynamics, recording: None }
    };
    let body = |(index, x): (usize, f64)| {
        let hits = if index < 2 { vec![0] } else { Vec::new() };
        RoundBody { center: [x, 0.0, 0.0], radius: 0.3, mass: 1.0, hits }
    };
    let contact = MutualContact {
        bodies: places.into_iter().enumerate().map(body).collect(),
        restitution: 1.0,
        friction: 0.0,
        deviations: [0.0; 2],
    };
    let objects = vec![0, 1, 2];
    let contact = ObjectContact { objects, contact, drawn: Vec::new(), replays_window: true };
    let means = places.map(|x| [x as f32, 0.0, 0.0]).to_vec();
    LagrangianScene {
        velocities: vec![[0.0; 3]; means.len()],
        dynamic_gaussians: GaussianCloud::isotropic(means, 0.1, [0.5; 3], 0.9),
        objects: places.into_iter().enumerate().map(ball).collect(),
        contact: Some(contact),
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.05, time_window: 1.0 },
            [1.0; 3],
        )
    }
}
