//! What is known of a law together with the geometry of its coordinates: axes, pivots, places of bodies and
//! normal modes come from the same noisy poses as the law, so their errors are its errors.

use super::observed::ObservedPoses;
use super::placed::Placed;
use super::window::Window;
use crate::motion::pose::Pose;
use crate::thresholds::{
    GEOMETRY_STEPS, LIKELY_CHANGES, OBLIQUE_SPREAD, PROBED_CHANGES, SCALE_DEVIATIONS, TOLD,
};
use lgs_mechanics::bands::changes;
use lgs_mechanics::coordinates::InertiaForm;
use lgs_mechanics::fit::{Fitted, Problem, Settings, Unknown, covariance_of, minimise};
use lgs_mechanics::terms::Parameter;
use nalgebra::{DMatrix, DVector};
use std::cell::Cell;
use std::sync::OnceLock;

/// Part of a change by which its first order is found: far above rounding, and so little that what raises χ²
/// by a million in all raises it by a hundredth.
const PROBE: f64 = 1e-4;

/// Observed poses as a law's are compared with them.
pub(super) struct Compared<'a> {
    /// Times of the samples.
    pub(super) times: &'a [f64],
    /// Differences of poses, `[times][bodies]`, from the observed ones in units of their noise.
    pub(super) whitened: &'a dyn Fn(&[Vec<Pose>]) -> Vec<f64>,
    /// Standard deviation of an angle and of a place at one sample.
    pub(super) noise: [f64; 2],
    /// Root mean square distance of the particles of the body from their centre.
    pub(super) radius: f64,
}

/// A law with the joint posterior of its unknowns and those of its geometry.
pub(super) struct Posterior {
    pub(super) placed: Placed,
    /// χ² with the priors.
    pub(super) loss: f64,
    /// Of the changes that [`Placed::changed`] takes.
    pub(super) covariance: DMatrix<f64>,
    /// Smallest and largest change of each parameter.
    bounds: Vec<[f64; 2]>,
    /// The window by which laws drawn from it are judged, where it is known.
    window: Option<Window>,
    /// Whether motions are followed to first order alone, once it is known.
    is_curved: OnceLock<bool>,
}

impl Posterior {
    /// What a fit says of a law whose geometry is given.
    pub(super) fn of(placed: Placed, fitted: &Fitted) -> Self {
        let bounds =
            fitted.bounds.iter().zip(&fitted.law.parameters).map(|(b, p)| b.map(|b| b - p)).collect();
        let (covariance, is_curved) = (fitted.covariance.clone(), OnceLock::new());
        Self { placed, loss: fitted.loss, covariance, bounds, window: None, is_curved }
    }

    /// The same for motions that are followed to first order in its changes, whatever these are.
    pub(super) fn followed_to_first_order(self) -> Self {
        Self { is_curved: OnceLock::from(true), ..self }
    }

    /// Fits law and geometry together, from where they are; `None` if there is neither a geometry nor an
    /// inertia to be fitted with the law, or the fit fails.
    pub(super) fn joint(placed: &Placed, fitted: &Fitted, compared: &Compared<'_>) -> Option<Self> {
        let is_open = has_whole_inertia(placed) || !placed.geometry().is_empty();
        is_open.then(|| Self::fitted_together(placed, fitted, compared))?
    }

    /// The same whatever there is to be fitted.
    pub(super) fn fitted_together(placed: &Placed, fitted: &Fitted, compared: &Compared<'_>) -> Option<Self> {
        let geometry = placed.geometry();
        let own = Self::of(placed.clone(), fitted);
        let problem = Joint::new(&own, (fitted, &geometry), compared);
        let settings = Settings { iterations: GEOMETRY_STEPS, ..Settings::default() };
        let found = minimise(&problem, &vec![0.0; problem.len()], &settings)?;
        let covariance = covariance_of(&found.information)?;
        let bounds = own.bounds.iter().zip(&found.values[2 * placed.start.v.len()..]);
        let bounds = bounds.map(|(bound, change)| bound.map(|b| b - change)).collect();
        let placed = placed.changed(&found.values);
        let is_curved = OnceLock::new();
        Some(Self { placed, loss: found.loss, covariance, bounds, window: None, is_curved })
    }

    /// Takes the poses of its bodies, in the order of its coordinates, as the window by which laws drawn from
    /// it are judged.
    pub(super) fn set_window(&mut self, bodies: Vec<ObservedPoses>) {
        self.window = Window::of(&self.placed, bodies);
        self.is_curved = OnceLock::new();
    }

    /// Whether laws drawn from it are judged by a window.
    pub(super) fn is_judged(&self) -> bool {
        self.window.is_some()
    }

    /// The fit with these values, without what is known of the geometry.
    pub(super) fn fitted(&self, old: &Fitted) -> Fitted {
        let size = self.placed.motion();
        let covariance = self.covariance.view((0, 0), (size, size)).into_owned();
        let mut law = self.placed.law.clone();
        let first = size - law.parameters.len();
        law.deviations = (first..size).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
        Fitted { law, start: self.placed.start.clone(), loss: self.loss, covariance, ..old.clone() }
    }

    /// Whether the poses tell more of the inertia than its prior does: those of a body that hardly turns do
    /// not.
    pub(super) fn tells_of_inertia(&self) -> bool {
        let first = 2 * self.placed.start.v.len();
        let own = self.placed.law.coordinates.parameters();
        let is_told = |(i, parameter): (usize, &Parameter)| {
            self.covariance[(first + i, first + i)] < (TOLD * parameter.spread).powi(2)
        };
        own.iter().enumerate().any(is_told)
    }

    /// Motions drawn from it at ascending times, `[times][bodies]`, where the variance of the noise is so
    /// many times as large as it looks; `None` at times to which one cannot be followed.
    pub(super) fn drawn(
        &self,
        inflation: f64,
        count: usize,
        times: &[f64],
        stream: (u64, u64),
    ) -> Vec<Vec<Option<Vec<Pose>>>> {
        let middle = self.is_curved().then(|| self.placed.poses_followed(times));
        let all = self.changed(inflation, count, stream);
        let motion = |changed: Placed| {
            let near = changed.poses_followed(times);
            let Some(middle) = &middle else { return near };
            let pairs = middle.iter().zip(&near);
            pairs.map(|(middle, near)| Some(magnified(middle.as_ref()?, near.as_ref()?))).collect()
        };
        all.into_iter().map(motion).collect()
    }

    /// The part of its change that each of [`Self::changed`] is: a little of it where motions are followed to
    /// first order alone.
    pub(super) fn part(&self) -> f64 {
        if self.is_curved() { PROBE } else { 1.0 }
    }

    /// Laws drawn from it, each a part of the way from the middle one. Changes to which the law is not linear
    /// are accepted by how much less likely the window makes them than their linearisation.
    pub(super) fn changed(&self, inflation: f64, count: usize, stream: (u64, u64)) -> Vec<Placed> {
        let first = 2 * self.placed.start.v.len();
        let window = self.window.as_ref().filter(|_| !self.is_curved());
        let probability = |by: &[f64], square: f64| match window {
            _ if !self.is_inside(by) => 0.0,
            Some(window) => window.probability(&self.placed.changed(by), square, inflation),
            None => 1.0,
        };
        let all = changes(&(&self.covariance * inflation), count, stream, &probability);
        let law = |mut by: Vec<f64>| {
            let bounded = by[first..].iter_mut().zip(&self.bounds);
            bounded.for_each(|(by, [lower, upper])| *by = by.clamp(*lower, *upper));
            by.iter_mut().for_each(|by| *by *= self.part());
            self.placed.changed(&by)
        };
        all.into_iter().map(law).collect()
    }

    /// Whether a change leaves the parameters within their bounds.
    fn is_inside(&self, by: &[f64]) -> bool {
        let parameters = &by[2 * self.placed.start.v.len()..];
        parameters.iter().zip(&self.bounds).all(|(by, [lower, upper])| (*lower..=*upper).contains(by))
    }

    /// Whether unknowns are bound together along a curve, as inertia and weight are: changes along its
    /// tangent leave the window that they were fitted to, and are followed to first order alone.
    fn is_curved(&self) -> bool {
        let leaves = || self.window.as_ref().is_some_and(|window| self.leaves(window));
        *self.is_curved.get_or_init(|| has_whole_inertia(&self.placed) || leaves())
    }

    /// Whether motions are followed to first order for another reason than an inertia that was fitted.
    pub(super) fn bends(&self) -> bool {
        !has_whole_inertia(&self.placed) && self.is_curved()
    }

    /// Whether the window makes most changes that are likely to first order far less likely.
    fn leaves(&self, window: &Window) -> bool {
        let (tried, likely) = (Cell::new(0), Cell::new(0.0));
        let probe = |by: &[f64], square: f64| {
            if self.is_inside(by) {
                let own = window.probability(&self.placed.changed(by), square, 1.0);
                tried.set(tried.get() + 1);
                likely.set(likely.get() + own);
            }
            1.0
        };
        let _ = changes(&self.covariance, PROBED_CHANGES, (0, 0), &probe);
        likely.get() < LIKELY_CHANGES * f64::from(tried.get())
    }
}

fn has_whole_inertia(placed: &Placed) -> bool {
    placed.law.coordinates.inertia().is_some_and(|own| own.form == InertiaForm::Whole)
}

/// Poses as far from the middle ones, to first order, as a part [`PROBE`] of the change takes them.
fn magnified(middle: &[Pose], near: &[Pose]) -> Vec<Pose> {
    let pose = |(middle, near): (&Pose, &Pose)| Pose {
        linear: middle.linear + (near.linear - middle.linear) * PROBE.recip(),
        shift: middle.shift + (near.shift - middle.shift) / PROBE,
    };
    middle.iter().zip(near).map(pose).collect()
}

/// Start, parameters and geometry as unknowns, all as changes.
struct Joint<'a> {
    placed: &'a Placed,
    compared: &'a Compared<'a>,
    unknowns: Vec<Unknown>,
    /// Sums of unknowns, their expected value and its deviation.
    priors: Vec<(Vec<usize>, f64, f64)>,
}

impl<'a> Joint<'a> {
    fn new(own: &'a Posterior, (fitted, geometry): (&Fitted, &[bool]), compared: &'a Compared<'a>) -> Self {
        let placed = &own.placed;
        let (n, open) = (placed.start.v.len(), [f64::NEG_INFINITY, f64::INFINITY]);
        let deviation = |i: usize| SCALE_DEVIATIONS * own.covariance[(i, i)].max(0.0).sqrt();
        let mut unknowns: Vec<Unknown> = Vec::new();
        for i in 0..placed.motion() {
            let [lower, upper] = i.checked_sub(2 * n).map_or(open, |p| own.bounds[p]);
            let value = i.checked_sub(2 * n).map_or(1.0, |p| placed.law.parameters[p].abs());
            let scale = if deviation(i) > 0.0 { deviation(i) } else { value.max(f64::MIN_POSITIVE.sqrt()) };
            unknowns.push(Unknown { scale, lower, upper });
        }
        let [turn, place] = compared.noise.map(|noise| SCALE_DEVIATIONS * noise);
        unknowns.extend(geometry.iter().map(|&turns| Unknown {
            scale: if turns { turn } else { place },
            lower: open[0],
            upper: open[1],
        }));
        let value = |i: usize| i.checked_sub(2 * n).map_or(0.0, |p| placed.law.parameters[p]);
        let told =
            fitted.priors.iter().map(|&(i, centre, deviation)| (vec![i], centre - value(i), deviation));
        let mut priors: Vec<(Vec<usize>, f64, f64)> = told.collect();
        if placed.has_normal_modes() {
            priors.extend(oblique(placed.motion(), placed.modes()));
        }
        priors.extend(placed.center().map(|i| (vec![placed.motion() + i], 0.0, compared.radius)));
        Self { placed, compared, unknowns, priors }
    }

    fn len(&self) -> usize {
        self.unknowns.len()
    }
}

/// How far normal modes are from orthogonal in the particles, which begins at 0 for each pair of `n` modes:
/// the share of each mode in the other; `first` is the place of the first share among the unknowns.
fn oblique(first: usize, n: usize) -> Vec<(Vec<usize>, f64, f64)> {
    let place = |of: usize, other: usize| first + of * (n - 1) + other - usize::from(other > of);
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    pairs.map(|(i, j)| (vec![place(i, j), place(j, i)], 0.0, OBLIQUE_SPREAD)).collect()
}

impl Problem for Joint<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let poses = self.placed.changed(values).poses(self.compared.times)?;
        let mut residuals = (self.compared.whitened)(&poses);
        let sum = |of: &[usize]| of.iter().map(|&i| values[i]).sum::<f64>();
        residuals.extend(self.priors.iter().map(|(of, mean, deviation)| (sum(of) - mean) / deviation));
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}
