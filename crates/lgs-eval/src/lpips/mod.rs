//! LPIPS: the distance of two images in the features of a network trained on photographs (Zhang et
//! al. 2018, version 0.1; method §7).
//!
//! Both images are shifted and scaled per channel, pass the convolutions of VGG-16 or AlexNet, and at five
//! depths the feature vectors of every pixel are brought to unit length; their squared differences are
//! weighted per channel, averaged over the image and summed.
//!
//! The networks' weights are not ours to ship. [`store`] keeps what a user imports once and says what content
//! it had; without weights a figure is absent, never estimated. The published figures feed images in [0, 1]
//! to a network that expects [−1, 1] (method §7), so both conventions are computed and named: see
//! [`PerceptualScore`].

mod error;
mod features;
mod input_range;
mod perceptual;
pub mod store;
mod trunk;
mod weight_kind;

pub use features::Lpips;
pub use input_range::InputRange;
pub use perceptual::{Perceptual, PerceptualScore};
pub use trunk::Trunk;
