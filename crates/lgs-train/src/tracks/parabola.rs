//! The parabola through the places of a flight: what nothing but a uniform field acts on follows one.

use lgs_core::geometry::solve_positive;
use nalgebra::DMatrix;

use super::thresholds::LARGEST_MISS;

/// A stretch of time over which a thing flew, and the parabola that it followed there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeFlight {
    /// First and last time.
    pub times: [f32; 2],
    /// Acceleration, world units per squared unit of time.
    pub acceleration: [f32; 3],
    /// Standard deviation of each of its components, from what the parabola leaves.
    pub deviation: f32,
    /// Root mean square distance of the places from the parabola, world units.
    pub miss: f32,
}

/// The flight through places at times, and these places on its parabola; nothing if there are fewer than four
/// times or these are not different.
pub(super) fn free_flight(places: &[(f32, [f32; 3])]) -> Option<(FreeFlight, Vec<[f32; 3]>)> {
    let (first, last) = (places.first()?.0, places.last()?.0);
    let (count, half) = (places.len(), 0.5 * f64::from(last - first));
    if count < 4 || half <= 0.0 {
        return None;
    }
    let local = |time: f32| f64::from(time - first) / half - 1.0;
    let rows = DMatrix::from_fn(count, 3, |i, power| local(places[i].0).powi(power as i32));
    let values = DMatrix::from_fn(count, 3, |i, axis| f64::from(places[i].1[axis]));
    let gram = rows.transpose() * &rows;
    let found = solve_positive(gram.clone(), &(rows.transpose() * &values))?;
    let spread = solve_positive(gram, &DMatrix::from_fn(3, 1, |i, _| f64::from(u8::from(i == 2))))?;
    let fitted = &rows * &found;
    let squares = (&values - &fitted).iter().map(|v| v * v).sum::<f64>();
    // The second derivative of c x² with x = (t − mid) / half is 2 c / half².
    let unit = 2.0 / (half * half);
    let flight = FreeFlight {
        times: [first, last],
        acceleration: std::array::from_fn(|axis| (unit * found[(2, axis)]) as f32),
        deviation: (unit * (spread[2] * squares / (3 * (count - 3)) as f64).sqrt()) as f32,
        miss: (squares / count as f64).sqrt() as f32,
    };
    let on_parabola = (0..count).map(|i| std::array::from_fn(|axis| fitted[(i, axis)] as f32)).collect();
    Some((flight, on_parabola))
}

/// Puts the places of a flight where its parabola has them, if that leaves no more of them than what rays
/// leave of an accepted path; what acts on the thing is no uniform field otherwise.
pub(super) fn smoothed(places: &mut [(f32, [f32; 3])], radius: f32) -> Option<FreeFlight> {
    let (flight, on_parabola) = free_flight(places)?;
    if flight.miss > LARGEST_MISS * radius {
        tracing::debug!(?flight, "a flight that is no parabola");
        return None;
    }
    places.iter_mut().zip(on_parabola).for_each(|(place, at)| place.1 = at);
    Some(flight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::linear::{norm, sub};

    fn places(wobble: f32) -> Vec<(f32, [f32; 3])> {
        let at = |i: usize| {
            let t = 0.4 + 0.02 * i as f32;
            let off = wobble * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
            (t, [1.0 + 2.0 * t + off, 0.5 - t, 3.0 * t - 4.0 * t * t])
        };
        (0..9).map(at).collect()
    }

    #[test]
    fn a_thing_in_a_uniform_field_tells_its_acceleration() {
        let (flight, fitted) = free_flight(&places(0.0)).expect("enough places");
        let [x, y, z] = flight.acceleration;
        assert!(x.abs() < 1e-2 && y.abs() < 1e-2 && (z + 8.0).abs() < 1e-2, "{flight:?}");
        assert!(flight.miss < 1e-5 && fitted.len() == 9);
        let (noisy, _) = free_flight(&places(0.002)).expect("enough places");
        let off = norm(sub(noisy.acceleration, [0.0, 0.0, -8.0]));
        assert!(noisy.deviation > 10.0 * flight.deviation && off < 4.0 * noisy.deviation, "{noisy:?}");
        assert_eq!(free_flight(&places(0.0)[..3]), None);
    }

    #[test]
    fn places_go_to_a_parabola_that_they_follow_and_stay_where_they_follow_none() {
        let mut near = places(0.002);
        assert!(smoothed(&mut near, 0.1).is_some());
        assert!(norm(sub(near[4].1, places(0.0)[4].1)) < 0.001);
        let mut far = places(0.05);
        assert_eq!(smoothed(&mut far, 0.1), None);
        assert_eq!(far, places(0.05));
    }
}
