//! Pictures of a scene, a source model or a dataset, as a page asks for them.

use glam::{Mat4, Quat, Vec3};
use lgs_core::{Camera, GaussianCloud, Image, SH_C0};
use lgs_model::SceneState;

use crate::colors::{STATIC, object_color};
use crate::motions::Motions;
use crate::protocol::{FrameRequest, Model, ObjectEdit, Style, ViewCamera};
use crate::subject::Subject;
use crate::thresholds::{ELLIPSOID_SCALE, LARGEST_SIDE, PICKED_SHARE, POINT_RADIUS, SOLID_LOGIT};

/// A picture, and the time that it shows.
pub(crate) struct Drawn {
    pub(crate) image: Image,
    pub(crate) time: f32,
    /// Whether the motion has still to be rolled out to the time that was asked for.
    pub(crate) rolling: bool,
}

/// Draws a request, as far as its motion is rolled out.
pub(crate) fn draw(
    subject: &Subject,
    motions: &mut Motions,
    request: &FrameRequest,
) -> Result<Drawn, String> {
    let camera = camera(subject, request)?;
    if request.model == Model::Truth {
        return truth(subject, request, &camera);
    }
    let (cloud, time, rolling) = cloud(subject, motions, request)?;
    let cloud = styled(subject, cloud, request);
    let image = lgs_eval::render(&cloud, &camera, subject.scene.background).image;
    Ok(Drawn { image, time, rolling })
}

/// The object that gives most light to a pixel of a request.
pub(crate) fn pick(
    subject: &Subject,
    motions: &mut Motions,
    request: &FrameRequest,
    pixel: [f32; 2],
) -> Result<Option<usize>, String> {
    let full = camera(subject, request)?;
    let one = Camera {
        width: 1,
        height: 1,
        cx: full.cx - pixel[0].floor(),
        cy: full.cy - pixel[1].floor(),
        ..full
    };
    let (cloud, ..) = cloud(subject, motions, request)?;
    let objects = subject.scene.objects.len();
    let first = subject.scene.static_gaussians.len();
    let mut best = (PICKED_SHARE, None);
    // Each picture shows the light of three objects.
    for group in (0..objects).step_by(3) {
        let mut marked = painted(&cloud, |_| [0.0; 3]);
        for channel in 0..3.min(objects - group) {
            for row in subject.scene.objects[group + channel].members.clone() {
                let mut color = [0.0; 3];
                color[channel] = 1.0;
                paint(&mut marked, first + row, color);
            }
        }
        let light = lgs_eval::render(&marked, &one, [0.0; 3]).image.pixels[0];
        for (object, light) in (group..objects).zip(light) {
            if light > best.0 {
                best = (light, Some(object));
            }
        }
    }
    Ok(best.1)
}

/// The camera of a request at its size.
pub(crate) fn camera(subject: &Subject, request: &FrameRequest) -> Result<Camera, String> {
    let [width, height] = request.size;
    if !(1..=LARGEST_SIDE).contains(&width) || !(1..=LARGEST_SIDE).contains(&height) {
        return Err(format!("a picture of {width} × {height} pixels; each side is 1 to {LARGEST_SIDE}"));
    }
    match request.camera {
        ViewCamera::Dataset { dataset } => {
            let known = subject.cameras.get(dataset).ok_or_else(|| format!("no camera {dataset}"))?;
            Ok(known.1.resized(width, height))
        }
        ViewCamera::Free { position, rotation: [w, x, y, z], fov_y } => {
            let rotation = Quat::from_xyzw(x, y, z, w);
            let numbers = position.iter().chain([&w, &x, &y, &z, &fov_y]).all(|v| v.is_finite());
            if !numbers || rotation.length_squared() < 1e-6 || !(0.01..3.1).contains(&fov_y) {
                return Err("a camera needs finite numbers, a rotation, and a field of view".to_owned());
            }
            let pose = Mat4::from_rotation_translation(rotation.normalize(), Vec3::from(position));
            let focal = height as f32 / (2.0 * (0.5 * fov_y).tan());
            let camera = Camera::centered(pose.inverse(), focal, width, height);
            Ok(Camera { near: subject.start.0.near, filter: subject.start.0.filter, ..camera })
        }
    }
}

fn truth(subject: &Subject, request: &FrameRequest, camera: &Camera) -> Result<Drawn, String> {
    let ViewCamera::Dataset { dataset } = request.camera else {
        return Err("images of the dataset are there for its own cameras alone".to_owned());
    };
    let none = || format!("no image of camera {dataset}");
    let found = subject.truth_at(dataset, request.time).ok_or_else(none)?;
    let image = (found.load)()?;
    let image = image.resampled(camera.width, camera.height);
    Ok(Drawn { image, time: found.time, rolling: false })
}

/// Refuses times that the scene does not have.
pub(crate) fn check_time(subject: &Subject, time: f32) -> Result<(), String> {
    let (first, last) = subject.scene.motion.time_range();
    if (first - 1e-4..=last + 1e-4).contains(&time) {
        return Ok(());
    }
    Err(format!("t = {time} is not between {first} and {last}"))
}

fn cloud(
    subject: &Subject,
    motions: &mut Motions,
    request: &FrameRequest,
) -> Result<(GaussianCloud, f32, bool), String> {
    check_time(subject, request.time)?;
    if request.model == Model::Source {
        let source = subject.source.as_ref().ok_or("the run has no source model")?;
        return Ok((source.cloud_at(request.time), request.time, false));
    }
    let reached = motions.towards(request.time, &request.edits)?;
    Ok((subject.scene.cloud_at(&reached.state, reached.time), reached.time, !reached.is_there))
}

/// Gaussians as a style draws them.
fn styled(subject: &Subject, cloud: GaussianCloud, request: &FrameRequest) -> GaussianCloud {
    let solid = |mut cloud: GaussianCloud| {
        cloud.raw_opacities.fill(SOLID_LOGIT);
        cloud
    };
    match request.style {
        Style::Color => cloud,
        Style::Objects if request.model == Model::Lagrangian => {
            let of_dynamic = object_of_rows(subject);
            let first = subject.scene.static_gaussians.len();
            painted(&cloud, |row| row.checked_sub(first).map_or(STATIC, |row| object_color(of_dynamic[row])))
        }
        Style::Objects => cloud,
        Style::Points => {
            let (camera, target) = &subject.start;
            let distance = Vec3::from(camera.center_in_world()).distance(Vec3::from(*target));
            let mut cloud = solid(cloud);
            cloud.log_scales.fill([(POINT_RADIUS * distance).max(f32::MIN_POSITIVE).ln(); 3]);
            cloud
        }
        Style::Ellipsoids => {
            let mut cloud = solid(cloud);
            cloud.log_scales.as_flattened_mut().iter_mut().for_each(|s| *s += ELLIPSOID_SCALE.ln());
            cloud
        }
    }
}

/// The object of each dynamic Gaussian.
fn object_of_rows(subject: &Subject) -> Vec<usize> {
    let rows = subject.scene.objects.iter().enumerate();
    rows.flat_map(|(index, object)| std::iter::repeat_n(index, object.members.len())).collect()
}

/// The cloud with plain colours.
fn painted(cloud: &GaussianCloud, color: impl Fn(usize) -> [f32; 3]) -> GaussianCloud {
    let mut out = GaussianCloud {
        means: cloud.means.clone(),
        rotations: cloud.rotations.clone(),
        log_scales: cloud.log_scales.clone(),
        raw_opacities: cloud.raw_opacities.clone(),
        sh: vec![0.0; 3 * cloud.len()],
        sh_degree: 0,
    };
    (0..out.len()).for_each(|row| paint(&mut out, row, color(row)));
    out
}

/// Sets the colour of a Gaussian of degree 0.
fn paint(cloud: &mut GaussianCloud, row: usize, color: [f32; 3]) {
    for (value, channel) in cloud.sh[3 * row..3 * row + 3].iter_mut().zip(color) {
        *value = (channel - 0.5) / SH_C0;
    }
}

/// Positions of some dynamic Gaussians along the whole of the scene's times.
pub(crate) fn paths(
    subject: &Subject,
    motions: &mut Motions,
    edits: &[ObjectEdit],
    (count, times): (usize, usize),
) -> Result<Paths, String> {
    let (first, last) = subject.scene.motion.time_range();
    let total = subject.scene.dynamic_gaussians.len();
    let rows: Vec<usize> = (0..total).step_by(total.div_ceil(count.max(1)).max(1)).collect();
    let of_rows = object_of_rows(subject);
    let step = (last - first) / times.saturating_sub(1).max(1) as f32;
    let times: Vec<f32> = (0..times).map(|i| first + i as f32 * step).collect();
    let mut points = vec![Vec::with_capacity(times.len()); rows.len()];
    for &time in &times {
        let state: SceneState = loop {
            let reached = motions.towards(time, edits)?;
            if reached.is_there {
                break reached.state;
            }
        };
        rows.iter().zip(&mut points).for_each(|(&row, path)| path.push(state.q[row]));
    }
    Ok(Paths { times, objects: rows.iter().map(|&row| of_rows[row]).collect(), points })
}

/// Sampled paths.
pub(crate) struct Paths {
    pub(crate) times: Vec<f32>,
    pub(crate) objects: Vec<usize>,
    pub(crate) points: Vec<Vec<[f32; 3]>>,
}
