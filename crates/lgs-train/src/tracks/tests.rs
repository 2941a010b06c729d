use super::*;
use glam::{Quat, Vec3};
use lgs_core::Exposure;
use lgs_core::linear::add;

const RADIUS: f32 = 0.3;

#[derive(Clone, Copy, PartialEq)]
enum Cameras {
    Still,
    Moving,
}

/// A ball on an arc and one that falls, seen by eight cameras in turn, one image per moment: dark discs on
/// white.
fn scene(cameras: Cameras) -> Vec<Frame> {
    let size = 100;
    let frame = |i: usize| {
        let (camera_id, time) = (i * 5 % 8, i as f32 / 120.0);
        let drift = if cameras == Cameras::Moving { 0.2 * time } else { 0.0 };
        let angle = std::f32::consts::TAU * camera_id as f32 / 8.0 + drift;
        let camera = Camera::look_at([4.0 * angle.cos(), 4.0 * angle.sin(), 1.5], [0.0; 3], 1.0, size, size);
        let id = if cameras == Cameras::Moving { i } else { camera_id };
        let pixel = |p: usize| {
            let ray = camera
                .ray_direction_in_world([(p as u32 % size) as f32 + 0.5, (p as u32 / size) as f32 + 0.5]);
            let hit = balls(time).iter().any(|&center| {
                let from_eye = sub(center, camera.center_in_world());
                let depth = dot(from_eye, ray);
                norm(sub(from_eye, scale(ray, depth))) < RADIUS
            });
            if hit { [40, 40, 40, 255] } else { [255; 4] }
        };
        let rgba: Vec<u8> = (0..(size * size) as usize).flat_map(pixel).collect();
        let (name, exposure) = (format!("{i}"), Exposure::IDENTITY);
        Frame { name, camera_id: id, camera, time, exposure, pixels: rgba.into() }
    };
    (0..90).map(frame).collect()
}

fn balls(time: f32) -> [[f32; 3]; 2] {
    let angle = 4.0 * time;
    [[angle.cos(), angle.sin(), 0.5], [0.9 - 2.4 * time, -0.2, -0.6]]
}

const BOUNDS: SceneBox = SceneBox { center: [0.0; 3], half_side: 2.0 };

#[test]
fn two_balls_are_followed_from_single_images_of_moments() {
    let tracks = find_tracks(&scene(Cameras::Still), [1.0; 3], BOUNDS);
    assert_eq!(tracks.len(), 2, "{tracks:?}");
    for which in 0..2 {
        let off = |track: &Track, time: f32| norm(sub(track.position(time), balls(time)[which]));
        let worst = |track: &Track| (0..8).map(|i| off(track, 0.1 * i as f32)).fold(0.0, f32::max);
        let track = tracks.iter().min_by(|a, b| worst(a).total_cmp(&worst(b))).expect("tracks");
        assert!(worst(track) < 0.2 * RADIUS, "ball {which}: {}", worst(track));
        assert!((track.radius - RADIUS).abs() < 0.15 * RADIUS, "{}", track.radius);
    }
}

#[test]
fn moving_cameras_and_empty_images_give_no_paths() {
    assert_eq!(find_tracks(&scene(Cameras::Moving), [1.0; 3], BOUNDS), []);
    let mut still = scene(Cameras::Still);
    still.iter_mut().for_each(|frame| frame.pixels = vec![255; 4 * frame.camera.pixels()].into());
    assert_eq!(find_tracks(&still, [1.0; 3], BOUNDS), []);
    assert_eq!(find_tracks(&[], [1.0; 3], BOUNDS), []);
}

#[test]
fn a_track_explains_what_is_seen_of_its_ball() {
    let frames = scene(Cameras::Still);
    let tracks = find_tracks(&frames, [1.0; 3], BOUNDS);
    let frame = &frames[20];
    let toward = |point: [f32; 3]| {
        let from_eye = sub(point, frame.camera.center_in_world());
        scale(from_eye, 1.0 / norm(from_eye))
    };
    let explained =
        |point| tracks.iter().any(|track| track.explains(&frame.camera, frame.time, toward(point)));
    assert!(explained(balls(frame.time)[0]));
    assert!(!explained(add(balls(frame.time)[0], [0.0, 0.0, 1.0])));
}

/// A ball with a texture of patches that moves on an arc and turns, seen as in [`scene`].
fn textured(spin: [f32; 3]) -> Vec<Frame> {
    const LARGE: f32 = 0.6;
    let mut frames = scene(Cameras::Still);
    for frame in &mut frames {
        let (camera, time) = (&frame.camera, frame.time);
        let center = [1.2 * (3.0 * time).cos(), 1.2 * (3.0 * time).sin(), 0.0];
        let from_body = Quat::from_scaled_axis(Vec3::from(spin) * time);
        let pixel = |p: usize| {
            let ray = camera.ray_direction_in_world([(p % 100) as f32 + 0.5, (p / 100) as f32 + 0.5]);
            let from_eye = sub(center, camera.center_in_world());
            let depth = dot(from_eye, ray);
            let inside = LARGE * LARGE - norm(sub(from_eye, scale(ray, depth))).powi(2);
            if inside < 0.0 {
                return [255; 4];
            }
            let normal = sub(scale(ray, depth - inside.sqrt()), from_eye);
            let wave = from_body.inverse() * Vec3::from(normal) * 12.0;
            let bright = (wave.x + 1.0).sin() + (wave.y * 1.3).sin() + (wave.z * 0.8 + 0.5).sin();
            let grey = (90.0 + 25.0 * bright) as u8;
            [grey, grey, grey, 255]
        };
        let rgba: Vec<u8> = (0..camera.pixels()).flat_map(pixel).collect();
        frame.pixels = rgba.into();
    }
    frames
}

#[test]
fn the_texture_of_a_ball_tells_how_it_turns() {
    let spin = [3.0, -8.0, 5.0];
    let tracks = find_tracks(&textured(spin), [1.0; 3], BOUNDS);
    let [Track { spin: Some(found), .. }] = tracks[..] else { panic!("one ball with a texture: {tracks:?}") };
    // Over the whole time, three quarters, that is less than nine degrees: three pixels of the ball.
    assert!(norm(sub(found, spin)) < 0.2, "{found:?}");
    let plain = find_tracks(&scene(Cameras::Still), [1.0; 3], BOUNDS);
    assert!(plain.len() == 2 && plain.iter().all(|track| track.spin.is_none()), "{plain:?}");
}
