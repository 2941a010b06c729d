use super::*;
use lgs_core::Exposure;
use lgs_core::linear::add;

const RADIUS: f32 = 0.15;
const MOMENTS: usize = 24;
const SIZE: u32 = 96;

/// A sphere of one colour.
struct Sphere {
    center: [f32; 3],
    radius: f32,
    color: [u8; 3],
}

/// Two large things that sway, and a small one of another colour that the first holds until the sixth moment
/// and the second catches at the sixteenth.
fn thrown(step: f32) -> impl Fn(usize) -> Vec<Sphere> {
    move |moment| {
        let sway = 0.08 * (moment as f32 * 0.7).sin();
        let flown = (moment as f32).clamp(6.0, 16.0) - 6.0;
        let height = 0.3 + 0.05 * flown * (10.0 - flown) * step;
        let ball = [-5.0 * step + step * flown, 0.0, height + if flown > 0.0 && flown < 10.0 { 0.0 } else { sway }];
        let person = |side: f32| Sphere {
            center: [side * (5.0 * step + 0.45), sway, 0.1 + sway],
            radius: 0.5,
            color: [60, 70, 80],
        };
        vec![Sphere { center: ball, radius: RADIUS, color: [200, 50, 30] }, person(-1.0), person(1.0)]
    }
}

/// What twelve cameras see of spheres in front of white at every moment, together.
fn seen(spheres: impl Fn(usize) -> Vec<Sphere>) -> Vec<Frame> {
    let frame = |index: usize| {
        let (moment, camera_id) = (index / 12, index % 12);
        let angle = std::f32::consts::TAU * camera_id as f32 / 12.0;
        let height = if camera_id.is_multiple_of(2) { 1.0 } else { 2.5 };
        let camera = Camera::look_at([4.0 * angle.cos(), 4.0 * angle.sin(), height], [0.0; 3], 1.0, SIZE, SIZE);
        let spheres = spheres(moment);
        let pixel = |p: usize| {
            let at = [(p as u32 % SIZE) as f32 + 0.5, (p as u32 / SIZE) as f32 + 0.5];
            let ray = camera.ray_direction_in_world(at);
            let depth = |sphere: &Sphere| {
                let from_eye = sub(sphere.center, camera.center_in_world());
                let along = dot(from_eye, ray);
                (norm(sub(from_eye, scale(ray, along))) < sphere.radius).then_some(along)
            };
            let hits = spheres.iter().filter_map(|sphere| Some((depth(sphere)?, sphere.color)));
            let [r, g, b] = hits.min_by(|a, b| a.0.total_cmp(&b.0)).map_or([250; 3], |hit| hit.1);
            [r, g, b, 255]
        };
        let rgba: Vec<u8> = (0..camera.pixels()).flat_map(pixel).collect();
        let (name, exposure) = (format!("{index}"), Exposure::IDENTITY);
        Frame { name, camera_id, camera, time: moment as f32 / 30.0, exposure, pixels: rgba.into() }
    };
    (0..12 * MOMENTS).map(frame).collect()
}

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
