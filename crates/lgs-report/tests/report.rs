//! Reports of scenes made by hand: what is written, that it decodes, and what is left out.

use std::collections::BTreeMap;
use std::path::Path;

use lgs_core::{Camera, Exposure, GaussianCloud};
use lgs_data::dataset::{Dataset, Frame};
use lgs_data::frames::FrameSequence;
use lgs_data::ply::read_ply;
use lgs_data::synth::GroundTruth;
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Supports, VelocityPolicy};
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate};
use lgs_model::source::{ImportedFrames, SourceModel};
use lgs_model::{Dynamics, LagrangianScene, MotionConfig, ObjectModel, ParticleDynamics};
use lgs_report::{Curve, FIGURE_NAMES, RunSubject, suite_html, write_run_report};

const GRAVITY: f32 = 2.0;
const SIZE: u32 = 24;

/// Blocks of 27 Gaussians in free fall side by side, over a still floor.
fn scene(blocks: usize) -> LagrangianScene {
    let block = |b: usize| {
        (0..27)
            .map(move |i| [i % 3, i / 3 % 3, i / 9].map(|c| 0.1 * c as f32))
            .map(move |[x, y, z]| [x + b as f32, y, z])
    };
    let means: Vec<[f32; 3]> = (0..blocks).flat_map(block).collect();
    let object = |b: usize| ObjectModel {
        members: 27 * b..27 * (b + 1),
        recording: None,
        dynamics: Dynamics::Particles(ParticleDynamics {
            system: quadratic([0.0, 0.0, GRAVITY], [0.0; 6]),
            supports: Some(Supports::nearest(&means[27 * b..27 * (b + 1)], 8).into()),
            velocity_policy: VelocityPolicy::Keep,
        }),
    };
    LagrangianScene {
        objects: (0..blocks).map(object).collect(),
        velocities: vec![[0.0; 3]; means.len()],
        dynamic_gaussians: GaussianCloud::isotropic(means, 0.05, [0.9, 0.3, 0.1], 0.9),
        ..LagrangianScene::still(
            GaussianCloud::isotropic(vec![[0.0, 0.0, -1.0]; 3], 0.1, [0.2, 0.5, 0.2], 0.9),
            MotionConfig { dt: 0.05, time_window: 0.75 },
            [1.0; 3],
        )
    }
}

/// A source model for which nothing moves.
fn still(gaussians: &GaussianCloud) -> ImportedFrames {
    ImportedFrames::new(FrameSequence {
        times: vec![-10.0, 10.0],
        positions: vec![gaussians.means.clone(); 2],
        rotations: vec![gaussians.rotations.clone()],
        gaussians: gaussians.clone(),
    })
}

fn truth(scene: &LagrangianScene) -> GroundTruth {
    let times: Vec<f32> = (-15..=45).map(|i| i as f32 * 0.05).collect();
    let fallen = |&[x, y, z]: &[f32; 3], t: f32| [x, y, z - 0.5 * GRAVITY * t * t];
    let points =
        times.iter().map(|&t| scene.dynamic_gaussians.means.iter().map(|p| fallen(p, t)).collect()).collect();
    let object = (0..scene.dynamic_gaussians.len()).map(|row| (row / 27) as i32).collect();
    let rest = [0.0; 3];
    let law = serde_json::json!({"law": "uniform gravity", "g": GRAVITY, "spin": rest, "velocity": rest});
    GroundTruth {
        times,
        points,
        object,
        law: serde_json::json!({"objects": vec![law; scene.objects.len()]}),
        ..GroundTruth::default()
    }
}

fn dataset() -> Dataset {
    let camera = Camera::look_at([0.5, -5.0, 0.5], [0.5, 0.0, -0.5], 0.9, SIZE, SIZE);
    let frame = |split: &str, time: f32| Frame {
        name: format!("{split}/{time}"),
        camera_id: 0,
        camera,
        time,
        exposure: Exposure::IDENTITY,
        pixels: vec![200; 4 * (SIZE * SIZE) as usize].into(),
    };
    let split = |name: &str, times: &[f32]| {
        (name.to_owned(), times.iter().map(|&t| frame(name, t)).collect::<Vec<_>>())
    };
    let splits = [
        split("train", &[0.0, 0.5, 0.75]),
        split("test", &[0.8, 0.9]),
        split("long", &[1.5, 2.25]),
        split("past", &[-0.5, -0.25]),
    ];
    Dataset { root: "data".into(), splits: BTreeMap::from(splits), ..Dataset::none([1.0; 3]) }
}

/// A run beside its scene: source model, true images and true motion.
#[derive(Clone, Copy)]
struct Known<'a> {
    source: Option<&'a dyn SourceModel>,
    dataset: Option<&'a Dataset>,
    truth: Option<&'a GroundTruth>,
}

/// Evaluates and reports; the names of the figures.
fn report(folder: &Path, scene: &LagrangianScene, known: Known<'_>) -> Vec<String> {
    let Known { source, dataset, truth } = known;
    let subject = Subject { scene, source, dataset, truth, laws: &[] };
    let metrics = evaluate(&subject, &EvalOptions::default(), &|_, _| {});
    std::fs::write(folder.join("metrics.json"), serde_json::to_vec(&metrics).expect("JSON"))
        .expect("metrics");
    let training = [Curve {
        stage: "source".into(),
        points: (1..40).map(|i| (f64::from(i), 20.0 + f64::from(i % 7))).collect(),
    }];
    let subject = RunSubject {
        title: "a <run>",
        scene,
        source: known.source,
        dataset: known.dataset,
        truth: known.truth,
        cameras: &[],
        metrics: &metrics,
        training: &training,
        config: "seed = 1",
    };
    write_run_report(folder, &subject).expect("a report").into_iter().map(|f| f.name).collect()
}

fn all_bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("figures");
    entries
        .map(|e| e.expect("entry").path())
        .map(|p| (p.display().to_string(), std::fs::read(&p).expect("file")))
        .map(|(name, bytes)| (name.rsplit('/').next().expect("name").to_owned(), bytes))
        .collect()
}

/// A figure is there in both formats, shows something, and stands on the page.
fn is_whole(folder: &Path, name: &str, page: &str) {
    let file = |extension: &str| folder.join("figures").join(format!("{name}.{extension}"));
    let png = image::open(file("png")).expect("a PNG").to_rgb8();
    let first = png.get_pixel(0, 0);
    assert!(png.pixels().any(|p| p != first), "{name} shows something");
    let svg = std::fs::read_to_string(file("svg")).expect("an SVG");
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{name}");
    assert!(page.contains(&format!("id=\"{name}\"")) && page.contains(&svg), "{name} is on the page");
}

#[test]
fn a_run_with_everything_has_every_figure_in_both_formats_and_on_the_page() {
    let dir = tempfile::tempdir().expect("folder");
    let (scene, dataset) = (scene(2), dataset());
    let (truth, source) = (truth(&scene), still(&scene.dynamic_gaussians));
    let names = report(
        dir.path(),
        &scene,
        Known { source: Some(&source), dataset: Some(&dataset), truth: Some(&truth) },
    );
    assert_eq!(names, FIGURE_NAMES);
    let page = std::fs::read_to_string(dir.path().join("report.html")).expect("page");
    FIGURE_NAMES.iter().for_each(|name| is_whole(dir.path(), name, &page));
    assert!(
        page.contains("a &lt;run&gt;")
            && page.contains("seed = 1")
            && page.contains("prefers-color-scheme:dark")
    );
    assert!(
        !page.contains("<script") && !page.contains("src=\"http") && !page.contains("<link"),
        "the page needs nothing else"
    );
    let coloured = read_ply(&dir.path().join("figures/partition.ply")).expect("a splat file");
    let (still, first, second) =
        (&coloured.sh[..3], &coloured.sh[3 * 3..3 * 4], &coloured.sh[3 * 30..3 * 31]);
    assert!(coloured.len() == 57 && still != first && first != second && still != second);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let (a, b) = (tempfile::tempdir().expect("folder"), tempfile::tempdir().expect("folder"));
    let (scene, dataset) = (scene(1), dataset());
    let known = Known { source: None, dataset: Some(&dataset), truth: None };
    assert_eq!(report(a.path(), &scene, known), report(b.path(), &scene, known));
    assert!(all_bytes(&a.path().join("figures")) == all_bytes(&b.path().join("figures")));
    assert_eq!(
        std::fs::read(a.path().join("report.html")).expect("page"),
        std::fs::read(b.path().join("report.html")).expect("page")
    );
}

#[test]
fn what_a_run_does_not_have_is_left_out() {
    let dir = tempfile::tempdir().expect("folder");
    let (still, dataset) = (scene(0), dataset());
    let names = report(dir.path(), &still, Known { source: None, dataset: Some(&dataset), truth: None });
    assert_eq!(names, ["extrapolation", "psnr", "partition", "training"], "nothing moves");
    // An earlier report's figures do not stay beside a new one's.
    let names = report(dir.path(), &scene(1), Known { source: None, dataset: None, truth: None });
    assert_eq!(names, ["trajectories", "potential", "beta-sweep", "training"], "no images, no truth");
    let files: Vec<String> =
        all_bytes(&dir.path().join("figures")).into_keys().filter(|n| n.ends_with(".png")).collect();
    assert_eq!(files, ["beta-sweep.png", "potential.png", "training.png", "trajectories.png"]);
}

#[test]
fn a_suite_lists_its_runs_and_those_that_are_missing() {
    let dir = tempfile::tempdir().expect("folder");
    let run = dir.path().join("a");
    std::fs::create_dir(&run).expect("folder");
    let (scene, dataset) = (scene(1), dataset());
    report(&run, &scene, Known { source: None, dataset: Some(&dataset), truth: None });
    let cells =
        vec![("falling / one".to_owned(), run.clone()), ("falling / two".to_owned(), dir.path().join("b"))];
    let page = suite_html("suite", &cells).expect("a page");
    assert!(
        page.contains("Not evaluated yet: falling / two")
            && page.contains("<svg ")
            && page.contains("data:image/png;base64,")
    );
    let metrics: Metrics =
        serde_json::from_slice(&std::fs::read(run.join("metrics.json")).expect("metrics")).expect("JSON");
    let psnr = metrics.splits["test"].lagrangian.and_then(|s| s.psnr).expect("psnr");
    assert!(page.contains(&format!("– → {psnr:.2}")), "its PSNR is in the table");
    std::fs::write(run.join("metrics.json"), "{").expect("damage");
    let error = suite_html("suite", &cells).expect_err("damaged metrics").to_string();
    assert!(error.contains("damaged") && error.ends_with("metrics.json"), "{error}");
    assert!(suite_html("empty", &[]).expect("a page").contains("<h1>empty</h1>"));
}
