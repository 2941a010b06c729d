//! Errors that are left once an image's exposure is fitted.

use lgs_core::Image;

/// Mean squared difference of the pixels that count, after the least-squares fit of every channel of the
/// first image to the second by a gain and an offset.
pub(crate) fn fitted_mse([image, truth]: [&Image; 2], counts: impl Fn(usize) -> bool) -> f64 {
    let of_channel = |c: usize| {
        let pairs = image.pixels.iter().zip(&truth.pixels).enumerate().filter(|&(i, _)| counts(i));
        let [mut n, mut x, mut y, mut xx, mut xy, mut yy] = [0.0; 6];
        for (_, (p, q)) in pairs {
            let (p, q) = (f64::from(p[c]), f64::from(q[c]));
            n += 1.0;
            (x, y) = (x + p, y + q);
            (xx, xy, yy) = (xx + p * p, xy + p * q, yy + q * q);
        }
        let n = f64::max(n, 1.0);
        let [spread, joint, own] = [xx - x * x / n, xy - x * y / n, yy - y * y / n];
        // A channel of one value is fitted by an offset alone.
        let explained = if spread > 0.0 { joint * joint / spread } else { 0.0 };
        (own - explained).max(0.0) / n
    };
    (0..3).map(of_channel).sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exposure_is_fitted_away_and_a_difference_of_content_is_not() {
        let ramp = |gain: f32, offset: f32| {
            let pixels = (0..256).map(|i| [gain * i as f32 / 255.0 + offset; 3]).collect();
            Image { width: 16, height: 16, pixels }
        };
        let error = |a: &Image, b: &Image| fitted_mse([a, b], |_| true);
        assert!(error(&ramp(0.5, 0.1), &ramp(0.6, 0.2)) < 1e-10);
        let of_ramp = error(&ramp(0.0, 0.5), &ramp(1.0, 0.0));
        assert!((of_ramp - 1.0 / 12.0).abs() < 1e-3, "the variance of a ramp: {of_ramp}");
        assert_eq!(fitted_mse([&ramp(1.0, 0.0), &ramp(0.0, 0.0)], |_| false), 0.0);
    }
}
