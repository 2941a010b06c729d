//! A sweep over times: clouds in the order of the times, a few at a time, handed to whatever draws or writes
//! them.

use anyhow::Result;
use clap::ValueEnum;
use lgs_core::GaussianCloud;
use lgs_data::edit::MotionEdit;
use lgs_dynamics::{Edit, Reversal};
use rayon::prelude::*;

use super::progress::Task;
use super::thresholds::CLOUDS_AT_ONCE;

/// Manipulations of a scene's motion, as flags.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct MotionArgs {
    /// α: multiplies the velocities at t = 0; −10 to 10, as the other scales
    #[arg(long, value_name = "ALPHA", default_value_t = 1.0)]
    #[arg(allow_hyphen_values = true, value_parser = edit_scale)]
    velocity_scale: f32,
    /// β: multiplies the potential
    #[arg(long, value_name = "BETA", default_value_t = 1.0)]
    #[arg(allow_hyphen_values = true, value_parser = edit_scale)]
    potential_scale: f32,
    /// γ: multiplies the force
    #[arg(long, value_name = "GAMMA", default_value_t = 1.0)]
    #[arg(allow_hyphen_values = true, value_parser = edit_scale)]
    force_scale: f32,
    /// How times before 0 are reached
    #[arg(long, value_enum, default_value_t = ReversalName::Exact)]
    reversal: ReversalName,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ReversalName {
    /// The inverse of the forward step
    Exact,
    /// The forward step with a negative time step, as published
    NegatedStep,
}

/// Parses a scale of an edit and checks its declared range.
fn edit_scale(text: &str) -> Result<f32, String> {
    let value = text.parse::<f64>().map_err(|_| "expected a number".to_owned())?;
    MotionEdit::checked_scale(value).map(|value| value as f32)
}

impl MotionArgs {
    /// The scales as an edit of the dynamics.
    pub(crate) fn edit(&self) -> Edit {
        Edit {
            velocity_scale: self.velocity_scale,
            potential_scale: self.potential_scale,
            force_scale: self.force_scale,
        }
    }

    /// The way to times before 0.
    pub(crate) fn reversal(&self) -> Reversal {
        match self.reversal {
            ReversalName::Exact => Reversal::Exact,
            ReversalName::NegatedStep => Reversal::NegatedStep,
        }
    }
}

/// Calls `work` with the index and cloud of every time, in parallel, and returns its results in the order of
/// the times.
pub(crate) fn sweep<T: Send>(
    mut cloud_at: impl FnMut(f32) -> GaussianCloud,
    times: &[f32],
    name: &str,
    work: impl Fn(usize, &GaussianCloud) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let mut results = Vec::with_capacity(times.len());
    let take = |result| {
        results.push(result);
        Ok(())
    };
    sweep_in_order(name, times.len(), |index| Ok(cloud_at(times[index])), work, take)?;
    Ok(results)
}

/// Makes `count` subjects in their order, calls `work` with each in parallel, and hands on its results in
/// their order, a few at a time.
pub(crate) fn sweep_in_order<S: Send + Sync, T: Send>(
    name: &str,
    count: usize,
    mut subject: impl FnMut(usize) -> Result<S>,
    work: impl Fn(usize, &S) -> Result<T> + Sync,
    mut take: impl FnMut(T) -> Result<()>,
) -> Result<()> {
    let _span = tracing::trace_span!("frames").entered();
    let task = Task::new(name, count as u64);
    let indices: Vec<usize> = (0..count).collect();
    for chunk in indices.chunks(CLOUDS_AT_ONCE) {
        let subjects = chunk.iter().map(|&i| Ok((i, subject(i)?))).collect::<Result<Vec<(usize, S)>>>()?;
        let results =
            subjects.par_iter().map(|(i, subject)| work(*i, subject)).collect::<Result<Vec<T>>>()?;
        results.into_iter().try_for_each(&mut take)?;
        task.count(chunk.last().map_or(count, |last| last + 1), count);
    }
    Ok(())
}

/// File name of a frame: its number and its time, so that names sort in the order of the times given.
pub(crate) fn file_name(index: usize, time: f32, extension: &str) -> String {
    format!("{index:04}_t{time:+.4}.{extension}")
}
