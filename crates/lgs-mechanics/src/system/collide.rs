//! Motion with collisions.

use crate::contact::{Body, Contact, Impact, Touch, carrying, solve};
use crate::coordinates::State;
use crate::integrate::{self, NoSolution, Solved, Stepper};
use crate::law::Law;
use crate::thresholds::{CONTACT_PARTS, HALVINGS, LIFT, MOST_IMPACTS, TOUCHING};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{exp, quaternion};
use std::cell::Cell;

/// Collisions along a motion, and those met so far.
#[derive(Debug)]
pub(crate) struct Collider<'a> {
    contact: &'a Contact,
    /// Impacts known from the track, for the way back.
    known: &'a [Impact],
    /// Inverse of the inertia, body axes; none for a point.
    inverse: Option<DMat3>,
    /// Largest distance of the surface from the centre.
    extent: f64,
    /// Impacts met, in order.
    pub(crate) met: Vec<Impact>,
    /// Free motions followed near the plane so far, by which impacts are found and slow contacts closed.
    followed: Cell<usize>,
}

/// A state and its time.
#[derive(Clone, Debug)]
pub(crate) struct Moment {
    pub(crate) state: State,
    pub(crate) time: f64,
}

impl<'a> Collider<'a> {
    /// Collisions of a law that has a contact.
    pub(crate) fn new(law: &'a Law) -> Option<Self> {
        let inverse = law.coordinates.inertia().map(|inertia| inertia.inverse_tensor(&law.parameters));
        let contact = law.contact.as_ref()?;
        let (known, extent) = (&law.impacts, contact.extent());
        Some(Self { contact, known, inverse, extent, met: Vec::new(), followed: Cell::new(0) })
    }

    /// Advances by a step that may be negative.
    pub(crate) fn advance(&mut self, stepper: &mut dyn Stepper, at: &mut Moment, h: f64) -> Solved {
        if h < 0.0 {
            return self.back(stepper, at, h);
        }
        if self.gap(&at.state) > self.reach(&at.state, h) {
            integrate::advance(stepper, &mut at.state, h)?;
            at.time += h;
            return Ok(());
        }
        (0..CONTACT_PARTS).try_for_each(|_| self.part(stepper, at, h / CONTACT_PARTS as f64))
    }

    /// Free motion backward to the last known impact, whose change is taken back, and on; a motion that would
    /// come out of the plane is not determined.
    fn back(&self, stepper: &mut dyn Stepper, at: &mut Moment, h: f64) -> Solved {
        let target = at.time + h;
        let depth = self.gap(&at.state).min(0.0) - TOUCHING * self.extent;
        let passed = |impact: &&Impact| impact.time < at.time && impact.time >= target;
        if let Some(impact) = self.known.iter().rev().find(passed) {
            integrate::advance(stepper, &mut at.state, impact.time - at.time)?;
            at.state.v.iter_mut().zip(&impact.change).for_each(|(v, change)| *v -= change);
            at.time = impact.time;
            return self.back(stepper, at, target - impact.time);
        }
        integrate::advance(stepper, &mut at.state, target - at.time)?;
        at.time = target;
        if self.gap(&at.state) < depth { Err(NoSolution) } else { Ok(()) }
    }

    fn body(&self, state: &State) -> Body {
        Body::new(state, self.inverse)
    }

    fn gap(&self, state: &State) -> f64 {
        self.body(state).gap(self.contact)
    }

    /// Twice the way that a point of the surface can move in a step.
    fn reach(&self, state: &State, h: f64) -> f64 {
        let turns = state.v.len() - 3;
        let speed = DVec3::from_slice(&state.v[turns..]).length();
        let spin = if turns == 3 { DVec3::from_slice(&state.v).length() } else { 0.0 };
        2.0 * h * (speed + spin * self.extent + self.contact.resting_speed)
    }

    /// A part of a step near the plane.
    fn part(&mut self, stepper: &mut dyn Stepper, at: &mut Moment, h: f64) -> Solved {
        let mut left = h;
        for _ in 0..MOST_IMPACTS {
            let free = self.moved(stepper, at, left)?;
            if self.gap(&free.state) >= 0.0 {
                *at = free;
                return Ok(());
            }
            let touching = self.first_touch(stepper, at, left)?;
            if self.approach(&touching.state) <= self.contact.resting_speed {
                break;
            }
            left -= touching.time - at.time;
            *at = touching;
            self.collide(at);
        }
        self.rest(stepper, at, left)
    }

    /// The last moment before a point is below the plane; the present one if one touches already.
    fn first_touch(&self, stepper: &mut dyn Stepper, at: &Moment, h: f64) -> Solved<Moment> {
        let mut best = at.clone();
        if self.gap(&at.state) <= 0.0 {
            return Ok(best);
        }
        let (mut low, mut high) = (0.0, h);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let found = self.moved(stepper, at, middle)?;
            if self.gap(&found.state) > 0.0 {
                (low, best) = (middle, found);
            } else {
                high = middle;
            }
        }
        Ok(best)
    }

    /// The points that touch, and their velocities along the normals of the planes.
    fn touching(&self, body: &Body) -> Vec<(Touch, f64)> {
        let near = TOUCHING * self.extent;
        let touches = body.touches(self.contact, near).into_iter();
        touches.map(|touch| (touch, body.velocity_along(&touch))).collect()
    }

    /// Fastest approach of a point to the plane that it touches.
    fn approach(&self, state: &State) -> f64 {
        self.touching(&self.body(state)).iter().fold(0.0, |most, (_, along)| most.max(-along))
    }

    /// An impact of all points that touch.
    fn collide(&mut self, at: &mut Moment) {
        let mut body = self.body(&at.state);
        let resting = self.contact.resting_speed;
        let bounce = |(mut touch, along): (Touch, f64)| {
            touch.least = if along < -resting { -self.contact.restitution * along } else { 0.0 };
            touch
        };
        let mut touches: Vec<Touch> = self.touching(&body).into_iter().map(bounce).collect();
        solve(&mut body, &mut touches, self.contact);
        let before = at.state.v.clone();
        body.write(&mut at.state);
        let change = at.state.v.iter().zip(&before).map(|(after, before)| after - before).collect();
        self.met.push(Impact { time: at.time, change });
    }

    /// A part of a step in which slow contacts stay closed: impulses against what the free motion would do,
    /// then positions with the velocities that are left.
    fn rest(&self, stepper: &mut dyn Stepper, at: &mut Moment, h: f64) -> Solved {
        let free = self.moved(stepper, at, h)?;
        let before = self.body(&at.state);
        let mut body = before.with_velocities(&self.body(&free.state));
        let hold = |mut touch: Touch| {
            let along = before.velocity_along(&touch);
            let give = if touch.gap > 0.0 { touch.gap } else { LIFT * touch.gap };
            let fast = along < -self.contact.resting_speed;
            touch.least = if fast { -self.contact.restitution * along } else { -give / h };
            touch
        };
        let reach = h * body.fastest(self.extent);
        let after = |touch: &Touch| touch.gap + h * body.velocity_along(touch);
        let closing = before.touches(self.contact, reach).into_iter().filter(|touch| after(touch) < 0.0);
        let carrying = carrying(&closing.collect::<Vec<_>>(), after);
        let mut touches: Vec<Touch> = carrying.into_iter().map(hold).collect();
        solve(&mut body, &mut touches, self.contact);
        let turns = at.state.v.len() - 3;
        if turns == 3 {
            let rotation = (exp(body.spin() * h) * quaternion(&at.state.x)).normalize();
            at.state.x[..4].copy_from_slice(&[rotation.w, rotation.x, rotation.y, rotation.z]);
        }
        let places = at.state.x.len() - 3;
        at.state.x[places..].iter_mut().zip(body.velocity().to_array()).for_each(|(x, v)| *x += h * v);
        self.body(&at.state).with_velocities(&body).write(&mut at.state);
        at.time = free.time;
        Ok(())
    }

    /// Free motion near the plane.
    fn moved(&self, stepper: &mut dyn Stepper, at: &Moment, h: f64) -> Solved<Moment> {
        self.followed.set(self.followed.get() + 1);
        let mut moved = at.clone();
        integrate::advance(stepper, &mut moved.state, h)?;
        moved.time += h;
        Ok(moved)
    }

    /// Free motions that were followed near the plane.
    pub(crate) fn followed(&self) -> usize {
        self.followed.get()
    }
}
