//! The moment of training that an iteration is at.

/// The time of a training frame, and the state of the schedule when it is drawn.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub(super) time: f32,
    pub(super) iteration: usize,
    /// End of the time window that training has grown to.
    pub(super) window_end: f32,
}
