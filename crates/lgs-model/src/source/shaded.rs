//! A source model whose Gaussians are lit differently at different times.

use lgs_core::GaussianCloud;

use super::kind::SourceKind;
use super::model::SourceModel;
use crate::shading::Shading;
use crate::tensor_file::TensorFile;

/// A model of any kind, with factors of its Gaussians' colours over time.
pub struct ShadedSource {
    moved: Box<dyn SourceModel>,
    shading: Shading,
}

impl ShadedSource {
    /// A model with factors for all its Gaussians.
    ///
    /// # Panics
    /// If their number is another.
    #[must_use]
    pub fn new(moved: Box<dyn SourceModel>, shading: Shading) -> Self {
        assert_eq!(moved.len(), shading.len(), "Gaussians of a shading");
        Self { moved, shading }
    }
}

impl SourceModel for ShadedSource {
    fn kind(&self) -> SourceKind {
        self.moved.kind()
    }

    fn len(&self) -> usize {
        self.moved.len()
    }

    fn inner(&self) -> Option<&dyn SourceModel> {
        Some(&*self.moved)
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        let mut cloud = self.moved.cloud_at(time);
        self.shading.shade(&mut cloud, time);
        cloud
    }

    fn unshaded_at(&self, time: f32) -> GaussianCloud {
        self.moved.unshaded_at(time)
    }

    fn shading(&self) -> Option<&Shading> {
        Some(&self.shading)
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        self.moved.positions_at(time)
    }

    fn before(&self, time: f32) -> Option<Box<dyn SourceModel>> {
        let moved = self.moved.before(time)?;
        Some(Box::new(Self { moved, shading: self.shading.clone() }))
    }

    fn to_tensors(&self) -> TensorFile {
        let mut file = self.moved.to_tensors();
        self.shading.insert_into(&mut file);
        file
    }
}
