//! The impulses of one hit.

use crate::coordinates::{Coordinates, Embedding, State};
use crate::law::Law;
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

/// A point of a body, and what an impulse there does.
pub(super) struct Struck {
    /// Velocity of the point, world units per unit of time.
    pub(super) velocity: DVec3,
    /// Velocity of the point by the generalised velocity, `[3, freedoms]`.
    jacobian: DMatrix<f64>,
    /// Change of the generalised velocity by an impulse, `[freedoms, 3]`.
    response: DMatrix<f64>,
    /// Change of the point's velocity by an impulse.
    mobility: DMat3,
}

impl Struck {
    /// The point of a body that is at `place` in a state; its particles have their places of t = 0 in the
    /// configuration `reference`. `None` where the kinetic energy of the state is not definite.
    pub(super) fn new(
        law: &Law,
        reference: &[f64],
        state: &State,
        (place, mass): (DVec3, f64),
    ) -> Option<Self> {
        let embedding = Embedding::new(&law.coordinates, reference);
        let placed = *embedding.placements(&state.x).first()?;
        let point = placed.from + placed.linear.inverse() * (place - placed.to);
        let velocity_by = |change: &[f64]| embedding.rates(&state.x, change)[0].apply(point);
        let freedoms = state.v.len();
        let unit = |k: usize| (0..freedoms).map(|i| f64::from(u8::from(i == k))).collect::<Vec<f64>>();
        let columns: Vec<DVec3> = (0..freedoms).map(|k| velocity_by(&unit(k))).collect();
        let jacobian = DMatrix::from_fn(3, freedoms, |row, column| columns[column][row]);
        let inertia = mass_matrix(&law.coordinates, &law.parameters, &state.x, freedoms) * mass;
        let response = inertia.cholesky()?.solve(&jacobian.transpose());
        let product = &jacobian * &response;
        let mobility = DMat3::from_cols_slice(product.as_slice());
        Some(Self { velocity: velocity_by(&state.v), jacobian, response, mobility })
    }

    /// The impulse at this point that a change of the generalised velocity tells of, by what it does to
    /// another point of the body; without what the body cannot follow, as one about a hinge.
    pub(super) fn impulse_of(&self, change: &[f64], by: &Self) -> DVec3 {
        let change = DMatrix::from_column_slice(change.len(), 1, change);
        let response = &by.jacobian * &self.response;
        let least = 1e-9 * response.amax();
        let inverse = response.pseudo_inverse(least).ok();
        let impulse = inverse.map(|inverse| inverse * (&by.jacobian * change));
        impulse.map_or(DVec3::ZERO, |impulse| DVec3::from_slice(impulse.as_slice()))
    }

    /// Change of the generalised velocity by an impulse.
    pub(super) fn change(&self, impulse: DVec3) -> Vec<f64> {
        let impulse = DMatrix::from_column_slice(3, 1, &impulse.to_array());
        (&self.response * impulse).as_slice().to_vec()
    }
}

/// The matrix of the kinetic energy, `T = ½ v·M v`.
fn mass_matrix(coordinates: &Coordinates, p: &[f64], x: &[f64], freedoms: usize) -> DMatrix<f64> {
    let energy = |ones: &[usize]| {
        let mut v = vec![0.0; freedoms];
        ones.iter().for_each(|&i| v[i] += 1.0);
        coordinates.kinetic_energy(p, &State { x: x.to_vec(), v })
    };
    let alone: Vec<f64> = (0..freedoms).map(|i| energy(&[i])).collect();
    DMatrix::from_fn(freedoms, freedoms, |i, j| {
        if i == j { 2.0 * alone[i] } else { energy(&[i, j]) - alone[i] - alone[j] }
    })
}

/// The impulse on the second of two bodies where they touch, with a normal from the first to the second,
/// after which they part at a speed; the first gets the opposite one. It stops the sliding if friction can.
pub(super) fn impulse([first, second]: [&Struck; 2], normal: DVec3, parting: f64, friction: f64) -> DVec3 {
    let mobility = first.mobility + second.mobility;
    let relative = second.velocity - first.velocity;
    let slide = relative.reject_from_normalized(normal);
    let bounce = parting - relative.dot(normal);
    let sticking = mobility.inverse() * (normal * bounce - slide);
    let along = sticking.dot(normal);
    let across = sticking - normal * along;
    if along > 0.0 && across.length() <= friction * along && sticking.is_finite() {
        return sticking;
    }
    let opposed = normal - slide.normalize_or_zero() * friction;
    let response = normal.dot(mobility * opposed);
    if response > 0.0 { opposed * (bounce / response) } else { DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::{Hinge, Inertia};

    fn at(
        coordinates: Coordinates,
        x: &[f64],
        v: &[f64],
        (place, mass): (DVec3, f64),
    ) -> (Law, State, Struck) {
        let law = Law::new(coordinates, Vec::new(), Vec::new(), 0.01).expect("a law");
        let state = State { x: x.to_vec(), v: v.to_vec() };
        let struck = Struck::new(&law, &state.x, &state, (place, mass)).expect("a point");
        (law, state, struck)
    }

    #[test]
    fn points_exchange_what_restitution_and_masses_say() {
        let (_, _, light) = at(Coordinates::Point, &[0.0; 3], &[2.0, 0.5, 0.0], (DVec3::X, 1.0));
        let (_, _, heavy) = at(Coordinates::Point, &[2.0, 0.0, 0.0], &[0.0; 3], (DVec3::X, 3.0));
        let push = impulse([&light, &heavy], DVec3::X, 0.5 * 2.0, 0.0);
        // Reduced mass ¾, times 1 + e, times the approach.
        assert!((push - DVec3::X * 0.75 * 1.5 * 2.0).length() < 1e-12, "{push}");
        assert!((heavy.change(push)[0] - 0.75).abs() < 1e-12);
        assert!((light.change(-push)[0] + 2.25).abs() < 1e-12, "they part at half the speed");
    }

    #[test]
    fn friction_that_holds_stops_the_sliding_of_a_ball() {
        let ball = || Coordinates::Rigid(Inertia::ball(0.4 * 0.25));
        let unturned = |x: f64| [1.0, 0.0, 0.0, 0.0, x, 0.0, 0.0];
        let [one, other] = [(0.0, [0.0, 0.0, 0.0, 2.0, 1.0, 0.0]), (1.0, [0.0; 6])]
            .map(|(x, v)| at(ball(), &unturned(x), &v, (DVec3::X * 0.5, 1.0)));
        let velocity_after = |(law, state, _): &(Law, State, Struck), change: Vec<f64>| {
            let v = state.v.iter().zip(change).map(|(v, change)| v + change).collect();
            let state = State { x: state.x.clone(), v };
            Struck::new(law, &state.x, &state, (DVec3::X * 0.5, 1.0)).expect("a point").velocity
        };
        for (friction, left) in [(10.0, 0.0), (0.05, 1.0 - 0.05 * 7.0 * 1.8)] {
            let push = impulse([&one.2, &other.2], DVec3::X, 0.8 * 2.0, friction);
            let [first, second] =
                [(&one, -push), (&other, push)].map(|(body, push)| velocity_after(body, body.2.change(push)));
            assert!(((second - first).x - 0.8 * 2.0).abs() < 1e-12, "restitution");
            assert!(((first - second).y - left).abs() < 1e-12, "friction {friction}: {}", first - second);
        }
    }

    #[test]
    fn a_body_on_a_hinge_gives_way_along_its_circle_alone() {
        let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 1.0, 0.0], pivot: [0.0, 0.0, 2.0] });
        let (_, _, hanging) = at(hinge, &[0.0], &[0.0], (DVec3::ZERO, 4.0));
        let (_, _, free) = at(Coordinates::Point, &[-1.0, 0.0, 0.0], &[1.0, 0.0, 0.0], (DVec3::ZERO, 1.0));
        // A bob of mass 1 at a distance of 2 from the hinge has a moment of 4: equal masses exchange speeds.
        let push = impulse([&free, &hanging], DVec3::X, 1.0, 0.0);
        assert!(
            (free.change(-push)[0] + 1.0).abs() < 1e-12
                && (hanging.change(push)[0].abs() - 0.5).abs() < 1e-12
        );
        assert_eq!(hanging.change(DVec3::Z)[0], 0.0);
    }
}
