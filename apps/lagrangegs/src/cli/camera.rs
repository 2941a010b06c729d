//! `--camera`: a view of the dataset by name or number, or an orbit around the scene.

use super::thresholds::{DEFAULT_DISTANCE, DEFAULT_FOV_X, DEFAULT_WIDTH, ORBIT_ROOM, PARALLEL_AXES};
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Result, bail};
use lgs_core::{Camera, DEFAULT_NEAR, GaussianCloud, PixelFilter};

/// The camera that the user asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CameraChoice {
    /// Once around the scene over all frames, or standing still at an azimuth in degrees.
    Orbit(Option<f32>),
    /// A view of the dataset.
    Named(String),
    /// From one view of the dataset to the next; without names all of them.
    Through(Vec<String>),
    /// A path from a file.
    Path(PathBuf),
}

impl FromStr for CameraChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_prefix("orbit") {
            Some("") => Ok(Self::Orbit(None)),
            Some(rest) if rest.starts_with(':') => match rest[1..].trim().parse::<f32>() {
                Ok(degrees) if degrees.is_finite() => Ok(Self::Orbit(Some(degrees))),
                _ => Err(format!("`{}` is not an azimuth in degrees", &rest[1..])),
            },
            _ if text.is_empty() => Err("a camera needs a name".to_owned()),
            _ => Self::of_words(text),
        }
    }
}

impl CameraChoice {
    /// A choice that is no orbit.
    fn of_words(text: &str) -> Result<Self, String> {
        let is_json = Path::new(text).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        match text.strip_prefix("through") {
            Some("") => Ok(Self::Through(Vec::new())),
            Some(rest) if rest.starts_with(':') => {
                let names: Vec<String> = rest[1..].split(',').map(|name| name.trim().to_owned()).collect();
                if names.len() < 2 || names.iter().any(String::is_empty) {
                    return Err(format!("`{text}` should name two views or more: through:NAME,NAME"));
                }
                Ok(Self::Through(names))
            }
            _ if is_json => Ok(Self::Path(text.into())),
            _ => Ok(Self::Named(text.to_owned())),
        }
    }
}

/// A circle around the scene, in the mean direction of the known cameras and a little farther away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    center: [f32; 3],
    radius: f32,
    height: f32,
    fov_x: f32,
    size: [u32; 2],
    near: f32,
    filter: PixelFilter,
}

impl Orbit {
    /// The orbit that fits the known cameras, or the Gaussians if there are none.
    pub(crate) fn around(cameras: &[Camera], cloud: &GaussianCloud) -> Self {
        match (cameras.first(), common_target(cameras)) {
            (Some(first), Some(center)) => Self::through(cameras, first, center),
            _ => Self::of_cloud(cloud, cameras.first()),
        }
    }

    fn through(cameras: &[Camera], first: &Camera, center: [f32; 3]) -> Self {
        let n = cameras.len() as f32;
        let offsets: Vec<[f32; 3]> =
            cameras.iter().map(|c| lgs_core::linear::sub(c.center_in_world(), center)).collect();
        let radius = ORBIT_ROOM * offsets.iter().map(|o| o[0].hypot(o[1])).sum::<f32>() / n;
        let height = ORBIT_ROOM * offsets.iter().map(|o| o[2]).sum::<f32>() / n;
        let fov_x = 2.0 * (first.width as f32 / (2.0 * first.fx)).atan();
        Self {
            center,
            radius: radius.max(1e-3),
            height,
            fov_x,
            size: [first.width, first.height],
            near: first.near,
            filter: first.filter,
        }
    }

    fn of_cloud(cloud: &GaussianCloud, first: Option<&Camera>) -> Self {
        let n = cloud.len().max(1) as f32;
        let center: [f32; 3] = std::array::from_fn(|c| cloud.means.iter().map(|p| p[c]).sum::<f32>() / n);
        let square = |p: &[f32; 3]| (0..3).map(|c| (p[c] - center[c]).powi(2)).sum::<f32>();
        let spread = (cloud.means.iter().map(square).sum::<f32>() / n).sqrt().max(0.1);
        let size = first.map_or([DEFAULT_WIDTH; 2], |c| [c.width, c.height]);
        Self {
            center,
            radius: DEFAULT_DISTANCE * spread,
            height: spread,
            fov_x: DEFAULT_FOV_X,
            size,
            near: first.map_or(DEFAULT_NEAR, |c| c.near),
            filter: first.map_or_else(PixelFilter::default, |c| c.filter),
        }
    }

    /// The point that all cameras look at.
    pub(crate) fn center(&self) -> [f32; 3] {
        self.center
    }

    /// The camera at an azimuth, counted from +x towards +y.
    pub(crate) fn at(&self, azimuth_degrees: f32) -> Camera {
        let (s, c) = azimuth_degrees.to_radians().sin_cos();
        let eye = [
            self.center[0] + self.radius * c,
            self.center[1] + self.radius * s,
            self.center[2] + self.height,
        ];
        Camera {
            near: self.near,
            filter: self.filter,
            ..Camera::look_at(eye, self.center, self.fov_x, self.size[0], self.size[1])
        }
    }

    /// Cameras for `count` frames: once around, or still.
    pub(crate) fn cameras(&self, azimuth_degrees: Option<f32>, count: usize) -> Vec<Camera> {
        let turn = TAU.to_degrees() / count.max(1) as f32;
        (0..count).map(|i| self.at(azimuth_degrees.unwrap_or(turn * i as f32))).collect()
    }
}

/// The point nearest to all optical axes; nothing for fewer than two, or parallel, axes.
fn common_target(cameras: &[Camera]) -> Option<[f32; 3]> {
    let (mut matrix, mut right) = (glam::DMat3::ZERO, glam::DVec3::ZERO);
    for camera in cameras {
        let eye = glam::Vec3::from(camera.center_in_world()).as_dvec3();
        let axis = glam::Vec3::from(camera.ray_direction_in_world([camera.cx, camera.cy])).as_dvec3();
        let across =
            glam::DMat3::IDENTITY - glam::DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        matrix += across;
        right += across * eye;
    }
    let solvable = cameras.len() > 1 && matrix.determinant() > PARALLEL_AXES * (cameras.len() as f64).powi(3);
    solvable.then(|| (matrix.inverse() * right).as_vec3().into())
}

/// The camera of a name or number among `(name, camera)`: the name may leave out the file extension.
pub(crate) fn find(name: &str, cameras: &[(String, Camera)]) -> Option<Camera> {
    let stem = |full: &str| full.rsplit_once('.').map_or(full.to_owned(), |(stem, _)| stem.to_owned());
    let wanted = name.trim_start_matches("./");
    let by_name = cameras.iter().find(|(full, _)| full == wanted || stem(full) == wanted);
    let by_number = || wanted.parse::<usize>().ok().and_then(|number| cameras.get(number));
    by_name.or_else(by_number).map(|(_, camera)| *camera)
}

/// The error that no camera of a run has this name, with some that exist.
pub(crate) fn unknown<T>(name: &str, cameras: &[(String, Camera)], run: &Path) -> Result<T> {
    let some: Vec<&str> = cameras.iter().take(4).map(|(name, _)| name.as_str()).collect();
    let hint = if some.is_empty() {
        "none is known, use `orbit`".to_owned()
    } else {
        format!("there are {}, …, and `orbit`", some.join(", "))
    };
    bail!("no camera is called `{name}`: {hint}: {}", run.display())
}

/// A camera with its image resized to a width, keeping the aspect.
pub(crate) fn with_width(camera: &Camera, width: Option<u32>) -> Camera {
    let Some(width) = width else { return *camera };
    let height =
        (f64::from(camera.height) * f64::from(width) / f64::from(camera.width)).round().max(1.0) as u32;
    camera.resized(width, height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orbit_is_a_ring_of_cameras_seen_from_a_little_farther() {
        let ring: Vec<Camera> = (0..6)
            .map(|i| {
                let (s, c) = (i as f32).sin_cos();
                Camera::look_at([0.5 + 4.0 * c, 4.0 * s, 2.0], [0.5, 0.0, 0.3], 0.7, 100, 80)
            })
            .collect();
        let orbit = Orbit::around(&ring, &GaussianCloud::default());
        let camera = orbit.at(1.0_f32.to_degrees());
        let eye = lgs_core::linear::sub(camera.center_in_world(), [0.5, 0.0, 0.3]);
        let expected =
            lgs_core::linear::sub(ring[1].center_in_world(), [0.5, 0.0, 0.3]).map(|v| ORBIT_ROOM * v);
        assert!(lgs_core::linear::norm(lgs_core::linear::sub(eye, expected)) < 1e-2, "{orbit:?}");
        assert!((camera.fx - ring[1].fx).abs() < 0.1);
        assert_eq!(orbit.cameras(None, 4).len(), 4);
        assert_eq!(orbit.cameras(Some(30.0), 2)[0], orbit.cameras(Some(30.0), 2)[1]);
    }

    #[test]
    fn without_cameras_the_orbit_sees_the_gaussians() {
        let cloud = GaussianCloud::isotropic(vec![[1.0, 1.0, 1.0], [1.0, 2.0, 1.0]], 0.1, [0.5; 3], 0.9);
        let camera = Orbit::around(&[], &cloud).at(0.0);
        let (pixel, depth) = camera.pixel_from_world([1.0, 1.5, 1.0]);
        assert!(depth > 0.5 && (pixel[0] - 200.0).abs() < 1.0, "{pixel:?} {depth}");
    }

    #[test]
    fn cameras_are_found_by_name_stem_and_number() {
        let camera = |x| Camera::look_at([x, 4.0, 1.0], [0.0; 3], 0.7, 10, 10);
        let list =
            vec![("train/r_000.png".to_owned(), camera(0.0)), ("train/r_001.png".to_owned(), camera(1.0))];
        for name in ["train/r_001.png", "train/r_001", "./train/r_001", "1"] {
            assert_eq!(find(name, &list), Some(list[1].1), "{name}");
        }
        assert_eq!(find("train/r_002", &list), None);
        assert!(
            unknown::<()>("x", &list, Path::new("run"))
                .expect_err("unknown")
                .to_string()
                .contains("train/r_000.png")
        );
    }

    #[test]
    fn choices_are_parsed() {
        assert_eq!("orbit".parse(), Ok(CameraChoice::Orbit(None)));
        assert_eq!("orbit:-30".parse(), Ok(CameraChoice::Orbit(Some(-30.0))));
        assert_eq!("orbital/r_0".parse(), Ok(CameraChoice::Named("orbital/r_0".to_owned())));
        let through = |names: &[&str]| CameraChoice::Through(names.iter().map(|&n| n.to_owned()).collect());
        assert_eq!("through".parse(), Ok(through(&[])));
        assert_eq!("through:0,train/r_1".parse(), Ok(through(&["0", "train/r_1"])));
        assert_eq!("a/b.json".parse(), Ok(CameraChoice::Path("a/b.json".into())));
        for text in ["orbit:x", "through:", "through:0", "through:0,,1"] {
            assert!(text.parse::<CameraChoice>().is_err(), "{text}");
        }
    }
}
