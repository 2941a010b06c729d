//! Lenses: where a ray that a pinhole would send to one place of the image lands through a real lens.
//!
//! Coordinates are those of the ideal image plane at depth 1, `x = X/Z`, `y = Y/Z`. The models are OpenCV's:
//!
//! - radial and tangential (`calib3d`, "camera calibration"): with r² = x² + y² and
//!   s = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶),
//!   `x' = x s + 2 p1 x y + p2 (r² + 2 x²)`, `y' = y s + p1 (r² + 2 y²) + 2 p2 x y`;
//! - fisheye (Kannala and Brandt 2006): with θ = arctan r and θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸),
//!   `(x', y') = (x, y) θ' / r`.
//!
//! Beyond some radius the polynomials of a calibration turn back and send different rays to one place. That
//! radius is where the derivative of the radial part first vanishes: [`Lens::reach`].

use super::error::Problem;
use crate::thresholds::{LENS_SCAN, MAX_LENS_COEFFICIENT};

/// A lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Lens {
    /// None: a pinhole.
    #[default]
    Pinhole,
    /// Radial coefficients k1 … k6, tangential p1 and p2.
    Radial {
        /// k1, k2, k3 above and k4, k5, k6 below the line.
        radial: [f64; 6],
        /// p1, p2.
        tangential: [f64; 2],
    },
    /// Coefficients k1 … k4.
    Fisheye([f64; 4]),
}

impl Lens {
    /// A radial and tangential lens; a pinhole if all is zero.
    pub(super) fn radial(radial: [f64; 6], tangential: [f64; 2]) -> Self {
        if radial.iter().chain(&tangential).all(|&v| v == 0.0) {
            Self::Pinhole
        } else {
            Self::Radial { radial, tangential }
        }
    }

    /// The lens of a list of coefficients in OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6, which may end after two,
    /// four, five or eight; nothing if it has another length.
    pub(super) fn of_opencv(values: &[f64]) -> Option<Self> {
        if ![0, 1, 2, 4, 5, 8].contains(&values.len()) {
            return None;
        }
        let at = |i: usize| values.get(i).copied().unwrap_or(0.0);
        Some(Self::radial([at(0), at(1), at(4), at(5), at(6), at(7)], [at(2), at(3)]))
    }

    /// Refuses coefficients that are not finite or that no lens has.
    pub(super) fn check(&self, frame: usize, field: &'static str) -> Result<(), Problem> {
        let values: Vec<f64> = match self {
            Self::Pinhole => Vec::new(),
            Self::Radial { radial, tangential } => radial.iter().chain(tangential).copied().collect(),
            Self::Fisheye(k) => k.to_vec(),
        };
        match values.into_iter().find(|v| !(v.is_finite() && v.abs() <= MAX_LENS_COEFFICIENT)) {
            Some(v) => {
                let expected = "finite and of a size that a lens has";
                Err(Problem::Value { frame, field, expected, found: v.to_string() })
            }
            None => Ok(()),
        }
    }

    /// Where the lens sends the ray of a place of the ideal image plane.
    pub(super) fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let r2 = x * x + y * y;
        match self {
            Self::Pinhole => [x, y],
            Self::Radial { tangential: [p1, p2], .. } => {
                let s = self.magnification(r2.sqrt());
                [
                    x * s + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                    y * s + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
                ]
            }
            Self::Fisheye(_) => {
                let s = self.magnification(r2.sqrt());
                [x * s, y * s]
            }
        }
    }

    /// The factor of a radius, without the tangential part.
    fn magnification(&self, r: f64) -> f64 {
        let r2 = r * r;
        match self {
            Self::Pinhole => 1.0,
            Self::Radial { radial: [k1, k2, k3, k4, k5, k6], .. } => {
                let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                above / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let angle = r.atan();
                let a2 = angle * angle;
                let bent = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
                if r > 0.0 { bent / r } else { 1.0 }
            }
        }
    }

    /// The radius of the ideal image plane, at most `limit`, up to which farther rays land farther out.
    pub(super) fn reach(&self, limit: f64) -> f64 {
        let image = |i: usize| {
            let r = limit * i as f64 / LENS_SCAN as f64;
            r * self.magnification(r)
        };
        let rises = |i: &usize| image(*i) > image(*i - 1);
        let last = (1..=LENS_SCAN).take_while(rises).last().unwrap_or(0);
        limit * last as f64 / LENS_SCAN as f64
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The place of the ideal image plane that a lens sends to `target`, by Newton's method.
    pub(in crate::dataset) fn undistorted(lens: &Lens, target: [f64; 2]) -> [f64; 2] {
        let mut at = target;
        for _ in 0..50 {
            let h = 1e-7;
            let now = lens.distorted(at);
            let by = |i: usize| {
                let mut moved = at;
                moved[i] += h;
                lens.distorted(moved).map(|v| v)
            };
            let [dx, dy] = [by(0), by(1)].map(|p| [(p[0] - now[0]) / h, (p[1] - now[1]) / h]);
            let (u, v) = (target[0] - now[0], target[1] - now[1]);
            let determinant = dx[0] * dy[1] - dy[0] * dx[1];
            at[0] += (u * dy[1] - v * dy[0]) / determinant;
            at[1] += (v * dx[0] - u * dx[1]) / determinant;
        }
        at
    }

    pub(in crate::dataset) fn lenses() -> [Lens; 3] {
        [
            Lens::of_opencv(&[-0.28, 0.09, 1e-3, -2e-3, -0.01]).unwrap(),
            Lens::of_opencv(&[0.1, 0.02, 0.0, 1e-3, 0.0, 0.05, 0.01, 0.0]).unwrap(),
            Lens::Fisheye([0.03, -0.01, 0.004, -0.001]),
        ]
    }

    #[test]
    fn what_a_lens_does_can_be_undone() {
        for lens in lenses() {
            for place in [[0.0, 0.0], [0.3, -0.2], [-0.6, 0.5]] {
                let back = undistorted(&lens, lens.distorted(place));
                assert!((0..2).all(|i| (back[i] - place[i]).abs() < 1e-9), "{lens:?}: {back:?}");
            }
        }
    }

    #[test]
    fn the_reach_ends_where_the_image_turns_back() {
        // r (1 − r²/3) has its maximum at 1.
        let lens = Lens::of_opencv(&[-1.0 / 3.0, 0.0]).unwrap();
        assert!((lens.reach(3.0) - 1.0).abs() < 5e-3, "{}", lens.reach(3.0));
        assert_eq!(lens.reach(0.8), 0.8);
        assert_eq!(Lens::Fisheye([0.0; 4]).reach(50.0), 50.0, "arctan never turns");
    }

    #[test]
    fn lists_of_coefficients_have_opencv_s_order_and_lengths() {
        assert_eq!(Lens::of_opencv(&[0.0; 5]), Some(Lens::Pinhole));
        assert_eq!(Lens::of_opencv(&[0.1; 3]), None);
        let Some(Lens::Radial { radial, tangential }) = Lens::of_opencv(&[1.0, 2.0, 3.0, 4.0, 5.0]) else {
            panic!("a radial lens")
        };
        assert_eq!((radial, tangential), ([1.0, 2.0, 5.0, 0.0, 0.0, 0.0], [3.0, 4.0]));
        assert!(Lens::Fisheye([f64::NAN; 4]).check(3, "k1").is_err());
    }
}
