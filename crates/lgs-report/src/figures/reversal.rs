//! Time reversal: the motion forward and backward from t = 0, with velocity arrows (the state's v forward, −v
//! stepping back).

use lgs_core::Camera;
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::{LagrangianScene, Motion, SceneState};
use plotters::style::RGBColor;

use super::over_time::Span;
use super::strip::{Cell, Row, Strip, image_width};
use crate::axis::number;
use crate::canvas::Figure;
use crate::error::ReportError;
use crate::paths::spread;
use crate::style::{LAGRANGIAN, TRUTH};
use crate::thresholds::{LONG_ARROW, NOT_LONGER, REVERSAL_COLUMNS as COLUMNS, SHORT_TIME, VELOCITY_ARROWS};
use crate::views::{drawn, longest_view, of_width, resized};

/// Colour of the way back.
const BACKWARD: RGBColor = RGBColor(0xcc, 0x79, 0xa7);

const CAPTION: &str = "The Lagrangian scene forward from t = 0 and, with the exact inverse of its steps, \
    backward to times before the first image. Arrows: velocity v forward, −v backward, the direction \
    of the next step. A red corner: the forecast of some object is not trusted at that time.";

/// The figure; nothing without dynamic Gaussians or without a camera.
pub(crate) fn figure(
    (scene, motion): (&LagrangianScene, &mut Motion<'_>),
    dataset: Option<&Dataset>,
    cameras: &[Camera],
    span: Span,
) -> Result<Option<Figure>, ReportError> {
    let seen = dataset.map(longest_view).unwrap_or_default();
    let Some(camera) = seen.first().map(|f| f.camera).or(cameras.first().copied()) else { return Ok(None) };
    if scene.dynamic_gaussians.is_empty() {
        return Ok(None);
    }
    let (window, camera) = (scene.motion.time_window, of_width(&camera, image_width(COLUMNS)));
    let even: Vec<f32> = (1..COLUMNS).map(|i| window * i as f32 / (COLUMNS - 1) as f32).collect();
    let frames = past_frames(&seen, window, &even);
    let later = if frames.len() == COLUMNS - 1 { frames.iter().map(|f| -f.time).collect() } else { even };
    let times: Vec<f32> = std::iter::once(0.0).chain(later).collect();
    let rows_of_arrows = followed(scene);
    let scale = LONG_ARROW / fast(motion, &times, &rows_of_arrows, &camera).max(1e-9);
    let mut row = |title: &str, colour, sign: f32| {
        let mut cell = |&time: &f32| {
            let state = motion.state_at(sign * time);
            let cloud = scene.cloud_at(&state, sign * time);
            let image = span.marked(f64::from(sign * time), drawn(&cloud, &camera, scene.background));
            let all = rows_of_arrows.iter().map(|&r| arrow(&state, r, &camera, f64::from(sign) * scale));
            let arrows = all.filter(|[from, _]| in_view(*from)).collect();
            Some(Cell { image, note: format!("t = {}", number(f64::from(sign * time), 2)), arrows })
        };
        Row { title: title.to_owned(), colour, cells: times.iter().map(&mut cell).collect() }
    };
    let mut rows = vec![row("forward", LAGRANGIAN, 1.0), row("backward", BACKWARD, -1.0)];
    if frames.len() == COLUMNS - 1 {
        let zero = seen.iter().copied().find(|f| f.time.abs() < 1e-4);
        let of = |frame: Option<&Frame>| frame.map(|f| true_cell(f, scene, &camera));
        let cells = std::iter::once(of(zero)).chain(frames.iter().map(|f| of(Some(f)))).collect();
        rows.push(Row { title: "truth".to_owned(), colour: TRUTH, cells });
    }
    let aspect = f64::from(camera.height) / f64::from(camera.width);
    let strip = Strip { labels: times.into_iter().map(label).collect(), groups: Vec::new(), rows, aspect };
    Figure::of(("time-reversal", CAPTION), strip.size(), &strip).map(Some)
}

/// The frames nearest to the mirrored times, from among those before the first image.
fn past_frames<'a>(seen: &[&'a Frame], window: f32, times: &[f32]) -> Vec<&'a Frame> {
    let past = || seen.iter().copied().filter(|f| f.time < -1e-4 && f.time >= -window - 1e-4);
    let nearest = |time: f32| past().min_by(|a, b| (a.time + time).abs().total_cmp(&(b.time + time).abs()));
    let mut frames: Vec<&Frame> = times.iter().filter_map(|&time| nearest(time)).collect();
    frames.dedup_by_key(|f| f.time.to_bits());
    frames
}

/// The label of a column, which shows both signs of a time.
fn label(time: f32) -> String {
    if time == 0.0 { "t = 0".to_owned() } else { format!("±{}", number(f64::from(time), 2)) }
}

/// A true image with its time below.
fn true_cell(frame: &Frame, scene: &LagrangianScene, camera: &Camera) -> Cell {
    Cell {
        image: resized(&frame.composited(scene.background), camera.width, camera.height),
        note: format!("t = {}", number(f64::from(frame.time), 2)),
        arrows: Vec::new(),
    }
}

/// Rows of the moving Gaussians that carry an arrow.
fn followed(scene: &LagrangianScene) -> Vec<usize> {
    let each = (VELOCITY_ARROWS / scene.objects.len().max(1)).max(2);
    let of = |object: &lgs_model::ObjectModel| {
        let first = object.members.start;
        spread(&scene.dynamic_gaussians.means[object.members.clone()], each)
            .into_iter()
            .map(move |i| first + i)
            .collect::<Vec<_>>()
    };
    scene.objects.iter().flat_map(of).collect()
}

/// Ends of a Gaussian's velocity arrow as parts of the image, `scale` units of time long.
fn arrow(state: &SceneState, row: usize, camera: &Camera, scale: f64) -> [[f64; 2]; 2] {
    let (q, v) = (state.q[row], state.v[row]);
    let tip: [f32; 3] = std::array::from_fn(|c| (f64::from(q[c]) + scale * f64::from(v[c])) as f32);
    let part = |p: [f32; 3]| {
        let (pixel, depth) = camera.pixel_from_world(p);
        let inside = depth > 1e-3;
        [pixel[0] / camera.width as f32, pixel[1] / camera.height as f32]
            .map(|x| if inside { f64::from(x) } else { f64::NAN })
    };
    [part(q), part(tip)]
}

/// Whether a part of the image is inside of it.
fn in_view(part: [f64; 2]) -> bool {
    part.iter().all(|p| (0.0..=1.0).contains(p))
}

/// A speed in the image that [`NOT_LONGER`] do not exceed, parts of its width per unit of time.
fn fast(motion: &mut Motion<'_>, times: &[f32], rows: &[usize], camera: &Camera) -> f64 {
    let mut speeds = Vec::new();
    for &time in times {
        for sign in [1.0, -1.0] {
            let state = motion.state_at(sign * time);
            for &row in rows {
                let [from, to] = arrow(&state, row, camera, SHORT_TIME);
                if in_view(from) {
                    speeds.push((to[0] - from[0]).hypot(to[1] - from[1]) / SHORT_TIME);
                }
            }
        }
    }
    speeds.retain(|s| s.is_finite());
    speeds.sort_by(f64::total_cmp);
    speeds.get((NOT_LONGER * speeds.len() as f64) as usize).copied().unwrap_or(0.0)
}
