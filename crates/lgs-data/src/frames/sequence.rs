//! Gaussians at several times, however they came.

use lgs_core::GaussianCloud;

use super::error::FramesProblem;

/// Gaussians at several times.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSequence {
    /// The Gaussians at the frame nearest to t = 0.
    pub gaussians: GaussianCloud,
    /// Times of the frames, strictly ascending, at least two.
    pub times: Vec<f32>,
    /// Centres, `[T][n]`, world units.
    pub positions: Vec<Vec<[f32; 3]>>,
    /// Quaternions w x y z, `[T][n]`, or `[1][n]` where nothing turns; of any length but zero.
    pub rotations: Vec<Vec<[f32; 4]>>,
}

impl FrameSequence {
    /// Checks that folders and files share; lengths agree already.
    pub(super) fn check(&self) -> Result<(), FramesProblem> {
        if self.times.len() < 2 {
            return Err(FramesProblem::TooFew(self.times.len()));
        }
        if let Some(pair) =
            self.times.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less))
        {
            return Err(FramesProblem::NotAscending { before: pair[0], after: pair[1] });
        }
        if let Some(scale) =
            self.gaussians.log_scales.as_flattened().iter().find(|scale| !scale.exp().is_finite())
        {
            let (expected, found) = ("logarithms of finite scales".to_owned(), scale.to_string());
            return Err(FramesProblem::Tensor { field: "log_scales", expected, found });
        }
        let zero = |q: &[f32; 4]| q.iter().all(|v| v.abs() < f32::MIN_POSITIVE);
        for (frame, row) in self.rotations.iter().enumerate() {
            if let Some(index) = row.iter().position(zero) {
                return Err(FramesProblem::ZeroRotation { frame, index });
            }
        }
        Ok(())
    }
}

/// Which of several ascending times is nearest to 0.
pub(super) fn nearest_to_start(times: &[f32]) -> usize {
    let distance = |i: &usize| times[*i].abs();
    (0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}
