//! The LPIPS figures of an image for which there are weights.

use burn::tensor::Device;
use lgs_core::Image;

use super::store::{Origin, WeightStore, WeightsError};
use super::{InputRange, Lpips, Trunk};

/// LPIPS of one image; absent where there are no weights or the image is too small.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerceptualScore {
    /// VGG, inputs in [−1, 1] as the network expects.
    pub vgg: Option<f64>,
    /// VGG, inputs in [0, 1], as in the published tables.
    pub vgg_unnormalised: Option<f64>,
    /// AlexNet, inputs in [−1, 1].
    pub alex: Option<f64>,
}

/// The networks for which there are weights.
#[derive(Clone, Debug, Default)]
pub struct Perceptual {
    vgg: Option<Lpips>,
    alex: Option<Lpips>,
    /// The files that their weights were imported from.
    pub origins: Vec<Origin>,
}

impl Perceptual {
    /// Loads a store's networks onto a device; a network needs both of its files.
    ///
    /// # Errors
    /// If a stored file can't be read or is damaged.
    pub fn load(store: &WeightStore, device: &Device) -> Result<Self, WeightsError> {
        let mut origins = Vec::new();
        let mut network = |trunk: Trunk| {
            let [convolutions, linear] = trunk.files().map(|kind| store.load(kind));
            let (Some(convolutions), Some(linear)) = (convolutions?, linear?) else {
                return Ok::<_, WeightsError>(None);
            };
            let network = Lpips::new(trunk, &convolutions, &linear, device)?;
            origins.extend([convolutions.origin, linear.origin]);
            Ok(Some(network))
        };
        let (vgg, alex) = (network(Trunk::Vgg)?, network(Trunk::Alex)?);
        Ok(Self { vgg, alex, origins })
    }

    /// Whether there is no network.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.vgg.is_none() && self.alex.is_none()
    }

    /// Scores every prediction against the truth.
    ///
    /// # Panics
    /// If the images differ in size.
    #[must_use]
    pub fn score(&self, predictions: &[&Image], truth: &Image) -> Vec<PerceptualScore> {
        let distances = |network: &Option<Lpips>, range| {
            network.as_ref().and_then(|n| n.distances(predictions, truth, range))
        };
        let vgg = distances(&self.vgg, InputRange::Symmetric);
        let vgg_unnormalised = distances(&self.vgg, InputRange::Unnormalised);
        let alex = distances(&self.alex, InputRange::Symmetric);
        let at = |all: &Option<Vec<f64>>, i: usize| all.as_ref().map(|d| d[i]);
        let one = |i| PerceptualScore {
            vgg: at(&vgg, i),
            vgg_unnormalised: at(&vgg_unnormalised, i),
            alex: at(&alex, i),
        };
        (0..predictions.len()).map(one).collect()
    }
}
