//! Trust in edited forecasts.

use super::{DrawnLaws, Known, PositionBand, PosteriorLaws, StartedLaw, Verdict};
use crate::coordinates::{Bodies, Coordinates, Hinge, Port, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::terms::Term;

/// A body that a spring of some stiffness holds at an angle of 1 rad against a torque.
fn held(stiffness: f64) -> StartedLaw {
    let hinge = Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] };
    let term = |name| Term::named(name, Port::Whole).expect("a term");
    let terms = vec![term("spring"), term("constant-drive")];
    let law = Law::new(Coordinates::Hinge(hinge), terms, vec![stiffness, 0.0, stiffness], 0.01);
    StartedLaw { law: law.expect("a law"), start: State { x: vec![1.0], v: vec![0.0] } }
}

fn known(spread: f64) -> Known {
    let drawn = [-1.0, 1.0].map(|side| held(4.0 + side * spread)).to_vec();
    let laws = vec![DrawnLaws { middle: held(4.0), order: vec![0], part: 1.0, drawn }];
    let times: Vec<f64> = (-8..=24).map(|i| 0.125 * f64::from(i)).collect();
    let radius = vec![Some(0.001); times.len()];
    Known {
        verdict: Verdict::Explained,
        trusted: [-1.0, 3.0],
        band: PositionBand { times, radius },
        posterior: Some(PosteriorLaws { laws, window: 1.0, path: 1.0, radius: 0.001 }),
        ..Known::default()
    }
}

fn until(known: &Known, edit: Edit) -> f64 {
    let StartedLaw { law, start } = held(4.0);
    let points = (&Bodies::default(), &[[1.0, 0.0, 0.0]][..]);
    known.trusted_under(edit, (&law, &start), points).expect("draws")[1]
}

#[test]
fn laws_that_agree_on_a_motion_may_part_where_it_is_edited() {
    let released = Edit { force: 0.0, ..Edit::NONE };
    assert_eq!(until(&known(0.4), Edit::NONE), 3.0, "it stays where it is by any of the laws");
    let [near, far] = [0.1, 0.4].map(|spread| until(&known(spread), released));
    assert!(0.0 < far && far < near && near < 3.0, "{far} {near}");
    let mut wide = known(0.1);
    wide.band.radius.fill(Some(0.01));
    assert!(until(&wide, released) < near, "a band that images widen is as wide under an edit");
}

#[test]
fn drawn_laws_have_to_move_the_same_bodies() {
    let mut posterior = known(0.1).posterior.expect("laws");
    assert!(posterior.check(1).is_ok() && posterior.check(2).is_err());
    posterior.laws[0].drawn[0].start.v.clear();
    assert!(posterior.check(1).is_err());
}
