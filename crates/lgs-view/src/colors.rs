//! Colours of objects: hues a golden angle apart, so that neighbours in number are far apart in colour.

/// Colour of an object, linear RGB as Gaussians have it.
#[must_use]
pub fn object_color(index: usize) -> [f32; 3] {
    const GOLDEN: f32 = 0.618_034;
    let hue = (0.58 + index as f32 * GOLDEN).fract() * 6.0;
    [5.0_f32, 3.0, 1.0].map(|shift| {
        let k = (shift + hue).rem_euclid(6.0);
        0.9 - 0.65 * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Colour of static Gaussians beside coloured objects.
pub(crate) const STATIC: [f32; 3] = [0.55; 3];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_of_the_first_objects_differ() {
        let far = |a: [f32; 3], b: [f32; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f32>() > 0.15;
        for i in 0..8 {
            assert!((0..i).all(|j| far(object_color(i), object_color(j))), "object {i}");
            assert!(far(object_color(i), STATIC));
        }
    }
}
