//! Contact between bodies as the laws of each of them tell of it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, state};
use glam::{DMat3, DVec3};
use lgs_mechanics::contact::Impact;
use lgs_mechanics::coordinates::{Coordinates, Inertia, Port, State};
use lgs_mechanics::mutual_contact::{
    Moving, MutualContact, RoundBody, SeenBody, SurfaceGaussian, mutual_contact,
};
use lgs_mechanics::{Edit, Law};

/// Gaussians of a sphere.
fn sphere(center: [f64; 3], radius: f64) -> Vec<SurfaceGaussian> {
    let point = |k: usize| {
        let (z, turn) = (1.0 - (2 * k + 1) as f64 / 200.0, 2.4 * k as f64);
        let across = f64::sqrt(1.0 - z * z);
        let outward = DVec3::new(across * turn.cos(), across * turn.sin(), z);
        SurfaceGaussian { mean: DVec3::from(center) + radius * outward, covariance: DMat3::ZERO }
    };
    (0..200).map(point).collect()
}

struct Balls {
    laws: Vec<Law>,
    starts: Vec<State>,
    gaussians: Vec<Vec<SurfaceGaussian>>,
    contact: MutualContact,
}

/// Three balls, turning ones that fall and slide past each other: the first hits the second, and that the
/// third.
fn balls(restitution: f64, friction: f64) -> Balls {
    let radii = [0.2, 0.3, 0.25];
    let masses = [1.0, 2.5, 0.7];
    let centers = [[0.0, 0.0, 0.0], [0.8, 0.1, 0.05], [1.7, 0.0, 0.0]];
    let velocities = [[2.0, 0.0, 0.2], [0.0, 0.0, 0.2], [0.0, 0.0, 0.2]];
    let weight: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Center, &[0.0, 0.0, -0.4])];
    let body = |i: usize| {
        let inertia = Inertia::ball(0.4 * radii[i] * radii[i]);
        let x = [&[1.0, 0.0, 0.0, 0.0], &centers[i][..]].concat();
        let v = [&[0.0, 3.0, 0.0], &velocities[i][..]].concat();
        (law(Coordinates::Rigid(inertia), &[], &weight), state(&x, &v))
    };
    let (laws, starts): (Vec<Law>, Vec<State>) = (0..3).map(body).unzip();
    let round =
        |i: usize| RoundBody { center: centers[i], radius: radii[i], mass: masses[i], hits: Vec::new() };
    let contact =
        MutualContact { bodies: (0..3).map(round).collect(), restitution, friction, deviations: [0.0; 2] };
    // Gaussians lie below the surface.
    let gaussians = (0..3).map(|i| sphere(centers[i], 0.93 * radii[i])).collect();
    Balls { laws, starts, gaussians, contact }
}

impl Balls {
    fn events(&self, contact: &MutualContact, edit: Edit) -> Vec<Vec<Impact>> {
        let moving = |(law, start)| Moving { law, start, edit };
        let motions: Vec<Moving<'_>> = self.laws.iter().zip(&self.starts).map(moving).collect();
        contact.events(&motions, [0.0, 1.0]).unwrap()
    }

    /// The laws with the hits of the contact, each event changed by a function.
    fn seen(&self, change: impl Fn(usize, Impact) -> Impact) -> Vec<Law> {
        let events = self.events(&self.contact, Edit::NONE).into_iter().enumerate();
        let changed = events.map(|(body, events)| events.into_iter().map(|e| change(body, e)).collect());
        let with = |(law, events): (&Law, Vec<Impact>)| Law { events, ..law.clone() };
        self.laws.iter().zip(changed).map(with).collect()
    }

    fn bodies<'a>(&'a self, laws: &'a [Law]) -> Vec<SeenBody<'a>> {
        let body =
            |i: usize| SeenBody { law: &laws[i], start: &self.starts[i], gaussians: &self.gaussians[i] };
        (0..3).map(body).collect()
    }
}

#[test]
fn restitution_friction_masses_and_radii_are_those_of_the_hits() {
    let balls = balls(0.7, 0.15);
    let laws = balls.seen(|_, event| event);
    assert_eq!(laws.iter().map(|law| law.events.len()).collect::<Vec<_>>(), [1, 2, 1], "two hits");
    let found = mutual_contact(&balls.bodies(&laws), 1.0, 0.02).unwrap();
    assert!(found.follows_laws() && found.error < 1e-3, "{found:?}");
    let MutualContact { bodies, restitution, friction, .. } = &found.contact;
    assert!((restitution - 0.7).abs() < 0.01 && (friction - 0.15).abs() < 0.02, "{found:?}");
    for (body, truth) in bodies.iter().zip(&balls.contact.bodies) {
        assert!((body.mass / truth.mass - 1.0).abs() < 0.02, "{found:?}");
    }
    let reach = |bodies: &[RoundBody]| bodies[0].radius + bodies[1].radius;
    assert!((reach(bodies) - reach(&balls.contact.bodies)).abs() < 2e-3, "{found:?}");
    // Twice as fast, the same hits come sooner and are harder.
    let edit = Edit { velocity: 1.5, ..Edit::NONE };
    let [truth, forecast] = [&balls.contact, &found.contact].map(|contact| balls.events(contact, edit));
    let [truth, forecast] = [truth, forecast].map(|events| events[2][0].clone());
    assert!((truth.time - forecast.time).abs() < 5e-3, "{truth:?} {forecast:?}");
}

#[test]
fn errors_of_the_impulses_are_errors_of_the_contact() {
    let balls = balls(0.8, 0.0);
    let laws = balls.seen(|body, mut event| {
        event.time += 0.004 * (body as f64 - 1.0);
        event.change.iter_mut().skip(3).for_each(|v| *v *= 1.02);
        event
    });
    let found = mutual_contact(&balls.bodies(&laws), 1.0, 0.02).unwrap();
    let [deviation, _] = found.contact.deviations;
    let error = (found.contact.restitution - 0.8).abs();
    assert!(found.follows_laws() && error < 0.06 && deviation > 0.1 * error, "{found:?}");
}

#[test]
fn bodies_that_are_pushed_at_one_time_have_not_hit_each_other() {
    let balls = balls(0.8, 0.0);
    let sideways = balls.seen(|_, mut event| {
        event.change.iter_mut().skip(3).zip([0.0, 0.9, 0.4]).for_each(|(v, push)| *v = push);
        event
    });
    assert!(mutual_contact(&balls.bodies(&sideways), 1.0, 0.02).is_none());
    let at_other_times = balls.seen(|body, mut event| {
        event.time += 0.1 * body as f64;
        event
    });
    assert!(mutual_contact(&balls.bodies(&at_other_times), 1.0, 0.02).is_none());
}
