//! The poses of a rigid body over time, with their noise.

use super::inertia::of_particles;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::LEAST_ARM;
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, nearest_rotation, quaternion, trace};
use lgs_mechanics::Candidate;
use lgs_mechanics::choose::{
    Choice, DESCRIBED, candidates, choose_among_neighbours, choose_as_simple, choose_beside, choose_further,
    further_candidates, surrounded_candidates,
};
use lgs_mechanics::coordinates::{Coordinates, Hinge, Inertia};
use lgs_mechanics::fit::Track;
use lgs_mechanics::noise::{Noise, SampleTimes};
use lgs_mechanics::terms::{Role, Scales};

/// Which laws are admitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Laws {
    /// Those without a force Q, as without the force in the paper's ablation.
    Conservative,
    /// All.
    All,
}

impl Laws {
    /// The admitted laws in some coordinates.
    pub(super) fn candidates(self, coordinates: &Coordinates) -> Vec<Candidate> {
        self.admitted(candidates(coordinates))
    }

    /// The admitted ones of the laws that are sought where none of [`Self::candidates`] explains a motion.
    pub(super) fn further(self, coordinates: &Coordinates) -> Vec<Candidate> {
        self.admitted(further_candidates(coordinates))
    }

    /// Those of surroundings that move, which are sought last.
    pub(super) fn surrounded(self, coordinates: &Coordinates) -> Vec<Candidate> {
        self.admitted(surrounded_candidates(coordinates))
    }

    fn admitted(self, list: Vec<Candidate>) -> Vec<Candidate> {
        list.into_iter().filter(|candidate| self.admits(candidate)).collect()
    }

    fn admits(self, candidate: &Candidate) -> bool {
        self == Self::All || candidate.terms.iter().all(|term| term.kind.role() == Role::Conserves)
    }
}

/// Poses of a body, times counted from the first sample.
#[derive(Clone)]
pub(super) struct ObservedPoses {
    pub(super) times: Vec<f64>,
    pub(super) poses: Vec<Pose>,
    /// Standard deviation of each pose in units of the usual one; empty where all are alike.
    pub(super) deviations: Vec<f64>,
    /// Principal axes and moments of the particles' second moments.
    pub(super) inertia: Inertia,
    /// The same poses in rigid coordinates.
    pub(super) track: Track,
    /// Laws that are admitted.
    pub(super) laws: Laws,
    /// Whether a simple law explains the poses already: others are its rivals at most.
    pub(super) is_explained: bool,
    /// Whether the body slides on a plane at rest.
    pub(super) slides: bool,
    rigid: Coordinates,
    /// Root mean square distance of the particles from the centre.
    radius: f64,
    resolution: f64,
    /// Factor of the variance of the noise, for errors that the scatter of the poses does not tell of.
    inflation: f64,
}

impl ObservedPoses {
    /// The poses of a shared motion. `resolution` is a length that the source of the tracks does not resolve:
    /// no pose is known better.
    pub(super) fn new(motion: &SharedMotion, laws: Laws, resolution: f64) -> Self {
        let inertia = of_particles(&motion.covariance());
        let rigid = Coordinates::Rigid(inertia);
        let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
        let x = configurations(&motion.poses, &inertia);
        let mut track = Track::new(&rigid, motion.samples(&times), &x);
        let radius = trace(&motion.covariance()).sqrt();
        coarsen(&mut track.noise[..3], resolution / radius.max(f64::MIN_POSITIVE));
        coarsen(&mut track.noise[3..], resolution);
        Self {
            times,
            poses: motion.poses.clone(),
            deviations: motion.deviations.clone(),
            inertia,
            track,
            laws,
            is_explained: false,
            slides: false,
            rigid,
            radius,
            resolution,
            inflation: 1.0,
        }
    }

    /// The times of the poses, with how well each is known.
    pub(super) fn samples(&self) -> SampleTimes<'_> {
        SampleTimes { times: &self.times, deviations: &self.deviations }
    }

    /// The likeliest of some laws of a track of the body.
    pub(super) fn choose(&self, list: &[Candidate], track: &Track, scales: &Scales) -> Option<Choice> {
        choose_beside(list, track, scales, if self.is_explained { 0 } else { usize::MAX })
    }

    /// χ² up to which a motion is explained, to within its scatter.
    pub(super) fn explained(&self) -> f64 {
        let samples = self.track.independent_samples();
        samples + 2.0 * (2.0 * samples).sqrt()
    }

    /// The likeliest laws of a track in coordinates.
    pub(super) fn choose_in(&self, coordinates: &Coordinates, track: &Track) -> Option<Choice> {
        self.choose(&self.laws.candidates(coordinates), track, &track.scales(coordinates))
    }

    /// The same with further laws, where one of these may be likelier, and the coordinates leave no more of
    /// the poses than what is described: their geometry is fitted with the laws later.
    pub(super) fn choose_further(
        &self,
        choice: Option<Choice>,
        (coordinates, track): (&Coordinates, &Track),
        left: f64,
    ) -> Option<Choice> {
        if self.is_explained || left > DESCRIBED * self.track.independent_samples() {
            return choice;
        }
        let (first, further) = (self.laws.candidates(coordinates), self.laws.further(coordinates));
        let scales = track.scales(coordinates);
        let found = choose_further(choice, (&first, &further), track, &scales);
        let surrounded = self.laws.surrounded(coordinates);
        let found = match found {
            Some(found) if found.judged.iter().any(|judged| found.explains(judged)) => {
                Some(choose_as_simple(found, (&first, &[further, surrounded].concat()), track, &scales))
            }
            found => choose_further(found, (&[first, further].concat(), &surrounded), track, &scales),
        };
        let admits = |candidate: &Candidate| self.laws.admits(candidate);
        Some(choose_among_neighbours(found?, coordinates, &admits, (track, &scales)))
    }

    /// χ² of other poses at the same times, whitened.
    pub(super) fn chi_square(&self, poses: &[Pose]) -> f64 {
        self.whitened(poses).map(|d| d * d).sum()
    }

    /// Differences of other poses at the same times, whitened.
    pub(super) fn whitened(&self, poses: &[Pose]) -> impl Iterator<Item = f64> {
        let weighted = |(difference, weights): ([f64; 6], Vec<f64>)| {
            difference.into_iter().zip(weights).map(|(d, w)| d * w)
        };
        self.differences(poses).into_iter().zip(self.track.weights()).flat_map(weighted)
    }

    /// Differences of other poses at the same times: rotation vector and shift.
    pub(super) fn differences(&self, poses: &[Pose]) -> Vec<[f64; 6]> {
        let predicted = configurations(poses, &self.inertia);
        let difference = |(own, x): (&Vec<f64>, &Vec<f64>)| -> [f64; 6] {
            let difference = self.rigid.difference(own, x);
            std::array::from_fn(|i| difference[i])
        };
        self.track.x.iter().zip(&predicted).map(difference).collect()
    }

    /// The same poses with another noise of their coordinates, as far as their source resolves them.
    pub(super) fn with_noise(&self, noise: &[Noise]) -> Self {
        let mut other = self.clone();
        other.track.noise = noise.to_vec();
        coarsen(&mut other.track.noise[..3], self.resolution / self.radius.max(f64::MIN_POSITIVE));
        coarsen(&mut other.track.noise[3..], self.resolution);
        other
    }

    /// Standard deviations of an angle and of a place at one sample.
    pub(super) fn noise(&self) -> [f64; 2] {
        let mean = |noise: &[Noise]| noise.iter().map(|noise| noise.deviation).sum::<f64>() / 3.0;
        [mean(&self.track.noise[..3]), mean(&self.track.noise[3..])]
    }

    /// Root mean square distance of the particles from their centre.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// Standard deviation of the place of the body, world units.
    pub(super) fn noise_of_place(&self) -> f64 {
        self.track.noise[3..].iter().map(|noise| noise.deviation).fold(0.0, f64::hypot)
    }

    /// Standard deviations, of rotations (radians) and places, below which no pose is known, with errors of a
    /// size (world units) that change slowly.
    pub(super) fn least(&self, slow_error: f64) -> [f64; 2] {
        let place = self.resolution.hypot(slow_error);
        [place / self.radius.max(f64::MIN_POSITIVE), place]
    }

    /// Whether the rotations leave their mean by more than `still` times their noise.
    pub(super) fn turns(&self, still: f64) -> bool {
        let linear = mean_pose(&self.poses).linear;
        let unturned: Vec<Pose> = self.poses.iter().map(|pose| Pose { linear, ..*pose }).collect();
        self.chi_square(&unturned) > still * 0.5 * self.track.independent_samples()
    }

    /// Configurations of other poses of a body with an inertia.
    pub(super) fn configurations_of(&self, poses: &[Pose], inertia: &Inertia) -> Vec<Vec<f64>> {
        configurations(poses, inertia)
    }

    /// Configurations of a body with another inertia.
    pub(super) fn configurations(&self, inertia: &Inertia) -> Vec<Vec<f64>> {
        configurations(&self.poses, inertia)
    }

    /// The track of a joint, no better known than the poses are.
    pub(super) fn along(&self, joint: &Coordinates, mut track: Track) -> Track {
        let is_angle = matches!(joint, Coordinates::Hinge(_));
        self.limit(&mut track.noise, if is_angle { self.radius } else { 1.0 });
        track
    }

    /// Makes the noise of an angle no less than that of the poses.
    pub(super) fn limit_angle(&self, noise: &mut Noise) {
        self.limit(std::slice::from_mut(noise), self.radius);
    }

    /// The same for noise of something by which the particles move so far.
    fn limit(&self, noise: &mut [Noise], lever: f64) {
        coarsen(noise, self.resolution / lever.max(f64::MIN_POSITIVE));
        inflate(noise, self.inflation);
    }

    /// Enlarges the noise such that a law whose χ² for each sample is given leaves 1, if errors of this size
    /// (world units) that change slowly can be the reason; returns whether they can.
    pub(super) fn allow_for(&mut self, slow_error: f64, chi_square: f64) -> bool {
        let turn = slow_error / self.radius.max(f64::MIN_POSITIVE);
        let errors = [[turn; 3], [slow_error; 3]].concat();
        let ratios = self.track.noise.iter().zip(errors).map(|(noise, e)| (e / noise.deviation).powi(2));
        let most = 1.0 + ratios.sum::<f64>() / self.track.noise.len() as f64;
        if chi_square <= 1.0 || chi_square > most {
            return false;
        }
        inflate(&mut self.track.noise, chi_square);
        self.inflation *= chi_square;
        true
    }

    /// Whether the centre of the particles lies on a hinge's axis, as far as particles tell.
    pub(super) fn is_balanced_on(&self, hinge: &Hinge) -> bool {
        let axis = DVec3::from_array(hinge.axis);
        let arm = |pose: &Pose| (pose.shift - DVec3::from_array(hinge.pivot)).reject_from(axis).length();
        let mean = self.poses.iter().map(arm).sum::<f64>() / self.poses.len() as f64;
        mean <= LEAST_ARM * self.radius
    }
}

/// Adds a standard deviation to a noise.
fn coarsen(noise: &mut [Noise], resolution: f64) {
    noise.iter_mut().for_each(|noise| noise.deviation = noise.deviation.hypot(resolution));
}

/// Enlarges the variance of a noise by a factor.
fn inflate(noise: &mut [Noise], factor: f64) {
    noise.iter_mut().for_each(|noise| noise.deviation *= factor.sqrt());
}

/// Quaternions of the principal axes, and centres.
fn configurations(poses: &[Pose], inertia: &Inertia) -> Vec<Vec<f64>> {
    let frame = quaternion(&inertia.frame);
    let mut last = DQuat::IDENTITY;
    let one = |pose: &Pose| {
        let turn = DQuat::from_mat3(&pose.linear) * frame;
        // A quaternion and its negative are the same rotation; paths of them must not jump.
        last = if turn.dot(last) < 0.0 { -turn } else { turn };
        [components(last).as_slice(), &pose.shift.to_array()].concat()
    };
    poses.iter().map(one).collect()
}

/// The mean of poses: the rotation nearest to the mean of their matrices, and the mean of their shifts.
pub(super) fn mean_pose(poses: &[Pose]) -> Pose {
    let n = poses.len().max(1) as f64;
    let linear = poses.iter().map(|pose| pose.linear).sum::<DMat3>() * n.recip();
    let shift = poses.iter().map(|pose| pose.shift).sum::<DVec3>() / n;
    Pose { linear: nearest_rotation(&linear), shift }
}
