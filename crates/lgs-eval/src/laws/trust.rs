//! Times at which the motion of each object of a scene is trusted.

use lgs_dynamics::Edit;
use lgs_mechanics::bands::Verdict;

use super::ObjectLaw;
use crate::thresholds::TIME_TOLERANCE;

/// First and last time at which each object of a scene is trusted, or a source model as a whole.
#[derive(Clone, Debug, PartialEq)]
pub enum Trust {
    /// One pair of times per object.
    Objects(Vec<[f64; 2]>),
    /// The times that a source model was trained on.
    Source([f64; 2]),
}

impl Trust {
    /// Trust in the motion of `objects` objects under an edit, with the captured window from 0 to `window`.
    ///
    /// Without an edit an object is trusted inside the window, and beyond it as far as its law says; one
    /// without a record, such as one that networks move, makes no claim beyond it. Under an edit only a law
    /// that explains the motion says anything: what fits the window alone need not be the right physics.
    #[must_use]
    pub fn of_objects(laws: &[Option<ObjectLaw>], objects: usize, (window, edit): (f64, Edit)) -> Self {
        let trusted = |object: usize| {
            let law = laws.get(object).and_then(Option::as_ref);
            if edit != Edit::default() && law.is_none_or(|law| law.verdict != Verdict::Explained) {
                return [0.0; 2];
            }
            let [from, to] = law.and_then(|law| law.trusted).unwrap_or([0.0, window]);
            [from.min(0.0), to.max(window)]
        };
        Self::Objects((0..objects).map(trusted).collect())
    }

    /// Numbers of the objects that are not trusted at a time; 0 stands for a source model.
    #[must_use]
    pub fn untrusted_at(&self, time: f32) -> Vec<usize> {
        let (time, rounding) = (f64::from(time), f64::from(TIME_TOLERANCE));
        let is_outside = |&[from, to]: &[f64; 2]| time < from - rounding || time > to + rounding;
        let parts = match self {
            Self::Objects(objects) => objects.as_slice(),
            Self::Source(window) => std::slice::from_ref(window),
        };
        (0..parts.len()).filter(|&part| is_outside(&parts[part])).collect()
    }

    /// A warning for each object, or the source model, that is not trusted at some of the times; it names
    /// them.
    #[must_use]
    pub fn warnings(&self, times: &[f32]) -> Vec<String> {
        let parts = match self {
            Self::Objects(objects) => objects.len(),
            Self::Source(_) => 1,
        };
        let warning = |part: usize| {
            let doubtful = times.iter().filter(|&&time| self.untrusted_at(time).contains(&part));
            let [first, last] = doubtful
                .clone()
                .fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], &time| [a.min(time), b.max(time)]);
            let (count, all) = (doubtful.count(), times.len());
            let span = if first < last { format!("{first:.2} to {last:.2}") } else { format!("{first:.2}") };
            (count > 0).then(|| format!("{} at {count} of {all} times: t = {span}", self.doubt(part)))
        };
        (0..parts).filter_map(warning).collect()
    }

    /// The doubt about an object in words.
    fn doubt(&self, part: usize) -> String {
        match self {
            Self::Objects(objects) => match objects[part] {
                [0.0, 0.0] => format!("the edited motion of object {part} is not known to hold"),
                [from, to] => {
                    format!("object {part}, trusted from t = {from:.2} to {to:.2}, is not to be trusted")
                }
            },
            Self::Source([from, to]) => {
                format!("the source model, trained from t = {from:.2} to {to:.2}, guesses")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(verdict: Verdict, trusted: Option<[f64; 2]>) -> Option<ObjectLaw> {
        Some(ObjectLaw { verdict, trusted, ..ObjectLaw::default() })
    }

    #[test]
    fn objects_are_trusted_as_far_as_their_laws_say_and_without_one_inside_the_window() {
        let laws = [law(Verdict::Explained, Some([-0.5, 2.0])), law(Verdict::Outside, None)];
        let trust = Trust::of_objects(&laws, 3, (0.75, Edit::default()));
        assert_eq!(trust, Trust::Objects(vec![[-0.5, 2.0], [0.0, 0.75], [0.0, 0.75]]));
        assert_eq!(trust.untrusted_at(0.75), [0_usize; 0]);
        assert_eq!(trust.untrusted_at(1.0), [1, 2]);
        assert_eq!(trust.untrusted_at(-0.6), [0, 1, 2]);
        let warnings = trust.warnings(&[0.5, 1.0, 2.25]);
        assert_eq!(
            warnings[0],
            "object 0, trusted from t = -0.50 to 2.00, is not to be trusted at 1 of 3 times: t = 2.25"
        );
        assert!(warnings[1].ends_with("at 2 of 3 times: t = 1.00 to 2.25"), "{warnings:?}");
    }

    #[test]
    fn an_edit_is_trusted_where_the_law_explains_the_motion() {
        let laws = [law(Verdict::Explained, Some([-0.5, 2.0])), law(Verdict::Described, Some([0.0, 0.9]))];
        let slow = Edit { potential_scale: 0.5, ..Edit::default() };
        let trust = Trust::of_objects(&laws, 2, (0.75, slow));
        assert_eq!((trust.untrusted_at(0.0), trust.untrusted_at(0.5)), (vec![], vec![1]));
        assert!(trust.warnings(&[0.5])[0].contains("edited motion of object 1 is not known to hold"));
    }

    #[test]
    fn a_source_model_is_trusted_where_it_was_trained() {
        let trust = Trust::Source([0.0, 0.75]);
        assert_eq!((trust.untrusted_at(0.7), trust.untrusted_at(-0.1)), (vec![], vec![0]));
        assert_eq!(trust.warnings(&[0.1]), Vec::<String>::new());
        assert!(trust.warnings(&[1.0])[0].contains("source model"));
    }
}
