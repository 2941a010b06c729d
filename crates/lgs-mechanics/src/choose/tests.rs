use super::{Choice, candidates, choose, choose_further, further_candidates};
use crate::bands::Band;
use crate::candidate::Candidate;
use crate::coordinates::{Coordinates, Hinge, Port, State};
use crate::edit::Edit;
use crate::fit::Track;
use crate::system::System;
use crate::terms::Term;
use crate::testing::normal;

/// Noisy samples of a law at 41 times.
fn samples(names: &[&str], parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let terms = names.iter().map(|n| Term::named(n, Port::Whole).unwrap()).collect();
    let law = Candidate::new(Coordinates::Point, terms).unwrap().law(parameters.to_vec(), 0.01).unwrap();
    let start = State { x: vec![1.0, 0.2, 0.1], v: vec![0.3, 1.5, -0.4] };
    let mut stream = lgs_core::stream(7, "choice tests", 0);
    let times: Vec<f64> = (0..41).map(|k| f64::from(k) / 40.0).collect();
    let states = System::new(&law, Edit::NONE).states(&start, &times).unwrap();
    let x = states.iter().map(|s| s.x.iter().map(|x| x + 0.001 * normal(&mut stream)).collect());
    (times, x.collect())
}

fn chosen(times: &[f64], x: &[Vec<f64>]) -> (String, Choice) {
    let list = candidates(&Coordinates::Point);
    let track = Track::new(&Coordinates::Point, times, x);
    let choice = choose(&list, &track, &track.scales(&Coordinates::Point)).unwrap();
    let names: Vec<&str> = list[choice.law().index].terms.iter().map(|t| t.kind.name()).collect();
    (names.join("+"), choice)
}

#[test]
fn the_choice_does_not_depend_on_units_or_place() {
    let (times, x) = samples(&["spring"], &[30.0, 0.1, -0.2, 0.1]);
    for (scale, shift) in [(1.0, 0.0), (0.01, 3.0), (100.0, -700.0)] {
        let moved: Vec<Vec<f64>> = x.iter().map(|x| x.iter().map(|x| scale * x + shift).collect()).collect();
        let (name, choice) = chosen(&times, &moved);
        assert_eq!(name, "spring");
        assert!(choice.chi_square_per_sample() < 2.0);
        let distance = |a: &State, b: &State| (a.x[0] - b.x[0]).abs() / scale;
        let radius = Band::new(&choice, &[0.5, 3.0], 0).unwrap().radius(0.9, &distance);
        assert!(radius[0] < 0.01 && radius[1] > radius[0] && radius[1] < 0.2, "{radius:?}");
    }
}

/// A pendulum that a motor turns and friction holds back: laws of two terms follow it to within the noise of
/// the window, with constants that are far off.
#[test]
fn a_law_of_three_terms_is_found_where_one_of_two_explains_the_window() {
    let hinge = Coordinates::Hinge(Hinge { axis: [1.0, 0.0, 0.0], pivot: [0.0; 3] });
    let terms = ["fourier", "constant-drive", "linear-drag"];
    let terms: Vec<Term> = terms.iter().map(|n| Term::named(n, Port::Whole).unwrap()).collect();
    let law = Candidate::new(hinge.clone(), terms).unwrap().law(vec![12.0, 5.0, 6.0, 0.7], 0.01).unwrap();
    let times: Vec<f64> = (0..76).map(|k| f64::from(k) / 100.0).collect();
    let start = State { x: vec![0.0], v: vec![-0.5] };
    let mut stream = lgs_core::stream(3, "choice tests", 0);
    let states = System::new(&law, Edit::NONE).states(&start, &times).unwrap();
    let x: Vec<Vec<f64>> = states.iter().map(|s| vec![s.x[0] + 0.0005 * normal(&mut stream)]).collect();
    let track = Track::new(&hinge, &times, &x);
    let (list, further, scales) = (candidates(&hinge), further_candidates(&hinge), track.scales(&hinge));
    let simple = choose(&list, &track, &scales);
    let choice = choose_further(simple, (&list, &further), &track, &scales).unwrap();
    assert_eq!(choice.law().names(), "fourier + constant-drive + linear-drag");
}
