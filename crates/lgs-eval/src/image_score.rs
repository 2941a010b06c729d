//! Scores of one rendered image against the true one (method §7).
//!
//! Both images are rounded to 8 bits first, as if they had been written and read back; with
//! [`Scoring::half_resolution`] they are then averaged to half their size, without rounding again. (Where the
//! true image is half transparent, the published scripts truncate what we round: less than one level of 255,
//! and nothing where it is opaque.) An object scene is mostly background, which any model paints perfectly,
//! so PSNR is also taken over the foreground alone: the union of the true and the predicted one. With alpha
//! in the images the true foreground is `alpha > 0.5` and the predicted one `1 − transmittance > 0.5`. Opaque
//! images say nothing about what is background, so both are then the pixels whose colour differs from the
//! background colour in a channel by more than 10 of 255 levels; for a room that is nearly everything. That
//! second mask is always scored too (`psnr_content`), because some sets paint a white floor that is opaque
//! but as flattering as an empty background. The silhouette's PSNR compares the two foregrounds by opacity as
//! binary images. Pixels that a frame's mask leaves out are in no figure.
//!
//! Cameras of a capture expose differently, and no training image tells how a held-out one does. PSNR is
//! therefore also taken after every channel of the prediction was fitted to the truth by a gain and an offset
//! (`psnr_fitted`): beside the others, never in their place.

use lgs_core::{Image, psnr_of_mse};
use serde::{Deserialize, Serialize};

use crate::fitted::fitted_mse;
use crate::half_size::{halved, halved_pixels};
use crate::lpips::{Perceptual, PerceptualScore};
use crate::thresholds::{CONTENT_THRESHOLD, OPACITY_THRESHOLD};

/// The rule by which foreground is told from background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForegroundRule {
    /// By opacity: the images have an alpha channel.
    Opacity,
    /// By difference from the background colour: the images are opaque.
    Colour,
}

/// The conditions under which images are compared.
#[derive(Clone, Copy, Debug)]
pub struct Scoring<'a> {
    /// Colour that both models are drawn on and true images are composited over.
    pub background: [f32; 3],
    /// The pixels that count as foreground.
    pub rule: ForegroundRule,
    /// Compare at half the size.
    pub half_resolution: bool,
    /// Networks of LPIPS, if there are weights.
    pub perceptual: Option<&'a Perceptual>,
}

/// An image with the foreground it shows.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Colours, rounded to 8 bits, then perhaps averaged to half the size.
    pub image: Image,
    /// Whether each pixel is foreground.
    pub foreground: Vec<bool>,
    /// Whether each pixel differs from the background colour.
    pub content: Vec<bool>,
    /// Whether each pixel of a true image counts; nothing where all do.
    pub counted: Option<Vec<bool>>,
}

impl Picture {
    /// Rounds an image and finds its foreground; `opacity` is `[height · width]`, in [0, 1].
    #[must_use]
    pub fn new(image: &Image, opacity: impl Iterator<Item = f32>, scoring: &Scoring<'_>) -> Self {
        let mut opacity: Vec<[f32; 1]> = opacity.map(|o| [o]).collect();
        let mut image = image.quantized();
        if scoring.half_resolution {
            opacity = halved_pixels(&opacity, [image.width as usize, image.height as usize]);
            image = halved(&image);
        }
        let content: Vec<bool> = image.pixels.iter().map(|&p| differs(p, scoring.background)).collect();
        let foreground = match scoring.rule {
            ForegroundRule::Opacity => opacity.iter().map(|[o]| *o > OPACITY_THRESHOLD).collect(),
            ForegroundRule::Colour => content.clone(),
        };
        assert_eq!(foreground.len(), image.pixels.len(), "opacity and pixels");
        Self { image, foreground, content, counted: None }
    }

    /// The picture of a frame, in which pixels with a weight of 0 are left out; `weights` are of the image
    /// before it is halved.
    #[must_use]
    pub fn counting(self, weights: Option<Vec<f32>>, scoring: &Scoring<'_>, size: [usize; 2]) -> Self {
        let counted = weights.map(|weights| {
            let mut weights: Vec<[f32; 1]> = weights.into_iter().map(|w| [w]).collect();
            if scoring.half_resolution {
                weights = halved_pixels(&weights, size);
            }
            weights.iter().map(|[w]| *w == 1.0).collect()
        });
        Self { counted, ..self }
    }

    /// Number of foreground pixels.
    #[must_use]
    pub fn foreground_pixels(&self) -> usize {
        self.foreground.iter().filter(|&&inside| inside).count()
    }
}

fn differs(pixel: [f32; 3], background: [f32; 3]) -> bool {
    pixel.iter().zip(background).any(|(p, b)| (p - b).abs() > CONTENT_THRESHOLD)
}

/// Scores of one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageScore {
    /// Mean squared error over all pixels and channels.
    pub mse: f64,
    /// PSNR over all pixels, dB.
    pub psnr: f64,
    /// PSNR over the union of both foregrounds, dB; nothing if there is none in either.
    pub psnr_foreground: Option<f64>,
    /// PSNR over the pixels of either image that differ from the background colour, dB.
    pub psnr_content: Option<f64>,
    /// PSNR of the two foregrounds as binary images, dB; nothing without opacity.
    pub psnr_silhouette: Option<f64>,
    /// PSNR over all pixels once each channel of the prediction is fitted by a gain and an offset, dB.
    pub psnr_fitted: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// LPIPS, filled in by who has the networks.
    pub perceptual: PerceptualScore,
    /// Foreground pixels of the prediction.
    pub predicted_pixels: usize,
    /// Foreground pixels of the truth.
    pub true_pixels: usize,
}

/// Scores a prediction, all but LPIPS; both pictures must have one size.
#[must_use]
pub fn score(predicted: &Picture, truth: &Picture, rule: ForegroundRule) -> ImageScore {
    let squared = squared_errors(&predicted.image, &truth.image);
    let counts = |i: usize| truth.counted.as_ref().is_none_or(|counted| counted[i]);
    let mse = masked_mse(&squared, counts).unwrap_or(0.0);
    let union =
        |a: &[bool], b: &[bool]| masked_mse(&squared, |i| counts(i) && (a[i] || b[i])).map(psnr_of_mse);
    // Pixels that are left out are alike in both images.
    let part = (0..squared.len()).filter(|&i| counts(i)).count().max(1) as f64 / squared.len().max(1) as f64;
    let ssim = 1.0 - (1.0 - f64::from(lgs_render::ssim(&predicted.image, &truth.image))) / part;
    ImageScore {
        mse,
        psnr: psnr_of_mse(mse),
        psnr_foreground: union(&predicted.foreground, &truth.foreground),
        psnr_content: union(&predicted.content, &truth.content),
        psnr_silhouette: (rule == ForegroundRule::Opacity)
            .then(|| silhouette_psnr(&predicted.foreground, &truth.foreground)),
        psnr_fitted: psnr_of_mse(fitted_mse([&predicted.image, &truth.image], counts)),
        ssim,
        perceptual: PerceptualScore::default(),
        predicted_pixels: predicted.foreground_pixels(),
        true_pixels: truth.foreground_pixels(),
    }
}

/// PSNR of two binary images.
fn silhouette_psnr(a: &[bool], b: &[bool]) -> f64 {
    let wrong = a.iter().zip(b).filter(|(a, b)| a != b).count();
    psnr_of_mse(wrong as f64 / a.len().max(1) as f64)
}

/// Mean squared difference of every pixel over its channels.
fn squared_errors(a: &Image, b: &Image) -> Vec<f64> {
    assert_eq!((a.width, a.height), (b.width, b.height), "image sizes");
    let error =
        |(p, q): (&[f32; 3], &[f32; 3])| (0..3).map(|c| f64::from(p[c] - q[c]).powi(2)).sum::<f64>() / 3.0;
    a.pixels.iter().zip(&b.pixels).map(error).collect()
}

fn masked_mse(squared: &[f64], inside: impl Fn(usize) -> bool) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (_, error) in squared.iter().enumerate().filter(|&(i, _)| inside(i)) {
        sum += error;
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [f32; 3] = [1.0; 3];

    fn picture(pixels: Vec<[f32; 3]>, opacity: &[f32], rule: ForegroundRule) -> Picture {
        scored(pixels, opacity, Scoring { background: WHITE, rule, half_resolution: false, perceptual: None })
    }

    fn scored(pixels: Vec<[f32; 3]>, opacity: &[f32], scoring: Scoring<'_>) -> Picture {
        let side = (pixels.len() as f32).sqrt() as u32;
        Picture::new(&Image { width: side, height: side, pixels }, opacity.iter().copied(), &scoring)
    }

    fn score(predicted: &Picture, truth: &Picture) -> ImageScore {
        super::score(predicted, truth, ForegroundRule::Opacity)
    }

    #[test]
    fn a_tenth_of_error_everywhere_is_twenty_decibels() {
        let a = picture(vec![[0.2; 3]; 256], &[1.0; 256], ForegroundRule::Opacity);
        let b = picture(vec![[0.3; 3]; 256], &[1.0; 256], ForegroundRule::Opacity);
        let s = score(&a, &b);
        // 0.2 and 0.3 round to 51/255 and 77/255 (76.5 rounds up).
        let expected = -20.0 * (26.0_f64 / 255.0).log10();
        assert!((s.psnr - expected).abs() < 1e-4, "{s:?}");
        assert!((s.psnr_foreground.expect("foreground") - expected).abs() < 1e-4);
    }

    #[test]
    fn identical_images_score_a_hundred_decibels_and_full_similarity() {
        let a =
            picture((0..256).map(|i| [i as f32 / 255.0; 3]).collect(), &[1.0; 256], ForegroundRule::Opacity);
        let s = score(&a, &a);
        assert_eq!(s.psnr, 100.0);
        assert!((s.ssim - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_foreground_is_the_union_of_both() {
        let mut opacity_a = vec![0.0; 256];
        let mut opacity_b = opacity_a.clone();
        let (mut a, mut b) = (vec![WHITE; 256], vec![WHITE; 256]);
        (opacity_a[0], a[0]) = (1.0, [0.0; 3]);
        (opacity_b[1], b[1]) = (1.0, [0.0; 3]);
        let s = score(
            &picture(a, &opacity_a, ForegroundRule::Opacity),
            &picture(b, &opacity_b, ForegroundRule::Opacity),
        );
        assert_eq!(s.psnr_foreground, Some(0.0), "both pixels of the union are wrong by one");
        assert!((s.psnr - -10.0 * (2.0_f64 / 256.0).log10()).abs() < 1e-9);
        assert_eq!((s.predicted_pixels, s.true_pixels), (1, 1));
    }

    #[test]
    fn opaque_images_take_what_differs_from_the_background() {
        let mut pixels = vec![WHITE; 256];
        pixels[7] = [0.5; 3];
        pixels[8] = [0.99; 3];
        let a = picture(pixels, &[1.0; 256], ForegroundRule::Colour);
        assert_eq!(a.foreground_pixels(), 1);
    }

    #[test]
    fn the_silhouette_counts_pixels_that_only_one_of_both_shows() {
        let shown = |n: usize| (0..256).map(|i| f32::from(u8::from(i < n))).collect::<Vec<f32>>();
        let of = |n: usize| picture(vec![WHITE; 256], &shown(n), ForegroundRule::Opacity);
        let psnr = score(&of(40), &of(16)).psnr_silhouette.expect("opacity");
        assert!((psnr - -10.0 * (24.0_f64 / 256.0).log10()).abs() < 1e-9);
        assert_eq!(score(&of(16), &of(16)).psnr_silhouette, Some(100.0));
        assert_eq!(super::score(&of(40), &of(16), ForegroundRule::Colour).psnr_silhouette, None);
    }

    #[test]
    fn half_resolution_averages_what_was_rounded() {
        // Columns of 0.2 (51 of 255) and 0.3 (77): their mean is no multiple of 1/255 and must not be rounded
        // again.
        let columns: Vec<[f32; 3]> = (0..256).map(|i| [if i % 2 == 0 { 0.2 } else { 0.3 }; 3]).collect();
        let rule = ForegroundRule::Opacity;
        let halved = Scoring { background: WHITE, rule, half_resolution: true, perceptual: None };
        let small = scored(columns, &[1.0; 256], halved);
        assert_eq!((small.image.width, small.image.height, small.foreground_pixels()), (8, 8, 64));
        assert!(small.image.pixels.iter().all(|p| (p[0] - 64.0 / 255.0).abs() < 1e-6));
    }

    #[test]
    fn an_empty_foreground_has_no_score() {
        let a = picture(vec![WHITE; 256], &[0.0; 256], ForegroundRule::Opacity);
        assert_eq!(score(&a, &a).psnr_foreground, None);
    }
}
