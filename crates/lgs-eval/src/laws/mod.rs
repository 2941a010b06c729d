//! The law of every object, as `metrics.json` has it: coordinates, terms with values and uncertainty, trust,
//! verdict, and what the truth says of them.
//!
//! A run without laws in generalised coordinates has no records, and its metrics are as if this module were
//! not there.

mod coverage;
mod table;
mod trust;

pub use coverage::{PositionErrors, band_coverage, covered, position_errors};
pub use table::{edit_rows, law_rows, measured, parameter_rows, rival_rows, trusted_edit_rows, verdict_name};
pub use trust::{Shown, Trust};

use lgs_mechanics::bands::Verdict;

use crate::metrics::ObjectSummary;
pub use crate::object_law::{
    BandCoverage, HitsOfObjects, LawContact, LawOutline, LawParameter, LawTerm, ObjectLaw, PositionBand,
    RivalLaw, TermOutline, TrustedEdit, unit_text,
};

/// First and last time at which the forecasts of all objects with a record are trusted, with the captured
/// window from 0 to `window` in between; nothing without a record.
#[must_use]
pub fn trusted_times(objects: &[ObjectSummary], window: f64) -> Option<[f64; 2]> {
    let trusted = |law: &ObjectLaw| law.trusted.unwrap_or([0.0, window]);
    let common = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].min(b[1])];
    let all = objects.iter().filter_map(|object| object.law.as_ref()).map(trusted).reduce(common)?;
    Some([all[0].min(0.0), all[1].max(window)])
}

/// Whether a verdict is the one that a synthetic scene expects. A motion that no law explains is expected to
/// be `outside`; `described` claims no forecast of it and is right as well.
#[must_use]
pub fn is_right(verdict: Verdict, expected: Verdict) -> bool {
    verdict == expected || (expected == Verdict::Outside && verdict == Verdict::Described)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(trusted: Option<[f64; 2]>) -> ObjectSummary {
        let law = ObjectLaw { trusted, ..ObjectLaw::default() };
        ObjectSummary { law: Some(law), ..ObjectSummary::default() }
    }

    #[test]
    fn a_scene_is_trusted_as_long_as_each_of_its_objects() {
        let objects = [object(Some([-0.5, 2.0])), object(Some([-1.0, 1.25])), ObjectSummary::default()];
        assert_eq!(trusted_times(&objects, 0.75), Some([-0.5, 1.25]));
        assert_eq!(trusted_times(&[object(None)], 0.75), Some([0.0, 0.75]), "nothing beyond the window");
        assert_eq!(trusted_times(&[ObjectSummary::default()], 0.75), None);
    }

    #[test]
    fn a_motion_without_a_law_may_be_described_and_never_explained() {
        assert!(is_right(Verdict::Explained, Verdict::Explained));
        assert!(!is_right(Verdict::Described, Verdict::Explained));
        assert!(
            is_right(Verdict::Described, Verdict::Outside) && is_right(Verdict::Outside, Verdict::Outside)
        );
        assert!(!is_right(Verdict::Explained, Verdict::Outside));
    }
}
