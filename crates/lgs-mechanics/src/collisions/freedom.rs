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
    /// Unknowns that are fitted to the track.
    pub(super) unknowns: usize,
}
