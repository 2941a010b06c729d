//! What is recorded, as rerun's archetypes.

use lgs_core::{Camera, GaussianCloud, SH_C0};
use re_sdk_types::archetypes::{
    Arrows3D, EncodedImage, GaussianSplats3D, LineStrips3D, Pinhole, Points3D, Scalars, SeriesLines,
    TextDocument, TextLog, Transform3D,
};
use re_sdk_types::components::{Color, LineStrip3D, MediaType, Radius, Scale3D};
use re_sdk_types::datatypes::{Mat3x3, Quaternion, SphericalHarmonics3Rgb};
use re_sdk_types::{AsComponents, SerializedComponentBatch};

use crate::content::Content;
use crate::thresholds::{MARK_POINTS, PATH_POINTS};

/// The components of what is recorded.
pub(crate) fn components(content: &Content<'_>) -> Vec<SerializedComponentBatch> {
    match *content {
        Content::Gaussians(cloud) => with_poses(looks(cloud), &cloud.means, &cloud.rotations)
            .with_spherical_harmonics_degree(0)
            .as_serialized_batches(),
        Content::Looks(cloud) if cloud.sh_degree > 0 => {
            looks(cloud).with_sh_coefficients(harmonics(cloud)).as_serialized_batches()
        }
        Content::Looks(cloud) => looks(cloud).as_serialized_batches(),
        Content::Poses(means, rotations) => {
            with_poses(GaussianSplats3D::update_fields(), means, rotations).as_serialized_batches()
        }
        Content::Camera(camera) => camera_batches(camera),
        Content::Picture(picture) => {
            EncodedImage::new(picture.png.clone()).with_media_type(MediaType::png()).as_serialized_batches()
        }
        Content::Number(value) => Scalars::single(value).as_serialized_batches(),
        Content::Curve(name, rgb) => {
            SeriesLines::new().with_names([name]).with_colors([color(rgb, 1.0)]).as_serialized_batches()
        }
        Content::Line(text) => TextLog::new(text).as_serialized_batches(),
        Content::Page(text) => TextDocument::from_markdown(text).as_serialized_batches(),
        Content::Label(name, rgb) => label(name, rgb).as_serialized_batches(),
        Content::Place(point) => Points3D::update_fields().with_positions([point]).as_serialized_batches(),
        Content::Arrow(origin, vector, rgb) => Arrows3D::from_vectors([vector])
            .with_origins([origin])
            .with_colors([color(rgb, 1.0)])
            .as_serialized_batches(),
        Content::Paths(paths, rgb) => {
            LineStrips3D::new(paths.iter().map(|path| LineStrip3D::from(path.iter().copied())))
                .with_colors([color(rgb, 1.0)])
                .with_radii([Radius::new_ui_points(PATH_POINTS)])
                .as_serialized_batches()
        }
    }
}

/// A point without its place.
fn label(name: &str, rgb: [f32; 3]) -> Points3D {
    Points3D::update_fields()
        .with_labels([name])
        .with_show_labels(true)
        .with_colors([color(rgb, 1.0)])
        .with_radii([Radius::new_ui_points(MARK_POINTS)])
}

/// Gaussians without their places.
fn looks(cloud: &GaussianCloud) -> GaussianSplats3D {
    let stride = cloud.sh_stride();
    let base = |row: usize| {
        let dc = &cloud.sh[row * stride..row * stride + 3];
        color([dc[0], dc[1], dc[2]].map(|value| 0.5 + SH_C0 * value), cloud.opacity(row))
    };
    GaussianSplats3D::update_fields()
        .with_scales(cloud.log_scales.iter().map(|scales| Scale3D::from(scales.map(f32::exp))))
        .with_colors((0..cloud.len()).map(base))
}

fn with_poses(gaussians: GaussianSplats3D, means: &[[f32; 3]], rotations: &[[f32; 4]]) -> GaussianSplats3D {
    let turned = rotations.iter().map(|&rotation| {
        let [w, x, y, z] = lgs_core::linear::quat_normalize(rotation);
        Quaternion::from_xyzw([x, y, z, w])
    });
    gaussians.with_centers(means.iter().copied()).with_quaternions(turned)
}

/// Coefficients of the degrees 1 to 3; those that the Gaussians have not are zero.
fn harmonics(cloud: &GaussianCloud) -> impl Iterator<Item = SphericalHarmonics3Rgb> {
    cloud.sh.chunks_exact(cloud.sh_stride()).map(|values| {
        let mut padded = [[0.0; 3]; SphericalHarmonics3Rgb::NUM_COEFFICIENTS];
        for (to, from) in padded.iter_mut().zip(values[3..].as_chunks::<3>().0) {
            *to = *from;
        }
        SphericalHarmonics3Rgb::from_f32(padded)
    })
}

fn camera_batches(camera: &Camera) -> Vec<SerializedComponentBatch> {
    let Camera { width, height, fx, fy, cx, cy, .. } = *camera;
    let (_, rotation, center) = camera.camera_from_world.inverse().to_scale_rotation_translation();
    let rotation = Quaternion::from_xyzw(rotation.to_array());
    let pose = Transform3D::from_translation_rotation(center.to_array(), rotation);
    let columns = [[fx, 0.0, 0.0], [0.0, fy, 0.0], [cx, cy, 1.0]];
    let pinhole = Pinhole::new(Mat3x3::from(columns)).with_resolution([width as f32, height as f32]);
    let mut batches = pose.as_serialized_batches();
    batches.extend(pinhole.as_serialized_batches());
    batches
}

fn color(rgb: [f32; 3], opacity: f32) -> Color {
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let [r, g, b] = rgb.map(byte);
    Color::from_unmultiplied_rgba(r, g, b, byte(opacity))
}
