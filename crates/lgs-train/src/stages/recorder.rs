//! Recordings of the source's motion, for objects that no law describes.

use lgs_core::GaussianCloud;
use lgs_core::geometry::narrow;
use lgs_core::linear::{quat_mul, quat_normalize};
use lgs_distill::{CoordinatesKind, DistillConfig, Distilled, PartLaw, PartLaws, Trajectories};
use lgs_mechanics::coordinates::Bodies;
use lgs_model::source::SourceModel;
use lgs_model::{GeneralisedDynamics, PartDynamics, Recording};

use super::things::HandledThings;

/// The motion of the source at some times.
#[derive(Clone, Copy)]
pub(super) struct SourceTracks<'a> {
    pub(super) source: &'a dyn SourceModel,
    pub(super) times: &'a [f32],
}

/// The tracks of the source, where no law describes them.
pub(super) struct Recorder<'a> {
    pub(super) tracks: SourceTracks<'a>,
    /// Positions at the times of the tracks.
    pub(super) trajectories: &'a Trajectories,
    pub(super) config: &'a DistillConfig,
    /// Things of which no law of all the window is sought.
    pub(super) handled: &'a HandledThings<'a>,
}

impl Recorder<'_> {
    /// The source's own motion of some of its Gaussians, if what stage 1 has found does not describe it. The
    /// paper's dynamics are never replaced.
    pub(super) fn recording(&self, rows: &[usize], object: &Distilled) -> Option<Recording> {
        let is_paper = self.config.coordinates == CoordinatesKind::Particles;
        let report = object.report();
        if is_paper || (report.describes_window(self.config) && report.parts.is_empty()) {
            return None;
        }
        tracing::debug!(gaussians = rows.len(), "no law describes an object: it plays its source's tracks");
        let recording = self.tracks.recording(rows, &self.trajectories.positions);
        let is_handled = rows.first().is_some_and(|&row| self.handled.has(row));
        recording.map(|recording| recording.with_parts(parts(&report.parts)).of_handled(is_handled))
    }
}

/// Laws of the beginning and the end of a recording as dynamics of all its particles.
pub(super) fn parts(laws: &PartLaws) -> [Option<PartDynamics>; 2] {
    [&laws.first, &laws.last].map(|part| {
        let PartLaw { times, law, start, known } = part.as_ref()?.clone();
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
        Some(PartDynamics { times, dynamics })
    })
}

impl SourceTracks<'_> {
    /// The motion of some Gaussians, given the positions of all at the times of the tracks.
    pub(super) fn recording(&self, rows: &[usize], positions: &[Vec<[f32; 3]>]) -> Option<Recording> {
        let positions = positions.iter().map(|all| rows.iter().map(|&i| all[i]).collect()).collect();
        let start = self.source.cloud_at(self.times[0]).rotations;
        let since_start = |&time: &f32| {
            let now = self.source.cloud_at(time).rotations;
            let turn = |&i: &usize| {
                let [w, x, y, z] = quat_normalize(start[i]);
                quat_mul(quat_normalize(now[i]), [w, -x, -y, -z])
            };
            rows.iter().map(turn).collect()
        };
        Recording::new(self.times.to_vec(), positions, self.times.iter().map(since_start).collect())
    }

    /// Puts some Gaussians where their trajectories are on average, in the shape that they have at half time.
    pub(super) fn bring_to_rest(
        &self,
        cloud: &mut GaussianCloud,
        rows: &[usize],
        trajectories: &Trajectories,
    ) {
        if rows.is_empty() {
            return;
        }
        let middle = self.source.unshaded_at(self.times[self.times.len() / 2]);
        for &row in rows {
            cloud.means[row] = narrow(trajectories.mean_place(row));
            cloud.rotations[row] = middle.rotations[row];
            cloud.log_scales[row] = middle.log_scales[row];
        }
    }

    /// The motion of some Gaussians.
    pub(super) fn of(&self, rows: &[usize]) -> Option<Recording> {
        let positions: Vec<Vec<[f32; 3]>> =
            self.times.iter().map(|&time| self.source.positions_at(time)).collect();
        self.recording(rows, &positions)
    }
}

/// Adds Gaussians at the end.
pub(super) fn append(cloud: &mut GaussianCloud, more: &GaussianCloud) {
    cloud.means.extend_from_slice(&more.means);
    cloud.rotations.extend_from_slice(&more.rotations);
    cloud.log_scales.extend_from_slice(&more.log_scales);
    cloud.raw_opacities.extend_from_slice(&more.raw_opacities);
    cloud.sh.extend_from_slice(&more.sh);
}
