//! Training and playback as recordings for [rerun](https://rerun.io)'s viewer.
//!
//! [`Training`] follows a run on the timeline `step`: the training curve, and now and then the Gaussians and
//! a picture of one training camera. [`Playback`] lays the motion of a trained model on the timeline `time`,
//! a unit of time being a second. Both write a [`Recording`].
//!
//! The feature `rerun` brings recordings; without it each is refused when it is begun, and nothing of rerun
//! is compiled. The same calls record the same chunks and numbers of rows;
//! the bytes differ in the order in which rerun's encoder lists them.

#[cfg(not(feature = "rerun"))]
mod absent;
#[cfg(feature = "rerun")]
mod archetypes;
mod content;
mod error;
mod note;
mod picture;
mod playback;
mod recorder;
#[cfg(feature = "rerun")]
mod recording;
mod thresholds;
mod training;

#[cfg(not(feature = "rerun"))]
pub use absent::Recording;
pub use error::RerunError;
pub use note::ObjectNote;
pub use picture::Picture;
pub use playback::{Moment, Moving, Playback};
pub use recorder::Recorder;
#[cfg(feature = "rerun")]
pub use recording::Recording;
pub use training::Training;
