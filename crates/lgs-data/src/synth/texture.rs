//! Colours as smooth functions of a position in the body's own axes.
//!
//! Two colours alternate in soft blobs, and a third, with the same blobs as highlights, replaces them in
//! patches of twice the size, so that no two places look alike and every rotation and displacement shows. The
//! wavelengths keep details above about an eighth of an object, which a few thousand Gaussians can reproduce
//! at 160 pixels.
//!
//! Shading is soft and fixed to the body unless a scene is asked for with a sun ([`super::sun`]): a lamp that
//! rides along. With a lamp in the world the colour of a turning surface changes with time, and what a model
//! misses of that would hide the motion that is judged.

use glam::DVec3;

/// A pattern.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
    /// The two colours that alternate, and the wash.
    pub(super) colors: [DVec3; 3],
    /// Wavelength of the alternation, world units.
    pub(super) wavelength: f64,
    /// Strength of the alternation: 0 is plain.
    pub(super) contrast: f64,
    /// Shifts the pattern, radians.
    pub(super) phase: f64,
}

/// Directions of the three waves of a blob pattern; oblique, so that no face of a box is parallel to one.
const WAVES: [DVec3; 3] =
    [DVec3::new(0.80, 0.36, 0.48), DVec3::new(-0.48, 0.80, 0.36), DVec3::new(0.36, -0.48, 0.80)];
/// Towards the lamp, body axes.
const LAMP: DVec3 = DVec3::new(0.36, -0.48, 0.80);

impl Texture {
    /// A pattern of two hex colours (`0xRRGGBB`) with a wash of a third.
    pub(super) fn new(colors: [u32; 3], wavelength: f64) -> Self {
        Self { colors: colors.map(rgb), wavelength, contrast: 1.0, phase: 0.0 }
    }

    /// The pattern with a weaker or stronger alternation.
    pub(super) fn with_contrast(self, contrast: f64) -> Self {
        Self { contrast, ..self }
    }

    /// The colour under a lamp that rides along at a point with a unit normal, both in body axes; channels in
    /// [0, 1].
    pub(super) fn color(&self, p: DVec3, normal: DVec3) -> DVec3 {
        let light = 0.82 + 0.18 * normal.dot(LAMP);
        (self.reflectance(p) * light).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// The colour in white light from everywhere at a point in body axes.
    pub(super) fn reflectance(&self, p: DVec3) -> DVec3 {
        let mix = 0.5 + 0.5 * self.contrast * saturated(self.waves(p, self.wavelength, self.phase));
        let wash = 0.5 + 0.5 * saturated(self.waves(p, 2.3 * self.wavelength, 1.7 - self.phase));
        let washed = self.colors[2].lerp(DVec3::ONE, 0.4 * mix);
        self.colors[0].lerp(self.colors[1], mix).lerp(washed, 0.9 * wash)
    }

    fn waves(&self, p: DVec3, wavelength: f64, phase: f64) -> f64 {
        let k = std::f64::consts::TAU / wavelength;
        WAVES.iter().enumerate().map(|(i, w)| (k * w.dot(p) + phase + 2.1 * i as f64).sin()).sum::<f64>()
            / 1.5
    }
}

/// A soft step from −1 to 1; cheaper than a hyperbolic tangent.
fn saturated(v: f64) -> f64 {
    let v = 2.2 * v;
    v / (1.0 + v * v).sqrt()
}

fn rgb(hex: u32) -> DVec3 {
    DVec3::new(f64::from(hex >> 16 & 255), f64::from(hex >> 8 & 255), f64::from(hex & 255)) / 255.0
}
