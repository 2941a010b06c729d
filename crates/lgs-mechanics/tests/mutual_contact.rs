//! Contact between bodies as the laws of each of them tell of it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, state};
use glam::{DMat3, DVec3};
use lgs_mechanics::bands::{DrawnLaws, PosteriorLaws, StartedLaw};
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
    fn impulses(&self, contact: &MutualContact, edit: Edit) -> Vec<Vec<Impact>> {
        let moving = |(law, start)| Moving { law, start, edit };
        let motions: Vec<Moving<'_>> = self.laws.iter().zip(&self.starts).map(moving).collect();
        contact.impulses(&motions, [0.0, 1.0]).unwrap()
    }

    /// The laws with the hits of the contact, each event changed by a function.
    fn seen(&self, change: impl Fn(usize, Impact) -> Impact) -> Vec<Law> {
        let events = self.impulses(&self.contact, Edit::NONE).into_iter().enumerate();
        let changed = events.map(|(body, events)| events.into_iter().map(|e| change(body, e)).collect());
        let with = |(law, impulses): (&Law, Vec<Impact>)| Law { impulses, ..law.clone() };
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
    assert_eq!(laws.iter().map(|law| law.impulses.len()).collect::<Vec<_>>(), [1, 2, 1], "two hits");
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
    let [truth, forecast] = [&balls.contact, &found.contact].map(|contact| balls.impulses(contact, edit));
    let [truth, forecast] = [truth, forecast].map(|events| events[2][0].clone());
    assert!((truth.time - forecast.time).abs() < 5e-3, "{truth:?} {forecast:?}");
}

#[test]
fn gaussians_that_do_not_cover_a_ball_evenly_leave_its_centre_where_the_hits_have_it() {
    let mut balls = balls(0.9, 0.0);
    for (gaussians, by) in balls.gaussians.iter_mut().zip([0.012, -0.008, 0.01]) {
        gaussians.iter_mut().for_each(|gaussian| gaussian.mean += DVec3::Y * by);
    }
    let laws = balls.seen(|_, event| event);
    let found = mutual_contact(&balls.bodies(&laws), 1.0, 0.02).unwrap();
    assert!(found.error < 2e-3, "{found:?}");
    let edit = Edit { velocity: 0.6, ..Edit::NONE };
    let [truth, forecast] = [&balls.contact, &found.contact].map(|contact| balls.impulses(contact, edit));
    let change = |events: &[Vec<Impact>]| DVec3::from_slice(&events[1][0].change[3..]);
    let apart = (change(&truth) - change(&forecast)).length() / change(&truth).length();
    assert!(apart < 0.02, "{apart}");
}

#[test]
fn contacts_are_drawn_as_widely_as_the_hits_leave_them_open() {
    let balls = balls(0.7, 0.15);
    let laws = balls.seen(|_, event| event);
    let found = mutual_contact(&balls.bodies(&laws), 1.0, 0.02).unwrap();
    let [deviation, _] = found.contact.deviations;
    let squares = found.drawn.iter().map(|drawn| (drawn.restitution - found.contact.restitution).powi(2));
    let drawn = (squares.sum::<f64>() / found.drawn.len() as f64).sqrt();
    assert!((0.6..1.6).contains(&(drawn / deviation)), "{drawn}, not {deviation}");
    assert!(found.drawn.iter().all(|drawn| drawn.check().is_ok() && found.contact.has_hits_of(drawn)));
}

/// A ball on a line, with draws of its velocity.
fn drawn_ball(x: f64, velocity: f64, drawn: &[f64]) -> PosteriorLaws {
    let started = |velocity: f64| StartedLaw {
        law: law(Coordinates::Point, &[], &[]),
        start: state(&[x, 0.0, 0.0], &[velocity, 0.0, 0.0]),
    };
    let drawn = drawn.iter().map(|&velocity| started(velocity)).collect();
    let laws = vec![DrawnLaws { middle: started(velocity), order: vec![0], part: 1.0, drawn }];
    PosteriorLaws { laws, window: 1.0, path: 1.0, radius: 1e-3 }
}

#[test]
fn each_draw_of_all_bodies_has_the_hits_that_follow_from_it() {
    let round =
        |x: f64, radius: f64| RoundBody { center: [x, 0.0, 0.0], radius, mass: 1.0, hits: Vec::new() };
    let contact = |radius: f64| MutualContact {
        bodies: vec![round(0.0, radius), round(1.0, 0.3)],
        restitution: 1.0,
        friction: 0.0,
        deviations: [0.0; 2],
    };
    let (first, second) = (drawn_ball(0.0, 1.0, &[0.8, 1.25]), drawn_ball(1.0, 0.0, &[0.0]));
    let bodies = [(&first, Edit::NONE), (&second, Edit::NONE)];
    let drawn = [contact(0.3), contact(0.2)];
    let struck = contact(0.3).with_hits(&drawn, &bodies, [0.0, 2.0]).unwrap();
    let times = |body: usize| -> Vec<f64> {
        let DrawnLaws { middle, drawn, .. } = &struck[body].laws[0];
        std::iter::once(middle).chain(drawn).map(|one| one.law.impulses[0].time).collect()
    };
    for (found, expected) in times(0).iter().zip(times(1)).zip([0.4, 0.4 / 0.8, 0.5 / 1.25]) {
        assert!((found.0 - expected).abs() < 1e-6 && (found.1 - expected).abs() < 1e-6, "{found:?}");
    }
    assert!(contact(0.3).with_hits(&[], &bodies, [0.0, 2.0]).is_none(), "no draws");
    let mut in_part = first.clone();
    in_part.laws[0].part = 0.01;
    assert!(contact(0.3).with_hits(&drawn, &[(&in_part, Edit::NONE), bodies[1]], [0.0, 2.0]).is_none());
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
