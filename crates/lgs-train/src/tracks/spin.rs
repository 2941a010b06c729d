//! How a tracked ball turns, from its texture: the constant angular velocity under which images at different
//! times show the same contrasts at the same points of its surface.
//!
//! Rates are searched on a grid with pairs of images so near in time that no rate in question turns the ball
//! by more than a radian, and a step of the grid by less than its texture. The best are followed as pairs
//! farther apart join in; path and radius, which silhouettes give to a few per cent, are refined with them.

use glam::Vec3;
use lgs_core::linear::{norm, sub};
use lgs_data::dataset::Frame;
use rayon::prelude::*;

use super::curve::{Curve, median_of};
use super::texture::{Surface, TexturedView, TurningBall, spread, textured_views};
use super::thresholds::{
    CHANCE_DEVIATIONS, FEWEST_IMAGES_OF_BALL, LARGEST_CORRECTION, LEAST_AGREEMENT, LEAST_GAIN, MOMENTS,
    MOST_PAIRS, OTHER_SPINS, PAIRS_PER_VIEW, SPIN_CANDIDATES, SPIN_FINEST, SPIN_RANGE, SPIN_STEP,
    SPIN_WIDENING,
};

/// The path, radius and spin of a ball whose texture tells them; none where the texture is too faint or too
/// fine, or does not turn at a constant rate.
pub(super) fn turning(
    frames: &[Frame],
    background: [f32; 3],
    curve: &Curve,
    radius: f32,
) -> Option<TurningBall> {
    let ball = TurningBall { curve: curve.clone(), radius, spin: Vec3::ZERO };
    let views = textured_views(frames, background, &ball);
    if views.len() < FEWEST_IMAGES_OF_BALL {
        return None;
    }
    let pairs = Pairs::new(&views);
    if pairs.longest <= 0.0 {
        return None;
    }
    let mut lag = pairs.first_lag();
    let (mut best, mut agreement) = candidates(&views, &ball, &pairs, lag)
        .into_par_iter()
        .map(|spin| refined(&views, &TurningBall { spin, ..ball.clone() }, &pairs.within(lag), lag))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    while agreement > LEAST_AGREEMENT && lag < pairs.longest {
        lag = (SPIN_WIDENING * lag).min(pairs.longest);
        (best, agreement) = refined(&views, &best, &pairs.within(lag), lag);
    }
    let all = pairs.within(pairs.longest);
    let chance = chance(&Surface::new(&views, &best), &all, best.spin, SPIN_RANGE / pairs.mean_lag());
    let spin = best.spin.to_array();
    tracing::debug!(views = views.len(), agreement, chance, radius = best.radius, ?spin, "texture");
    (agreement > LEAST_AGREEMENT.max(chance) && is_near(&best, &ball)).then_some(best)
}

/// Whether path and radius are those that silhouettes gave, as exactly as they do.
fn is_near(ball: &TurningBall, seen: &TurningBall) -> bool {
    let (start, end) = seen.curve.span;
    let shift = |i: usize| {
        let time = start + (end - start) * i as f32 / (MOMENTS - 1) as f32;
        norm(sub(ball.curve.at(time), seen.curve.at(time)))
    };
    let shift = median_of((0..MOMENTS).map(shift)).unwrap_or(0.0);
    shift.max((ball.radius - seen.radius).abs()) < LARGEST_CORRECTION * seen.radius
}

/// Pairs of views by the time between them.
struct Pairs {
    /// Time between the two, and their numbers, ascending.
    by_lag: Vec<(f32, usize, usize)>,
    views: usize,
    longest: f32,
}

impl Pairs {
    fn new(views: &[TexturedView]) -> Self {
        let pair = |i: usize, j: usize| ((views[j].time - views[i].time).abs(), i, j);
        let mut by_lag: Vec<_> =
            (0..views.len()).flat_map(|j| (0..j).map(move |i| (i, j))).map(|(i, j)| pair(i, j)).collect();
        by_lag.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let longest = by_lag.last().map_or(0.0, |pair| pair.0);
        Self { by_lag, views: views.len(), longest }
    }

    /// The shortest time within which there are [`PAIRS_PER_VIEW`] pairs of different times.
    fn first_lag(&self) -> f32 {
        let mut later = self.by_lag.iter().filter(|pair| pair.0 > 0.0);
        later.nth(PAIRS_PER_VIEW * self.views).map_or(self.longest, |pair| pair.0)
    }

    fn mean_lag(&self) -> f32 {
        self.by_lag.iter().map(|pair| pair.0).sum::<f32>() / self.by_lag.len() as f32
    }

    /// The pairs within a lag, thinned evenly to [`MOST_PAIRS`].
    fn within(&self, lag: f32) -> Vec<(usize, usize)> {
        let count = self.by_lag.partition_point(|pair| pair.0 <= lag);
        let step = count.div_ceil(MOST_PAIRS).max(1);
        self.by_lag[..count].iter().step_by(step).map(|&(_, i, j)| (i, j)).collect()
    }
}

/// The spins of a grid that agree best, no two of them neighbours.
fn candidates(views: &[TexturedView], ball: &TurningBall, pairs: &Pairs, lag: f32) -> Vec<Vec3> {
    let surface = Surface::new(views, ball);
    let pairs = pairs.within(lag);
    let (steps, unit) = ((SPIN_RANGE / SPIN_STEP) as i32, SPIN_STEP / lag);
    let axis = || -steps..=steps;
    let grid: Vec<Vec3> = axis()
        .flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x as f32, y as f32, z as f32))))
        .filter(|spin| spin.length() <= steps as f32)
        .map(|spin| spin * unit)
        .collect();
    let mut rated: Vec<(f32, Vec3)> =
        grid.par_iter().map(|&spin| (surface.agreement(spin, &pairs), spin)).collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Vec3> = Vec::new();
    for (_, spin) in rated {
        if found.iter().all(|other| other.distance(spin) > 2.0 * unit) {
            found.push(spin);
        }
        if found.len() == SPIN_CANDIDATES {
            break;
        }
    }
    found
}

/// The ball with spin, radius and path moved uphill, one number at a time, with steps that halve; and its
/// agreement.
fn refined(
    views: &[TexturedView],
    start: &TurningBall,
    pairs: &[(usize, usize)],
    lag: f32,
) -> (TurningBall, f32) {
    let mut surface = Surface::new(views, start);
    let mut best = (start.clone(), surface.agreement(start.spin, pairs));
    let mut step = SPIN_STEP;
    while step > SPIN_FINEST {
        let before = best.1;
        for (number, by) in
            (0..=SPIN_NUMBERS + start.curve.coefficients()).flat_map(|n| [(n, step), (n, -step)])
        {
            let moved = moved(&best.0, number, by, lag);
            let other = (number >= SPIN_NUMBERS).then(|| Surface::new(views, &moved));
            let rated = other.as_ref().unwrap_or(&surface).agreement(moved.spin, pairs);
            if rated > best.1 {
                best = (moved, rated);
                surface = other.unwrap_or(surface);
            }
        }
        if best.1 - before < LEAST_GAIN {
            step *= 0.5;
        }
    }
    best
}

/// How many numbers of a ball are its spin's.
const SPIN_NUMBERS: usize = 3;

/// The ball with one number changed: spin by a step's angle within the lag, lengths by as many radii.
fn moved(ball: &TurningBall, number: usize, step: f32, lag: f32) -> TurningBall {
    let mut moved = ball.clone();
    match number {
        0..SPIN_NUMBERS => moved.spin[number] += step / lag,
        SPIN_NUMBERS => moved.radius *= 1.0 + step,
        _ => moved.curve.shift(number - SPIN_NUMBERS - 1, f64::from(step * ball.radius)),
    }
    moved
}

/// The agreement that spins at a distance from one reach: their mean and [`CHANCE_DEVIATIONS`] standard
/// deviations.
fn chance(surface: &Surface<'_>, pairs: &[(usize, usize)], spin: Vec3, distance: f32) -> f32 {
    let others: Vec<f32> = (0..OTHER_SPINS)
        .into_par_iter()
        .map(|i| surface.agreement(spin + spread(i, OTHER_SPINS) * distance, pairs))
        .collect();
    let mean = others.iter().sum::<f32>() / OTHER_SPINS as f32;
    let variance = others.iter().map(|a| (a - mean).powi(2)).sum::<f32>() / OTHER_SPINS as f32;
    mean + CHANCE_DEVIATIONS * variance.sqrt()
}
