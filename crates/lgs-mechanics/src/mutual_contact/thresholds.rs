//! Numbers that decide something about contact between bodies, each with its reason, in one place.

/// Part of the smallest radius that two bodies may come nearer to each other between two looks at them: a
/// graze that is over sooner is less deep than a hundredth of the radius, `1 − √(1 − (1/8)²)`.
pub(super) const LOOK: f64 = 0.25;
/// Looks at the bodies at a time.
pub(super) const LOOKS: usize = 32;
/// Fewest and most looks over all of a motion: bodies at rest begin to move, and fast ones have an end.
pub(super) const LEAST_LOOKS: f64 = 64.0;
pub(super) const MOST_LOOKS: f64 = 20_000.0;
/// Most hits that are followed; bodies that lean on each other are hit at every look.
pub(super) const MOST_HITS: usize = 5_000;
/// Halvings of the time between two looks by which a hit is found: to 10⁻¹² of it.
pub(super) const HALVINGS: usize = 40;
/// Time by which two hits of one body differ at least, as a part of the time followed: the times of events
/// ascend.
pub(super) const AFTER: f64 = 1e-12;

// Fits

/// Part by which the distance of two centres in a hit may differ from the sum of the radii that their
/// Gaussians show: these lie below the surface by up to their own size, or above it where a hit is late.
pub(super) const MOST_APART: f64 = 0.25;
/// Impulse across the line of the centres over that along it up to which a hit is one of spheres: that of
/// most dull solids that rub.
pub(super) const MOST_ACROSS: f64 = 0.5;
/// Largest coefficient of friction.
pub(super) const MOST_FRICTION: f64 = 1.5;
/// Times at which motions are compared.
pub(super) const COMPARED: usize = 48;
/// Contacts that are drawn from what laws tell of one: as many as laws are drawn of a body.
pub(super) const DRAWN_CONTACTS: usize = 32;
/// Error of a law's places, in radii.
pub(super) const PLACE_ERROR: f64 = 0.01;
/// Error of a mass as one hit tells it, relative.
pub(super) const MASS_PRIOR: f64 = 0.2;
/// Error of a radius as Gaussians and one hit tell it, relative.
pub(super) const RADIUS_PRIOR: f64 = 0.05;

// Spheres

/// Distance from the mean of an opaque Gaussian, in its standard deviations, at which it is half transparent:
/// `√(2 ln 2)`.
pub(super) const HALF_TRANSPARENT: f64 = 1.177_410_022_515_474_7;
/// Gaussians of a ball at least: a sphere has four unknowns.
pub(super) const FEWEST_OF_SPHERE: usize = 16;
/// Rounds of the search for a sphere.
pub(super) const SPHERE_ROUNDS: usize = 50;
/// Spread of a ball's Gaussians about its surface, relative: that of a quick source (measured: 0.13, of which
/// a part is outliers).
pub(super) const SPHERE_SPREAD: f64 = 0.1;
/// Relative distance from the sphere beyond which a Gaussian is no part of it.
pub(super) const OFF_SPHERE: f64 = 0.2;
/// Shares of a ball's opaque Gaussians that may lie inside of its sphere and outside of it (measured for the
/// three balls of one quick source: up to 0.2 and 0.1). Of a body three times as long as it is thick, 0.3
/// reach beyond any sphere: half-way between, as few of the Gaussians of `standard` are opaque, and some of a
/// shadow that moves with its ball may be among them.
pub(super) const MOST_INSIDE: f64 = 0.3;
pub(super) const MOST_OUTSIDE: f64 = 0.2;
