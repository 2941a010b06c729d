use super::*;

#[test]
fn what_goes_on_after_a_recording_begins_where_it_ends() {
    let still = [1.0, 0.0, 0.0, 0.0];
    let rows = |x: f32| vec![[x, 0.0, 0.0]];
    let recording =
        Recording::new(vec![0.0, 1.0], vec![rows(0.0), rows(1.0)], vec![vec![still]; 2]).expect("whole");
    let state = |x: f32| State { q: rows(x), v: rows(2.0), rotation: vec![still] };
    let mut later = [state(1.4), state(1.5), state(1.8)];
    recording.hand_over([&state(1.0), &state(1.4)], &mut later, &[1.0, 1.0 + 0.5 * HANDOVER, 1.3]);
    let places: Vec<f32> = later.iter().map(|state| state.q[0][0]).collect();
    assert!((places[0] - 1.0).abs() < 1e-6 && (places[1] - 1.3).abs() < 1e-6, "{places:?}");
    assert_eq!(places[2], 1.8, "the motion by itself");
}

#[test]
fn a_recording_is_played_between_its_times_alone() {
    let turned = [0.0, 0.0, 0.0, 1.0];
    let still = [1.0, 0.0, 0.0, 0.0];
    let recording = Recording::new(
        vec![0.0, 0.5],
        vec![vec![[0.0; 3]], vec![[1.0, 0.0, 0.0]]],
        vec![vec![still], vec![turned]],
    )
    .expect("a recording");
    let middle = recording.at(0.25).expect("a state");
    assert_eq!((middle.q[0], middle.v[0]), ([0.5, 0.0, 0.0], [2.0, 0.0, 0.0]));
    assert!((middle.rotation[0][0] - middle.rotation[0][3]).abs() < 1e-6, "half of half a turn");
    assert!(recording.at(0.6).is_none() && recording.at(-0.1).is_none());
    let moved = recording.played(&[[0.0, 0.2, 0.0]], &[0.5, 0.6]);
    assert_eq!(moved.len(), 1, "as many as there are");
    assert!((moved[0].q[0][1] + 0.2).abs() < 1e-6, "a particle apart turns with the others");
    assert!(Recording::new(vec![0.0], vec![vec![[0.0; 3]]], vec![vec![still]]).is_none());
}
