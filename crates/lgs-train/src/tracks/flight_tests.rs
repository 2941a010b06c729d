use super::testing::{MOMENTS, RADIUS, seen, thrown};
use super::*;
use lgs_core::linear::add;

#[test]
fn a_thing_that_is_thrown_and_caught_is_followed_in_flight_and_in_hands() {
    let spheres = thrown(0.25);
    let tracks = find_flights(&seen(&spheres), [1.0; 3]);
    let [track] = &tracks[..] else { panic!("one thing flies: {tracks:?}") };
    assert!((track.radius - RADIUS).abs() < 0.2 * RADIUS, "{}", track.radius);
    assert_eq!(track.span(), (0.0, (MOMENTS - 1) as f32 / 30.0), "its colours lead through all moments");
    for moment in 0..MOMENTS {
        let off = norm(sub(track.position(moment as f32 / 30.0), spheres(moment)[0].center));
        let allowed = if (7..16).contains(&moment) { 0.25 } else { 0.7 };
        assert!(off < allowed * RADIUS, "moment {moment}: {off}");
    }
}

#[test]
fn what_moves_little_for_its_size_and_what_is_never_apart_is_not_led() {
    assert_eq!(find_flights(&seen(thrown(0.04)), [1.0; 3]), []);
    let held = |moment: usize| {
        let mut spheres = thrown(0.25)(moment);
        let center = spheres[1].center;
        spheres[0].center = add(center, [0.5, 0.0, 0.1]);
        spheres
    };
    assert_eq!(find_flights(&seen(held), [1.0; 3]), []);
    assert_eq!(find_flights(&[], [1.0; 3]), []);
}
