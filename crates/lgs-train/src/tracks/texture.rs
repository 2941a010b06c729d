//! What images show of a tracked thing's surface, taken to be that of a ball: contrasts against their
//! surroundings, free of shading, and how well two of them agree where they show the same points.

use glam::{Quat, Vec3};
use lgs_core::Camera;
use lgs_core::linear::{dot, norm, scale, sub};
use lgs_data::dataset::Frame;
use rayon::prelude::*;

use super::curve::Curve;
use super::thresholds::{
    CONTRAST_NOISE, CONTRAST_RADII, FEWEST_TEXTURED, LEAST_CONTRAST, LEAST_FACING, MOST_VIEWS,
    SURFACE_POINTS, TEXTURE_RADIUS,
};

/// A ball that moves along a path and turns at a constant rate.
#[derive(Clone, Debug)]
pub(super) struct TurningBall {
    pub(super) curve: Curve,
    /// World units.
    pub(super) radius: f32,
    /// Angular velocity in world axes, radians per unit of time.
    pub(super) spin: Vec3,
}

/// An image of the ball.
pub(super) struct TexturedView {
    pub(super) time: f32,
    camera: Camera,
    /// Contrast of every pixel, `[h, w]`, in units of the spread around it; none beside the ball.
    contrast: Vec<Option<Vec3>>,
}

/// At most [`MOST_VIEWS`] images of a ball, spread evenly over those that show enough of it and its texture.
pub(super) fn textured_views(
    frames: &[Frame],
    background: [f32; 3],
    ball: &TurningBall,
) -> Vec<TexturedView> {
    let (start, end) = ball.curve.span;
    let spanned: Vec<&Frame> = frames.iter().filter(|frame| (start..=end).contains(&frame.time)).collect();
    let shown: Vec<(&Frame, Window)> =
        spanned.into_par_iter().filter_map(|frame| Some((frame, Window::of(frame, ball)?))).collect();
    let step = shown.len().div_ceil(MOST_VIEWS).max(1);
    let shown: Vec<(&Frame, Window)> = shown.into_iter().step_by(step).collect();
    let view = |(frame, window)| TexturedView::new(frame, window, background);
    shown.into_par_iter().filter_map(view).collect()
}

/// The part of a reduced image that shows a ball.
struct Window {
    /// Factor of the reduction: the ball's radius becomes about [`TEXTURE_RADIUS`].
    factor: u32,
    /// The camera of the part.
    camera: Camera,
    left: usize,
    top: usize,
    /// Radius of the ball in it, pixels.
    radius: f32,
    /// Whether the ray of a pixel meets the ball, `[h, w]`.
    inside: Vec<bool>,
}

impl Window {
    /// Nothing if too little of the ball is in view, or the camera in the ball.
    fn of(frame: &Frame, ball: &TurningBall) -> Option<Self> {
        let center = ball.curve.at(frame.time);
        let ([x, y], depth) = frame.camera.pixel_from_world(center);
        let distance = norm(sub(center, frame.camera.center_in_world()));
        if depth <= ball.radius {
            return None;
        }
        let (width, height) = (frame.camera.width, frame.camera.height);
        let pixels = (frame.camera.fx * frame.camera.fy).sqrt() * ball.radius / depth;
        let factor = ((pixels / TEXTURE_RADIUS) as u32).clamp(1, width.min(height));
        let camera = frame.camera.reduced(factor);
        let radius = pixels / factor as f32;
        // The image of a ball beside the axis is an ellipse, longer by up to this.
        let reach = 2.0 * radius * distance / depth;
        let part = |middle: f32, size: u32| {
            let (low, high) = (middle / factor as f32 - reach, middle / factor as f32 + reach);
            (low.clamp(0.0, size as f32) as u32, high.ceil().clamp(0.0, size as f32) as u32)
        };
        let ((left, right), (top, bottom)) = (part(x, camera.width), part(y, camera.height));
        let (cx, cy) = (camera.cx - left as f32, camera.cy - top as f32);
        let camera = Camera { width: right - left, height: bottom - top, cx, cy, ..camera };
        let inside = disc(&camera, center, ball.radius);
        let is_enough = inside.iter().filter(|&&is_inside| is_inside).count() >= FEWEST_TEXTURED;
        is_enough.then_some(Self { factor, camera, left: left as usize, top: top as usize, radius, inside })
    }
}

impl TexturedView {
    /// Nothing if the ball has no texture to speak of there.
    fn new(frame: &Frame, window: Window, background: [f32; 3]) -> Option<Self> {
        let Window { factor, camera, left, top, radius, inside } = window;
        let image = frame.composited(background).reduced(factor);
        let width = camera.width as usize;
        let row = |y: usize| &image.pixels[(top + y) * image.width as usize + left..][..width];
        let pixels: Vec<[f32; 3]> = (0..camera.height as usize).flat_map(row).copied().collect();
        let reach = (CONTRAST_RADII * radius).max(2.0) as usize;
        let contrast = contrasts(&pixels, &inside, width, reach);
        let (mut energy, mut count) = (0.0, 0);
        for contrast in contrast.iter().flatten() {
            (energy, count) = (energy + contrast.length_squared(), count + 1);
        }
        let is_textured = energy > LEAST_CONTRAST * count as f32;
        is_textured.then_some(Self { time: frame.time, camera, contrast })
    }

    /// The contrast at a point of the surface, if the image shows it: bilinear between pixels.
    fn at(&self, center: Vec3, offset: Vec3) -> Option<Vec3> {
        let point = center + offset;
        let to_eye = Vec3::from(self.camera.center_in_world()) - point;
        if offset.dot(to_eye) < LEAST_FACING * offset.length() * to_eye.length() {
            return None;
        }
        let ([x, y], _) = self.camera.pixel_from_world(point.into());
        let (x, y) = (x - 0.5, y - 0.5);
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        if x < 0.0 || y < 0.0 || x as usize + 1 >= width || y as usize + 1 >= height {
            return None;
        }
        let (right, down) = (x.fract(), y.fract());
        let at = y as usize * width + x as usize;
        let upper = self.contrast[at]? * (1.0 - right) + self.contrast[at + 1]? * right;
        let lower = self.contrast[at + width]? * (1.0 - right) + self.contrast[at + width + 1]? * right;
        Some(upper * (1.0 - down) + lower * down)
    }
}

/// The surface points of a ball that each view shows, for one path and radius.
pub(super) struct Surface<'a> {
    views: &'a [TexturedView],
    radius: f32,
    centers: Vec<Vec3>,
    shown: Vec<Vec<(Vec3, Vec3)>>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(views: &'a [TexturedView], ball: &TurningBall) -> Self {
        let directions: Vec<Vec3> = (0..SURFACE_POINTS).map(|i| spread(i, SURFACE_POINTS)).collect();
        let centers: Vec<Vec3> = views.iter().map(|view| ball.curve.at(view.time).into()).collect();
        let of_view = |(view, &center): (&TexturedView, &Vec3)| {
            let contrast = |&d: &Vec3| view.at(center, d * ball.radius).map(|contrast| (d, contrast));
            directions.iter().filter_map(contrast).collect()
        };
        let shown = views.iter().zip(&centers).map(of_view).collect();
        Self { views, radius: ball.radius, centers, shown }
    }

    /// Normalised correlation of what pairs of views show of the same points of the surface when it turns at
    /// a rate, radians per unit of time: 1 if they agree, 0 if they have nothing in common or no points.
    pub(super) fn agreement(&self, spin: Vec3, pairs: &[(usize, usize)]) -> f32 {
        let (mut product, mut first, mut second) = (0.0_f32, 0.0_f32, 0.0_f32);
        for &(i, j) in pairs {
            let turn = Quat::from_scaled_axis(spin * (self.views[j].time - self.views[i].time));
            for &(direction, a) in &self.shown[i] {
                let offset = turn * direction * self.radius;
                if let Some(b) = self.views[j].at(self.centers[j], offset) {
                    product += a.dot(b);
                    first += a.length_squared();
                    second += b.length_squared();
                }
            }
        }
        let norm = (first * second).sqrt();
        if norm > 0.0 { product / norm } else { 0.0 }
    }
}

/// The i-th of n unit vectors spread evenly (a Fibonacci lattice).
pub(super) fn spread(i: usize, n: usize) -> Vec3 {
    let z = 1.0 - (2 * i + 1) as f32 / n as f32;
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let (across, angle) = ((1.0 - z * z).sqrt(), golden * i as f32);
    Vec3::new(across * angle.cos(), across * angle.sin(), z)
}

/// Whether the ray of each pixel meets a ball, `[h, w]`.
fn disc(camera: &Camera, center: [f32; 3], radius: f32) -> Vec<bool> {
    let from_eye = sub(center, camera.center_in_world());
    let width = camera.width as usize;
    let meets = |i: usize| {
        let ray = camera.ray_direction_in_world([(i % width) as f32 + 0.5, (i / width) as f32 + 0.5]);
        let depth = dot(from_eye, ray);
        depth > 0.0 && norm(sub(from_eye, scale(ray, depth))) < radius
    };
    (0..camera.pixels()).map(meets).collect()
}

/// Differences from the mean of the pixels inside within a square window, over the spread of these.
fn contrasts(pixels: &[[f32; 3]], inside: &[bool], width: usize, reach: usize) -> Vec<Option<Vec3>> {
    let height = inside.len() / width;
    let sums = sums(pixels, inside, width);
    let contrast = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (left, right) = (x.saturating_sub(reach), (x + reach + 1).min(width));
        let (top, bottom) = (y.saturating_sub(reach), (y + reach + 1).min(height));
        let corner = |x: usize, y: usize| sums[y * (width + 1) + x];
        let part = |k: usize| {
            corner(right, bottom)[k] - corner(left, bottom)[k] - corner(right, top)[k] + corner(left, top)[k]
        };
        let mean = [part(0), part(1), part(2)].map(|sum| sum / part(4));
        let squares = part(3) / part(4) - mean.iter().map(|m| m * m).sum::<f64>();
        let spread = squares.max(0.0).sqrt() + f64::from(CONTRAST_NOISE);
        Vec3::from_array(std::array::from_fn(|c| ((f64::from(pixels[i][c]) - mean[c]) / spread) as f32))
    };
    (0..inside.len()).map(|i| inside[i].then(|| contrast(i))).collect()
}

/// Sums over all pixels inside above and to the left, `[h + 1, w + 1]`: of the channels, of their squares and
/// of ones.
fn sums(pixels: &[[f32; 3]], inside: &[bool], width: usize) -> Vec<[f64; 5]> {
    let mut sums = vec![[0.0; 5]; (width + 1) * (inside.len() / width + 1)];
    for (i, pixel) in pixels.iter().enumerate() {
        let [r, g, b] = pixel.map(f64::from);
        let own = if inside[i] { [r, g, b, r * r + g * g + b * b, 1.0] } else { [0.0; 5] };
        let at = (i / width + 1) * (width + 1) + i % width + 1;
        let (left, above, both) = (sums[at - 1], sums[at - width - 1], sums[at - width - 2]);
        sums[at] = std::array::from_fn(|k| own[k] + left[k] + above[k] - both[k]);
    }
    sums
}
