//! The partition into objects: every Gaussian in the colour of its object, static ones in grey, as an image
//! and as a splat file.

use lgs_core::{Camera, GaussianCloud};
use lgs_model::{LagrangianScene, Motion};
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::canvas::{Area, Drawing, Fault, Figure, Picture};
use crate::chart::{TITLE, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::style::{FAINT, INK, object_colour};
use crate::views::{drawn, of_width};

/// Coefficient of the constant harmonic.
const HARMONIC_0: f32 = 0.282_094_8;
/// Colour of static Gaussians.
const STILL: RGBColor = RGBColor(0xb8, 0xb8, 0xb8);
/// Width of an image, shown pixels.
const IMAGE: f64 = 396.0;
const GAP: f64 = 12.0;
const TOP: f64 = 28.0;
/// Entries of the legend in a line.
const ENTRIES: usize = 4;

struct Partition {
    pictures: Vec<Picture>,
    height: f64,
    entries: Vec<(Mark, RGBColor, String)>,
}

/// The scene at t = 0 with the colours of its objects and no others.
#[must_use]
pub fn coloured_partition(scene: &LagrangianScene, motion: &mut Motion<'_>) -> GaussianCloud {
    let cloud = scene.cloud_at(&motion.state_at(0.0), 0.0);
    let mut colours = vec![STILL; scene.static_gaussians.len()];
    for (index, object) in scene.objects.iter().enumerate() {
        colours.extend(std::iter::repeat_n(object_colour(index), object.members.len()));
    }
    let harmonic = |c: u8| (f32::from(c) / 255.0 - 0.5) / HARMONIC_0;
    let sh = colours.iter().flat_map(|c| [c.0, c.1, c.2].map(harmonic)).collect();
    GaussianCloud { sh, sh_degree: 0, ..cloud }
}

/// The figure; nothing without a camera.
pub(crate) fn figure(
    (scene, motion): (&LagrangianScene, &mut Motion<'_>),
    coloured: &GaussianCloud,
    camera: Option<Camera>,
) -> Result<Option<Figure>, ReportError> {
    let Some(camera) = camera else { return Ok(None) };
    let camera = of_width(&camera, (2.0 * IMAGE) as u32);
    let height = (IMAGE * f64::from(camera.height) / f64::from(camera.width)).round();
    let cloud = scene.cloud_at(&motion.state_at(0.0), 0.0);
    let picture = |cloud: &GaussianCloud, column: usize| Picture {
        at: [8.0 + column as f64 * (IMAGE + GAP), TOP],
        size: [IMAGE, height],
        image: drawn(cloud, &camera, scene.background),
    };
    let mut entries: Vec<(Mark, RGBColor, String)> = scene
        .objects
        .iter()
        .enumerate()
        .map(|(i, o)| (Mark::Square, object_colour(i), format!("object {i}: {}", o.members.len())))
        .collect();
    if !scene.static_gaussians.is_empty() {
        entries.push((Mark::Square, STILL, format!("still: {}", scene.static_gaussians.len())));
    }
    let caption = "The Lagrangian scene at t = 0 and the objects that it consists of, with their numbers \
        of Gaussians; the same colours are in partition.ply.";
    let lines = entries.len().div_ceil(ENTRIES) as f64;
    let size = [2.0 * IMAGE + GAP + 16.0, TOP + height + 12.0 + 20.0 * lines];
    let drawing = Partition { pictures: vec![picture(&cloud, 0), picture(coloured, 1)], height, entries };
    Figure::of(("partition", caption), size, &drawing).map(Some)
}

impl Drawing for Partition {
    fn pictures(&self) -> Vec<Picture> {
        self.pictures.clone()
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        for (picture, (title, colour)) in self.pictures.iter().zip([("scene", INK), ("objects", FAINT)]) {
            write(area, title, [picture.at[0], TOP - 8.0], (TITLE, colour), (HPos::Left, VPos::Bottom))?;
        }
        for (row, entries) in self.entries.chunks(ENTRIES).enumerate() {
            legend(area, [8.0, TOP + self.height + 18.0 + 20.0 * row as f64], entries)?;
        }
        Ok(())
    }
}
