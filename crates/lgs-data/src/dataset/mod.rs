//! Image sets: cameras, times and images of a scene, in one of the formats of [`DatasetFormat`].
//!
//! Poses are camera-to-world with OpenGL axes where a format follows D-NeRF. Intrinsics of a frame (`fl_x`,
//! `fl_y`, `cx`, `cy`, `w`, `h`) win over those of its file, which win over `camera_angle_x`; published sets
//! do carry a wrong file-level angle. Images are decoded in parallel and kept as 8-bit RGBA with a mask;
//! colours are composited over the background on demand in floats, `c = rgb·α + background·(1 − α)`. The
//! published programs truncate that to 8 bits, which only adds noise.
//!
//! `set.rs` is a loaded set, `store.rs` holds its images within a bound of memory, `load.rs` loads one and
//! `import.rs` writes one. `formats/` has one reader per format, `transforms.rs` the JSON that several of
//! them share, `frame_spec.rs` the description of a frame by a reader; `npy.rs`, `times.rs`, `poses.rs`,
//! `lens.rs` and `videos.rs` help readers. `pixels.rs` decodes images, `undistort.rs` takes lenses out of
//! them, `background.rs` finds the colour behind opaque ones, `points.rs`, `hull.rs` and `surfaces.rs` make
//! the positions of the first Gaussians, `pose_check.rs` names poses that cannot be right, `fingerprint.rs`
//! tells one set from another.

mod background;
mod error;
mod fingerprint;
mod formats;
mod frame_spec;
mod hull;
mod import;
mod import_rules;
mod lens;
mod load;
mod npy;
mod pixels;
mod points;
mod pose_check;
mod poses;
mod set;
mod store;
mod surfaces;
mod times;
mod transforms;
mod undistort;
mod videos;

pub use crate::ply::Points;
pub use error::{DatasetError, Problem};
pub use formats::{DatasetFormat, format_or_auto};
pub use import::{CaptureNoise, ImportOptions, ImportSize, Imported, import};
pub use import_rules::ImportRules;
pub use load::{AbsentImages, LoadOptions, Progress};
pub use points::{NearPlanes, SceneBox};
pub use set::{CameraOrigin, Dataset, Frame};
pub use store::{Picture, Pixels};
pub(crate) use transforms::write_split;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
