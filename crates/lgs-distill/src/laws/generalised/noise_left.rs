//! Laws rated by the noise that they leave (method §5.4).
//!
//! The noise of poses is estimated before any law is known, by a smooth path that has to be as free as any
//! motion is. Where a law explains the poses, what it leaves of them tells the noise better: which errors are
//! slow and which are not, of each coordinate by itself. That noise is the scale on which rivals are compared
//! and the unknowns' deviations are found.

use super::evidence::Evidence;
use super::observed::ObservedPoses;
use super::placed::Placed;
use super::rated::{Rated, RatedLaw};
use crate::thresholds::PROBED_DEVIATIONS;
use lgs_mechanics::bands::shares;
use lgs_mechanics::choose::EXPLAINED;
use lgs_mechanics::noise::LeftNoise;
use nalgebra::DMatrix;

impl Rated {
    /// Rates the laws that matter again, by the noise which the likeliest of them leaves where noise is
    /// whatever a law leaves; as they are if none explains the poses.
    pub(super) fn by_noise_left(mut self, bodies: &[&ObservedPoses]) -> Self {
        if self.chi_square() > EXPLAINED {
            return self;
        }
        let counts = shares(&self.weights());
        let mut counts = counts.iter();
        self.laws.retain(|_| counts.next().is_some_and(|&count| count > 0));
        let of_law = |law: &RatedLaw| {
            let left = left_by(law, &self.systems[law.system].order, bodies)?;
            let likelihood = left.iter().flatten().map(|left| left.likelihood).sum::<f64>();
            Some((likelihood + law.evidence.against, left))
        };
        let likeliest = self.laws.iter().filter_map(of_law).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, left)) = likeliest else { return self };
        let with_noise = |(body, left): (&&ObservedPoses, &[LeftNoise; 6])| {
            tracing::debug!(?left, looked = ?body.track.noise, "noise that a law leaves");
            body.with_noise(&left.map(|left| left.noise))
        };
        let bodies: Vec<ObservedPoses> = bodies.iter().zip(&left).map(with_noise).collect();
        self.rated_within(&bodies.iter().collect::<Vec<_>>());
        self
    }

    /// Fits all laws again within another noise, and brings them in the order of their evidence by it; those
    /// that cannot be fitted come last, and nothing changes if none can.
    fn rated_within(&mut self, bodies: &[&ObservedPoses]) {
        let samples = bodies.iter().map(|body| body.track.independent_samples()).sum();
        let is_fitted: Vec<bool> = (0..self.laws.len()).map(|index| self.fit_again(index, bodies)).collect();
        let of_law = |(law, is_fitted): (&RatedLaw, bool)| {
            let chi_square = if is_fitted { law.posterior.loss } else { f64::INFINITY };
            Evidence { chi_square, samples, ..law.evidence }
        };
        let evidence: Vec<Evidence> = self.laws.iter().zip(is_fitted).map(of_law).collect();
        if evidence.iter().any(|evidence| evidence.chi_square.is_finite()) {
            self.score_by(&evidence);
        }
    }
}

/// The noise of each of the six coordinates of some bodies, in their own order, that a law leaves which takes
/// them in another `order`; `None` if there is too little of them.
fn left_by(law: &RatedLaw, order: &[usize], bodies: &[&ObservedPoses]) -> Option<Vec<[LeftNoise; 6]>> {
    let (placed, covariance) = (&law.posterior.placed, &law.posterior.covariance);
    let differences = |placed: &Placed| -> Option<Vec<Vec<[f64; 6]>>> {
        let poses = placed.poses(&bodies[0].times)?;
        let of_body = |(body, observed): (usize, &&ObservedPoses)| {
            let place = order.iter().position(|&own| own == body)?;
            Some(observed.differences(&poses.iter().map(|of_time| of_time[place]).collect::<Vec<_>>()))
        };
        bodies.iter().enumerate().map(of_body).collect()
    };
    let middle = differences(placed)?;
    let changed = |i: usize| {
        let mut by = vec![0.0; covariance.nrows()];
        by[i] = PROBED_DEVIATIONS * covariance[(i, i)].sqrt();
        differences(&placed.changed(&by))
    };
    let known = (0..covariance.nrows()).filter(|&i| covariance[(i, i)] > 0.0);
    let changed: Vec<Vec<Vec<[f64; 6]>>> = known.map(changed).collect::<Option<_>>()?;
    let of_coordinate = |body: usize, c: usize| {
        let own = &middle[body];
        let residuals: Vec<f64> = own.iter().map(|of_time| of_time[c]).collect();
        let change = |k: usize, i: usize| (changed[i][body][k][c] - own[k][c]) / PROBED_DEVIATIONS;
        let changes = DMatrix::from_fn(own.len(), changed.len(), change);
        LeftNoise::of(&residuals, &changes, &bodies[body].track.sampling)
    };
    let of_body = |body: usize| {
        let all: Vec<LeftNoise> = (0..6).map(|c| of_coordinate(body, c)).collect::<Option<_>>()?;
        all.try_into().ok()
    };
    (0..bodies.len()).map(of_body).collect()
}

#[cfg(test)]
mod tests {
    use crate::laws::generalised::Laws;
    use crate::laws::generalised::choice::choose_law;
    use crate::laws::generalised::observed::ObservedPoses;
    use crate::laws::generalised::rated::Rated;
    use crate::motion::pose::{Pose, PoseKind};
    use crate::motion::shared_motion::SharedMotion;
    use crate::testing::block;
    use glam::DVec3;
    use lgs_core::geometry::rotation_by;
    use lgs_core::stream;
    use lgs_mechanics::coordinates::{Coordinates, Hinge, Port, State};
    use lgs_mechanics::terms::Term;
    use lgs_mechanics::{Edit, Law, System};
    use rand_distr::{Distribution, StandardNormal};

    const TIMES: usize = 46;
    /// Views that take turns, each with an error of its own.
    const VIEWS: usize = 4;

    /// A rod on a hinge with a torsion spring, seen from other views at each time: its place is well known,
    /// its turn about itself is not.
    fn observed(seed: u64) -> SharedMotion {
        let hinge = Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] };
        let spring = Term::named("spring", Port::Whole).expect("a term");
        let law = Law::new(Coordinates::Hinge(hinge), vec![spring], vec![27.0, 0.0], 1e-3).expect("a law");
        let times: Vec<f64> = (0..TIMES).map(|k| k as f64 / 60.0).collect();
        let start = State { x: vec![0.7], v: vec![1.0] };
        let states = System::new(&law, Edit::NONE).states(&start, &times).expect("a motion");
        let mut stream = stream(seed, "a rod seen from changing views", 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut stream) };
        let mut errors = |size: f64| DVec3::new(size * normal(), size * normal(), size * normal());
        let of_view: Vec<[DVec3; 2]> = (0..VIEWS).map(|_| [errors(8e-3), errors(2e-4)]).collect();
        let pose = |(k, state): (usize, &State)| {
            let turned = rotation_by(DVec3::Z * state.x[0]);
            let [turn, place] = of_view[k % VIEWS];
            let turn = turn * DVec3::new(1.0, 0.1, 0.1) + errors(3e-4);
            Pose {
                linear: turned * rotation_by(turn),
                shift: turned * (0.65 * DVec3::X) + place + errors(5e-5),
            }
        };
        let poses = states.iter().enumerate().map(pose).collect();
        SharedMotion {
            kind: PoseKind::Rigid,
            times,
            poses,
            shape: block([0.5, 0.05, 0.05], 64, 5),
            weights: vec![1.0 / 64.0; 64],
            deviations: Vec::new(),
            residual: 0.0,
        }
    }

    /// Value and deviation of the stiffness in the likeliest law.
    fn stiffness(rated: &Rated) -> [f64; 2] {
        let law = &rated.best().judged.fitted.law;
        [law.parameters[0], law.deviations[0]]
    }

    #[test]
    fn noise_that_was_enlarged_for_errors_that_are_not_there_does_not_stay() {
        for seed in 1..=3 {
            let mut observed = ObservedPoses::new(&observed(seed), Laws::All, 0.0);
            assert!(observed.allow_for(2e-3, 4.0));
            let before = stiffness(&choose_law(&observed).expect("laws"));
            let rated = choose_law(&observed).expect("laws").by_noise_left(&[&observed]);
            let [value, deviation] = stiffness(&rated);
            assert!((value - 27.0).abs() < 4.0 * deviation, "{value} ± {deviation}, before {before:?}");
            assert!(deviation < 0.7 * before[1], "{deviation}, before {before:?}");
        }
    }
}
