//! Colours, sizes and letters that all figures share.
//!
//! The palette is that of Okabe and Ito, which people with any kind of colour vision can tell apart. A colour
//! means the same everywhere: the source model is vermilion, the Lagrangian scene blue, the truth black;
//! objects have colours of their own.

use std::sync::OnceLock;

use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, RGBColor, ShapeStyle, TextStyle, register_font,
};

use crate::error::ReportError;

/// Canvas units per shown pixel: plotters rounds to whole units, so that a finer canvas gives smoother
/// curves.
pub(crate) const UNIT: f64 = 4.0;

/// Colour of the source model.
pub(crate) const SOURCE: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
/// Colour of the Lagrangian scene.
pub(crate) const LAGRANGIAN: RGBColor = RGBColor(0x00, 0x72, 0xb2);
/// Colour of the truth.
pub(crate) const TRUTH: RGBColor = RGBColor(0x1a, 0x1a, 0x1a);
/// Letters and axes.
pub(crate) const INK: RGBColor = RGBColor(0x33, 0x33, 0x33);
/// Colour of notes, borders and everything static.
pub(crate) const FAINT: RGBColor = RGBColor(0x8a, 0x8a, 0x8a);
/// Lines of a grid.
pub(crate) const GRID: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);
/// The captured window.
pub(crate) const WINDOW: RGBColor = RGBColor(0xee, 0xf1, 0xf4);
/// Times at which no forecast is trusted.
pub(crate) const UNTRUSTED: RGBColor = RGBColor(0xfa, 0xe6, 0xde);
/// Paper.
pub(crate) const PAPER: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// Objects, in their order; further ones begin again.
const OBJECTS: [RGBColor; 6] = [
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x8c, 0x56, 0x2b),
    RGBColor(0x6a, 0x51, 0xa3),
];

/// The colour of an object.
pub(crate) fn object_colour(index: usize) -> RGBColor {
    OBJECTS[index % OBJECTS.len()]
}

/// A colour mixed with paper; 1 leaves it as it is.
pub(crate) fn pale(colour: RGBColor, strength: f64) -> RGBColor {
    let mix = |c: u8| (255.0 + strength * (f64::from(c) - 255.0)).round() as u8;
    RGBColor(mix(colour.0), mix(colour.1), mix(colour.2))
}

/// Shown pixels as canvas units.
pub(crate) fn px(shown: f64) -> i32 {
    (shown * UNIT).round() as i32
}

/// A line of a width in shown pixels.
pub(crate) fn line(colour: RGBColor, width: f64) -> ShapeStyle {
    ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: px(width).max(1) as u32 }
}

/// A filled area.
pub(crate) fn filled(colour: RGBColor) -> ShapeStyle {
    colour.filled()
}

/// Letters of a size in shown pixels.
pub(crate) fn letters(size: f64, colour: RGBColor) -> TextStyle<'static> {
    /// plotters takes the height of a line, of which this is the letters' size.
    const LINE_HEIGHT: f64 = 1.24;
    let font = FontDesc::new(FontFamily::Name("sans-serif"), size * UNIT * LINE_HEIGHT, FontStyle::Normal);
    TextStyle { color: colour.to_backend_color(), ..TextStyle::from(font) }
}

/// How far a bitmap's letters stand above where an SVG has them, whatever they are aligned by, as a part of a
/// line's height.
pub(crate) const LOWER: f64 = 0.11;

/// Makes the bundled letters known to plotters, once.
pub(crate) fn load_letters() -> Result<(), ReportError> {
    static LOADED: OnceLock<bool> = OnceLock::new();
    let loaded = LOADED
        .get_or_init(|| register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular()).is_ok());
    if *loaded {
        Ok(())
    } else {
        Err(ReportError::Drawing { figure: "any".into(), reason: "the bundled font does not parse".into() })
    }
}
