//! One drawing, two files: SVG for print and screens of any size, PNG for everything else.
//!
//! A drawing is made with plotters on a canvas of [`crate::style::UNIT`] units per shown pixel. The SVG keeps
//! those coordinates under a view box; the PNG is rasterised at full size and averaged over 2×2 units, which
//! smooths its edges. Pictures lie below everything else; the SVG carries them inside.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lgs_core::Image;
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters_backend::DrawingBackend;

use crate::error::ReportError;
use crate::stroke::Stroked;
use crate::style::{load_letters, px};

/// Canvas units per pixel of the PNG, each way.
const SAMPLES: usize = 2;

/// The error of plotters when it cannot draw.
pub(crate) type Fault<B> = DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>;

/// A canvas or a part of it.
pub(crate) type Area<B> = DrawingArea<B, Shift>;

/// Something that can be drawn on any canvas.
pub(crate) trait Drawing {
    /// Images that lie below the drawing.
    fn pictures(&self) -> Vec<Picture> {
        Vec::new()
    }

    /// Draws everything but the pictures.
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>>;
}

/// An image in a drawing.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// Upper left corner, shown pixels.
    pub(crate) at: [f64; 2],
    /// Width and height, shown pixels.
    pub(crate) size: [f64; 2],
    /// The image.
    pub(crate) image: Image,
}

/// A finished figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of its files, without extension.
    pub name: String,
    /// Description for the reader, one or two sentences.
    pub caption: String,
    /// Width and height, shown pixels.
    pub size: [u32; 2],
    /// Scalable; pictures are inside.
    pub svg: String,
    /// Pixels, two per shown pixel each way.
    pub png: Vec<u8>,
}

impl Figure {
    /// Draws a figure of a width and height in shown pixels.
    pub(crate) fn of(
        (name, caption): (&str, &str),
        shown: [f64; 2],
        drawing: &impl Drawing,
    ) -> Result<Self, ReportError> {
        load_letters()?;
        let fault = |reason: String| ReportError::Drawing { figure: name.to_owned(), reason };
        let pictures = drawing.pictures();
        Ok(Self {
            name: name.to_owned(),
            caption: caption.to_owned(),
            size: shown.map(|s| s.round() as u32),
            svg: svg(drawing, &pictures, shown).map_err(fault)?,
            png: png(drawing, &pictures, shown).map_err(fault)?,
        })
    }
}

/// Width and height on the canvas of a size in shown pixels.
fn canvas_size(shown: [f64; 2]) -> [usize; 2] {
    shown.map(|side| px(side).max(1) as usize)
}

fn svg(drawing: &impl Drawing, pictures: &[Picture], shown: [f64; 2]) -> Result<String, String> {
    let size = canvas_size(shown);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (size[0] as u32, size[1] as u32)).into_drawing_area();
        drawing.draw(&area).map_err(|e| e.to_string())?;
        area.present().map_err(|e| e.to_string())?;
    }
    let (_, body) = text.split_once(">\n").ok_or("the drawing is empty")?;
    let mut whole = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0}\" height=\"{:.0}\" viewBox=\"0 0 {} \
            {}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        shown[0], shown[1], size[0], size[1]
    );
    for picture in pictures {
        let [x, y, width, height] = [picture.at[0], picture.at[1], picture.size[0], picture.size[1]].map(px);
        let data =
            BASE64.encode(encoded(&picture.image.to_rgb8(), picture.image.width, picture.image.height)?);
        whole.push_str(&format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
                href=\"data:image/png;base64,{data}\"/>\n"
        ));
    }
    Ok(whole + body)
}

fn png(drawing: &impl Drawing, pictures: &[Picture], shown: [f64; 2]) -> Result<Vec<u8>, String> {
    let size = canvas_size(shown);
    let mut pixels = vec![255_u8; 3 * size[0] * size[1]];
    for picture in pictures {
        paste(&mut pixels, size, picture);
    }
    {
        let bitmap = BitMapBackend::with_buffer(&mut pixels, (size[0] as u32, size[1] as u32));
        let area = Stroked(bitmap).into_drawing_area();
        drawing.draw(&area).map_err(|e| e.to_string())?;
        area.present().map_err(|e| e.to_string())?;
    }
    let (width, height) = (size[0] / SAMPLES, size[1] / SAMPLES);
    encoded(&averaged(&pixels, size[0], [width, height]), width as u32, height as u32)
}

/// Copies an image, nearest pixels, onto the canvas; what lies outside is cut off.
fn paste(canvas: &mut [u8], size: [usize; 2], picture: &Picture) {
    let image = &picture.image;
    let bytes = image.to_rgb8();
    let [x0, y0, width, height] =
        [picture.at[0], picture.at[1], picture.size[0], picture.size[1]].map(|v| px(v).max(0) as usize);
    if image.pixels.is_empty() || width == 0 || height == 0 {
        return;
    }
    for y in 0..height.min(size[1].saturating_sub(y0)) {
        let row = y * image.height as usize / height * image.width as usize;
        for x in 0..width.min(size[0].saturating_sub(x0)) {
            let from = 3 * (row + x * image.width as usize / width);
            let to = 3 * ((y0 + y) * size[0] + x0 + x);
            canvas[to..to + 3].copy_from_slice(&bytes[from..from + 3]);
        }
    }
}

/// Means over squares of [`SAMPLES`] by [`SAMPLES`].
fn averaged(pixels: &[u8], wide: usize, size: [usize; 2]) -> Vec<u8> {
    let mut small = Vec::with_capacity(3 * size[0] * size[1]);
    for y in 0..size[1] {
        for x in 0..size[0] {
            for c in 0..3 {
                let at = |i: usize, j: usize| {
                    u32::from(pixels[3 * ((SAMPLES * y + i) * wide + SAMPLES * x + j) + c])
                };
                small.push(((at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1) + 2) / 4) as u8);
            }
        }
    }
    small
}

/// An 8-bit PNG.
pub(crate) fn encoded(rgb: &[u8], width: u32, height: u32) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| e.to_string())?;
    Ok(bytes)
}
