//! What a camera makes of the colours of a scene: exposure and white balance.

/// A gain and an offset of every channel, of display-referred values.
///
/// A change of exposure or white balance multiplies light by a factor k per channel. The transfer curve of
/// sRGB is `1.055 L^(1/2.4) − 0.055` above its toe, so that this is a gain of `k^(1/2.4)` and an offset of
/// 0.055 times that gain minus 1 in display-referred values. These two numbers also describe a black level,
/// and a gain that was applied to display-referred values themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Factor of every channel.
    pub gain: [f32; 3],
    /// What is added to every channel after that.
    pub offset: [f32; 3],
}

impl Default for Exposure {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Exposure {
    /// The exposure that leaves colours as they are.
    pub const IDENTITY: Self = Self { gain: [1.0; 3], offset: [0.0; 3] };

    /// Exposes a drawn image: what covers the background, whose share of each pixel `transmittance` is. The
    /// background is put behind images and is no part of what was photographed.
    ///
    /// # Panics
    /// If there are not as many transmittances as pixels (a bug).
    pub fn expose(&self, pixels: &mut [[f32; 3]], transmittance: &[f32], background: [f32; 3]) {
        self.replace(pixels, transmittance, |c, value, through| {
            let behind = through * background[c];
            self.gain[c] * (value - behind) + self.offset[c] * (1.0 - through) + behind
        });
    }

    /// Exposes the change of a drawn image: the derivative of [`Self::expose`], given the changes of pixels
    /// and transmittances.
    ///
    /// # Panics
    /// If there are not as many transmittances as pixels (a bug).
    pub fn expose_change(&self, pixels: &mut [[f32; 3]], transmittance: &[f32], background: [f32; 3]) {
        self.replace(pixels, transmittance, |c, value, through| {
            let behind = background[c] * (1.0 - self.gain[c]) - self.offset[c];
            self.gain[c] * value + behind * through
        });
    }

    /// Replaces every value, given its channel, itself and its pixel's transmittance; the identity leaves all
    /// as they are.
    fn replace(
        &self,
        pixels: &mut [[f32; 3]],
        transmittance: &[f32],
        exposed: impl Fn(usize, f32, f32) -> f32,
    ) {
        assert_eq!(pixels.len(), transmittance.len(), "pixels and transmittances");
        if *self == Self::IDENTITY {
            return;
        }
        for (pixel, &through) in pixels.iter_mut().zip(transmittance) {
            for (c, value) in pixel.iter_mut().enumerate() {
                *value = exposed(c, *value, through);
            }
        }
    }

    /// The exposure that gives the scene's colours back; nothing where a channel has next to no gain.
    #[must_use]
    pub fn inverse(&self) -> Option<Self> {
        let has_inverse = self.gain.iter().all(|gain| *gain > f32::EPSILON);
        has_inverse.then(|| Self {
            gain: self.gain.map(|gain| 1.0 / gain),
            offset: std::array::from_fn(|c| -self.offset[c] / self.gain[c]),
        })
    }

    /// Largest and root-mean-square change that it makes to a channel of middle grey (0.5), as fractions of
    /// it.
    #[must_use]
    pub fn change_of_grey(&self) -> (f64, f64) {
        let changes = [0, 1, 2].map(|c| f64::from(self.gain[c] - 1.0) + f64::from(self.offset[c]) / 0.5);
        let largest = changes.iter().fold(0.0_f64, |most, change| most.max(change.abs()));
        (largest, (changes.iter().map(|c| c * c).sum::<f64>() / 3.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_background_is_not_exposed() {
        let exposure = Exposure { gain: [1.1, 1.0, 0.9], offset: [0.0, 0.02, 0.0] };
        let mut pixels = vec![[1.0; 3], [0.5; 3], [0.75; 3]];
        exposure.expose(&mut pixels, &[1.0, 0.0, 0.5], [1.0; 3]);
        let expected = [[1.0; 3], [0.55, 0.52, 0.45], [0.775, 0.76, 0.725]];
        for (found, expected) in pixels.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-6, "{pixels:?}");
        }
    }

    #[test]
    fn a_change_is_exposed_as_the_difference_of_two_images() {
        let exposure = Exposure { gain: [1.1, 1.0, 0.9], offset: [0.01, 0.02, -0.03] };
        let (before, after) = ([[0.2, 0.5, 0.7], [1.0; 3]], [[0.3, 0.4, 0.6], [0.8; 3]]);
        let (through, later) = ([0.1, 1.0], [0.3, 0.7]);
        let exposed = |mut pixels: [[f32; 3]; 2], through: &[f32]| {
            exposure.expose(&mut pixels, through, [1.0; 3]);
            pixels
        };
        let (a, b) = (exposed(before, &through), exposed(after, &later));
        let minus = |a: f32, b: f32| b - a;
        let mut change: [[f32; 3]; 2] =
            std::array::from_fn(|p| std::array::from_fn(|c| minus(before[p][c], after[p][c])));
        exposure.expose_change(&mut change, &[later[0] - through[0], later[1] - through[1]], [1.0; 3]);
        for p in 0..2 {
            for c in 0..3 {
                assert!((change[p][c] - (b[p][c] - a[p][c])).abs() < 1e-6, "{change:?}");
            }
        }
    }

    #[test]
    fn the_inverse_gives_colours_back_whatever_covers_the_background() {
        let exposure = Exposure { gain: [1.1, 1.0, 0.9], offset: [0.01, 0.02, -0.03] };
        let drawn = [[0.2, 0.5, 0.7], [0.6, 0.4, 0.9], [1.0; 3]];
        let mut pixels = drawn;
        let through = [0.0, 0.3, 1.0];
        exposure.expose(&mut pixels, &through, [1.0; 3]);
        exposure.inverse().expect("gains").expose(&mut pixels, &through, [1.0; 3]);
        for (found, expected) in pixels.as_flattened().iter().zip(drawn.as_flattened()) {
            assert!((found - expected).abs() < 1e-6, "{pixels:?}");
        }
        assert!(Exposure { gain: [1.0, 0.0, 1.0], ..exposure }.inverse().is_none());
    }

    #[test]
    fn light_times_a_factor_is_a_gain_and_an_offset_in_display_referred_values() {
        let displayed = |light: f32| 1.055 * light.powf(1.0 / 2.4) - 0.055;
        let gain = 1.3_f32.powf(1.0 / 2.4);
        let exposure = Exposure { gain: [gain; 3], offset: [0.055 * (gain - 1.0); 3] };
        for light in [0.01, 0.2, 0.6] {
            let mut pixel = [[displayed(light); 3]];
            exposure.expose(&mut pixel, &[0.0], [1.0; 3]);
            assert!((pixel[0][0] - displayed(1.3 * light)).abs() < 1e-6);
        }
    }
}
