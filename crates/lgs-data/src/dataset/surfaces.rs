//! First points on surfaces, by sweeping depths (Collins 1996).
//!
//! Images without transparency show surroundings, and points anywhere in their volume stay in mid-air, where
//! a few views have them right and others see haze. A patch of an image is therefore moved along its rays,
//! and is on a surface where images of other cameras show the same patch. Patches are compared by normalised
//! correlation, which no exposure changes; a patch without texture, or one that fits at two depths, gives no
//! point. Of every camera the earliest image is taken: what stands still is the same in all of them.

use super::set::{Dataset, Frame};
use crate::ply::Points;
use crate::thresholds::{
    FAREST_SWEPT, FEWEST_AGREEING, LEAST_CORRELATION, LEAST_LEAD, LEAST_TEXTURE, MOST_COMPANIONS,
    NEAREST_SWEPT, PARALLAX, PATCH_SPACING, SWEPT_DEPTHS, SWEPT_VIEWS, SWEPT_WIDTH,
};
use glam::{Mat3, Vec3};
use lgs_core::{Camera, stream};
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// Samples along an edge of a patch, and in all of it.
const EDGE: usize = 5;
const SAMPLES: usize = EDGE * EDGE;
/// Patches that are swept side by side, before it is seen whether there are enough points.
const ROUND: usize = 4096;
/// Inverse depths on either side of the best one, for every step to its neighbours.
const FINE: i32 = 8;

impl Dataset {
    /// At most `count` points on surfaces that training images agree on, with their colours; the same for the
    /// same seed. There are few, or none, where cameras are few or images have no texture.
    #[must_use]
    pub fn surface_points(&self, count: usize, seed: u64) -> Points {
        let cameras = self.cameras("train");
        let n = cameras.len().min(SWEPT_VIEWS);
        let spread: Vec<&Frame> = (0..n).map(|i| cameras[i * cameras.len() / n]).collect();
        let views: Vec<View> = spread.par_iter().map(|frame| View::of(frame)).collect();
        let center = Vec3::from(self.scene_box().center);
        let companions: Vec<Vec<usize>> = (0..n).map(|i| companions(&views, i, center)).collect();
        let mut candidates: Vec<(usize, [u32; 2])> = (0..n).flat_map(|i| views[i].grid(i)).collect();
        candidates.shuffle(&mut stream(seed, "points on surfaces", 0));
        let mut points = Points::default();
        for round in candidates.chunks(ROUND) {
            let found: Vec<Option<[Vec3; 2]>> = round
                .par_iter()
                .map(|&(view, pixel)| Sweep::new(&views, view, (&companions[view], center))?.point(pixel))
                .collect();
            for [position, color] in found.into_iter().flatten().take(count - points.positions.len()) {
                points.positions.push(position.into());
                points.colors.push(color.into());
            }
            if points.positions.len() == count {
                break;
            }
        }
        points
    }
}

/// A reduced image with its camera.
struct View {
    camera: Camera,
    rotation: Mat3,
    eye: Vec3,
    colors: Vec<Vec3>,
    /// Brightness of every pixel; not a number where a mask leaves it out.
    grey: Vec<f32>,
}

impl View {
    fn of(frame: &Frame) -> Self {
        let resized;
        let frame = if frame.camera.width > SWEPT_WIDTH {
            resized = frame.resized(SWEPT_WIDTH);
            &resized
        } else {
            frame
        };
        let (camera, weights) = (frame.camera, frame.weights());
        let colors: Vec<Vec3> = frame.composited([0.0; 3]).pixels.into_iter().map(Vec3::from).collect();
        let is_seen = |i: usize| weights.as_ref().is_none_or(|weights| weights[i] > 0.0);
        let grey = |(i, c): (usize, &Vec3)| if is_seen(i) { c.element_sum() / 3.0 } else { f32::NAN };
        Self {
            rotation: Mat3::from_mat4(camera.camera_from_world),
            eye: Vec3::from(camera.center_in_world()),
            grey: colors.iter().enumerate().map(grey).collect(),
            camera,
            colors,
        }
    }

    /// Distance between samples of a patch, pixels.
    fn spacing(&self) -> f32 {
        PATCH_SPACING * self.camera.width as f32 / SWEPT_WIDTH as f32
    }

    /// Centres of patches that lie next to each other, with the number of the view.
    fn grid(&self, view: usize) -> impl Iterator<Item = (usize, [u32; 2])> + use<> {
        let step = (2.0 * self.spacing()).ceil().max(1.0) as usize;
        let Camera { width, height, .. } = self.camera;
        let rows = (step as u32..height).step_by(step);
        rows.flat_map(move |y| (step as u32..width).step_by(step).map(move |x| (view, [x, y])))
    }

    /// Brightness at a place, between pixels; nothing outside.
    fn at(&self, [x, y]: [f32; 2]) -> Option<f32> {
        let (x, y) = (x - 0.5, y - 0.5);
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let is_inside = x >= 0.0 && y >= 0.0 && x < width as f32 - 1.0 && y < height as f32 - 1.0;
        is_inside.then(|| {
            let (i, j) = (x as usize, y as usize);
            let (u, v) = (x - i as f32, y - j as f32);
            let row = |j: usize| self.grey[j * width + i] * (1.0 - u) + self.grey[j * width + i + 1] * u;
            row(j) * (1.0 - v) + row(j + 1) * v
        })
    }
}

/// The cameras that see a place from sides different enough to tell depths and alike enough to look the same,
/// the nearest first.
fn companions(views: &[View], own: usize, center: Vec3) -> Vec<usize> {
    let towards = |i: usize| (center - views[i].eye).normalize_or_zero();
    let angle = |i: usize| towards(i).dot(towards(own)).clamp(-1.0, 1.0).acos();
    let mut others: Vec<(f32, usize)> = (0..views.len())
        .map(|i| (angle(i), i))
        .filter(|&(angle, i)| i != own && (PARALLAX[0]..PARALLAX[1]).contains(&angle))
        .collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    others.into_iter().map(|(_, i)| i).take(MOST_COMPANIONS).collect()
}

/// The sweep of patches of one view against its companions.
struct Sweep<'a> {
    own: &'a View,
    others: Vec<&'a View>,
    /// Least and largest inverse depth.
    range: [f32; 2],
}

impl<'a> Sweep<'a> {
    /// Nothing where there are too few companions.
    fn new(views: &'a [View], own: usize, (companions, center): (&[usize], Vec3)) -> Option<Self> {
        let own = &views[own];
        let distance = own.eye.distance(center);
        let range = [1.0 / (FAREST_SWEPT * distance), 1.0 / (NEAREST_SWEPT * distance)];
        let is_swept = companions.len() >= FEWEST_AGREEING && range[1].is_finite();
        is_swept.then(|| Self { own, others: companions.iter().map(|&i| &views[i]).collect(), range })
    }

    /// The place and colour of the surface that a pixel shows; nothing where no depth fits, or several do.
    fn point(&self, pixel: [u32; 2]) -> Option<[Vec3; 2]> {
        let patch = Patch::of(self.own, pixel.map(|p| p as f32 + 0.5))?;
        let seen: Vec<Seen<'_>> =
            self.others.iter().map(|&view| Seen::new(view, self.own.eye, &patch)).collect();
        let [least, most] = self.range;
        let inverse = |step: f32| least + (most - least) * step / (SWEPT_DEPTHS - 1) as f32;
        let score = |step: f32| agreement(&seen, &patch, 1.0 / inverse(step));
        let scores: Vec<f32> = (0..SWEPT_DEPTHS).map(|step| score(step as f32)).collect();
        let best = (1..SWEPT_DEPTHS - 1).max_by(|&a, &b| scores[a].total_cmp(&scores[b]).then(b.cmp(&a)))?;
        // Steps from the best one that its own peak may reach: four pixels of the patch's edge.
        let own_peak = SWEPT_DEPTHS / 24;
        let rival = (0..SWEPT_DEPTHS)
            .filter(|step| step.abs_diff(best) > own_peak)
            .fold(-1.0_f32, |most, step| most.max(scores[step]));
        if scores[best] < LEAST_CORRELATION || scores[best] - rival < LEAST_LEAD {
            return None;
        }
        let fine = |k: i32| best as f32 + k as f32 / FINE as f32;
        let step = (-FINE..=FINE).map(fine).max_by(|a, b| score(*a).total_cmp(&score(*b)))?;
        let place = self.own.eye + patch.rays[SAMPLES / 2] / inverse(step);
        let color = self.own.colors[(pixel[1] * self.own.camera.width + pixel[0]) as usize];
        Some([place, color])
    }
}

/// A patch of an image: rays of its samples, of depth one, and brightness with mean 0 and variance 1.
struct Patch {
    rays: [Vec3; SAMPLES],
    values: [f32; SAMPLES],
}

impl Patch {
    /// Nothing at edges, and where there is no texture.
    fn of(view: &View, center: [f32; 2]) -> Option<Self> {
        let (mut rays, mut values) = ([Vec3::ZERO; SAMPLES], [0.0; SAMPLES]);
        let axis = view.rotation.row(2);
        for (i, (ray, value)) in rays.iter_mut().zip(&mut values).enumerate() {
            let offset = |k: usize| (k as f32 - (EDGE / 2) as f32) * view.spacing();
            let pixel = [center[0] + offset(i % EDGE), center[1] + offset(i / EDGE)];
            let direction = Vec3::from(view.camera.ray_direction_in_world(pixel));
            *ray = direction / direction.dot(axis);
            *value = view.at(pixel)?;
        }
        normalise(&mut values, LEAST_TEXTURE).then_some(Self { rays, values })
    }
}

/// A patch as another view sees it at any depth: where its rays begin, and where they go, in camera axes.
struct Seen<'a> {
    view: &'a View,
    start: Vec3,
    rays: [Vec3; SAMPLES],
}

impl<'a> Seen<'a> {
    fn new(view: &'a View, eye: Vec3, patch: &Patch) -> Self {
        Self {
            view,
            start: view.rotation * (eye - view.eye),
            rays: patch.rays.map(|ray| view.rotation * ray),
        }
    }

    /// Correlation with the patch at a depth; −1 where it is not in view, or without texture.
    fn correlation(&self, patch: &Patch, depth: f32) -> f32 {
        let Camera { fx, fy, cx, cy, .. } = self.view.camera;
        let mut values = [0.0; SAMPLES];
        for (value, ray) in values.iter_mut().zip(&self.rays) {
            let p = self.start + depth * ray;
            let pixel = [fx * p.x / p.z + cx, fy * p.y / p.z + cy];
            match self.view.at(pixel).filter(|_| p.z > 0.0) {
                Some(found) => *value = found,
                None => return -1.0,
            }
        }
        if !normalise(&mut values, 0.5 * LEAST_TEXTURE) {
            return -1.0;
        }
        values.iter().zip(&patch.values).map(|(a, b)| a * b).sum::<f32>() / SAMPLES as f32
    }
}

/// Mean correlation of the companions that agree best, as many as have to: others may see something before.
fn agreement(seen: &[Seen<'_>], patch: &Patch, depth: f32) -> f32 {
    let mut best = [-1.0_f32; FEWEST_AGREEING];
    for one in seen {
        let mut found = one.correlation(patch, depth);
        for kept in &mut best {
            if found > *kept {
                std::mem::swap(&mut found, kept);
            }
        }
    }
    best.iter().sum::<f32>() / FEWEST_AGREEING as f32
}

/// Takes mean and deviation out of values; false where the deviation is less than asked for, or no number.
fn normalise(values: &mut [f32; SAMPLES], least: f32) -> bool {
    let mean = values.iter().sum::<f32>() / SAMPLES as f32;
    values.iter_mut().for_each(|v| *v -= mean);
    let deviation = (values.iter().map(|v| v * v).sum::<f32>() / SAMPLES as f32).sqrt();
    values.iter_mut().for_each(|v| *v /= deviation);
    deviation >= least
}

#[cfg(test)]
mod tests;
