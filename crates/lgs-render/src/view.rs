//! A camera in the form the projection wants, and the part of the projection of one Gaussian that its
//! backward pass recomputes.

use crate::image_part::ImagePart;
use crate::projected::{BLUR, MIP_VARIANCE};
use crate::splats::Splats;
use lgs_core::linear::{Mat3, add, mat_vec, matrix_from_quat, quat_normalize, scale, sub, transpose};
use lgs_core::{Camera, PixelFilter};

/// Clamp of `x/z` inside the Jacobian, in tangents of half the field of view.
const TANGENT_LIMIT: f32 = 1.3;
/// Quaternions up to this length count as the identity, as in `lgs_core::linear::quat_normalize`.
pub(crate) const TINY_QUATERNION: f32 = 1e-12;

/// A camera in the form the projection wants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub rotation: Mat3,
    pub translation: [f32; 3],
    pub focal: [f32; 2],
    pub principal: [f32; 2],
    pub tangent_limit: [f32; 2],
    pub center: [f32; 3],
    /// Width and height of the image, pixels.
    pub size: [usize; 2],
    pub near: f32,
    pub filter: PixelFilter,
    /// Variance added to every covariance on the image, square pixels.
    pub blur: f32,
}

/// The variance that a filter adds to every covariance on the image, square pixels.
pub(crate) fn blur_of(filter: PixelFilter) -> f32 {
    match filter {
        PixelFilter::Dilation => BLUR,
        PixelFilter::Mip => MIP_VARIANCE,
    }
}

impl From<&Camera> for View {
    fn from(camera: &Camera) -> Self {
        let rotation = transpose(&glam::Mat3::from_mat4(camera.camera_from_world).to_cols_array_2d());
        let translation: [f32; 3] = camera.camera_from_world.w_axis.truncate().into();
        Self {
            rotation,
            translation,
            focal: [camera.fx, camera.fy],
            principal: [camera.cx, camera.cy],
            tangent_limit: [
                TANGENT_LIMIT * camera.width as f32 / (2.0 * camera.fx),
                TANGENT_LIMIT * camera.height as f32 / (2.0 * camera.fy),
            ],
            center: scale(mat_vec(&transpose(&rotation), translation), -1.0),
            size: [camera.width as usize, camera.height as usize],
            near: camera.near,
            filter: camera.filter,
            blur: blur_of(camera.filter),
        }
    }
}

impl View {
    /// The same for a part of the image; directions are limited as in all of it.
    pub(crate) fn of_part(self, ImagePart { columns, rows }: &ImagePart) -> Self {
        let [cx, cy] = self.principal;
        let principal = [cx - columns.start as f32, cy - rows.start as f32];
        Self { principal, size: [columns.len(), rows.len()], ..self }
    }

    /// The mean of a Gaussian in camera axes.
    #[inline(always)]
    pub(crate) fn camera_mean(&self, mean: [f32; 3]) -> [f32; 3] {
        add(mat_vec(&self.rotation, mean), self.translation)
    }

    /// The way from a Gaussian's parameters to its covariance on the image.
    #[inline(always)]
    pub(crate) fn chain(&self, splats: &Splats, index: usize) -> Chain {
        let camera_mean = self.camera_mean(splats.means[index]);
        let [x, y, z] = camera_mean;
        let raw = [x / z, y / z];
        let tangent: [f32; 2] =
            std::array::from_fn(|i| raw[i].clamp(-self.tangent_limit[i], self.tangent_limit[i]));
        let clamped = std::array::from_fn(|i| raw[i] != tangent[i]);
        let image_from_world = std::array::from_fn(|i| {
            scale(sub(self.rotation[i], scale(self.rotation[2], tangent[i])), self.focal[i] / z)
        });
        let q = splats.rotations[index];
        let rotation = matrix_from_quat(quat_normalize(q));
        let scales = splats.log_scales[index].map(f32::exp);
        let m = image_from_world.map(|row| {
            let turned = mat_vec(&transpose(&rotation), row);
            std::array::from_fn(|j| turned[j] * scales[j])
        });
        Chain { camera_mean, rotation, image_from_world, tangent, clamped, scales, m }
    }
}

/// Intermediate matrices between the parameters of a Gaussian and its image covariance.
pub(crate) struct Chain {
    pub camera_mean: [f32; 3],
    pub rotation: Mat3,
    /// `J W`, 2×3.
    pub image_from_world: [[f32; 3]; 2],
    /// Clamped `x/z`, `y/z`, and whether each was clamped.
    pub tangent: [f32; 2],
    pub clamped: [bool; 2],
    pub scales: [f32; 3],
    /// `M = J W R S`.
    pub m: [[f32; 3]; 2],
}
