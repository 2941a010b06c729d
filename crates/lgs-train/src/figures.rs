//! The figures of training steps, which stay on the device of training until they are read.
//!
//! Reading makes the processor wait for all that the device has been asked to do. On a device that is not
//! the processor figures are therefore read every so many steps, those of all steps since in one transfer.

use burn::tensor::{Device, Tensor};
use lgs_core::psnr_of_mse;

use crate::adam::values;
use crate::checkpoint::Stage;
use crate::device::has_kernels;
use crate::error::TrainError;
use crate::thresholds::EVENT_INTERVAL;

/// The figures of a training step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Photometric loss, mean over the step's frames.
    pub loss: f32,
    /// PSNR of the step's frames before the step, dB, of their mean squared error.
    pub psnr: f32,
}

impl Figures {
    fn of(loss: f32, mse: f64) -> Self {
        Self { loss, psnr: psnr_of_mse(mse) as f32 }
    }
}

/// What a training step reports.
#[derive(Clone, Debug)]
pub struct StepReport(Report);

#[derive(Clone, Debug)]
enum Report {
    Known(Figures),
    /// `[2]`: loss and mean squared error.
    OnDevice(Box<Tensor<1>>),
}

impl StepReport {
    /// Figures of a step on the processor, from its loss and the mean squared error of its frames.
    pub(crate) fn known(loss: f32, mse: f64) -> Self {
        Self(Report::Known(Figures::of(loss, mse)))
    }

    /// Figures of a step from its loss `[1]` and the mean squared errors `[1]` of its frames.
    pub(crate) fn on_device(loss: &Tensor<1>, errors: &[Tensor<1>]) -> Self {
        let mean = Tensor::cat(errors.to_vec(), 0).mean();
        Self(Report::OnDevice(Box::new(Tensor::cat(vec![loss.clone().inner(), mean], 0))))
    }

    /// The figures; waits for the device that made them.
    pub fn figures(&self) -> Figures {
        match &self.0 {
            Report::Known(figures) => *figures,
            Report::OnDevice(pair) => {
                let pair = values(pair);
                Figures::of(pair[0], f64::from(pair[1]))
            }
        }
    }

    /// The device to wait for; none for the processor.
    fn device(&self) -> Option<Device> {
        match &self.0 {
            Report::OnDevice(pair) if has_kernels(&pair.device()) => Some(pair.device()),
            _ => None,
        }
    }
}

/// The figures of some reports, those on a device in one transfer.
fn figures_of(reports: &[StepReport]) -> Vec<Figures> {
    let pairs: Vec<Tensor<1>> = (reports.iter())
        .filter_map(|report| match &report.0 {
            Report::OnDevice(pair) => Some((**pair).clone()),
            Report::Known(_) => None,
        })
        .collect();
    if pairs.len() < reports.len() {
        return reports.iter().map(StepReport::figures).collect();
    }
    let pairs = values(&Tensor::cat(pairs, 0));
    pairs.as_chunks::<2>().0.iter().map(|&[loss, mse]| Figures::of(loss, f64::from(mse))).collect()
}

/// Reads the figures of a stage's steps.
pub(crate) struct FigureReader {
    stage: Stage,
    unread: Vec<(usize, StepReport)>,
    last: Option<Figures>,
}

impl FigureReader {
    /// A reader before the first step.
    pub(crate) fn new(stage: Stage) -> Self {
        Self { stage, unread: Vec::new(), last: None }
    }

    /// Takes a step's report; gives the latest figures that are known: those of this step on the processor,
    /// and elsewhere if it is the first or one of the curve.
    ///
    /// # Errors
    /// If a loss that is read is not finite.
    pub(crate) fn take(&mut self, step: usize, report: StepReport) -> Result<Figures, TrainError> {
        let at_hand = report.device().is_none() || self.last.is_none();
        let is_due = at_hand || step.is_multiple_of(EVENT_INTERVAL);
        self.unread.push((step, report));
        if is_due {
            self.read()?;
        }
        Ok(self.last.unwrap_or(Figures { loss: 0.0, psnr: 0.0 }))
    }

    /// Reads what has not been read; tile lists get the room that the steps since needed.
    ///
    /// # Errors
    /// If a loss is not finite.
    pub(crate) fn read(&mut self) -> Result<(), TrainError> {
        let Some(device) = self.unread.last().map(|(_, report)| report.device()) else { return Ok(()) };
        let (steps, reports): (Vec<usize>, Vec<StepReport>) = self.unread.drain(..).unzip();
        for (step, figures) in steps.into_iter().zip(figures_of(&reports)) {
            if !figures.loss.is_finite() {
                return Err(TrainError::NonFinite { stage: self.stage.name(), step });
            }
            self.last = Some(figures);
        }
        if let Some(device) = device {
            lgs_render::tensor::settle(&device);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceName;

    #[test]
    fn figures_are_those_of_their_step_and_a_loss_that_is_no_number_is_named_by_its_own() {
        let device = DeviceName::Cpu.device().autodiff();
        let report = |loss: f32| {
            let one = |value: f32| Tensor::<1>::from_floats([value], &device);
            StepReport::on_device(&one(loss), &[one(0.02).inner(), one(0.0).inner()])
        };
        let mut reader = FigureReader::new(Stage::Source);
        let figures = reader.take(1, report(0.5)).expect("finite");
        assert_eq!(figures, StepReport::known(0.5, f64::from(0.01_f32)).figures());
        reader.unread = vec![(2, report(0.25)), (3, report(f32::NAN)), (4, report(0.125))];
        let error = reader.read().expect_err("no number").to_string();
        assert!(error.contains('3') && reader.last.is_some_and(|last| last.loss == 0.25), "{error}");
    }
}
