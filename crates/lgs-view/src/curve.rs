//! The training curve as a page draws it: few points, however long training is.

use serde::Serialize;

use crate::thresholds::CURVE_POINTS;

/// The figures of a training step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepSheet {
    /// Name of the stage.
    pub stage: &'static str,
    /// Steps done of the stage.
    pub step: usize,
    /// Steps of the stage in all.
    pub steps: usize,
    /// Loss of the step.
    pub loss: f32,
    /// PSNR of the step's images, dB, where the stage renders.
    pub psnr: Option<f32>,
    /// Number of Gaussians.
    pub gaussians: usize,
}

/// A point of the curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct CurvePoint {
    pub(crate) stage: &'static str,
    pub(crate) step: usize,
    pub(crate) loss: f32,
    pub(crate) psnr: Option<f32>,
    pub(crate) gaussians: usize,
}

/// Points, evenly spaced in steps.
#[derive(Debug)]
pub(crate) struct Curve {
    points: Vec<CurvePoint>,
    /// Every how many reports a point is kept.
    stride: usize,
    reports: usize,
}

impl Default for Curve {
    fn default() -> Self {
        Self { points: Vec::new(), stride: 1, reports: 0 }
    }
}

impl Curve {
    pub(crate) fn points(&self) -> &[CurvePoint] {
        &self.points
    }

    /// Takes note of a step; when there are too many points, every second one goes.
    pub(crate) fn add(&mut self, sheet: &StepSheet) {
        if self.reports.is_multiple_of(self.stride) {
            let &StepSheet { stage, step, loss, psnr, gaussians, .. } = sheet;
            self.points.push(CurvePoint { stage, step, loss, psnr, gaussians });
        }
        self.reports += 1;
        if self.points.len() >= CURVE_POINTS {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_keeps_its_ends_and_stays_short() {
        let mut curve = Curve::default();
        for step in 0..10_000 {
            let psnr = Some(step as f32);
            curve.add(&StepSheet { stage: "source", step, steps: 10_000, loss: 0.1, psnr, gaussians: 5 });
        }
        let points = curve.points();
        assert!(points.len() < CURVE_POINTS && points.len() > CURVE_POINTS / 4, "{}", points.len());
        assert_eq!(points[0].step, 0);
        assert!(points[points.len() - 1].step > 9_900);
        let gaps: Vec<usize> = points.windows(2).map(|pair| pair[1].step - pair[0].step).collect();
        assert!(gaps.iter().all(|gap| *gap == gaps[0]), "{gaps:?}");
    }
}
