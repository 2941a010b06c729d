//! The unknowns of a contact.

/// Unknowns of a contact: restitution, friction, two tilts and a shift of the plane.
pub(super) const OF_CONTACT: usize = 5;

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
    pub(super) fn counted(&self, variances: [f64; 3]) -> f64 {
        let before = [self.tilt, self.tilt, self.shift];
        let told = |(after, before): (f64, f64)| (1.0 - after / before.powi(2)).clamp(0.0, 1.0);
        variances.into_iter().zip(before).map(told).sum::<f64>().max(self.least)
    }
}
