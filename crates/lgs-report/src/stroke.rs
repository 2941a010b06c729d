//! Thick lines on a bitmap, segment by segment, and letters where the SVG has them.
//!
//! plotters turns a thick path into one polygon, which it fills by the even-odd rule: a path that crosses
//! itself gets holes there. Drawn one by one, with a disc at every joint, segments have none.

use crate::style::LOWER;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
};

/// A backend whose thick paths are drawn in segments.
pub(crate) struct Stroked<B>(pub(crate) B);

type Done<B> = Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

impl<B: DrawingBackend> DrawingBackend for Stroked<B> {
    type ErrorType = B::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Done<B> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Done<B> {
        self.0.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Done<B> {
        self.0.draw_pixel(point, color)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Done<B> {
        self.0.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Done<B> {
        self.0.draw_rect(upper_left, bottom_right, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done<B> {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        let radius = style.stroke_width() / 2;
        for (index, pair) in points.windows(2).enumerate() {
            self.0.draw_line(pair[0], pair[1], style)?;
            if index > 0 && radius > 0 {
                self.0.draw_circle(pair[0], radius, style, true)?;
            }
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Done<B> {
        self.0.draw_circle(center, radius, style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vertices: I,
        style: &S,
    ) -> Done<B> {
        self.0.fill_polygon(vertices, style)
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Done<B> {
        let shift = (LOWER * style.size()).round() as i32;
        let (dx, dy) = match style.transform() {
            FontTransform::None => (0, shift),
            FontTransform::Rotate90 => (-shift, 0),
            FontTransform::Rotate180 => (0, -shift),
            FontTransform::Rotate270 => (shift, 0),
        };
        self.0.draw_text(text, style, (at.0 + dx, at.1 + dy))
    }
}
