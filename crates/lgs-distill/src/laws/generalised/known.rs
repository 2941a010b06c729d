//! A law with its start, and what is known of it.

use super::evidence::Evidence;
use super::mixture;
use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{JUDGED_WINDOWS, LEAST_WEIGHT, TIMES_IN_WINDOW};
use glam::DVec3;
use lgs_core::geometry::narrow;
use lgs_mechanics::bands::{DrawnLaws, Known, PosteriorLaws, Rival, Verdict};
use lgs_mechanics::choose::DESCRIBED;
use lgs_mechanics::coordinates::{Embedding, Placement, State};
use lgs_mechanics::{Edit, Law, System};

/// The law of one body, or of several that act on each other, with its start and what is known of it.
pub(crate) struct GeneralisedLaw {
    /// The law, at a step that resolves it.
    pub(crate) law: Law,
    /// State at the first sample.
    pub(crate) start: State,
    /// The bodies, by their places among those that the law was sought for, in the order in which the
    /// coordinates take them.
    pub(crate) order: Vec<usize>,
    /// Pose of the shape of each of them at the first sample.
    pub(crate) bases: Vec<Pose>,
    /// Root mean square position error over the window.
    pub(crate) window_error: f64,
    /// How well it is known.
    pub(crate) known: Known,
    /// What speaks for it, by the noise that the scatter of the poses tells of; nothing for laws through
    /// impacts.
    pub(crate) evidence: Option<Evidence>,
    /// Whether it was found within errors that were allowed because no law explains the motion.
    pub(crate) is_within_allowance: bool,
    /// Whether it follows the window and no more: its forecast is not trusted beyond that, and those of parts
    /// of the window say nothing of them, or less than free motion.
    pub(crate) is_refuted: bool,
}

impl GeneralisedLaw {
    /// A law of bodies, in the order of its coordinates, of which only χ² is known yet; `None` if it cannot
    /// be followed over the window.
    pub(super) fn new(
        (law, start): (Law, State),
        bases: Vec<Pose>,
        chi_square: f64,
        bodies: &[&SharedMotion],
    ) -> Option<Self> {
        let known = Known { chi_square, ..Known::default() };
        let order = (0..bodies.len()).collect();
        let (window_error, evidence, is_within_allowance, is_refuted) = (0.0, None, false, false);
        let mut found =
            Self { law, start, order, bases, window_error, known, evidence, is_within_allowance, is_refuted };
        found.window_error = found.error_over(bodies)?;
        Some(found)
    }

    /// Whether it describes the motion to within the noise of the poses, and is not refuted.
    pub(crate) fn is_within_noise(&self) -> bool {
        self.known.chi_square <= DESCRIBED && !self.is_within_allowance && !self.is_refuted
    }

    /// Times at which a forecast is judged.
    pub(super) fn judged_times(&self, bodies: &[&SharedMotion]) -> Vec<f64> {
        let spacing = bodies[0].duration() / TIMES_IN_WINDOW as f64;
        let [first, last] = JUDGED_WINDOWS.map(|windows| (windows * TIMES_IN_WINDOW as f64) as i32);
        (first..=last).map(|i| f64::from(i) * spacing).collect()
    }

    /// Positions of the shape points of each body at the first sample, and their velocities, body by body in
    /// the order of the coordinates.
    pub(crate) fn initial_states(&self, shapes: &[&[DVec3]]) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let rates = Embedding::new(&self.law.coordinates, &self.start.x).rates(&self.start.x, &self.start.v);
        let mut states = (Vec::new(), Vec::new());
        for ((base, rate), shape) in self.bases.iter().zip(rates).zip(shapes) {
            let positions = shape.iter().map(|&b| base.apply(b));
            states.0.extend(positions.clone().map(narrow));
            states.1.extend(positions.map(|position| narrow(rate.apply(position))));
        }
        states
    }

    /// The pose of the shape of each body in a configuration.
    fn poses_in(&self, x: &[f64]) -> Vec<Pose> {
        let pose = |(place, base): (Placement, &Pose)| Pose {
            linear: place.linear * base.linear,
            shift: place.apply(base.shift),
        };
        let placed = Embedding::new(&self.law.coordinates, &self.start.x).placements(x);
        placed.into_iter().zip(&self.bases).map(pose).collect()
    }

    /// Root mean square error of the particles' positions over the window, each pose counted by how well it
    /// is known.
    fn error_over(&self, bodies: &[&SharedMotion]) -> Option<f64> {
        let times: Vec<f64> = bodies[0].times.iter().map(|t| t - bodies[0].times[0]).collect();
        let states = System::new(&self.law, Edit::NONE).states(&self.start, &times).ok()?;
        let points = points_of(bodies);
        let of_sample = |(sample, state): (usize, &State)| {
            let observed: Vec<Pose> = bodies.iter().map(|motion| motion.poses[sample]).collect();
            let deviation = bodies.iter().map(|motion| motion.deviation(sample)).fold(0.0, f64::max);
            let weight = deviation.powi(-2);
            (weight, weight * distance(&points, &self.poses_in(&state.x), &observed).powi(2))
        };
        let add = |(total, sum): (f64, f64), (weight, square): (f64, f64)| (total + weight, sum + square);
        let (total, sum) = states.iter().enumerate().map(of_sample).fold((0.0, 0.0), add);
        Some((sum / total).sqrt())
    }

    /// The verdict, and the times between which the forecast is trusted: those where the 90 % band over the
    /// posterior of the law and of its rivals in all coordinates is narrower than a fraction of the path.
    pub(super) fn judge(&mut self, bodies: &[&SharedMotion], rated: &Rated, seed: u64) {
        self.known.rivals = rivals(rated);
        if self.known.chi_square > DESCRIBED {
            return;
        }
        self.known.verdict = Verdict::Described;
        let times = self.judged_times(bodies);
        let states = System::new(&self.law, Edit::NONE).states_followed(&self.start, &times);
        let by_body = |state: State| {
            let own = self.poses_in(&state.x);
            let mut poses = own.clone();
            own.into_iter().zip(&self.order).for_each(|(pose, &body)| poses[body] = pose);
            poses
        };
        let forecast: Vec<Option<Vec<Pose>>> = states.into_iter().map(|state| state.map(by_body)).collect();
        let radius = mixture::radius(rated, (bodies, &forecast), &times, seed);
        let ordered: Vec<&SharedMotion> = self.order.iter().map(|&body| bodies[body]).collect();
        self.trust(&radius, &ordered);
        if self.known.verdict == Verdict::Explained {
            self.set_posterior(mixture::drawn_laws(rated, &self.order, seed), &ordered);
        }
    }

    /// Takes laws that were drawn from what is known of it, once it has its band.
    pub(super) fn set_posterior(&mut self, laws: Vec<DrawnLaws>, bodies: &[&SharedMotion]) {
        let window = bodies[0].duration();
        let (path, radius) = (path(bodies), self.known.rms_radius(window));
        self.known.posterior = Some(PosteriorLaws { laws, window, path, radius });
    }

    /// Takes the radius of a band at the times at which a forecast is judged.
    pub(super) fn trust(&mut self, radius: &[f64], bodies: &[&SharedMotion]) {
        let (times, window) = (self.judged_times(bodies), bodies[0].duration());
        let path = path(bodies);
        self.known.take_band(&self.law, (&times, radius), window, path);
    }
}

/// Length of the path that the bodies took in the captured window. A law that runs away takes a longer one,
/// and deserves no more trust for it.
fn path(bodies: &[&SharedMotion]) -> f64 {
    let points = points_of(bodies);
    let poses = |sample: usize| bodies.iter().map(|motion| motion.poses[sample]).collect::<Vec<Pose>>();
    let samples = bodies[0].times.len();
    (1..samples).map(|sample| distance(&points, &poses(sample - 1), &poses(sample))).sum()
}

/// Points that stand for the particles of each body.
pub(super) fn points_of(bodies: &[&SharedMotion]) -> Vec<Vec<DVec3>> {
    bodies.iter().map(|motion| motion.sigma_points()).collect()
}

/// Root mean square distance of the points of all bodies in two poses each.
pub(super) fn distance(points: &[Vec<DVec3>], a: &[Pose], b: &[Pose]) -> f64 {
    let of_body = |(points, (a, b)): (&Vec<DVec3>, (&Pose, &Pose))| {
        points.iter().map(|&p| a.apply(p).distance_squared(b.apply(p))).sum::<f64>()
    };
    let sum: f64 = points.iter().zip(a.iter().zip(b)).map(of_body).sum();
    (sum / points.iter().map(Vec::len).sum::<usize>().max(1) as f64).sqrt()
}

/// Laws with a weight worth telling, the likeliest first; the coordinates are told of where they are others.
fn rivals(rated: &Rated) -> Vec<Rival> {
    let own = rated.system().coordinates.name();
    let mut told: Vec<Rival> = Vec::new();
    for (law, weight) in rated.laws.iter().zip(rated.weights()) {
        let coordinates = rated.systems[law.system].coordinates.name();
        let names = law.judged.names();
        let terms = if coordinates == own { names } else { format!("{coordinates}: {names}") };
        // Laws that differ in the inertia or the centre alone count as one.
        match told.iter_mut().find(|rival| rival.terms == terms) {
            Some(rival) => rival.weight += weight,
            None => told.push(Rival { terms, weight }),
        }
    }
    told.retain(|rival| rival.weight >= LEAST_WEIGHT);
    told
}
