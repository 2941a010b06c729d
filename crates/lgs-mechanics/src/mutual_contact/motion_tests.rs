//! Motions of bodies that hit each other.

use super::{Moving, MutualContact, RoundBody};
use crate::contact::Impact;
use crate::coordinates::{Coordinates, Port, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::system::System;
use crate::terms::Term;

fn still(radius: f64, mass: f64, center: [f64; 3]) -> RoundBody {
    RoundBody { center, radius, mass, hits: Vec::new() }
}

fn free() -> Law {
    Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law")
}

#[test]
fn a_ball_passes_its_speed_on_through_a_row() {
    let law = free();
    let places = [0.0, 1.0, 2.0];
    let contact = MutualContact {
        bodies: places.map(|x| still(0.3, 1.0, [x, 0.0, 0.0])).to_vec(),
        restitution: 1.0,
        friction: 0.0,
        deviations: [0.0; 2],
    };
    let speeds = [1.0, 0.0, 0.0];
    let starts: Vec<State> = places
        .iter()
        .zip(speeds)
        .map(|(&x, v)| State { x: vec![x, 0.0, 0.0], v: vec![v, 0.0, 0.0] })
        .collect();
    for scale in [1.0, 2.0] {
        let edit = Edit { velocity: scale, ..Edit::NONE };
        let motions: Vec<Moving<'_>> = starts.iter().map(|start| Moving { law: &law, start, edit }).collect();
        let events = contact.impulses(&motions, [0.0, 1.5]).expect("events");
        let times: Vec<Vec<f64>> =
            events.iter().map(|events| events.iter().map(|event| event.time).collect()).collect();
        let [first, second] = [0.4 / scale, 0.8 / scale];
        let near = |times: &[f64], expected: &[f64]| {
            times.len() == expected.len() && times.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-7)
        };
        assert!(near(&times[0], &[first]) && near(&times[1], &[first, second]), "{times:?}");
        assert!(near(&times[2], &[second]) && (events[2][0].change[0] - scale).abs() < 1e-9, "{events:?}");
    }
}

#[test]
fn a_hit_after_known_ones_is_as_hard_as_one_before() {
    let hit = |change: f64| vec![Impact { time: 0.4, change: vec![change, 0.0, 0.0] }];
    let laws = [hit(-1.0), hit(1.0), Vec::new()].map(|impulses| Law { impulses, ..free() });
    let places = [0.0, 1.0, 2.6];
    let body = |i: usize| {
        let hits = if i < 2 { vec![0] } else { Vec::new() };
        RoundBody { hits, ..still(0.3, 1.0, [places[i], 0.0, 0.0]) }
    };
    let bodies = (0..3).map(body).collect();
    let contact = MutualContact { bodies, restitution: 1.0, friction: 0.0, deviations: [0.0; 2] };
    let start = |i: usize| State { x: vec![places[i], 0.0, 0.0], v: vec![[1.0, 0.0, 0.0][i], 0.0, 0.0] };
    let starts = [0, 1, 2].map(start);
    let motion = |i: usize| Moving { law: &laws[i], start: &starts[i], edit: Edit::NONE };
    let motions = [0, 1, 2].map(motion);
    for until in [1.5, 2.0, 9.0, 25.6] {
        let events = contact.impulses(&motions, [1.0, until]).expect("events");
        let [first, second, third] = &events[..] else { panic!("three bodies") };
        assert!(first.len() == 1 && second.len() == 2 && third.len() == 1, "until {until}: {events:?}");
        assert!((third[0].time - 1.4).abs() < 1e-7, "until {until}: {events:?}");
        assert!((third[0].change[0] - 1.0).abs() < 1e-9, "until {until}: {events:?}");
    }
}

#[test]
fn a_ball_comes_to_lie_on_another_one() {
    let weight = Term::named("uniform-field", Port::Whole).expect("a term");
    let falling = Law::new(Coordinates::Point, vec![weight], vec![0.0, 0.0, -9.81], 0.01).expect("a law");
    let lying = free();
    let contact = MutualContact {
        bodies: vec![still(0.5, 1e6, [0.0; 3]), still(0.5, 1.0, [0.0, 0.0, 1.2])],
        restitution: 0.4,
        friction: 0.3,
        deviations: [0.0; 2],
    };
    let at = |z: f64| State { x: vec![0.0, 0.0, z], v: vec![0.0; 3] };
    let starts = [at(0.0), at(1.2)];
    let motions = [(&lying, &starts[0]), (&falling, &starts[1])].map(|(law, start)| Moving {
        law,
        start,
        edit: Edit::NONE,
    });
    let events = contact.impulses(&motions, [0.0, 3.0]).expect("events").remove(1);
    let law = Law { impulses: events, ..falling.clone() };
    let times: Vec<f64> = (0..30).map(|k| 0.1 * f64::from(k)).collect();
    let states = System::new(&law, Edit::NONE).states(&starts[1], &times).expect("states");
    assert!(states.iter().all(|state| state.x[2] > 0.95), "{states:?}");
    assert!((states[29].x[2] - 1.0).abs() < 0.05 && states[29].v[2].abs() < 0.5, "{:?}", states[29]);
}

#[test]
fn hits_up_to_a_time_are_those_of_the_law() {
    let struck = Impact { time: 0.25, change: vec![0.0, 0.5, 0.0] };
    let mut law = free();
    law.impulses = vec![Impact { time: 0.1, change: vec![0.0; 3] }, struck.clone()];
    let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
    let far = State { x: vec![9.0, 0.0, 0.0], v: vec![0.0; 3] };
    let other = free();
    let mut bodies = vec![still(0.3, 1.0, [0.0; 3]), still(0.3, 1.0, [9.0, 0.0, 0.0])];
    bodies[0].hits = vec![1];
    let contact = MutualContact { bodies, restitution: 1.0, friction: 0.0, deviations: [0.0; 2] };
    let motions =
        [(&law, &start), (&other, &far)].map(|(law, start)| Moving { law, start, edit: Edit::NONE });
    let events = |since: f64| contact.impulses(&motions, [since, 1.0]).expect("events").remove(0);
    assert_eq!(events(0.5), law.impulses, "known ones stay");
    assert_eq!(events(0.0), law.impulses[..1], "a hit that does not happen is gone, the push stays");
}
