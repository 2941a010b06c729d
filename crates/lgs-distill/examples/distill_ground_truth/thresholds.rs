//! What counts as recovered, wrong or compared, with reasons.

/// Relative error up to which a constant counts as recovered.
pub(super) const RECOVERED: f64 = 0.03;

/// Standard deviations of a constant's own interval: 95 % of normal errors.
pub(super) const DEVIATIONS: f64 = 2.0;

/// Potentials under which a body must keep above its plane as well.
pub(super) const POTENTIALS: [f64; 3] = [1.0, 0.5, 2.0];

/// Depth to which noisy tracks tell where the points of a body are, world units: their noise of 0.002 over 76
/// samples leaves 0.0002 of each.
pub(super) const NOT_DEEP: f64 = 1e-3;

/// Samples of the window, and steps of the rollout at the same spacing.
pub(super) const WINDOW: usize = 76;

/// Step at t = 1, the end of the whole recording.
pub(super) const RECORDED: usize = 100;

/// Every so many steps the truth is compared with a band.
pub(super) const COMPARED: usize = 5;

/// Error over the path beyond which a forecast is wrong: what stage 1 promises of times that it trusts.
pub(super) const WRONG: f64 = 0.04;
