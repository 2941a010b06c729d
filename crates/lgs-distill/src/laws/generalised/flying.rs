//! Laws of a body that deforms in flight, put together from those of its centre and of its deformation, which
//! do not act on each other.

use super::decomposition::{Decomposition, FIRST_MIXING, OfModes, mean};
use super::geometry::center_of_mass;
use super::kinematics::Configured;
use super::observed::Laws;
use super::placed::Placed;
use super::posterior::{Compared, Posterior};
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{CENTER_COEFFICIENTS, MOST_CENTERS, MOST_MODES, NO_RIVAL, NOISE_DEVIATIONS};
use glam::DVec3;
use lgs_core::geometry::trace;
use lgs_mechanics::Candidate;
use lgs_mechanics::choose::{Choice, Judged, choose, choose_further};
use lgs_mechanics::coordinates::{Coordinates, Modal, Port};
use lgs_mechanics::explain::joined_law;
use lgs_mechanics::fit::Track;
use lgs_mechanics::terms::Term;

/// Numbers of a linear map.
const ENTRIES: usize = 9;

/// A body that deforms about a centre that moves.
struct InFlight<'a> {
    motion: &'a SharedMotion,
    /// Length that its source does not resolve, world units.
    resolution: f64,
    /// The mean pose.
    rest: Pose,
    /// Points of the shape that may be the centre of mass.
    points: Vec<DVec3>,
    /// The centre of the particles about its mean.
    center: Track,
    /// The deformation about the centre, and the noise of its amplitudes.
    deformation: Decomposition,
    amplitudes: Track,
}

/// A law of the centre of mass, which is at a point of the shape.
struct OfCenter {
    point: DVec3,
    judged: Judged,
}

/// The likely laws of a body in flight; none of one of which a point stays where it is.
pub(super) fn in_flight(motion: &SharedMotion, laws: Laws, resolution: f64) -> Vec<OfModes> {
    let Some(body) = InFlight::of(motion, resolution) else { return Vec::new() };
    let centers = body.centers(laws);
    let most = MOST_MODES.min(body.deformation.count());
    let of_deformation =
        (1..=most).flat_map(|modes| body.deformation.laws(modes, &body.amplitudes, laws, NO_RIVAL));
    let of_both = |(system, deformation, _): OfModes| {
        let joined = centers.iter().filter_map(|center| body.joined(center, (&system, &deformation)));
        joined.collect::<Vec<_>>()
    };
    of_deformation.flat_map(of_both).collect()
}

impl<'a> InFlight<'a> {
    fn of(motion: &'a SharedMotion, resolution: f64) -> Option<Self> {
        let rest = mean(&motion.poses);
        let center = track_of(motion, DVec3::ZERO, resolution);
        let points = points(motion, &center.times);
        if points.iter().any(|&point| stays(&track_of(motion, point, resolution))) {
            return None;
        }
        let poses = motion.poses.iter().map(|pose| Pose { shift: rest.shift, ..*pose }).collect();
        let deformation = Decomposition::of(&SharedMotion { poses, ..motion.clone() })?;
        let entries = ENTRIES.min(deformation.count());
        let rows: Vec<Vec<f64>> = deformation.amplitudes.iter().map(|row| row[..entries].to_vec()).collect();
        let coordinates = deformation.coordinates(entries);
        let amplitudes =
            Track::new(&coordinates, center.samples(), &rows).coarsened(&coordinates, [0.0, resolution]);
        Some(Self { motion, resolution, rest, points, center, deformation, amplitudes })
    }

    /// The likely laws of the centre of mass.
    fn centers(&self, laws: Laws) -> Vec<OfCenter> {
        let (list, further) = (laws.candidates(&Coordinates::Point), laws.further(&Coordinates::Point));
        let of_point = |&point: &DVec3| {
            let track = track_of(self.motion, point, self.resolution);
            let choice = choose(&list, &track, &track.scales(&Coordinates::Point))?;
            Some((point, track, choice))
        };
        let mut all: Vec<_> = self.points.iter().filter_map(of_point).collect();
        all.sort_by(|(.., a), (.., b)| a.law().score().total_cmp(&b.law().score()));
        if let Some((_, track, choice)) = all.first_mut() {
            let scales = track.scales(&Coordinates::Point);
            let found = choose_further(Some(choice.clone()), (&list, &further), track, &scales);
            *choice = found.unwrap_or_else(|| choice.clone());
        }
        let of_choice = |(point, _, choice): (DVec3, Track, Choice)| {
            choice.judged.into_iter().map(move |judged| OfCenter { point, judged })
        };
        let mut laws: Vec<OfCenter> = all.into_iter().flat_map(of_choice).collect();
        laws.sort_by(|a, b| a.judged.score().total_cmp(&b.judged.score()));
        let most = laws.first().map_or(0.0, |law| law.judged.score()) + NO_RIVAL;
        laws.retain(|law| law.judged.score() <= most);
        laws.truncate(MOST_CENTERS);
        laws
    }

    /// The law of a centre with one of a deformation.
    fn joined(&self, center: &OfCenter, (own, deformation): (&Configured, &Judged)) -> Option<OfModes> {
        let Coordinates::Modal(modal) = &own.coordinates else { return None };
        let (modes, OfCenter { point, judged: center }) = (modal.affine.len(), center);
        let at = |terms: &[Term], port: Port| terms.iter().map(move |term| Term { port, ..*term }).collect();
        let terms: [Vec<Term>; 2] =
            [at(&center.fitted.law.terms, Port::Center), at(&deformation.fitted.law.terms, Port::Shape)];
        let mut flying = Modal::in_flight(&modal.affine);
        let offset = self.rest.linear * *point;
        flying.move_center(offset);
        // Where the first configuration takes the centre of the particles.
        let moved = flying.affine.iter().zip(&own.x[0]).map(|(mode, x)| (DVec3::from(mode.shift), *x));
        let moved = moved.zip(&modal.affine).map(|((to, x), mode)| x * (to - DVec3::from(mode.shift)));
        let base = Pose { shift: own.bases[0].shift + moved.sum::<DVec3>(), ..own.bases[0] };
        let coordinates = Coordinates::Modal(flying);
        let candidate = Candidate::new(coordinates.clone(), terms.concat()).ok()?;
        let mut judged = joined_law(center.index, &candidate, [deformation, center])?;
        let mut system = Configured {
            x: vec![[own.x[0].as_slice(), &[0.0; 3]].concat()],
            order: vec![0],
            bases: vec![base],
            // The body at rest, the directions of the modes, and how far these are from orthogonal.
            constants: ENTRIES + modes * (ENTRIES - modes) + coordinates.geometry(),
            chi_square: own.chi_square,
            coordinates,
        };
        let placed = Placed::at(&judged.fitted, system.poses_in(&judged.fitted.start.x));
        let whitened = |poses: &[Vec<Pose>]| self.whitened(poses, modes);
        let noise = [FIRST_MIXING, self.center.noise[0].deviation];
        let radius = trace(&self.motion.covariance()).sqrt();
        let compared = Compared { times: &self.center.times, whitened: &whitened, noise, radius };
        let posterior = Posterior::joint(&placed, &judged.fitted, &compared);
        if let Some(posterior) = &posterior {
            judged.fitted = posterior.fitted(&judged.fitted);
            system.coordinates = judged.fitted.law.coordinates.clone();
            system.x = vec![posterior.placed.reference().to_vec()];
            system.bases.clone_from(&posterior.placed.bases);
        }
        Some((system, judged, posterior))
    }

    /// Differences of centre and first amplitudes of poses from the observed ones, in units of their noise.
    fn whitened(&self, poses: &[Vec<Pose>], modes: usize) -> Vec<f64> {
        let weights = [self.center.weights(), self.amplitudes.weights()];
        let of_sample = |(k, of_time): (usize, &Vec<Pose>)| {
            let place = (of_time[0].shift - self.rest.shift).to_array();
            let about_center = Pose { shift: self.rest.shift, ..of_time[0] };
            let amplitudes = self.deformation.amplitudes_of(&about_center, modes);
            let of_center = place.into_iter().zip(&self.center.x[k]).zip(&weights[0][k]);
            let of_shape = amplitudes.into_iter().zip(&self.amplitudes.x[k]).zip(&weights[1][k]);
            let both = of_center.chain(of_shape);
            both.map(|((x, observed), weight)| (x - observed) * weight).collect::<Vec<f64>>()
        };
        poses.iter().enumerate().flat_map(of_sample).collect()
    }
}

/// Points of the shape that may be the centre of mass: the centre of the particles, and those that move
/// evenly or evenly faster while the body deforms about them.
fn points(motion: &SharedMotion, times: &[f64]) -> Vec<DVec3> {
    let shown = |coefficients| center_of_mass(&motion.poses, times, coefficients);
    std::iter::once(DVec3::ZERO).chain(CENTER_COEFFICIENTS.into_iter().filter_map(shown)).collect()
}

/// The path of a point of the shape about its mean, with its noise.
fn track_of(motion: &SharedMotion, point: DVec3, resolution: f64) -> Track {
    let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
    let middle = mean(&motion.poses).apply(point);
    let place = |pose: &Pose| (pose.apply(point) - middle).to_array().to_vec();
    let x: Vec<Vec<f64>> = motion.poses.iter().map(place).collect();
    let track = Track::new(&Coordinates::Point, motion.samples(&times), &x);
    track.coarsened(&Coordinates::Point, [0.0, resolution])
}

/// Whether a point stays where it is, to within its noise.
fn stays(track: &Track) -> bool {
    let noise = track.noise.iter().map(|noise| noise.deviation).fold(0.0, f64::hypot);
    let squares = track.x.iter().flatten().map(|x| x * x).sum::<f64>();
    (squares / track.x.len() as f64).sqrt() <= NOISE_DEVIATIONS * noise
}
