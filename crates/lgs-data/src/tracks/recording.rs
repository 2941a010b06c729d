//! Points at several times, however they came.

use super::error::TracksProblem;

/// The unit of a file's lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct LengthUnit {
    /// Its name in the file; empty if the file names none.
    pub name: String,
    /// Metres in it, if it is known.
    pub metres: Option<f64>,
}

impl LengthUnit {
    /// A unit by its name.
    #[must_use]
    pub fn named(name: &str) -> Self {
        let metres = match name.trim().to_ascii_lowercase().as_str() {
            "mm" | "millimeters" | "millimetres" => Some(1e-3),
            "cm" | "centimeters" | "centimetres" => Some(1e-2),
            "m" | "meters" | "metres" => Some(1.0),
            "in" | "inch" | "inches" => Some(0.0254),
            "ft" | "feet" => Some(0.3048),
            _ => None,
        };
        Self { name: name.trim().to_owned(), metres }
    }

    /// Factor from the file's lengths to world units: metres, where the unit is known.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.metres.unwrap_or(1.0)
    }
}

/// Points at several times, with gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTracks {
    /// Names of the points, `[n]`.
    pub labels: Vec<String>,
    /// The unit of `points`.
    pub unit: LengthUnit,
    /// Times `[T]`, strictly ascending from 0: seconds, where the file knows its rate.
    pub times: Vec<f64>,
    /// Positions `[T][n]`, finite; nothing where a point is not seen.
    pub points: Vec<Vec<Option<[f32; 3]>>>,
}

impl PointTracks {
    /// Checks what all layouts share, and lets the times begin at 0.
    pub(super) fn checked(mut self) -> Result<Self, TracksProblem> {
        if self.labels.is_empty() {
            return Err(TracksProblem::Empty("points"));
        }
        let first = *self.times.first().ok_or(TracksProblem::Empty("times"))?;
        self.times.iter_mut().for_each(|time| *time -= first);
        let ascends = |pair: &[f64]| pair[0].partial_cmp(&pair[1]) == Some(std::cmp::Ordering::Less);
        match self.times.windows(2).find(|pair| !ascends(pair)) {
            Some(pair) => {
                Err(TracksProblem::NotAscending { before: pair[0] + first, after: pair[1] + first })
            }
            None => Ok(self),
        }
    }
}
