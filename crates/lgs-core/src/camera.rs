//! A pinhole camera with OpenCV axes: x right, y down, z forward.

use crate::geometry::exp;
use crate::thresholds::DISPLACEMENT_SAMPLES as SAMPLES;
use glam::{DMat4, DVec3, Mat4, Vec3, Vec4};

/// Depth up to which nothing is drawn unless a camera says otherwise, world units: as in 3D Gaussian
/// splatting (method §2.1).
pub const DEFAULT_NEAR: f32 = 0.2;

/// What a rasterizer does about detail finer than a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PixelFilter {
    /// Gaussians are widened a little and keep their peaks, as in 3D Gaussian splatting: what is smaller than
    /// a pixel is drawn larger than it is.
    #[default]
    Dilation,
    /// Gaussians are averaged over a pixel and keep their energy: the 2D Mip filter (Yu et al. 2024).
    Mip,
}

/// A pinhole camera. Pixels are continuous coordinates, the centre of pixel (i, j) being (i + 0.5, j + 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Focal length along x, in pixels.
    pub fx: f32,
    /// Focal length along y, in pixels.
    pub fy: f32,
    /// Principal point, x, in pixels.
    pub cx: f32,
    /// Principal point, y, in pixels.
    pub cy: f32,
    /// Rigid transform from world to camera axes (OpenCV).
    pub camera_from_world: Mat4,
    /// Only Gaussians whose centres are deeper than this are drawn, world units.
    pub near: f32,
    /// How detail finer than a pixel is drawn.
    pub filter: PixelFilter,
}

impl Camera {
    /// A camera at `eye` that looks at `target` with world z up; `fov_x` is the horizontal field of view in
    /// radians.
    ///
    /// A view along the z axis falls back to y as the up direction.
    #[must_use]
    pub fn look_at(eye: [f32; 3], target: [f32; 3], fov_x: f32, width: u32, height: u32) -> Self {
        let eye = Vec3::from(eye);
        let forward = (Vec3::from(target) - eye).try_normalize().unwrap_or(Vec3::Y);
        let up = if forward.z.abs() > 0.999 { Vec3::Y } else { Vec3::Z };
        let right = forward.cross(up).normalize();
        let down = forward.cross(right);
        let world_from_camera =
            Mat4::from_cols(right.extend(0.0), down.extend(0.0), forward.extend(0.0), eye.extend(1.0));
        let focal = width as f32 / (2.0 * (0.5 * fov_x).tan());
        Self::centered(world_from_camera.inverse(), focal, width, height)
    }

    /// A camera with square pixels whose principal point is the image's centre; `focal` in pixels.
    #[must_use]
    pub fn centered(camera_from_world: Mat4, focal: f32, width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            fx: focal,
            fy: focal,
            cx: 0.5 * width as f32,
            cy: 0.5 * height as f32,
            camera_from_world,
            near: DEFAULT_NEAR,
            filter: PixelFilter::default(),
        }
    }

    /// The camera of a pose with OpenGL/Blender axes (x right, y up, z backwards), given camera-to-world, row
    /// by row.
    #[must_use]
    pub fn camera_from_world_of_opengl(world_from_camera: [[f32; 4]; 4]) -> Mat4 {
        let rows = world_from_camera.map(Vec4::from);
        let pose = Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
        let flip = Mat4::from_diagonal(Vec4::new(1.0, -1.0, -1.0, 1.0));
        (pose * flip).inverse()
    }

    /// The centre of projection, in world units.
    #[must_use]
    pub fn center_in_world(&self) -> [f32; 3] {
        self.camera_from_world.inverse().w_axis.truncate().into()
    }

    /// The pixel that a world point projects to, and its depth along the viewing axis. Behind the camera the
    /// pixel means nothing.
    #[must_use]
    pub fn pixel_from_world(&self, point: [f32; 3]) -> ([f32; 2], f32) {
        let p = self.camera_from_world.transform_point3(Vec3::from(point));
        ([self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy], p.z)
    }

    /// The unit direction in world axes of the ray through a pixel position.
    #[must_use]
    pub fn ray_direction_in_world(&self, pixel: [f32; 2]) -> [f32; 3] {
        let d = Vec3::new((pixel[0] - self.cx) / self.fx, (pixel[1] - self.cy) / self.fy, 1.0);
        let rotation = glam::Mat3::from_mat4(self.camera_from_world).transpose();
        (rotation * d).normalize().into()
    }

    /// The same view at another image size; focal lengths and principal point scale with each axis.
    #[must_use]
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let (sx, sy) = (width as f32 / self.width as f32, height as f32 / self.height as f32);
        Self {
            width,
            height,
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: self.cx * sx,
            cy: self.cy * sy,
            ..*self
        }
    }

    /// The view of [`crate::Image::reduced`].
    #[must_use]
    pub fn reduced(&self, factor: u32) -> Self {
        let by = factor as f32;
        let (width, height) = (self.width / factor, self.height / factor);
        Self {
            width,
            height,
            fx: self.fx / by,
            fy: self.fy / by,
            cx: self.cx / by,
            cy: self.cy / by,
            ..*self
        }
    }

    /// The camera to which the scene appears moved: rotated about the camera's centre by a rotation vector,
    /// the first three numbers, then shifted by the last three, all in the axes of this camera.
    #[must_use]
    pub fn seeing_moved(&self, [rx, ry, rz, tx, ty, tz]: [f32; 6]) -> Self {
        let wide = |x: f32, y: f32, z: f32| DVec3::new(f64::from(x), f64::from(y), f64::from(z));
        let moved = DMat4::from_rotation_translation(exp(wide(rx, ry, rz)), wide(tx, ty, tz));
        Self { camera_from_world: (moved * self.camera_from_world.as_dmat4()).as_mat4(), ..*self }
    }

    /// How far apart this camera and another see the points of a plane at a depth of this one, pixels: root
    /// mean square over the image.
    #[must_use]
    pub fn displacement(&self, other: &Self, depth: f32) -> f64 {
        let world_from_camera = self.camera_from_world.as_dmat4().inverse();
        let other_from_camera = other.camera_from_world.as_dmat4() * world_from_camera;
        let square = |i: u32| {
            let [x, y] =
                [(i % SAMPLES, self.width, self.cx, self.fx), (i / SAMPLES, self.height, self.cy, self.fy)]
                    .map(|(at, size, center, focal)| {
                        let pixel = f64::from(size) * (f64::from(at) + 0.5) / f64::from(SAMPLES);
                        (pixel - f64::from(center)) / f64::from(focal)
                    });
            let point = DVec3::new(x, y, 1.0) * f64::from(depth);
            let seen = other_from_camera.transform_point3(point);
            let dx = f64::from(other.fx) * (seen.x / seen.z - x);
            let dy = f64::from(other.fy) * (seen.y / seen.z - y);
            dx * dx + dy * dy
        };
        ((0..SAMPLES * SAMPLES).map(square).sum::<f64>() / f64::from(SAMPLES * SAMPLES)).sqrt()
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_and_the_opengl_pose_agree() {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.7, 40, 30);
        // Blender camera at (0, -4, 0) looking along +y: right = +x, up = +z, backwards = -y.
        let pose = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, -4.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let other = Camera::camera_from_world_of_opengl(pose);
        assert!(
            camera.camera_from_world.abs_diff_eq(other, 1e-5),
            "{:?} {other:?}",
            camera.camera_from_world
        );
        let (up, _) = camera.pixel_from_world([0.0, 0.0, 0.5]);
        assert!(up[1] < camera.cy, "world up is towards row 0");
    }

    #[test]
    fn a_turned_camera_keeps_its_centre_and_a_shift_is_in_its_own_axes() {
        let camera = Camera::look_at([2.0, -3.0, 1.5], [0.1, 0.2, 0.3], 0.9, 64, 48);
        let distance = |other: &Camera| {
            let [a, b] = [&camera, other].map(|c| Vec3::from(c.center_in_world()));
            (a - b).length()
        };
        let turned = camera.seeing_moved([0.01, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(distance(&turned) < 1e-5);
        let (before, depth) = camera.pixel_from_world([0.1, 0.2, 0.3]);
        let (after, _) = turned.pixel_from_world([0.1, 0.2, 0.3]);
        assert!((after[1] - before[1] + 0.01 * camera.fy).abs() < 0.02, "{before:?} {after:?}");
        assert!((camera.displacement(&turned, depth) - f64::from(0.01 * camera.fy)).abs() < 0.1);
        let shifted = camera.seeing_moved([0.0, 0.0, 0.0, 0.02, 0.0, 0.0]);
        assert!((distance(&shifted) - 0.02).abs() < 1e-5);
        let (after, _) = shifted.pixel_from_world([0.1, 0.2, 0.3]);
        assert!((after[0] - before[0] - 0.02 * camera.fx / depth).abs() < 1e-3);
    }

    #[test]
    fn a_ray_through_a_projected_point_meets_it() {
        let camera = Camera::look_at([2.0, -3.0, 1.5], [0.1, 0.2, 0.3], 0.9, 64, 48);
        let point = Vec3::new(0.4, -0.2, 0.6);
        let (pixel, _) = camera.pixel_from_world(point.into());
        let direction = Vec3::from(camera.ray_direction_in_world(pixel));
        let expected = (point - Vec3::from(camera.center_in_world())).normalize();
        assert!((direction - expected).length() < 1e-5);
    }
}
