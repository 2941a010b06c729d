//! Images as a pinhole with the same focal lengths and principal point would have taken them.
//!
//! Every pixel of the new image is looked up where the lens put its ray, so that nothing but the resampling
//! (Catmull and Rom's cubic, premultiplied colours) is approximate. Pixels whose rays the lens did not put on
//! the image, or sent to a place where other rays landed before ([`Lens::reach`]), are masked and black.

use super::lens::Lens;
use super::pixels::{Masked, premultiplied, straight};
use image::{GrayImage, Luma, Rgba, Rgba32FImage, RgbaImage};
use lgs_core::Camera;

/// Takes the distortion of a lens out of an image and its mask.
pub(super) fn undistorted(distorted: &Masked, camera: &Camera, lens: &Lens) -> Masked {
    let (width, height) = distorted.image.dimensions();
    let source = premultiplied(&distorted.image);
    let look_up = LookUp::new(camera, lens);
    let mut image = RgbaImage::from_pixel(width, height, Rgba([0, 0, 0, 255]));
    let mut mask = GrayImage::new(width, height);
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let Some(place) = look_up.place(x, y) else { continue };
        if distorted.mask.as_ref().is_some_and(|mask| is_left_out(mask, place)) {
            continue;
        }
        *pixel = Rgba(straight(sample(&source, place)));
        mask.put_pixel(x, y, Luma([255]));
    }
    Masked { image, mask: Some(mask) }
}

/// Where the pixels of the new image lie in the old one.
struct LookUp<'a> {
    focal: [f64; 2],
    principal: [f64; 2],
    size: [f64; 2],
    lens: &'a Lens,
    reach: f64,
}

impl<'a> LookUp<'a> {
    fn new(camera: &Camera, lens: &'a Lens) -> Self {
        let focal = [camera.fx, camera.fy].map(f64::from);
        let principal = [camera.cx, camera.cy].map(f64::from);
        let size = [camera.width, camera.height].map(f64::from);
        let farthest = |i: usize| principal[i].abs().max((size[i] - principal[i]).abs()) / focal[i];
        let reach = lens.reach(farthest(0).hypot(farthest(1)));
        Self { focal, principal, size, lens, reach }
    }

    /// The place in the old image, pixels; nothing if there is none inside of it.
    fn place(&self, x: u32, y: u32) -> Option<[f64; 2]> {
        let at = [x, y].map(|v| f64::from(v) + 0.5);
        let ideal: [f64; 2] = std::array::from_fn(|i| (at[i] - self.principal[i]) / self.focal[i]);
        let through = self.lens.distorted(ideal);
        let place: [f64; 2] = std::array::from_fn(|i| self.focal[i] * through[i] + self.principal[i]);
        let inside = (0..2).all(|i| (0.5..=self.size[i] - 0.5).contains(&place[i]));
        (inside && ideal[0].hypot(ideal[1]) <= self.reach).then_some(place)
    }
}

/// Whether a mask leaves one of the four pixels around a place out.
fn is_left_out(mask: &GrayImage, place: [f64; 2]) -> bool {
    let [x, y] = place.map(|v| (v - 0.5).floor().max(0.0) as u32);
    let near = |x: u32, y: u32| mask.get_pixel(x.min(mask.width() - 1), y.min(mask.height() - 1)).0 == [0];
    near(x, y) || near(x + 1, y) || near(x, y + 1) || near(x + 1, y + 1)
}

/// The image between its pixels; beyond the edge the last pixel is repeated.
fn sample(image: &Rgba32FImage, place: [f64; 2]) -> [f32; 4] {
    let [(x, wx), (y, wy)] = place.map(|v| {
        let corner = (v - 0.5).floor();
        (corner as i64, weights((v - 0.5 - corner) as f32))
    });
    let at = |corner: i64, i: usize, size: u32| (corner + i as i64 - 1).clamp(0, i64::from(size) - 1) as u32;
    let mut sum = [0.0; 4];
    for (j, wy) in wy.iter().enumerate() {
        for (i, wx) in wx.iter().enumerate() {
            let pixel = image.get_pixel(at(x, i, image.width()), at(y, j, image.height())).0;
            (0..4).for_each(|c| sum[c] += wx * wy * pixel[c]);
        }
    }
    sum
}

/// Weights of the four pixels around a place at a fraction of the way from the second to the third.
fn weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
}

#[cfg(test)]
mod tests {
    use super::super::lens::tests::{lenses, undistorted as ideal};
    use super::*;

    /// A smooth pattern on the ideal image plane.
    fn shade([x, y]: [f64; 2]) -> u8 {
        (127.5 + 60.0 * (7.0 * x + 1.0).sin() + 60.0 * (6.0 * y - 2.0 * x).cos()).round() as u8
    }

    fn photograph(camera: &Camera, ray: impl Fn([f64; 2]) -> [f64; 2]) -> RgbaImage {
        RgbaImage::from_fn(camera.width, camera.height, |x, y| {
            let at = [
                (f64::from(x) + 0.5 - f64::from(camera.cx)) / f64::from(camera.fx),
                (f64::from(y) + 0.5 - f64::from(camera.cy)) / f64::from(camera.fy),
            ];
            let v = shade(ray(at));
            Rgba([v, 255 - v, v / 2, 255])
        })
    }

    #[test]
    fn an_undistorted_image_is_what_a_pinhole_sees() {
        let mut camera = Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 0.9, 160, 120);
        (camera.cx, camera.fy) = (76.0, 1.1 * camera.fx);
        for lens in lenses() {
            let image = photograph(&camera, |at| ideal(&lens, at));
            let found = undistorted(&Masked { image, mask: None }, &camera, &lens);
            let truth = photograph(&camera, |at| at);
            let mask = found.mask.unwrap();
            let (mut worst, mut counted) = (0, 0);
            for ((a, b), m) in found.image.pixels().zip(truth.pixels()).zip(mask.pixels()) {
                if m.0[0] > 0 {
                    worst = (0..3).map(|c| a.0[c].abs_diff(b.0[c])).max().unwrap().max(worst);
                    counted += 1;
                }
            }
            assert!(worst <= 3, "{lens:?}: off by {worst} levels");
            assert!(counted > 12_000, "{lens:?}: {counted} of 19200 pixels");
        }
    }

    #[test]
    fn what_left_the_image_and_what_was_masked_is_masked() {
        let camera = Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 1.0, 60, 40);
        let pincushion = Lens::of_opencv(&[0.4, 0.0]).unwrap();
        let mut mask = GrayImage::from_pixel(60, 40, Luma([255]));
        mask.put_pixel(30, 20, Luma([0]));
        let image = RgbaImage::from_pixel(60, 40, Rgba([9, 9, 9, 255]));
        let found = undistorted(&Masked { image, mask: Some(mask) }, &camera, &pincushion);
        let mask = found.mask.unwrap();
        assert_eq!(mask.get_pixel(0, 0).0, [0], "the corner of the pinhole's view is not on the image");
        assert_eq!(mask.get_pixel(30, 20).0, [0], "a masked pixel stays masked");
        assert_eq!(mask.get_pixel(40, 25).0, [255]);
        assert_eq!(found.image.get_pixel(40, 25).0, [9, 9, 9, 255]);
    }
}
