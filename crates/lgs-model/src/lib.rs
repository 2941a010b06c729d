//! Trained models: the source model that was learned from images, and the Lagrangian scene that was distilled
//! from it.
//!
//! A [`source::SourceModel`] answers "where is every Gaussian at time t" inside the captured window. A
//! [`LagrangianScene`] answers it for any time and under edited physics, by rolling a Lagrangian system; it
//! is what a run delivers (`lagrangian.safetensors`).
//!
//! One motion path: training, evaluation, rendering and export all obtain a Lagrangian scene's Gaussians from
//! [`Motion`].

mod light;
#[cfg(test)]
mod lit_testing;
mod scene;
mod shading;
pub mod source;
mod tensor_file;
pub mod testing;
mod thresholds;

pub use light::{Irradiance, Light};
pub use scene::{
    Continuation, Dynamics, GeneralisedDynamics, ObjectContact, ObjectFields, PartDynamics, ParticleDynamics,
    Projection, Recording, Shadow,
};
pub use scene::{LagrangianScene, Motion, MotionConfig, ObjectModel, SceneError, SceneState, mapped_shape};
pub use scene::{insert_cloud, load_scene, read_cloud, save_scene, scene_from_tensors, scene_to_tensors};
pub use shading::{Shading, ShadingTimes};
pub use tensor_file::{TensorFile, TensorFileError};
