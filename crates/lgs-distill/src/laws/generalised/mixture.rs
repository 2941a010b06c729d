//! The band of a forecast: draws from the posteriors of all likely laws, in all coordinates, by their
//! weights. A law that the evidence hardly tells from the chosen one and that forecasts something else widens
//! it.

use super::placed::Placed;
use super::rated::{Rated, RatedLaw};
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{BAND_POINTS, DRAWN_LAWS, LIGHTEST};
use glam::DVec3;
use lgs_core::holding;
use lgs_mechanics::bands::{DrawnLaws, HELD, StartedLaw, shares, shares_of};

/// Radius around the positions of a forecast that holds 90 % of the posterior of positions, over the
/// particles of all bodies, at each of some ascending times; infinite where too many draws cannot be
/// followed. `forecast` has the poses of all bodies at these times, as far as it can be followed.
pub(super) fn radius(
    rated: &Rated,
    (bodies, forecast): (&[&SharedMotion], &[Option<Vec<Pose>>]),
    times: &[f64],
    seed: u64,
) -> Vec<f64> {
    let points: Vec<Vec<DVec3>> = bodies.iter().map(|motion| spread_points(motion)).collect();
    let mut distances: Vec<Vec<f64>> = vec![Vec::new(); times.len()];
    let counts = shares(&rated.weights());
    for (index, (law, count)) in rated.laws.iter().zip(counts).enumerate() {
        let system = &rated.systems[law.system];
        for motion in law.posterior.drawn(rated.inflation, count, times, (seed, index as u64)) {
            for (at, distances) in distances.iter_mut().enumerate() {
                let both = motion[at].as_ref().zip(forecast[at].as_ref());
                for (place, &body) in system.order.iter().enumerate() {
                    let apart = |point: &DVec3| match both {
                        Some((moved, own)) => moved[place].apply(*point).distance(own[body].apply(*point)),
                        None => f64::INFINITY,
                    };
                    distances.extend(points[body].iter().map(apart));
                }
            }
        }
    }
    distances.into_iter().map(|distances| holding(HELD, distances)).collect()
}

/// Laws drawn from the posteriors of all likely laws, by their weights, for the bodies in the `order` of the
/// likeliest one's coordinates.
pub(super) fn drawn_laws(rated: &Rated, order: &[usize], seed: u64) -> Vec<DrawnLaws> {
    let counts = shares_of(DRAWN_LAWS, &rated.weights());
    let started = |placed: &Placed| StartedLaw { law: placed.law.clone(), start: placed.start.clone() };
    let drawn = |(index, (law, count)): (usize, (&RatedLaw, usize))| {
        let all = law.posterior.changed(rated.inflation, count, (seed, index as u64));
        let place = |body: &usize| order.iter().position(|own| own == body);
        Some(DrawnLaws {
            middle: started(&law.posterior.placed),
            order: rated.systems[law.system].order.iter().map(place).collect::<Option<_>>()?,
            part: law.posterior.part(),
            drawn: all.iter().map(started).collect(),
        })
    };
    let all = rated.laws.iter().zip(counts).enumerate();
    all.filter(|(index, (_, count))| *index == 0 || *count > 0).filter_map(drawn).collect()
}

/// Some of the points of a body, spread evenly over their order, without outliers.
fn spread_points(motion: &SharedMotion) -> Vec<DVec3> {
    let least = LIGHTEST / motion.weights.len().max(1) as f64;
    let heavy = motion.shape.iter().zip(&motion.weights).filter(|(_, weight)| **weight >= least);
    let heavy: Vec<DVec3> = heavy.map(|(point, _)| *point).collect();
    let count = heavy.len().min(BAND_POINTS);
    (0..count).map(|i| heavy[i * heavy.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::generalised::evidence::Evidence;
    use crate::laws::generalised::kinematics::Configured;
    use crate::motion::pose::PoseKind;
    use lgs_mechanics::Law;
    use lgs_mechanics::choose::{Choice, Judged};
    use lgs_mechanics::coordinates::{Coordinates, Hinge, Port, State};
    use lgs_mechanics::fit::Fitted;
    use lgs_mechanics::terms::Term;
    use nalgebra::DMatrix;

    const STILL: Pose = Pose { linear: glam::DMat3::IDENTITY, shift: DVec3::ZERO };

    fn body(shape: &[DVec3]) -> SharedMotion {
        let weights = vec![(shape.len() as f64).recip(); shape.len()];
        let (times, poses) = (vec![0.0, 1.0], vec![STILL; 2]);
        SharedMotion {
            kind: PoseKind::Rigid,
            times,
            poses,
            shape: shape.to_vec(),
            weights,
            deviations: Vec::new(),
            residual: 0.0,
        }
    }

    /// A law in coordinates of its own, of a rate 1 along the first coordinate with a deviation.
    fn fitted(coordinates: Coordinates, drag: Option<f64>, deviation: f64) -> (Configured, Choice) {
        let terms = drag.iter().map(|_| Term::named("linear-drag", Port::Whole).expect("a term")).collect();
        let law = Law::new(coordinates.clone(), terms, drag.into_iter().collect(), 0.01).expect("a law");
        let n = coordinates.freedoms();
        let mut start = State { x: vec![0.0; n], v: vec![0.0; n] };
        start.v[0] = 1.0;
        let mut covariance = DMatrix::zeros(2 * n + law.parameters.len(), 2 * n + law.parameters.len());
        covariance[(n, n)] = deviation * deviation;
        let bounds = vec![[0.0, 9.0]; law.parameters.len()];
        let x = vec![start.x.clone()];
        let fitted = Fitted { law, start, loss: 1.0, covariance, bounds, priors: Vec::new() };
        let judged = vec![Judged { index: 0, fitted, evidence: 0.0, simplicity: 0 }];
        let system =
            Configured { coordinates, x, order: vec![0], bases: vec![STILL], constants: 0, chi_square: 0.0 };
        (system, Choice { judged, chosen: 0, samples: 1.0 })
    }

    /// Radius at t = 3 around free motion along x, of laws that are so much less likely than the first.
    fn at_three(laws: Vec<((Configured, Choice), f64)>, (motion, forecast): (&SharedMotion, Pose)) -> f64 {
        let (found, behind): (Vec<_>, Vec<f64>) = laws.into_iter().unzip();
        let places: Vec<Coordinates> = found.iter().map(|(system, _)| system.coordinates.clone()).collect();
        let evidence = |system: &Configured, law: &Judged| {
            let at = places.iter().position(|place| *place == system.coordinates).unwrap_or(0);
            let at = at + usize::from(places.len() > 1 && !law.fitted.law.terms.is_empty());
            Evidence { chi_square: 1.0, samples: 1.0, against: behind[at] }
        };
        let rated = Rated::new(found, &evidence).expect("laws");
        radius(&rated, (&[motion], &[Some(vec![forecast])]), &[3.0], 1)[0]
    }

    #[test]
    fn a_rival_that_forecasts_something_else_widens_the_band_if_it_is_likely() {
        let motion = body(&[DVec3::ZERO, DVec3::Y]);
        let forecast = Pose { shift: DVec3::X * 3.0, ..STILL };
        let with_rival = |behind: f64| {
            let free = (fitted(Coordinates::Point, None, 1e-4), 0.0);
            let dragged = (fitted(Coordinates::Point, Some(1.0), 1e-4), behind);
            at_three(vec![free, dragged], (&motion, forecast))
        };
        let apart = 3.0 - (1.0 - (-3.0_f64).exp());
        assert!((with_rival(0.0) - apart).abs() < 0.01, "{}", with_rival(0.0));
        assert!(with_rival(20.0) < 0.01, "{}", with_rival(20.0));
    }

    #[test]
    fn a_band_holds_positions_of_points_that_move_differently() {
        // Half of the points lie on the axis, where an error of the rate does not show.
        let shape: Vec<DVec3> =
            (0..40).map(|i| if i % 2 == 0 { DVec3::Z * f64::from(i) } else { DVec3::X }).collect();
        let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] });
        let turned = glam::DMat3::from_rotation_z(3.0);
        let law = (fitted(hinge, None, 0.01), 0.0);
        let found = at_three(vec![law], (&body(&shape), Pose { linear: turned, ..STILL }));
        // Nine tenths of all points are four fifths of the outer ones: 1.28 deviations.
        let expected = 1.2816 * 0.03;
        assert!((found / expected - 1.0).abs() < 0.2, "{found}, not {expected}");
    }
}
