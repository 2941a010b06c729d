//! The colour behind images without transparency: rendered sets often have one colour behind what they show.

use super::frame_spec::FrameSpec;
use super::pixels::decode;
use crate::thresholds::{BACKGROUND_TOLERANCE, BORDER_IMAGES, BORDER_SHARE};
use image::{Rgba, RgbaImage};

/// The colour that the borders of images show nearly everywhere, if the images have no transparent pixel and
/// their borders agree on one. Images that are absent or do not decode say nothing.
pub(super) fn of_opaque_images(specs: &[FrameSpec]) -> Option<[f32; 3]> {
    let count = specs.len().min(BORDER_IMAGES);
    let spread = (0..count).map(|i| &specs[i * specs.len() / count]);
    let images: Vec<RgbaImage> = spread.filter_map(|spec| decode(&spec.image_path).ok()).collect();
    let is_opaque = |image: &RgbaImage| image.pixels().all(|pixel| pixel.0[3] == u8::MAX);
    if images.is_empty() || !images.iter().all(is_opaque) {
        return None;
    }
    let border: Vec<[u8; 3]> = images.iter().flat_map(border_of).collect();
    let color = std::array::from_fn(|channel| median(border.iter().map(|pixel| pixel[channel])));
    let is_like = |pixel: &&[u8; 3]| {
        let off = |(a, b): (&u8, &u8)| f32::from(a.abs_diff(*b)) / 255.0;
        pixel.iter().zip(&color).map(off).all(|off| off <= BACKGROUND_TOLERANCE)
    };
    let alike = border.iter().filter(is_like).count();
    (alike as f64 >= BORDER_SHARE * border.len() as f64).then(|| color.map(|level| f32::from(level) / 255.0))
}

/// Colours of the outermost pixels of an image.
fn border_of(image: &RgbaImage) -> Vec<[u8; 3]> {
    let (width, height) = image.dimensions();
    let is_outer =
        |(x, y, _): &(u32, u32, &Rgba<u8>)| *x == 0 || *y == 0 || *x + 1 == width || *y + 1 == height;
    image.enumerate_pixels().filter(is_outer).map(|(.., p)| [p.0[0], p.0[1], p.0[2]]).collect()
}

/// The middle of some levels; 0 if there are none.
fn median(levels: impl Iterator<Item = u8>) -> u8 {
    let mut levels: Vec<u8> = levels.collect();
    levels.sort_unstable();
    levels.get(levels.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use std::path::Path;

    const GREY: [u8; 3] = [90, 100, 110];

    /// What images say that are `draw`n, in which a thing of another colour may reach the border.
    fn found(folder: &Path, draw: impl Fn(u32, u32) -> [u8; 3]) -> Option<[f32; 3]> {
        let image_path = folder.join("a.png");
        RgbImage::from_fn(16, 12, |x, y| image::Rgb(draw(x, y))).save(&image_path).expect("written");
        let absent = FrameSpec { image_path: folder.join("absent.png"), ..FrameSpec::default() };
        of_opaque_images(&[absent, FrameSpec { image_path, ..FrameSpec::default() }])
    }

    #[test]
    fn a_colour_all_along_the_borders_is_the_background() {
        let folder = tempfile::tempdir().expect("a folder");
        let thing = |x: u32, y: u32| if x < 8 && (2..5).contains(&y) { [200, 10, 10] } else { GREY };
        let noisy = |x: u32, y: u32| thing(x, y).map(|level| level + ((x + y) % 3) as u8);
        let near = |a: f32, b: u8| (a - f32::from(b) / 255.0).abs() < 3.0 / 255.0;
        let color = found(folder.path(), noisy).expect("a colour");
        assert!(color.iter().zip(GREY).all(|(&a, b)| near(a, b)), "{color:?}");
        let floor = |_: u32, y: u32| if y < 6 { GREY } else { [160, 140, 120] };
        assert_eq!(found(folder.path(), floor), None);
    }

    #[test]
    fn images_with_transparency_say_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let image_path = folder.path().join("a.png");
        let clear = RgbaImage::from_fn(8, 8, |x, _| Rgba([0, 0, 0, if x > 2 { 255 } else { 0 }]));
        clear.save(&image_path).expect("written");
        assert_eq!(of_opaque_images(&[FrameSpec { image_path, ..FrameSpec::default() }]), None);
        assert_eq!(of_opaque_images(&[]), None);
    }
}
