//! A fitted law whose body gets an inertia that is known only roughly.

use super::fitted::Fitted;
use crate::coordinates::InertiaForm;
use nalgebra::DMatrix;

impl Fitted {
    /// The same motion with moments and axes of the inertia, and the direction to the centre of mass, as
    /// parameters: particles, of which the law has axes or moments, show them only roughly. Their prior is
    /// that of a law which is fitted with them. `None` of laws without an inertia from particles.
    #[must_use]
    pub fn with_open_inertia(&self) -> Option<Self> {
        let mut law = self.law.clone();
        let kept = law.coordinates.parameters().len();
        let inertia = law.coordinates.inertia_mut()?;
        if !matches!(inertia.form, InertiaForm::Prior | InertiaForm::Free) {
            return None;
        }
        inertia.form = InertiaForm::Whole;
        let added = law.coordinates.parameters().split_off(kept);
        law.parameters.splice(kept..kept, vec![0.0; added.len()]);
        if law.deviations.len() >= kept {
            law.deviations.splice(kept..kept, added.iter().map(|parameter| parameter.spread));
        }
        let (mut bounds, mut priors) = (self.bounds.clone(), self.priors.clone());
        bounds.splice(kept..kept, added.iter().map(|parameter| parameter.bounds));
        let first = 2 * self.start.v.len() + kept;
        priors.iter_mut().filter(|(place, ..)| *place >= first).for_each(|(place, ..)| *place += added.len());
        priors.extend(added.iter().enumerate().map(|(i, parameter)| (first + i, 0.0, parameter.spread)));
        let spreads: Vec<f64> = added.iter().map(|parameter| parameter.spread).collect();
        let covariance = with_independent(&self.covariance, first, &spreads);
        Some(Self { law, start: self.start.clone(), loss: self.loss, covariance, bounds, priors })
    }
}

/// A covariance with more unknowns before one of them, independent of all others.
fn with_independent(covariance: &DMatrix<f64>, first: usize, deviations: &[f64]) -> DMatrix<f64> {
    let added = deviations.len();
    let mut all = covariance.clone().insert_rows(first, added, 0.0).insert_columns(first, added, 0.0);
    deviations.iter().enumerate().for_each(|(i, deviation)| all[(first + i, first + i)] = deviation.powi(2));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::{Ball, Coordinates, Inertia, Port, State};
    use crate::law::Law;
    use crate::terms::Term;
    use crate::{Edit, System};

    fn ball(form: InertiaForm, parameters: Vec<f64>) -> Fitted {
        let inertia = Inertia { form, frame: [1.0, 0.0, 0.0, 0.0], moments: [0.5, 0.4, 0.2] };
        let ball = Ball { pivot: [0.0; 3], arm: [0.0, 0.1, 0.6], inertia };
        let weight = Term::named("uniform-field", Port::Arm).expect("a term");
        let mut law = Law::new(Coordinates::Ball(ball), vec![weight], parameters, 0.01).expect("a law");
        law.deviations = vec![1.0; law.parameters.len()];
        let count = 6 + law.parameters.len();
        let start = State { x: vec![1.0, 0.0, 0.0, 0.0], v: vec![0.3, 0.1, 5.0] };
        let bounds = vec![[-1.6, 1.6]; law.parameters.len()];
        let covariance = DMatrix::identity(count, count);
        Fitted { law, start, loss: 1.0, covariance, bounds, priors: vec![(count - 1, 0.5, 2.0)] }
    }

    #[test]
    fn an_inertia_that_is_opened_moves_as_before() {
        let own = ball(InertiaForm::Free, vec![0.1, -0.2, 0.0, 0.0, -4.0]);
        let open = own.with_open_inertia().expect("an inertia");
        let states = |fitted: &Fitted| {
            System::new(&fitted.law, Edit::NONE).states(&fitted.start, &[0.4, 1.3]).expect("a motion")
        };
        for (a, b) in states(&own).iter().zip(states(&open)) {
            a.x.iter().zip(b.x).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a}, not {b}"));
        }
        let names: Vec<String> = open.law.table().into_iter().map(|(p, _)| p.name).collect();
        assert_eq!(names[1..4], ["log-moment-3", "coupling-12", "coupling-13"]);
        assert_eq!(open.law.parameters.len(), open.bounds.len());
        assert_eq!(open.law.parameters.len(), open.law.deviations.len());
        assert_eq!(open.covariance.nrows(), 6 + open.law.parameters.len());
        // The prior of the last parameter is still that of the last.
        assert_eq!(open.priors[0], (5 + open.law.parameters.len(), 0.5, 2.0));
    }

    #[test]
    fn moments_of_particles_are_opened_and_those_of_a_ball_are_not() {
        let open = ball(InertiaForm::Prior, vec![0.0, 0.0, -4.0]).with_open_inertia().expect("an inertia");
        assert_eq!(open.law.table()[0].0.name, "log-moment-1");
        assert!(
            open.priors.iter().any(|&(place, centre, spread)| place == 6 && centre == 0.0 && spread > 0.0)
        );
        assert!(ball(InertiaForm::Isotropic, vec![0.0, 0.0, -4.0]).with_open_inertia().is_none());
        assert!(open.with_open_inertia().is_none());
    }
}
