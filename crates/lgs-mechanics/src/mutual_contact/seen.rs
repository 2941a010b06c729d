//! Hits in the laws of bodies that something struck: sudden changes of two velocities at one time, opposite
//! to each other and along the line of the centres of two spheres that touch.

use super::RoundBody;
use super::hit::Struck;
use super::sphere::{SurfaceGaussian, sphere};
use super::thresholds::{MOST_ACROSS, MOST_APART};
use crate::contact::Impact;
use crate::coordinates::{Embedding, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::system::System;
use crate::thresholds::SAME_HIT;
use glam::DVec3;

/// A body, and the law that it has been found to follow.
#[derive(Clone, Copy, Debug)]
pub struct SeenBody<'a> {
    /// Its law with the impulses that it was seen to get.
    pub law: &'a Law,
    /// Configuration and velocity at t = 0.
    pub start: &'a State,
    /// Its opaque Gaussians at t = 0.
    pub gaussians: &'a [SurfaceGaussian],
}

/// A hit of two bodies as their laws have it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenHit {
    /// The bodies.
    pub(super) pair: [usize; 2],
    /// The impulse of each.
    pub(super) events: [usize; 2],
    /// Distance of the centres, world units.
    pub(super) distance: f64,
    /// Mass of the second body over that of the first.
    pub(super) mass_ratio: f64,
    /// Speeds along the line of the centres, of approach and of parting.
    pub(super) approach: f64,
    pub(super) parting: f64,
    /// Impulse across that line over the one along it.
    pub(super) across: f64,
    /// How far apart the times of both events are.
    apart: f64,
}

/// A body in the moment of one of its events.
struct Moment<'a> {
    of: &'a SeenBody<'a>,
    /// The event's time, and the state after it.
    time: f64,
    state: State,
    change: &'a [f64],
    center: DVec3,
}

impl<'a> SeenBody<'a> {
    /// Its sphere, if it is round.
    pub(super) fn sphere(&self) -> Option<RoundBody> {
        let (center, radius) = sphere(self.gaussians)?;
        Some(RoundBody { center: center.to_array(), radius, mass: radius.powi(3), hits: Vec::new() })
    }

    fn moments(&'a self, sphere: &RoundBody) -> Vec<Moment<'a>> {
        let system = System::new(self.law, Edit::NONE);
        let embedding = Embedding::new(&self.law.coordinates, &self.start.x);
        let of_event = |event: &'a Impact| {
            let state = system.states(self.start, &[event.time]).ok()?.pop()?;
            let center = embedding.placements(&state.x)[0].apply(sphere.center.into());
            Some(Moment { of: self, time: event.time, state, change: &event.change, center })
        };
        self.law.impulses.iter().filter_map(of_event).collect()
    }
}

impl Moment<'_> {
    /// Velocities of the point at a place before and after the event, and its impulse there.
    fn read(&self, place: DVec3, normal: DVec3) -> Option<Read> {
        let SeenBody { law, start, .. } = self.of;
        let v = self.state.v.iter().zip(self.change).map(|(v, change)| v - change).collect();
        let before = State { x: self.state.x.clone(), v };
        let [before, after] =
            [&before, &self.state].map(|state| Struck::new(law, &start.x, state, (place, 1.0)));
        let (before, after) = (before?, after?);
        let middle = Struck::new(law, &start.x, &self.state, (self.center, 1.0))?;
        let impulse = before.impulse_of(self.change, &middle);
        let along = impulse.dot(normal);
        Some(Read { before: before.velocity, after: after.velocity, along, across: impulse - normal * along })
    }
}

/// What a body's event says about a hit.
struct Read {
    /// Velocity of the touching point before.
    before: DVec3,
    /// The same after.
    after: DVec3,
    /// Impulse along the normal, per mass of the body.
    along: f64,
    /// Impulse across it.
    across: DVec3,
}

/// The hits among some round bodies, each event in one at most.
pub(super) fn hits(bodies: &[SeenBody<'_>], spheres: &[RoundBody], interval: f64) -> Vec<SeenHit> {
    let moments: Vec<Vec<Moment<'_>>> =
        bodies.iter().zip(spheres).map(|(body, sphere)| body.moments(sphere)).collect();
    let mut found: Vec<SeenHit> = Vec::new();
    for first in 0..bodies.len() {
        for second in first + 1..bodies.len() {
            let reach = spheres[first].radius + spheres[second].radius;
            let share = spheres[first].radius / reach;
            for (i, one) in moments[first].iter().enumerate() {
                for (j, other) in moments[second].iter().enumerate() {
                    let hit = hit([one, other], (reach, share), interval);
                    found.extend(hit.map(|hit| SeenHit { pair: [first, second], events: [i, j], ..hit }));
                }
            }
        }
    }
    found.sort_by(|a, b| a.apart.total_cmp(&b.apart));
    let mut kept: Vec<SeenHit> = Vec::new();
    for hit in found {
        let uses = |other: &SeenHit, (body, event): (usize, usize)| {
            (0..2).any(|k| other.pair[k] == body && other.events[k] == event)
        };
        let is_free = |k: usize| !kept.iter().any(|other| uses(other, (hit.pair[k], hit.events[k])));
        if is_free(0) && is_free(1) {
            kept.push(hit);
        }
    }
    kept
}

/// What two events are if they are one hit.
fn hit([one, other]: [&Moment<'_>; 2], (reach, share): (f64, f64), interval: f64) -> Option<SeenHit> {
    let apart = (one.time - other.time).abs();
    let distance = one.center.distance(other.center);
    if apart > SAME_HIT * interval || (distance / reach - 1.0).abs() > MOST_APART {
        return None;
    }
    let normal = (other.center - one.center).try_normalize()?;
    let place = one.center.lerp(other.center, share);
    let (first, second) = (one.read(place, normal)?, other.read(place, normal)?);
    let approach = (first.before - second.before).dot(normal);
    let parting = (second.after - first.after).dot(normal);
    let is_push = first.along < 0.0 && second.along > 0.0 && approach > 0.0;
    let across = |read: &Read| read.across.length() / read.along.abs();
    if !is_push || across(&first).max(across(&second)) > MOST_ACROSS {
        return None;
    }
    Some(SeenHit {
        pair: [0; 2],
        events: [0; 2],
        distance,
        mass_ratio: -first.along / second.along,
        approach,
        parting,
        across: 0.5 * (across(&first) + across(&second)),
        apart,
    })
}
