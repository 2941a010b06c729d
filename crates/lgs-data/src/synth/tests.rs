use super::*;
use crate::dataset::{Dataset, LoadOptions};
use glam::DVec3;
use serde_json::Value;
use shape::{Ray, Shape};
use std::fs;
use std::path::PathBuf;

/// Options of the smallest dataset that has everything.
pub(super) fn small() -> SynthOptions {
    SynthOptions { size: 16, views: 2, train_fps: 4, ..SynthOptions::default() }
}

/// A dataset of a scene in a folder that goes with the first value.
pub(super) fn make(scene: &str, options: &SynthOptions) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("set");
    generate(scene, options, &out, &|_, _| {}).unwrap();
    (dir, out)
}

#[test]
fn every_moving_body_stays_in_view_of_most_cameras() {
    for (info, seed) in scenes().into_iter().flat_map(|info| (0..4).map(move |seed| (info, seed))) {
        let scene = find(info.name, seed).unwrap();
        let views = scene.rig.views(12, 160, seed);
        for body in &scene.stage.bodies {
            let samples: Vec<f64> = (-75..=225).step_by(3).map(|i| f64::from(i) / 100.0).collect();
            let (mut seen, mut all) = (0, 0);
            for &t in &samples {
                let pose = body.motion.pose(t);
                let center = pose.linear * body.center + pose.position;
                let now = views.iter().filter(|view| view.sees(center)).count();
                assert!(
                    10 * now >= 8 * views.len(),
                    "{} {}: {now} of {} at {t}",
                    info.name,
                    body.name,
                    views.len()
                );
                (seen, all) = (seen + now, all + views.len());
            }
            assert!(20 * seen >= 19 * all, "{} {}: {seen} of {all}", info.name, body.name);
        }
    }
}

#[test]
fn moving_bodies_of_the_room_cover_a_good_part_of_most_images() {
    let scene = find("room", 0).unwrap();
    let views = scene.rig.views(12, 40, 0);
    for (number, body) in scene.stage.bodies.iter().enumerate() {
        let alone = body::Stage { bodies: vec![body.clone()], fixed: Vec::new() };
        let (mut good, mut all) = (0, 0);
        for view in &views {
            let backdrop = trace::Backdrop::new(&alone, view);
            for t in [0.0, 0.25, 0.5, 0.75, 0.9] {
                let image = trace::image(&alone, view, &backdrop, t);
                let covered = image.iter().skip(3).step_by(4).filter(|&&alpha| alpha > 127).count();
                (good, all) = (good + usize::from(20 * covered >= 40 * 40), all + 1);
            }
        }
        assert!(2 * good > all, "{} ({number}) covers 5 % of {good} of {all} images", body.name);
    }
}

#[test]
fn moving_bodies_never_touch_one_another_or_the_furniture() {
    (0..4).for_each(moving_bodies_are_free);
}

fn moving_bodies_are_free(seed: u64) {
    let scene = find("room", seed).unwrap();
    let times: Vec<f64> = (-75..=225).step_by(5).map(|i| f64::from(i) / 100.0).collect();
    let truth = truth::follow(&scene.stage, &times, 400, 0, Value::Null);
    for (row, &t) in truth.points.iter().zip(&times) {
        for (number, body) in scene.stage.bodies.iter().enumerate() {
            let pose = body.motion.pose(t);
            for (p, &object) in row.iter().zip(&truth.object) {
                let local = pose.inverse * (DVec3::from_array(p.map(f64::from)) - pose.position);
                let inside = object != number as i32 && body.parts.iter().any(|part| part.contains(local));
                assert!(!inside, "{p:?} of object {object} is inside {} at {t}", body.name);
            }
        }
    }
}

#[test]
fn moving_bodies_move_a_lot_between_observation_and_forecast() {
    // Mean displacement from the last observed time to 1, over the object's size.
    for info in scenes().into_iter().take(7) {
        let truth = ground_truth(info.name, &[0.75, 1.0], 300, 0).unwrap();
        for object in truth.objects() {
            let rows = truth.trajectories(object);
            let n = rows[0].len() as f32;
            let moved = rows[0]
                .iter()
                .zip(&rows[1])
                .map(|(&a, &b)| glam::Vec3::from(a).distance(b.into()))
                .sum::<f32>()
                / n;
            let mean = rows[0].iter().map(|&p| glam::Vec3::from(p)).sum::<glam::Vec3>() / n;
            let mut radii: Vec<f32> = rows[0].iter().map(|&p| glam::Vec3::from(p).distance(mean)).collect();
            radii.sort_by(f32::total_cmp);
            let size = 2.0 * radii[radii.len() / 2]; // the median, or a thin rod would count for a body
            let least = if info.name == "room" { 0.25 } else { 0.1 };
            assert!(moved > least * size, "{} {object}: moved {moved}, size {size}", info.name);
        }
    }
}

#[test]
fn the_sun_leaves_silhouettes_and_casts_a_shadow_that_follows_the_body() {
    let scene = find("bounce", 1).unwrap();
    let view = scene.rig.views(1, 64, 0)[0];
    let backdrop = trace::Backdrop::new(&scene.stage, &view);
    let gray = |image: &[u8], i: usize| image[4 * i..4 * i + 3].iter().map(|&v| i32::from(v)).sum::<i32>();
    let mut darkened = Vec::new();
    for t in [0.0, 0.3] {
        let riding = trace::image(&scene.stage, &view, &backdrop, t);
        let sunlit = trace::sunlit_image(&scene.stage, &view, t);
        let alphas = |image: &[u8]| image.iter().skip(3).step_by(4).copied().collect::<Vec<u8>>();
        let differing = alphas(&riding).iter().zip(&alphas(&sunlit)).filter(|(a, b)| a != b).count();
        assert!(differing < 40, "pixels of other opacity: {differing}");
        let is_dark = |&i: &usize| gray(&sunlit, i) * 5 < gray(&riding, i) * 3;
        darkened.push((0..64 * 64).filter(is_dark).collect::<Vec<usize>>());
    }
    assert!(darkened.iter().all(|pixels| pixels.len() > 20), "{darkened:?}");
    assert_ne!(darkened[0], darkened[1]);
}

#[test]
fn the_silhouette_of_a_sphere_is_its_projection() {
    let scene = find("falling-ball", 0).unwrap();
    let view = scene.rig.views(1, 200, 0)[0];
    let backdrop = trace::Backdrop::new(&scene.stage, &view);
    let t = 0.5;
    let image = trace::image(&scene.stage, &view, &backdrop, t);
    let center = scene.stage.bodies[0].motion.pose(t).position;
    let to_center = center - view.eye;
    let limit = (0.5 / to_center.length()).asin();
    let mut covered = 0.0;
    for y in 0..200 {
        for x in 0..200 {
            let alpha = f64::from(image[4 * (200 * y + x) + 3]) / 255.0;
            covered += alpha;
            let angle = view.ray(x as f64 + 0.5, y as f64 + 0.5).direction.angle_between(to_center);
            let margin = 1.0 / view.focal;
            assert!(alpha == 1.0 || angle > limit - margin, "a hole at {x}, {y}");
            assert!(alpha == 0.0 || angle < limit + margin, "an opaque pixel outside at {x}, {y}");
        }
    }
    // The cone around the sphere, of half-angle `limit`, cuts the image plane in an ellipse of this area.
    let (focal, axis_angle) = (view.focal, view.ray(100.0, 100.0).direction.angle_between(to_center));
    let across = (limit.cos().powi(2) - axis_angle.sin().powi(2)).sqrt();
    let area = std::f64::consts::PI * (focal * limit.sin()).powi(2) * limit.cos() / across.powi(3);
    assert!((covered / area - 1.0).abs() < 0.01, "{covered} {area}");
}

#[test]
fn the_written_camera_and_the_tracer_agree() {
    let (_dir, out) = make("falling-ball", &SynthOptions { size: 64, ..small() });
    let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
    for frame in ["train", "val", "test", "long", "past"].iter().flat_map(|split| dataset.split(split)) {
        let fall = 1.0 - 0.45 * frame.time * frame.time;
        let (expected, _) = frame.camera.pixel_from_world([0.0, 0.0, fall]);
        let alpha = frame.alpha();
        if alpha
            .iter()
            .enumerate()
            .any(|(i, &a)| a > 0.0 && (i % 64 == 0 || i % 64 == 63 || i / 64 == 0 || i / 64 == 63))
        {
            continue; // partly outside: the mean says nothing
        }
        let total: f32 = alpha.iter().sum();
        let mean = |of: &dyn Fn(usize) -> usize| {
            alpha.iter().enumerate().map(|(i, &a)| a * (of(i) as f32 + 0.5)).sum::<f32>() / total
        };
        let found = [mean(&|i| i % 64), mean(&|i| i / 64)];
        assert!(
            (found[0] - expected[0]).abs() < 0.3 && (found[1] - expected[1]).abs() < 0.3,
            "{}: {found:?} {expected:?}",
            frame.name
        );
    }
}

#[test]
fn a_room_is_opaque_and_an_object_is_not() {
    for (scene, opaque) in [("room", true), ("spring", false)] {
        let (_dir, out) = make(scene, &small());
        let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
        assert!(dataset.splits.values().flatten().all(|frame| frame.has_alpha() != opaque), "{scene}");
    }
}

#[test]
fn splits_have_their_times_and_views() {
    let (_dir, out) = make("fan", &SynthOptions { train_fps: 60, ..small() });
    let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
    let span = |split: &str| {
        let times: Vec<f32> = dataset.split(split).iter().map(|f| f.time).collect();
        (times.len(), dataset.cameras(split).len(), times[0], times[times.len() - 1])
    };
    assert_eq!(span("train"), (92, 2, 0.0, 0.75));
    assert_eq!(span("val"), (48, 3, 0.0, 0.75));
    assert_eq!(span("test"), (70, 5, 46.0 / 60.0, 59.0 / 60.0));
    assert_eq!(span("long"), (64, 4, 1.0, 2.25));
    assert_eq!(span("past"), (64, 4, -0.75, -0.75 / 16.0));
    let training: Vec<usize> = dataset.cameras("train").iter().map(|f| f.camera_id).collect();
    assert!(dataset.cameras("val").iter().all(|f| !training.contains(&f.camera_id)), "val is held out");
}

#[test]
fn ground_truth_round_trips_and_follows_the_law() {
    let (_dir, out) = make("room", &small());
    let truth = GroundTruth::load(&out).unwrap().unwrap();
    assert_eq!((truth.times.len(), truth.points.len(), truth.objects()), (301, 301, vec![0, 1, 2]));
    assert_eq!((truth.times[0], truth.times[300]), (-0.75, 2.25));
    let still = truth.trajectories(-1);
    assert!(!still[0].is_empty() && still.iter().all(|row| row == &still[0]));
    assert_eq!(truth.law["objects"][1]["law"], "uniform rotation");
    assert_eq!(truth.law["objects"][1]["omega"], 2.6);
    let again: Vec<f64> = (-75..=225).map(|i| f64::from(i) / 100.0).collect();
    assert_eq!(
        ground_truth("room", &again, 500, 0).unwrap(),
        GroundTruth { edited: Default::default(), ..truth.clone() }
    );
    assert_eq!(GroundTruth::load(out.parent().unwrap()).unwrap(), None);
}

#[test]
fn bad_ground_truth_is_an_error_with_its_path() {
    let (_dir, out) = make("fan", &small());
    let path = out.join("ground_truth.safetensors");
    let bytes = fs::read(&path).unwrap();
    for cut in [0, 7, 100, bytes.len() - 1] {
        fs::write(&path, &bytes[..cut]).unwrap();
        assert!(GroundTruth::load(&out).unwrap_err().to_string().ends_with("ground_truth.safetensors"));
    }
    fs::write(out.join("scene.json"), "{").unwrap();
    assert!(GroundTruth::load(&out).unwrap_err().to_string().ends_with("scene.json"));
}

#[test]
fn the_same_options_give_the_same_bytes_and_another_seed_others() {
    let (_a, one) = make("spring", &small());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (_b, two) = pool.install(|| make("spring", &small()));
    let (_c, other) = make("spring", &SynthOptions { seed: 1, ..small() });
    for file in ["transforms_train.json", "train/r_0003.png", "ground_truth.safetensors", "scene.json"] {
        assert_eq!(fs::read(one.join(file)).unwrap(), fs::read(two.join(file)).unwrap(), "{file}");
        assert_ne!(fs::read(one.join(file)).unwrap(), fs::read(other.join(file)).unwrap(), "{file}");
    }
}

#[test]
fn an_occupied_folder_is_refused_and_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mine"), "1").unwrap();
    assert!(matches!(generate("fan", &small(), dir.path(), &|_, _| {}), Err(SynthError::Occupied(_))));
    assert!(matches!(
        generate("fan", &small(), &dir.path().join("mine"), &|_, _| {}),
        Err(SynthError::Occupied(_))
    ));
    let under_a_file =
        generate("fan", &small(), &dir.path().join("mine/set"), &|_, _| {}).unwrap_err().to_string();
    assert!(
        under_a_file.starts_with("can't create folder") && under_a_file.ends_with("mine"),
        "{under_a_file}"
    );
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    let empty = dir.path().join("empty");
    fs::create_dir(&empty).unwrap();
    generate("fan", &small(), &empty, &|_, _| {}).unwrap();
    assert!(empty.join("transforms_past.json").exists());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "no temporary folder is left");
}

#[test]
fn unknown_scenes_and_options_out_of_range_are_named() {
    let out = Path::new("never-made");
    let message = |options: &SynthOptions| generate("fan", options, out, &|_, _| {}).unwrap_err().to_string();
    assert!(message(&SynthOptions { size: 0, ..small() }).contains("`size`"));
    assert!(message(&SynthOptions { views: 0, ..small() }).contains("`views`"));
    assert!(message(&SynthOptions { train_fps: 7, ..small() }).contains("`train_fps`"));
    let error = generate("fun", &small(), out, &|_, _| {}).unwrap_err().to_string();
    assert!(error.contains("`fun`") && error.contains("falling-ball"), "{error}");
    assert!(!out.exists());
}

#[test]
fn parts_occlude_by_distance() {
    let texture = texture::Texture::new([0xff0000; 3], 1.0);
    let ball = |x| body::Part::new(Shape::Ellipsoid(DVec3::splat(0.5)), DVec3::new(x, 0.0, 0.0), texture);
    let stage = body::Stage { bodies: Vec::new(), fixed: vec![ball(3.0), ball(0.0)] };
    let hit =
        body::meet_fixed(&stage, &Ray { origin: DVec3::NEG_X * 2.0, direction: DVec3::X }).unwrap().hit();
    assert_eq!((hit.distance, hit.part.1), (1.5, 1));
}
