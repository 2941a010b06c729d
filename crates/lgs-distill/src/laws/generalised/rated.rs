//! Laws in all coordinates of an object, rated by one evidence: the chosen law and its rivals.

use super::evidence::{Evidence, unknowns};
use super::kinematics::Configured;
use super::observed::ObservedPoses;
use super::placed::Placed;
use super::posterior::{Compared, Posterior};
use crate::motion::pose::Pose;
use crate::thresholds::{MOST_GEOMETRIES, MOST_KINEMATIC, NO_RIVAL};
use lgs_mechanics::bands::shares;
use lgs_mechanics::choose::{Choice, DESCRIBED, Judged, explained, weights};
use lgs_mechanics::fit::Fitted;

/// A law with what speaks for it.
pub(super) struct RatedLaw {
    /// The place of its coordinates among all.
    pub(super) system: usize,
    pub(super) judged: Judged,
    pub(super) evidence: Evidence,
    pub(super) posterior: Posterior,
    score: f64,
}

impl RatedLaw {
    /// Its score by the evidence that there is now.
    fn now(&self, inflation: f64) -> f64 {
        self.evidence.score(inflation)
    }

    /// The law fitted together with its geometry, and with its inertia where the poses tell of that.
    fn with_geometry(&self, compared: &Compared<'_>) -> Option<(Posterior, Fitted)> {
        let joint = |fitted: Fitted| {
            let placed = self.posterior.placed.with_law(&fitted.law);
            Some((Posterior::joint(&placed, &fitted, compared)?, fitted))
        };
        let open = self.judged.fitted.with_open_inertia().and_then(joint);
        let open = open.filter(|(posterior, _)| posterior.tells_of_inertia());
        open.or_else(|| joint(self.judged.fitted.clone()))
    }

    /// Takes what is known of the law together with its geometry.
    pub(super) fn set(&mut self, posterior: Posterior) {
        self.judged.fitted = posterior.fitted(&self.judged.fitted);
        self.posterior = posterior;
    }
}

/// The likely laws of an object in all coordinates, the best score first; at least one.
pub(super) struct Rated {
    pub(super) systems: Vec<Configured>,
    pub(super) laws: Vec<RatedLaw>,
    /// How much larger the variance of the noise is than it looks: the least χ² for each sample, at least 1.
    pub(super) inflation: f64,
}

impl Rated {
    /// Rates all laws by the evidence for each of them; `None` if there are none.
    pub(super) fn new(
        found: Vec<(Configured, Choice)>,
        evidence: &dyn Fn(&Configured, &Judged) -> Evidence,
    ) -> Option<Self> {
        let (systems, choices): (Vec<Configured>, Vec<Choice>) = found.into_iter().unzip();
        let of_system = |(system, choice): (usize, Choice)| -> Vec<RatedLaw> {
            let rated = |judged: Judged| {
                let evidence = evidence(&systems[system], &judged);
                let placed = Placed::new(&systems[system], &judged.fitted);
                let posterior = Posterior::of(placed, &judged.fitted);
                RatedLaw { system, judged, evidence, posterior, score: f64::INFINITY }
            };
            choice.judged.into_iter().map(rated).collect()
        };
        let mut laws: Vec<RatedLaw> = choices.into_iter().enumerate().flat_map(of_system).collect();
        laws.retain(|law| law.evidence.score(1.0).is_finite());
        let mut rated = Self { systems, laws, inflation: 1.0 };
        rated.score();
        rated.laws.first()?;
        Some(rated)
    }

    /// Brings the laws in the order of their evidence, without those that are not likely enough to matter
    /// beside another one in coordinates of their kind: what a geometry gains that is fitted with its law
    /// differs from kind to kind.
    fn score(&mut self) {
        let evidence: Vec<Evidence> = self.laws.iter().map(|law| law.evidence).collect();
        self.score_by(&evidence);
    }

    /// The same by other evidence, for each of the laws.
    pub(super) fn score_by(&mut self, evidence: &[Evidence]) {
        let Self { systems, laws, inflation } = self;
        *inflation = Evidence::inflation(evidence.iter().copied());
        laws.iter_mut().zip(evidence).for_each(|(law, evidence)| law.score = evidence.score(*inflation));
        laws.sort_by(|a, b| a.score.total_cmp(&b.score));
        let kind = |law: &RatedLaw| std::mem::discriminant(&systems[law.system].coordinates);
        let mut best = Vec::new();
        laws.retain(|law| {
            let known = best.iter().find(|(own, _)| *own == kind(law)).map(|(_, score)| *score);
            best.extend(known.is_none().then_some((kind(law), law.score)));
            known.is_none_or(|best| law.score <= best + NO_RIVAL)
        });
        for law in laws {
            let terms = law.judged.names();
            let coordinates = systems[law.system].coordinates.name();
            tracing::debug!(coordinates, terms, score = law.score, "score of a law");
        }
    }

    /// Fits the laws that are likely enough to be in a band together with the geometry of their coordinates,
    /// and rates them anew: joints that were found by themselves may be where no law agrees with them. The
    /// inertia is fitted as well, whose axes and moments particles show only roughly. What is far from any
    /// law is left as it is.
    pub(super) fn with_geometry(mut self, bodies: &[&ObservedPoses]) -> Self {
        if self.chi_square() > MOST_KINEMATIC {
            return self;
        }
        // What one law gains, another one behind it may gain as well.
        let (mut is_fitted, mut gain) = (vec![false; self.laws.len()], 0.0_f64);
        for _ in 0..MOST_GEOMETRIES {
            let Some(index) = self.due(&is_fitted, gain) else { break };
            is_fitted[index] = true;
            gain = gain.max(self.fit_geometry(index, bodies));
        }
        self.score();
        self
    }

    /// The likeliest law that is not fitted with its geometry yet, and may matter once it is, if it gains as
    /// much as others did. Rivals have a weight in bands, but there is none where no law describes the
    /// motion: then only what may become the likeliest law matters, or the likeliest in other coordinates.
    fn due(&self, is_fitted: &[bool], gain: f64) -> Option<usize> {
        let score = |index: usize| self.laws[index].now(self.inflation);
        let hope = |index: usize| score(index) - if is_fitted[index] { 0.0 } else { gain / self.inflation };
        let hoped: Vec<f64> = (0..self.laws.len()).map(hope).collect();
        let counts = shares(&weights(&hoped));
        let best = (0..hoped.len()).min_by(|&a, &b| score(a).total_cmp(&score(b)))?;
        let is_described = self.laws.iter().any(|law| self.chi_square_of(law) <= DESCRIBED);
        let kind = |index: usize| std::mem::discriminant(&self.systems[self.laws[index].system].coordinates);
        let is_first_of_kind = |index: usize| !(0..index).any(|other| kind(other) == kind(index));
        let matters = |index: usize| is_described || hoped[index] < score(best) || is_first_of_kind(index);
        let is_due = |&index: &usize| {
            !is_fitted[index] && (is_first_of_kind(index) || (counts[index] > 0 && matters(index)))
        };
        (0..hoped.len()).filter(is_due).min_by(|&a, &b| hoped[a].total_cmp(&hoped[b]))
    }

    /// Fits a law together with the geometry of its coordinates; returns what χ² of the poses gains by it,
    /// which is less than nothing where coordinates had hidden what the law leaves.
    fn fit_geometry(&mut self, index: usize, bodies: &[&ObservedPoses]) -> f64 {
        let law = &mut self.laws[index];
        let order = &self.systems[law.system].order;
        let found = compared_with(bodies, order, |compared| law.with_geometry(compared));
        let window = order.iter().map(|&body| bodies[body].clone()).collect();
        let Some((mut posterior, fitted)) = found else {
            law.posterior.set_window(window);
            return 0.0;
        };
        let gain = law.evidence.chi_square - posterior.loss;
        let coordinates = &posterior.placed.law.coordinates;
        tracing::debug!(index, ?coordinates, gain, left = posterior.loss, "a law with its geometry");
        law.judged.fitted = fitted;
        law.evidence.chi_square -= gain;
        posterior.set_window(window);
        law.set(posterior);
        gain
    }

    /// Fits a law and its geometry again, to poses with another noise; returns whether it could be fitted.
    pub(super) fn fit_again(&mut self, index: usize, bodies: &[&ObservedPoses]) -> bool {
        let law = &mut self.laws[index];
        let order = &self.systems[law.system].order;
        let fit = |compared: &Compared<'_>| {
            Posterior::fitted_together(&law.posterior.placed, &law.judged.fitted, compared)
        };
        let Some(mut posterior) = compared_with(bodies, order, fit) else { return false };
        if law.posterior.is_judged() {
            posterior.set_window(order.iter().map(|&body| bodies[body].clone()).collect());
        }
        law.set(posterior);
        true
    }

    /// The likeliest law.
    pub(super) fn best(&self) -> &RatedLaw {
        &self.laws[0]
    }

    /// The coordinates of the likeliest law.
    pub(super) fn system(&self) -> &Configured {
        &self.systems[self.best().system]
    }

    /// Weights of all laws in forecasts; they add up to 1.
    pub(super) fn weights(&self) -> Vec<f64> {
        weights(&self.laws.iter().map(|law| law.score).collect::<Vec<_>>())
    }

    /// χ² of the poses for each degree of freedom that the likeliest law leaves.
    pub(super) fn chi_square(&self) -> f64 {
        self.chi_square_of(self.best())
    }

    /// The same of any law. Of few samples the unknowns leave less than the scatter of χ²: what explains the
    /// poses to within that describes them.
    fn chi_square_of(&self, law: &RatedLaw) -> f64 {
        let Evidence { chi_square, samples, .. } = law.evidence;
        let unknowns = unknowns(&self.systems[law.system], &law.judged);
        let left = (samples - unknowns).max(1.0);
        chi_square / left.max(explained(samples, unknowns) / DESCRIBED)
    }
}

/// What a fit finds whose poses are compared with those of bodies, in the order of its coordinates.
fn compared_with<T>(
    bodies: &[&ObservedPoses],
    order: &[usize],
    fit: impl FnOnce(&Compared<'_>) -> Option<T>,
) -> Option<T> {
    let whitened = |poses: &[Vec<Pose>]| -> Vec<f64> {
        let of_body = |(place, &body): (usize, &usize)| {
            let own: Vec<Pose> = poses.iter().map(|of_time| of_time[place]).collect();
            bodies[body].whitened(&own).collect::<Vec<f64>>()
        };
        order.iter().enumerate().flat_map(of_body).collect()
    };
    let (times, noise) = (&bodies[0].times, bodies[order[0]].noise());
    let radius = bodies[order[0]].radius();
    fit(&Compared { times, whitened: &whitened, noise, radius })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::Law;
    use lgs_mechanics::coordinates::{Coordinates, Hinge, State};
    use nalgebra::DMatrix;

    const SAMPLES: f64 = 100.0;

    /// Laws on a hinge with a χ² for each independent sample, each so much less likely than the one before.
    fn rated(chi_square: f64, behind: &[f64]) -> Rated {
        of_samples(SAMPLES, chi_square, behind)
    }

    /// The same of so many independent samples.
    fn of_samples(samples: f64, chi_square: f64, behind: &[f64]) -> Rated {
        let coordinates = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] });
        let law = Law::new(coordinates.clone(), Vec::new(), Vec::new(), 0.01).expect("a law");
        let start = State { x: vec![0.0], v: vec![1.0] };
        let loss = chi_square * samples;
        let judged = |index: usize| Judged {
            index,
            fitted: Fitted {
                law: law.clone(),
                start: start.clone(),
                loss,
                covariance: DMatrix::zeros(2, 2),
                bounds: Vec::new(),
                priors: Vec::new(),
            },
            evidence: loss,
            simplicity: 0,
        };
        let choice = Choice { judged: (0..behind.len()).map(judged).collect(), chosen: 0, samples };
        let system = Configured {
            coordinates,
            x: vec![vec![0.0]],
            order: vec![0],
            bases: vec![Pose { linear: glam::DMat3::IDENTITY, shift: glam::DVec3::ZERO }],
            constants: 0,
            chi_square: 0.0,
        };
        let evidence = |_: &Configured, judged: &Judged| Evidence {
            chi_square: loss,
            samples,
            against: behind[judged.index],
        };
        Rated::new(vec![(system, choice)], &evidence).expect("laws")
    }

    #[test]
    fn rivals_are_fitted_with_their_geometry_where_a_law_describes_the_motion() {
        let due = |chi_square: f64, gain: f64| {
            let rated = rated(chi_square, &[0.0, 1.0, 25.0]);
            assert_eq!(rated.due(&[false; 3], 0.0), Some(0));
            rated.due(&[true, false, false], gain)
        };
        assert_eq!(due(1.0, 0.0), Some(1));
        assert_eq!(due(5.0, 0.0), None);
        // What may become the likeliest law matters all the same.
        assert_eq!(due(5.0, 10.0), Some(1));
    }

    #[test]
    fn a_law_that_explains_few_samples_describes_them() {
        let chi_square = |samples: f64, each: f64| of_samples(samples, each, &[0.0]).chi_square();
        // The start has two unknowns, beside which three samples leave one.
        assert!(chi_square(3.0, 0.9) <= DESCRIBED && chi_square(3.0, 3.0) > DESCRIBED);
        assert!((chi_square(SAMPLES, 0.9) - 90.0 / 98.0).abs() < 1e-12);
    }
}
