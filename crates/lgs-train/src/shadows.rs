//! Shadows among the objects of a trained scene (method §5.10): what moves along a surface, and there as a
//! sun or a lamp casts another object onto that.

use glam::{DMat3, DVec2, DVec3};
use lgs_core::geometry::{outer, principal_axes, trace, wide};
use lgs_core::{GaussianCloud, median};
use lgs_dynamics::{Edit, Reversal};
use lgs_mechanics::contact::planes;
use lgs_model::{LagrangianScene, Motion, ObjectModel, Projection, Shadow};
use nalgebra::{Matrix2, Vector2};

use crate::thresholds::{
    BY_PATH, FLAT, LAMP_GAIN, LAMPS, LOWEST_LAMP, SAMPLES_OF_SHADOW, SHADOW_CENTER, SHADOW_ERROR,
    SHADOW_GAIN, STRAY,
};

/// The scene with those of its objects that are shadows of others going on as these cast them.
pub(crate) fn with_shadows(scene: LagrangianScene) -> LagrangianScene {
    let casts = |caster: &usize| has_law(&scene.objects[*caster]);
    let casters: Vec<usize> = (0..scene.objects.len()).filter(casts).collect();
    if casters.is_empty() || scene.objects.len() < 2 {
        return scene;
    }
    let window = scene.motion.time_window;
    let times = (0..SAMPLES_OF_SHADOW).map(|i| window * i as f32 / (SAMPLES_OF_SHADOW - 1) as f32);
    let times: Vec<f32> = times.collect();
    let mut motion = Motion::new(&scene, Edit::default(), Reversal::default());
    let states: Vec<Vec<[f32; 3]>> = times.iter().map(|&time| motion.state_at(time).q).collect();
    let seen = |object: &ObjectModel| Seen::new(&core(&scene, object), &states);
    let seen: Vec<Seen> = scene.objects.iter().map(seen).collect();
    let has_hits = |object: usize| scene.contact.iter().any(|contact| contact.objects.contains(&object));
    let at_rest = opaque(&scene.static_gaussians);
    let shadow_of = |object: usize| {
        let planes = if has_hits(object) { Vec::new() } else { seen[object].planes(&at_rest) };
        let others = casters.iter().filter(|caster| **caster != object);
        let pairs = others.flat_map(|&caster| planes.iter().map(move |&plane| (caster, plane)));
        let cast = |(caster, plane): (usize, (DVec3, f64))| {
            let cast = Cast::new(plane, &seen[caster].centers, &seen[object].centers)?;
            Some((cast.projection()?, caster, cast.error))
        };
        let (projection, caster, error) = pairs.filter_map(cast).min_by(|a, b| a.2.total_cmp(&b.2))?;
        let of_caster = |state: &Vec<[f32; 3]>| mean(&state[scene.objects[caster].members.clone()]);
        let ends = [of_caster(&states[0]), of_caster(&states[times.len() - 1])];
        tracing::debug!(object, caster, error, ?projection, "a shadow");
        Some(Shadow { object, caster, projection, centers: ends.map(Into::into) })
    };
    let mut shadows: Vec<Shadow> = (0..seen.len()).filter_map(shadow_of).collect();
    let objects: Vec<usize> = shadows.iter().map(|shadow| shadow.object).collect();
    shadows.retain(|shadow| !objects.contains(&shadow.caster));
    drop(motion);
    LagrangianScene { shadows, ..scene }
}

fn mean(points: &[[f32; 3]]) -> DVec3 {
    points.iter().map(|&p| wide(p)).sum::<DVec3>() / points.len().max(1) as f64
}

/// Gaussians of an object that show where it is: those that hide what is behind them, but for what lies far
/// from the others; all of them where there are no such.
fn core(scene: &LagrangianScene, object: &ObjectModel) -> Vec<usize> {
    let GaussianCloud { means, raw_opacities, .. } = &scene.dynamic_gaussians;
    let opaque: Vec<usize> = object.members.clone().filter(|&i| raw_opacities[i] > 0.0).collect();
    let middle = |axis: usize| median(opaque.iter().map(|&i| f64::from(means[i][axis])));
    let Some(((x, y), z)) = middle(0).zip(middle(1)).zip(middle(2)) else {
        return object.members.clone().collect();
    };
    let distance = |i: usize| wide(means[i]).distance(DVec3::new(x, y, z));
    let reach = STRAY * median(opaque.iter().map(|&i| distance(i))).unwrap_or(0.0);
    opaque.into_iter().filter(|&i| distance(i) <= reach).collect()
}

/// The centres of Gaussians that hide what is behind them.
fn opaque(cloud: &GaussianCloud) -> Vec<[f64; 3]> {
    let is_opaque = |(_, raw): &(&[f32; 3], &f32)| **raw > 0.0;
    let centers = cloud.means.iter().zip(&cloud.raw_opacities).filter(is_opaque);
    centers.map(|(center, _)| center.map(f64::from)).collect()
}

/// Whether an object follows a law in the captured window and beyond: its shadow is where that has it,
/// however far the law is trusted.
fn has_law(object: &ObjectModel) -> bool {
    object.dynamics.generalised().is_some() && object.recording.is_none()
}

/// What was seen of an object in the captured window.
struct Seen {
    /// Mean positions at the sampled times.
    centers: Vec<DVec3>,
    /// Covariance of the positions about these, and that of all positions at all times about their mean.
    about_centers: DMat3,
    about_mean: DMat3,
    mean: DVec3,
}

impl Seen {
    fn new(members: &[usize], states: &[Vec<[f32; 3]>]) -> Self {
        let of_members = |state: &Vec<[f32; 3]>| members.iter().map(|&i| wide(state[i])).collect();
        let positions: Vec<Vec<DVec3>> = states.iter().map(of_members).collect();
        let positions = || positions.iter();
        let count = members.len().max(1) as f64;
        let center = |at: &Vec<DVec3>| at.iter().sum::<DVec3>() / count;
        let centers: Vec<DVec3> = positions().map(center).collect();
        let mean = centers.iter().sum::<DVec3>() / centers.len() as f64;
        let covariance = |offsets: &mut dyn Iterator<Item = DVec3>| {
            offsets.fold(DMat3::ZERO, |sum, offset| sum + outer(offset, offset))
        };
        let mut own = positions().zip(&centers).flat_map(|(at, center)| at.iter().map(move |p| p - center));
        let about_centers = covariance(&mut own) * (count * centers.len() as f64).recip();
        let of_centers =
            covariance(&mut centers.iter().map(|center| center - mean)) * (centers.len() as f64).recip();
        Self { about_mean: about_centers + of_centers, about_centers, centers, mean }
    }

    /// Normals and offsets of planes along which it moves: that in which all of it lies, if it is flat, and
    /// those of points at rest that it moves by.
    fn planes(&self, at_rest: &[[f64; 3]]) -> Vec<(DVec3, f64)> {
        let [.., (thickness, normal)] = principal_axes(&self.about_mean);
        let extent = trace(&self.about_centers);
        let flat = (thickness <= FLAT * FLAT * extent).then(|| (normal, normal.dot(self.mean)));
        let extent = extent.sqrt();
        let near = |point: &&[f64; 3]| {
            let is_near = |center: &DVec3| center.distance(DVec3::from(**point)) <= BY_PATH * extent;
            self.centers.iter().any(is_near)
        };
        let near: Vec<[f64; 3]> = at_rest.iter().filter(near).copied().collect();
        let grounds = planes(&near, self.mean.to_array(), FLAT * extent);
        let grounds = grounds.iter().map(|ground| (ground.plane.normal.into(), ground.plane.offset));
        let lies_by = |(normal, offset): &(DVec3, f64)| {
            let heights = self.centers.iter().map(|center| center.dot(*normal) - offset);
            let mean = heights.clone().sum::<f64>() / self.centers.len() as f64;
            let (straying, moving) = heights.zip(&self.centers).fold((0.0, 0.0), |sums, (height, center)| {
                (sums.0 + (height - mean).powi(2), sums.1 + center.distance_squared(self.mean))
            });
            mean.abs() <= extent && straying <= SHADOW_ERROR * SHADOW_ERROR * moving
        };
        flat.into_iter().chain(grounds).filter(lies_by).collect()
    }
}

/// The centres of a caster and of a flat object on its plane.
struct Cast {
    normal: DVec3,
    offset: f64,
    /// Directions along the plane.
    along: [DVec3; 2],
    /// Of each sample: the caster's height, its foot and the centre of the flat object.
    samples: Vec<(f64, DVec2, DVec2)>,
    slope: DVec2,
    closeness: f64,
    /// Root mean square distance of the flat object from the shadow.
    error: f64,
}

impl Cast {
    /// The sun, or if that explains much more, the lamp that casts an object nearest to a flat one; nothing
    /// if the one is not on one side of the other's plane.
    fn new((normal, offset): (DVec3, f64), caster: &[DVec3], flat: &[DVec3]) -> Option<Self> {
        let side = (caster.iter().map(|c| c.dot(normal) - offset).sum::<f64>()).signum();
        let (normal, offset) = (side * normal, side * offset);
        let (first, second) = normal.any_orthonormal_pair();
        let on_plane = |p: &DVec3| DVec2::new(p.dot(first), p.dot(second));
        let sample = |(c, f): (&DVec3, &DVec3)| (c.dot(normal) - offset, on_plane(c), on_plane(f));
        let samples: Vec<(f64, DVec2, DVec2)> = caster.iter().zip(flat).map(sample).collect();
        let highest = samples.iter().map(|sample| sample.0).fold(0.0, f64::max);
        if samples.iter().any(|sample| sample.0 <= 0.0) {
            return None;
        }
        let (slope, error) = best_slope(&samples, 0.0)?;
        let sun = Self { normal, offset, along: [first, second], samples, slope, closeness: 0.0, error };
        let closest = 1.0 / (LOWEST_LAMP * highest);
        let lamp = |i: usize| {
            let closeness = closest * i as f64 / LAMPS as f64;
            let (slope, error) = best_slope(&sun.samples, closeness)?;
            Some((slope, closeness, error))
        };
        let lamp = (1..=LAMPS).filter_map(lamp).min_by(|a, b| a.2.total_cmp(&b.2));
        match lamp.filter(|lamp| lamp.2 <= LAMP_GAIN * sun.error) {
            Some((slope, closeness, error)) => Some(Self { slope, closeness, error, ..sun }),
            None => Some(sun),
        }
    }

    /// The projection, if it explains the path of the flat object, and a constant velocity does not.
    fn projection(&self) -> Option<Projection> {
        let places: Vec<DVec2> = self.samples.iter().map(|sample| sample.2).collect();
        let [rest, even] = [0, 1].map(|degree| error_of_even_motion(&places, degree));
        tracing::debug!(error = self.error, rest, even, "a flat object as a shadow");
        let is_shadow = self.error <= SHADOW_ERROR * rest && SHADOW_GAIN * self.error <= even;
        let slope = self.slope.x * self.along[0] + self.slope.y * self.along[1];
        is_shadow.then(|| Projection {
            normal: self.normal.into(),
            offset: self.offset,
            slope: slope.into(),
            closeness: self.closeness,
        })
    }
}

/// The slope of light of a closeness that casts feet at heights nearest to places, and its root mean square
/// error. The middle of a shadow that is partly hidden may be beside its place by a constant.
fn best_slope(samples: &[(f64, DVec2, DVec2)], closeness: f64) -> Option<(DVec2, f64)> {
    let count = samples.len() as f64;
    let row = |&(height, foot, place): &(f64, DVec2, DVec2)| {
        let scale = 1.0 / (1.0 - height * closeness);
        (Vector2::new(1.0, height * scale), place - scale * foot)
    };
    let mut gram = Matrix2::new(SHADOW_CENTER * count, 0.0, 0.0, 0.0);
    let mut moments = [Vector2::zeros(); 2];
    for (basis, value) in samples.iter().map(row) {
        gram += basis * basis.transpose();
        moments.iter_mut().zip(value.to_array()).for_each(|(moment, value)| *moment += basis * value);
    }
    let inverse = gram.try_inverse()?;
    let [x, y] = moments.map(|moment| inverse * moment);
    let off = |sample| {
        let (basis, value) = row(sample);
        (value - DVec2::new(basis.dot(&x), basis.dot(&y))).length_squared()
    };
    let error = (samples.iter().map(off).sum::<f64>() / count).sqrt();
    Some((DVec2::new(x[1], y[1]), error))
}

/// Root mean square distance of places at even times from their mean (degree 0), or from the even motion that
/// is nearest to them (1).
fn error_of_even_motion(places: &[DVec2], degree: usize) -> f64 {
    let count = places.len() as f64;
    let time = |i: usize| i as f64 - 0.5 * (count - 1.0);
    let mean = places.iter().sum::<DVec2>() / count;
    let squares: f64 = (0..places.len()).map(|i| time(i).powi(2)).sum();
    let velocity = places.iter().enumerate().map(|(i, place)| time(i) * *place).sum::<DVec2>() / squares;
    let off = |(i, place): (usize, &DVec2)| {
        let even = mean + if degree == 0 { DVec2::ZERO } else { time(i) * velocity };
        place.distance_squared(even)
    };
    (places.iter().enumerate().map(off).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests;
