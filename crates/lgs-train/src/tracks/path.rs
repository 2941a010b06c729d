//! Where a tracked thing is over time: a smooth curve over the whole of the captured window, or places at
//! successive moments of a part of it.

use lgs_model::source::place_at;

use super::curve::Curve;
use super::thresholds::CURVE_PLACES;

/// The path of a thing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Path {
    /// A polynomial, where each moment is seen from a few sides.
    Curve(Curve),
    /// Times, ascending, and places at these, world units, where each moment is seen from many sides.
    Places(Vec<(f32, [f32; 3])>),
}

impl Path {
    /// First and last time.
    pub(super) fn span(&self) -> (f32, f32) {
        match self {
            Self::Curve(curve) => curve.span,
            Self::Places(places) => {
                places.first().zip(places.last()).map_or((0.0, 0.0), |(first, last)| (first.0, last.0))
            }
        }
    }

    /// The position at a time, world units; beyond the span that of the nearest end.
    pub(super) fn at(&self, time: f32) -> [f32; 3] {
        match self {
            Self::Curve(curve) => curve.at(time),
            Self::Places(places) => place_at(places, time),
        }
    }

    /// Times, ascending, and places at these, world units, between which the path is about straight.
    pub(super) fn places(&self) -> Vec<(f32, [f32; 3])> {
        let (first, last) = self.span();
        let time = |i: usize| first + (last - first) * i as f32 / (CURVE_PLACES - 1) as f32;
        match self {
            Self::Curve(curve) => (0..CURVE_PLACES).map(|i| (time(i), curve.at(time(i)))).collect(),
            Self::Places(places) => places.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_joined_evenly_and_kept_beyond_their_ends() {
        let path = Path::Places(vec![(0.2, [0.0; 3]), (0.3, [1.0, 0.0, 0.0]), (0.4, [1.0, 2.0, 0.0])]);
        assert_eq!(path.span(), (0.2, 0.4));
        let near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-5);
        assert!(near(path.at(0.25), [0.5, 0.0, 0.0]) && near(path.at(0.35), [1.0, 1.0, 0.0]));
        assert!(near(path.at(0.3), [1.0, 0.0, 0.0]));
        assert!(near(path.at(0.0), [0.0; 3]) && near(path.at(1.0), [1.0, 2.0, 0.0]));
        assert_eq!(Path::Places(Vec::new()).at(0.5), [0.0; 3]);
    }
}
