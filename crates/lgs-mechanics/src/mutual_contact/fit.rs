//! Contact between bodies from the laws of each of them.

use super::seen::{SeenBody, SeenHit, hits};
use super::thresholds::{COMPARED, DRAWN_CONTACTS, MASS_PRIOR, MOST_FRICTION, PLACE_ERROR, RADIUS_PRIOR};
use super::{Moving, MutualContact, RoundBody};
use crate::bands::changes;
use crate::coordinates::Embedding;
use crate::edit::Edit;
use crate::fit::{Minimum, Problem, Settings, Unknown, covariance_of, minimise};
use crate::law::Law;
use crate::system::System;
use crate::thresholds::TRUSTED_FRACTION;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// A contact as the laws of bodies tell of it.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenContact {
    /// Which of the bodies were seen to hit each other.
    pub bodies: Vec<usize>,
    /// Their contact.
    pub contact: MutualContact,
    /// Contacts drawn from what the laws tell of it.
    pub drawn: Vec<MutualContact>,
    /// Farthest that a body gets in the window, by hits as the contact has them, from where its own law has
    /// it, over the length of the longest path.
    pub error: f64,
}

impl SeenContact {
    /// Whether the contact follows the laws of its bodies through the window.
    #[must_use]
    pub fn follows_laws(&self) -> bool {
        self.error <= TRUSTED_FRACTION
    }
}

/// The contact of those among some bodies that were seen to hit each other in a window; `None` where no two
/// did. `interval` is the time between two samples.
#[must_use]
pub fn mutual_contact(bodies: &[SeenBody<'_>], window: f64, interval: f64) -> Option<SeenContact> {
    let is_able = |body: &SeenBody<'_>| body.law.coordinates.bodies() == 1;
    let rounds = bodies.iter().enumerate().filter(|(_, body)| is_able(body));
    let rounds = rounds.filter_map(|(index, body)| Some((index, body.sphere()?)));
    let (mut places, mut spheres): (Vec<usize>, Vec<RoundBody>) = rounds.unzip();
    let of = |places: &[usize]| places.iter().map(|&i| bodies[i]).collect::<Vec<_>>();
    let is_hit = |hits: &[SeenHit], body: usize| hits.iter().any(|hit| hit.pair.contains(&body));
    let seen = hits(&of(&places), &spheres, interval);
    let hit: Vec<bool> = (0..places.len()).map(|body| is_hit(&seen, body)).collect();
    let mut keep = hit.iter();
    places.retain(|_| keep.next().is_some_and(|hit| *hit));
    let mut keep = hit.iter();
    spheres.retain(|_| keep.next().is_some_and(|hit| *hit));
    let bodies = of(&places);
    let seen = hits(&bodies, &spheres, interval);
    let first = first_values(spheres, &seen)?;
    Fit::new(&bodies, first, window)?.solve(places)
}

/// The contact as single hits tell of it.
fn first_values(mut spheres: Vec<RoundBody>, hits: &[SeenHit]) -> Option<MutualContact> {
    if hits.is_empty() {
        return None;
    }
    let sum = |value: &dyn Fn(&SeenHit) -> f64| hits.iter().map(value).sum::<f64>();
    let reach = |hit: &SeenHit| spheres[hit.pair[0]].radius + spheres[hit.pair[1]].radius;
    // Gaussians lie a little below the surface that they draw.
    let scale = sum(&|hit| hit.distance) / sum(&reach);
    let masses = masses(&spheres, hits)?;
    for (body, (sphere, mass)) in spheres.iter_mut().zip(masses).enumerate() {
        sphere.radius *= scale;
        sphere.mass = mass;
        let of_body = |hit: &SeenHit| (0..2).find(|&k| hit.pair[k] == body).map(|k| hit.events[k]);
        sphere.hits = hits.iter().filter_map(of_body).collect();
        sphere.hits.sort_unstable();
    }
    let restitution = sum(&|hit| hit.parting * hit.approach) / sum(&|hit| hit.approach.powi(2));
    let friction = sum(&|hit| hit.across) / hits.len() as f64;
    Some(MutualContact {
        bodies: spheres,
        restitution: restitution.clamp(0.0, 1.0),
        friction,
        deviations: [0.0; 2],
    })
}

/// Masses over that of the first body: their ratios are those of the hits, and where these do not tell, those
/// of the volumes.
fn masses(spheres: &[RoundBody], hits: &[SeenHit]) -> Option<Vec<f64>> {
    let count = spheres.len();
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    for (i, sphere) in spheres.iter().enumerate() {
        matrix[(i, i)] += MASS_PRIOR.powi(-2) * 1e-3;
        right[i] += MASS_PRIOR.powi(-2) * 1e-3 * sphere.mass.ln();
    }
    for hit in hits {
        let [a, b] = hit.pair;
        for (row, sign) in [(a, -1.0), (b, 1.0)] {
            matrix[(row, a)] -= sign;
            matrix[(row, b)] += sign;
            right[row] += sign * hit.mass_ratio.ln();
        }
    }
    let logarithms = matrix.cholesky()?.solve(&right);
    Some(logarithms.iter().map(|log| (log - logarithms[0]).exp()).collect())
}

/// A contact whose motion is to be that of the laws. Unknowns are the logarithms of the masses but the first,
/// all radii, all centres (Gaussians do not cover a ball evenly), restitution and friction.
struct Fit<'a> {
    bodies: &'a [SeenBody<'a>],
    first: MutualContact,
    times: Vec<f64>,
    /// Centres of the bodies at these times.
    seen: Vec<Vec<DVec3>>,
    /// Length that counts as one.
    error: f64,
    /// Length of the longest path.
    path: f64,
    unknowns: Vec<Unknown>,
}

impl<'a> Fit<'a> {
    fn new(bodies: &'a [SeenBody<'a>], first: MutualContact, window: f64) -> Option<Self> {
        let times: Vec<f64> = (1..=COMPARED).map(|k| window * k as f64 / COMPARED as f64).collect();
        let own = |(body, round): (&SeenBody<'_>, &RoundBody)| centers(body, body.law, round, &times);
        let seen = bodies.iter().zip(&first.bodies).map(own).collect::<Option<Vec<_>>>()?;
        let length = |path: &Vec<DVec3>| path.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
        let path = seen.iter().map(length).fold(0.0, f64::max);
        let radii = first.bodies.iter().map(|body| body.radius);
        let error = PLACE_ERROR * radii.clone().fold(f64::INFINITY, f64::min);
        let log = Unknown { scale: MASS_PRIOR, lower: -20.0, upper: 20.0 };
        let mut unknowns = vec![log; bodies.len() - 1];
        let radius = |r: f64| Unknown { scale: RADIUS_PRIOR * r, lower: 0.5 * r, upper: 2.0 * r };
        unknowns.extend(radii.clone().map(radius));
        let place = |r: f64, x: f64| Unknown { scale: RADIUS_PRIOR * r, lower: x - r, upper: x + r };
        unknowns.extend(first.bodies.iter().flat_map(|body| body.center.map(|x| place(body.radius, x))));
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: 1.0 });
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: MOST_FRICTION });
        Some(Self { bodies, first, times, seen, error, path, unknowns })
    }

    fn values(&self) -> Vec<f64> {
        let MutualContact { bodies, restitution, friction, .. } = &self.first;
        let masses = bodies[1..].iter().map(|body| body.mass.ln());
        let radii = bodies.iter().map(|body| body.radius);
        let centers = bodies.iter().flat_map(|body| body.center);
        masses.chain(radii).chain(centers).chain([*restitution, *friction]).collect()
    }

    fn contact(&self, values: &[f64]) -> MutualContact {
        let count = self.bodies.len();
        let mut contact = self.first.clone();
        let centers = values[2 * count - 1..].chunks_exact(3);
        for (index, (body, center)) in contact.bodies.iter_mut().zip(centers).enumerate() {
            body.mass = index.checked_sub(1).map_or(1.0, |later| values[later].exp());
            body.radius = values[count - 1 + index];
            body.center.copy_from_slice(center);
        }
        (contact.restitution, contact.friction) = (values[values.len() - 2], values[values.len() - 1]);
        contact
    }

    /// How far the bodies of a contact get from where they are seen, one time after the other.
    fn apart(&self, contact: &MutualContact) -> Option<Vec<DVec3>> {
        let motion = |body: &SeenBody<'a>| Moving { law: body.law, start: body.start, edit: Edit::NONE };
        let motions: Vec<Moving<'_>> = self.bodies.iter().map(motion).collect();
        let window = self.times[self.times.len() - 1];
        let impulses = contact.impulses(&motions, [0.0, window]).ok()?;
        let mut apart = Vec::with_capacity(self.bodies.len() * self.times.len());
        for (index, impulses) in impulses.into_iter().enumerate() {
            let body = &self.bodies[index];
            // The same point of the body as is seen, wherever the contact has its centre.
            let point = &self.first.bodies[index];
            let law = Law { impulses, ..body.law.clone() };
            let moved = centers(body, &law, point, &self.times)?;
            apart.extend(moved.iter().zip(&self.seen[index]).map(|(moved, seen)| *moved - *seen));
        }
        Some(apart)
    }

    /// The contact that follows the laws best of bodies with these places among all.
    fn solve(&self, places: Vec<usize>) -> Option<SeenContact> {
        let settings = Settings { iterations: 20, ..Settings::default() };
        let Minimum { values, loss, information } = minimise(self, &self.values(), &settings)?;
        let contact = self.contact(&values);
        let farthest = self.apart(&contact)?.iter().map(|apart| apart.length()).fold(0.0, f64::max);
        // What is left of the motion is error of the laws, in a few numbers: a bend for each flight.
        let spread = (loss / (3.0 * self.bodies.len() as f64)).max(1.0);
        let covariance = covariance_of(&information)? * spread;
        let deviation = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let count = values.len();
        let contact = MutualContact { deviations: [deviation(count - 2), deviation(count - 1)], ..contact };
        let drawn = self.drawn(&values, &covariance);
        Some(SeenContact { bodies: places, contact, drawn, error: farthest / self.path })
    }

    /// Contacts drawn around some values.
    fn drawn(&self, values: &[f64], covariance: &DMatrix<f64>) -> Vec<MutualContact> {
        let changes = changes(covariance, DRAWN_CONTACTS, (0, 0), &|_, _| 1.0);
        let bounded = |((value, change), unknown): ((&f64, &f64), &Unknown)| {
            (value + change).clamp(unknown.lower, unknown.upper)
        };
        let changed = |change: &Vec<f64>| -> Vec<f64> {
            values.iter().zip(change).zip(&self.unknowns).map(bounded).collect()
        };
        changes.iter().map(|change| self.contact(&changed(change))).collect()
    }
}

/// Centres of a body's sphere by a law at some times.
fn centers(body: &SeenBody<'_>, law: &Law, round: &RoundBody, times: &[f64]) -> Option<Vec<DVec3>> {
    let embedding = Embedding::new(&law.coordinates, &body.start.x);
    let states = System::new(law, Edit::NONE).states(body.start, times).ok()?;
    let center = |x: &[f64]| embedding.placements(x)[0].apply(round.center.into());
    Some(states.iter().map(|state| center(&state.x)).collect())
}

impl Problem for Fit<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let apart = self.apart(&self.contact(values))?;
        let places = apart.iter().flat_map(|apart| (*apart / self.error).to_array());
        // Masses, radii and friction stay near what single hits tell, where the motion does not tell better.
        let first = self.values();
        let prior = |index: usize| (values[index] - first[index]) / self.unknowns[index].scale;
        let residuals: Vec<f64> = places.chain((0..values.len()).map(prior)).collect();
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}
