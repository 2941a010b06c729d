use super::{Settings, Track, first_values, shoot};
use crate::candidate::Candidate;
use crate::coordinates::{Coordinates, Port, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::system::System;
use crate::terms::Term;
use crate::testing::normal;

/// A track of a law at 41 times over one unit, with white noise.
fn track(law: &Law, start: &State, noise: f64) -> Track {
    let mut stream = lgs_core::stream(5, "fit tests", 0);
    let times: Vec<f64> = (0..41).map(|k| f64::from(k) / 40.0).collect();
    let states = System::new(law, Edit::NONE).states(start, &times).unwrap();
    let noisy = |s: &State| s.x.iter().map(|x| x + noise * normal(&mut stream)).collect();
    let x: Vec<Vec<f64>> = states.iter().map(noisy).collect();
    Track::new(&law.coordinates, &times, &x)
}

/// Fits the true terms and returns parameters with their deviations.
fn refit(kinds: &[&str], parameters: &[f64], start: &State) -> (Vec<f64>, Vec<f64>) {
    let terms: Vec<Term> = kinds.iter().map(|k| Term::named(k, Port::Whole).unwrap()).collect();
    let candidate = Candidate::new(Coordinates::Point, terms).unwrap();
    let law = candidate.law(parameters.to_vec(), 0.01).unwrap();
    let track = track(&law, start, 0.001);
    let scales = track.scales(&candidate.coordinates);
    let fit = first_values(&candidate, &track, &scales, 3)
        .iter()
        .filter_map(|p| shoot(&candidate, &track, (&scales, &track.smooth[0].0), p, &Settings::default()))
        .min_by(|a, b| a.loss.total_cmp(&b.loss))
        .unwrap();
    assert!(fit.loss < 1.5 * track.independent_samples(), "{} of {}", fit.loss, track.independent_samples());
    (fit.law.parameters.clone(), fit.law.deviations)
}

#[test]
fn parameters_are_found_within_their_deviations() {
    let start = State { x: vec![1.0, 0.2, 0.1], v: vec![0.3, 1.5, -0.4] };
    let cases: [(&[&str], &[f64]); 4] = [
        (&["uniform-field", "linear-drag"], &[0.2, -0.4, -3.0, 0.8]),
        (&["spring"], &[30.0, 0.1, -0.2, 0.1]),
        (&["central-inverse-square"], &[2.0, 0.0, 0.1, 0.0]),
        (&["gyroscopic"], &[2.0, -1.0, 6.0]),
    ];
    for (kinds, truth) in cases {
        let (found, deviations) = refit(kinds, truth, &start);
        for ((found, truth), deviation) in found.iter().zip(truth).zip(&deviations) {
            assert!((found - truth).abs() < 4.0 * deviation, "{kinds:?}: {found} ± {deviation} for {truth}");
            assert!(*deviation < 0.2 * (1.0 + truth.abs()), "{kinds:?}: {found} ± {deviation}");
        }
    }
}
