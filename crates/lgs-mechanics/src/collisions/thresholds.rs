//! Constants that decide something in fits through impacts, each with its reason.

/// The same where the track is sought for what strikes a body between impacts on planes: as little as a hit
/// may be beside a bounce, a wiggle of a source beside one is smaller.
pub(super) const LEAST_OF_BOUNCE: f64 = 0.05;
/// Height over the extent of a body at which an observed pose counts as touching: no better are plane and
/// shape known.
pub(super) const NEAR_PLANE: f64 = 0.01;
/// Steps from one sample to the next, at most, of motions through impacts: what is faster, samples do not
/// show.
pub(super) const MOST_STEPS_OF_SAMPLE: f64 = 8.0;
/// Steps of motions through impacts in search of a body's contact, and parts of steps that are followed near
/// the plane: some twenty fits, each of up to a thousand motions, through tracks of a hundred samples. What
/// lies on a plane takes up to eighty parts for a step.
pub(super) const MOST_CONTACT_STEPS: f64 = 6e6;
/// Mean distance from the samples after the free flight, over the extent of the body, that the best of some
/// restitutions and frictions may leave: beyond its own width the body is elsewhere.
pub(super) const HOPELESS: f64 = 2.0;
/// Values of restitution that are tried first.
pub(super) const RESTITUTIONS: [f64; 10] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
/// Values of friction that are tried first.
pub(super) const FRICTIONS: [f64; 10] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.1];
/// Deviation of restitution and friction where the track does not tell them: both lie between 0 and about 1.
pub(super) const CONTACT_SPREAD: f64 = 0.5;
/// Fits of all unknowns, each weighing the later samples by the error that the one before has left.
pub(super) const CONTACT_PASSES: usize = 3;
/// Linearisations of the fit of all unknowns together.
pub(super) const CONTACT_ITERATIONS: usize = 12;
/// Error of a contact after its first impact over that of impulses up to which it comes before them: less is
/// no difference in kind.
pub(super) const AS_NEAR: f64 = 2.0;
/// Factor by which the noise that two divisions of a track into flights leave differs if both are right: its
/// estimates from a dozen samples do.
pub(super) const SAME_NOISE: f64 = 2.0;
/// Unknowns of a hit that the body which is hit as well tells of: its time, and two of three for its change.
pub(super) const KNOWN_OF_HIT: usize = 3;
/// Turns of finding where two flights meet, which their speeds at one time tell of another.
pub(super) const MEETINGS: usize = 4;
/// Samples at each side of an impact that a source may smear: beyond, a short flight has too few left.
pub(super) const MOST_BLURRED: usize = 6;
/// Second moments of a filled body over those of its surface: exact for every body whose faces (or surface)
/// are equally far from its centre, since a cone's are 3/5 of those of its base.
pub(super) const FILLED: f64 = 0.6;
/// Standard deviation of the tilt of a plane against the change of velocity at one impact, radians: that of a
/// friction of about a half.
pub(super) const WIDEST_TILT: f64 = 0.5;
/// Speed after an impact over that of the approach, both along the normal, above which no plane at rest is
/// the cause: 1 is a perfect bounce, and the rest what flights may be wrong by.
pub(super) const FASTEST: f64 = 1.25;
/// Deviations of its tilt within which a plane at rest is the one that an impact tells of.
pub(super) const AGREED: f64 = 3.0;
/// Depth below a plane at rest, and height of the lowest sample over it, in extents of the body, beyond which
/// the body does not collide with it: it passes through it, or turns back before it.
pub(super) const DEEPEST: f64 = 0.15;
/// Part of a typical size of a parameter by which it changes in a fit.
pub(super) const OF_SCALE: f64 = 0.01;
