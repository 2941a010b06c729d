//! Recordings of the source's motion, for objects that no law describes.

use lgs_core::linear::{quat_mul, quat_normalize};
use lgs_distill::{CoordinatesKind, DistillConfig, Distilled, Trajectories};
use lgs_model::Recording;
use lgs_model::source::SourceModel;

/// The tracks of the source.
pub(super) struct Recorder<'a> {
    pub(super) source: &'a dyn SourceModel,
    pub(super) trajectories: &'a Trajectories,
    pub(super) config: &'a DistillConfig,
}

impl Recorder<'_> {
    /// The source's own motion of some of its Gaussians, if what stage 1 has found does not describe it. The
    /// paper's dynamics are never replaced.
    pub(super) fn recording(&self, rows: &[usize], object: &Distilled) -> Option<Recording> {
        let is_paper = self.config.coordinates == CoordinatesKind::Particles;
        if is_paper || object.report().describes_window(self.config) {
            return None;
        }
        tracing::debug!(gaussians = rows.len(), "no law describes an object: it plays its source's tracks");
        let Trajectories { times, positions, .. } = self.trajectories;
        let positions = positions.iter().map(|all| rows.iter().map(|&i| all[i]).collect()).collect();
        let start = self.source.cloud_at(times[0]).rotations;
        let since_start = |&time: &f32| {
            let now = self.source.cloud_at(time).rotations;
            let turn = |&i: &usize| {
                let [w, x, y, z] = quat_normalize(start[i]);
                quat_mul(quat_normalize(now[i]), [w, -x, -y, -z])
            };
            rows.iter().map(turn).collect()
        };
        Recording::new(times.clone(), positions, times.iter().map(since_start).collect())
    }
}
