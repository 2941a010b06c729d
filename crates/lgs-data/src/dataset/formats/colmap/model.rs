//! What COLMAP's files of cameras and images hold, and its camera models.

use crate::dataset::error::Problem;
use crate::dataset::frame_spec::Intrinsics;
use crate::dataset::lens::Lens;

#[derive(Clone, Debug)]
pub(super) struct ColmapCamera {
    pub(super) id: u32,
    pub(super) intrinsics: Intrinsics,
    pub(super) lens: Lens,
}

/// An image with its pose: camera-from-world, OpenCV axes.
#[derive(Clone, Debug)]
pub(super) struct ColmapImage {
    /// Quaternion w x y z.
    pub(super) rotation: [f64; 4],
    pub(super) translation: [f64; 3],
    pub(super) camera_id: u32,
    pub(super) name: String,
}

/// Names and numbers of parameters of COLMAP's models, by their number in binary files.
pub(super) const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

impl ColmapCamera {
    /// The camera of a model with these parameters, in COLMAP's order.
    pub(super) fn new(id: u32, model: &str, size: [f64; 2], p: &[f64]) -> Result<Self, Problem> {
        let part = |field, expected: String, found: String| Problem::Part {
            part: format!("camera {id}"),
            field,
            expected,
            found,
        };
        let supported = "a model of COLMAP other than FOV and THIN_PRISM_FISHEYE";
        let unknown = || part("model", supported.to_owned(), format!("`{model}`"));
        let &(_, count) = MODELS.iter().find(|(name, _)| *name == model).ok_or_else(unknown)?;
        if p.len() != count {
            let expected = format!("{count} numbers for {model}");
            return Err(part("parameters", expected, p.len().to_string()));
        }
        if let Some(bad) = p.iter().find(|v| !v.is_finite()) {
            return Err(part("parameters", "finite".to_owned(), bad.to_string()));
        }
        let (focal, rest) = if model.starts_with("SIMPLE") || model.starts_with("RADIAL") {
            ([p[0]; 2], &p[1..])
        } else {
            ([p[0], p[1]], &p[2..])
        };
        let k = &rest[2..];
        let lens = match model {
            "SIMPLE_PINHOLE" | "PINHOLE" => Lens::Pinhole,
            "SIMPLE_RADIAL" => Lens::radial([k[0], 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]),
            "RADIAL" => Lens::radial([k[0], k[1], 0.0, 0.0, 0.0, 0.0], [0.0; 2]),
            "OPENCV" | "FULL_OPENCV" => Lens::of_opencv(k).ok_or_else(unknown)?,
            "OPENCV_FISHEYE" => Lens::Fisheye([k[0], k[1], k[2], k[3]]),
            "SIMPLE_RADIAL_FISHEYE" => Lens::Fisheye([k[0], 0.0, 0.0, 0.0]),
            "RADIAL_FISHEYE" => Lens::Fisheye([k[0], k[1], 0.0, 0.0]),
            _ => return Err(unknown()),
        };
        let intrinsics = Intrinsics::of(focal, [rest[0], rest[1]], Some(size));
        Ok(Self { id, intrinsics, lens })
    }
}
