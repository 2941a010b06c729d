//! Defects of trajectories and configurations.

/// A defect of the input of this crate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DistillError {
    /// An array has the wrong length.
    #[error("`{field}`: {expected} expected, {found} found")]
    Length {
        /// The array.
        field: &'static str,
        /// Length asked for.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// There are too few samples to see accelerations in.
    #[error("trajectories have {found} samples where at least {expected} are needed")]
    TooFewSamples {
        /// The fewest that work.
        expected: usize,
        /// Samples found.
        found: usize,
    },
    /// Sample times are not ascending with one spacing.
    #[error("sample time {index} of the trajectories is off the even spacing")]
    UnevenTimes {
        /// The sample.
        index: usize,
    },
    /// A position is NaN or infinite.
    #[error("position of particle {particle} at sample {sample} is not finite")]
    NonFinite {
        /// The sample.
        sample: usize,
        /// The particle.
        particle: usize,
    },
    /// There is nothing to fit.
    #[error("an object without particles has no motion")]
    Empty,
    /// A configuration value is outside of its range.
    #[error("`{field}` is {found}, expected {expected}")]
    Config {
        /// The field.
        field: &'static str,
        /// The range.
        expected: String,
        /// The value.
        found: String,
    },
    /// A fit left the finite numbers.
    #[error("the fit of an object's motion became non-finite in {stage}")]
    Diverged {
        /// The stage.
        stage: &'static str,
    },
}
