//! The figures of a run, one file each.

mod beta_sweep;
mod extrapolation;
mod field;
mod over_time;
mod partition;
mod potential;
mod reversal;
mod rig;
mod strip;
mod suite;
mod training;
mod trajectories;

pub use partition::coloured_partition;
pub use rig::rig_figure;
pub(crate) use suite::suite_figure;

use lgs_core::Camera;
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::laws::trusted_times;
use lgs_eval::physics::Truth;
use lgs_eval::physics::potential::true_forces;
use lgs_model::Motion;

use self::over_time::Span;
use crate::canvas::Figure;
use crate::error::ReportError;
use crate::paths::Paths;
use crate::subject::RunSubject;
use crate::views::longest_view;

/// All figures that a run has something for, in the order of the page.
///
/// # Errors
/// If plotters cannot draw.
pub fn run_figures(subject: &RunSubject<'_>) -> Result<Vec<Figure>, ReportError> {
    let _span = tracing::trace_span!("figures").entered();
    let scene = subject.scene;
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let truth = subject.truth.and_then(Truth::new);
    let paths = Paths::of(scene, &mut motion, subject.source, truth.as_ref());
    let forces = truth.as_ref().map(|t| true_forces(scene, t)).unwrap_or_default();
    let coloured = coloured_partition(scene, &mut motion);
    let window = f64::from(scene.motion.time_window);
    // An object without a law makes no claim beyond the window.
    let trusted = trusted_times(&subject.metrics.physics.objects, window).unwrap_or([0.0, window]);
    let span = Span { window, trusted: (!scene.objects.is_empty()).then_some(trusted) };
    let images = match subject.dataset {
        Some(dataset) => {
            extrapolation::figure((scene, &mut motion), subject.source, dataset, (subject.metrics, span))?
        }
        None => None,
    };
    let figures = [
        images,
        over_time::psnr(subject.metrics, span)?,
        if paths.particles.is_empty() { None } else { trajectories::figure(&paths)? },
        over_time::position_error(&paths, span)?,
        potential::figure(scene, &paths, &forces)?,
        beta_sweep::figure(&subject.metrics.physics)?,
        reversal::figure((scene, &mut motion), subject.dataset, subject.cameras, span)?,
        partition::figure((scene, &mut motion), &coloured, camera(subject))?,
        training::figure(subject.training)?,
    ];
    Ok(figures.into_iter().flatten().collect())
}

/// The camera of figures that show one moment.
fn camera(subject: &RunSubject<'_>) -> Option<Camera> {
    let of_dataset = subject.dataset.and_then(|d| longest_view(d).first().map(|f| f.camera));
    of_dataset.or(subject.cameras.first().copied())
}
