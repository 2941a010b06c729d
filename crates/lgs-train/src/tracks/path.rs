//! Where a tracked thing is over time: a smooth curve over the whole of the captured window, or places at
//! successive moments of a part of it.

use lgs_core::linear::{add, scale, sub};

use super::curve::Curve;

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
            Self::Places(places) => between(places, time),
        }
    }
}

/// The place at a time, evenly on the way from one given place to the next.
fn between(places: &[(f32, [f32; 3])], time: f32) -> [f32; 3] {
    let after = places.partition_point(|(t, _)| *t < time);
    let (Some(&(start, from)), Some(&(end, to))) =
        (places.get(after.saturating_sub(1)), places.get(after.min(places.len().saturating_sub(1))))
    else {
        return [0.0; 3];
    };
    let part = ((time - start) / (end - start).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    add(from, scale(sub(to, from), part))
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
