//! The interface of source models.

use std::path::Path;

use lgs_core::GaussianCloud;

use super::error::SourceError;
use super::kind::SourceKind;
use crate::shading::Shading;
use crate::tensor_file::TensorFile;

/// A model of moving Gaussians that can be asked for any time of the captured window (times are in units of
/// the sequence, see `docs`).
pub trait SourceModel: Send + Sync {
    /// Kind of the model.
    fn kind(&self) -> SourceKind;

    /// Number of Gaussians; the same, and in the same order, at every time.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The model whose Gaussians this one carries or lights, where it does. What is known of that one's times
    /// and paths is known of this one, too.
    fn inner(&self) -> Option<&dyn SourceModel> {
        None
    }

    /// All Gaussians as they are drawn at a time: unit quaternions, logarithms of positive scales.
    fn cloud_at(&self, time: f32) -> GaussianCloud;

    /// The same Gaussians in their own colours, without what [`Self::shading`] makes of them.
    fn unshaded_at(&self, time: f32) -> GaussianCloud {
        self.cloud_at(time)
    }

    /// How Gaussians are lit over time, where the model has learned that.
    fn shading(&self) -> Option<&Shading> {
        None
    }

    /// The number of the path that carries each Gaussian as a thing of its own, from 1, and 0 for the others;
    /// empty where none does.
    fn carried(&self) -> &[u32] {
        self.inner().map_or(&[], |inner| inner.carried())
    }

    /// First and last time of each stretch over which the thing that a path carries, by its number from 1,
    /// flew freely; what it did else it was made to do.
    fn free_flights(&self, thing: u32) -> &[[f32; 2]] {
        self.inner().map_or(&[], |inner| inner.free_flights(thing))
    }

    /// The Gaussians' centres at a time, `[n]`, world units.
    fn positions_at(&self, time: f32) -> Vec<[f32; 3]>;

    /// First and last time that the model knows anything of, where it ends; outside of them its Gaussians
    /// rest.
    fn time_range(&self) -> Option<[f32; 2]> {
        self.inner()?.time_range()
    }

    /// Times that the motion is known at, ascending, where it comes from frames and not from a function of
    /// time.
    fn known_times(&self) -> Option<&[f32]> {
        self.inner()?.known_times()
    }

    /// The model without what it knows of a time and those after it, where it comes from frames.
    fn before(&self, _time: f32) -> Option<Box<dyn SourceModel>> {
        None
    }

    /// Whether a time is within [`Self::time_range`], rounding aside.
    fn covers(&self, time: f32) -> bool {
        const ROUNDING: f32 = 1e-4;
        self.time_range().is_none_or(|[first, last]| time > first - ROUNDING && time < last + ROUNDING)
    }

    /// The whole model in the format of its kind, to be read by [`load_source`](super::load_source).
    fn to_tensors(&self) -> TensorFile;

    /// Writes the model, atomically.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn save(&self, path: &Path) -> Result<(), SourceError> {
        Ok(self.to_tensors().save(path)?)
    }
}
