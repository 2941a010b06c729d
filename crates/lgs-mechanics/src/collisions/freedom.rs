//! The unknowns of a contact.

use crate::contact::{Contact, Impact};

/// Unknowns of a contact beside those of its planes: restitution and friction.
pub(super) const OF_MATERIAL: usize = 2;

/// Unknowns of a plane: two tilts and a shift.
pub(super) const OF_PLANE: usize = 3;

/// How far a plane may be from where it was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Freedom {
    /// Point about which it tilts.
    pub(super) about: [f64; 3],
    /// Standard deviation of its tilts, radians.
    pub(super) tilt: f64,
    /// Standard deviation of its shift, world units.
    pub(super) shift: f64,
    /// Unknowns that count whatever the track tells: those of a plane that nothing but the track shows.
    pub(super) least: f64,
}

impl Freedom {
    /// How many unknowns of the plane count, from their variances with the track: each by the part of its
    /// variance that the track takes away.
    pub(super) fn counted(&self, variances: [f64; OF_PLANE]) -> f64 {
        let told = |(after, before): (f64, f64)| (1.0 - after / before.powi(2)).clamp(0.0, 1.0);
        variances.into_iter().zip(self.deviations()).map(told).sum::<f64>().max(self.least)
    }

    /// Standard deviations of both tilts and of the shift.
    pub(super) fn deviations(&self) -> [f64; OF_PLANE] {
        [self.tilt, self.tilt, self.shift]
    }
}

/// A contact that a body may have, how far each of its planes may be from where it has it, and what strikes
/// the body beside.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub(super) contact: Contact,
    /// One for each plane.
    pub(super) freedoms: Vec<Freedom>,
    /// Impulses by something else.
    pub(super) impulses: Vec<Impact>,
}

impl Hypothesis {
    /// A contact with one plane.
    pub(super) fn of(contact: Contact, freedom: Freedom) -> Self {
        Self { contact, freedoms: vec![freedom], impulses: Vec::new() }
    }
}

/// Number of unknowns of a contact.
pub(super) fn unknowns_of(contact: &Contact) -> usize {
    OF_MATERIAL + OF_PLANE * contact.planes().count()
}

/// A contact after changes of its planes, two tilts and a shift each, about a point of each.
pub(super) fn with_planes_changed(contact: &Contact, about: &[[f64; 3]], changes: &[f64]) -> Contact {
    let each = contact.planes().zip(about).zip(changes.chunks_exact(OF_PLANE));
    let mut planes = each.map(|((plane, &about), by)| plane.changed(about, [by[0], by[1]], by[2]));
    let plane = planes.next().unwrap_or(contact.plane);
    Contact { plane, walls: planes.collect(), ..contact.clone() }
}
