//! Times at which the motion of each object of a scene is trusted.

use lgs_dynamics::Edit;
use lgs_mechanics::bands::Verdict;
use lgs_model::LagrangianScene;

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

/// Whether the motion of an object is shown as it was captured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// As it was.
    Unedited,
    /// Under an edit, with the times between which the laws that are drawn from what is known of it agree,
    /// where there are any.
    Edited(Option<[f64; 2]>),
}

impl Shown {
    /// The motions of all objects of a scene under an edit of each; `is_edited` tells which are edited.
    #[must_use]
    pub fn of_objects(
        scene: &LagrangianScene,
        edits: &[Edit],
        is_edited: &dyn Fn(usize) -> bool,
    ) -> Vec<Self> {
        let moves_otherwise = |&object: &usize| scene.moved_with(object).into_iter().any(is_edited);
        let otherwise: Vec<usize> = (0..scene.objects.len()).filter(moves_otherwise).collect();
        let mut shown = vec![Self::Unedited; scene.objects.len()];
        for (&object, trusted) in otherwise.iter().zip(scene.trusted_under(&otherwise, edits)) {
            shown[object] = Self::Edited(trusted);
        }
        shown
    }

    /// The same where the whole scene has one edit.
    #[must_use]
    pub fn of_scene(scene: &LagrangianScene, edit: Edit) -> Vec<Self> {
        Self::of_objects(scene, &vec![edit; scene.objects.len()], &|_| edit != Edit::default())
    }
}

impl Trust {
    /// Trust in the motion of objects, with the captured window from 0 to `window`.
    ///
    /// Without an edit an object is trusted inside the window, and beyond it as far as its law says; one
    /// without a record, such as one that networks move, makes no claim beyond it. Under an edit only a law
    /// that explains the motion says anything, since what fits the window alone need not be the right
    /// physics; and as far as other laws that explain it say the same.
    #[must_use]
    pub fn of_objects<'a>(
        objects: impl IntoIterator<Item = (Option<&'a ObjectLaw>, Shown)>,
        window: f64,
    ) -> Self {
        let trusted = |(law, shown): (Option<&ObjectLaw>, Shown)| {
            let is_explained = law.is_some_and(|law| law.verdict == Verdict::Explained);
            match shown {
                Shown::Edited(_) if !is_explained => [0.0; 2],
                Shown::Edited(Some([from, to])) => [from.min(0.0), to.max(0.0)],
                Shown::Edited(None) | Shown::Unedited => {
                    let [from, to] = law.and_then(|law| law.trusted).unwrap_or([0.0, window]);
                    [from.min(0.0), to.max(window)]
                }
            }
        };
        Self::Objects(objects.into_iter().map(trusted).collect())
    }

    /// First and last time at which everything is trusted; nothing where there is nothing to trust.
    #[must_use]
    pub fn common(&self) -> Option<[f64; 2]> {
        let common = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].min(b[1])];
        self.parts().iter().copied().reduce(common)
    }

    fn parts(&self) -> &[[f64; 2]] {
        match self {
            Self::Objects(objects) => objects,
            Self::Source(window) => std::slice::from_ref(window),
        }
    }

    /// Numbers of the objects that are not trusted at a time; 0 stands for a source model.
    #[must_use]
    pub fn untrusted_at(&self, time: f32) -> Vec<usize> {
        let (time, rounding) = (f64::from(time), f64::from(TIME_TOLERANCE));
        let is_outside = |&[from, to]: &[f64; 2]| time < from - rounding || time > to + rounding;
        let parts = self.parts();
        (0..parts.len()).filter(|&part| is_outside(&parts[part])).collect()
    }

    /// A warning for each object, or the source model, that is not trusted at some of the times; it names
    /// them.
    #[must_use]
    pub fn warnings(&self, times: &[f32]) -> Vec<String> {
        let parts = self.parts().len();
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
        let shown = laws.iter().map(Option::as_ref).chain([None]).map(|law| (law, Shown::Unedited));
        let trust = Trust::of_objects(shown, 0.75);
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
        let edited =
            |drawn| Trust::of_objects(laws.iter().map(|law| (law.as_ref(), Shown::Edited(drawn))), 0.75);
        assert_eq!(edited(Some([-0.1, 0.4])), Trust::Objects(vec![[-0.1, 0.4], [0.0, 0.0]]));
        assert_eq!(edited(Some([-0.1, 0.4])).common(), Some([0.0, 0.0]));
        let trust = edited(None);
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
