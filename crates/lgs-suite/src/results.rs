//! The metrics of a suite's cells, and means over scenes and seeds.

use lgs_eval::Metrics;
use serde::Serialize;

use crate::figures::{Model, Over};
use crate::plan::{Cell, Plan};

/// Mean and spread over seeds of a figure that is already taken over scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Mean over seeds; nothing if no seed is complete.
    pub mean: Option<f64>,
    /// Sample standard deviation over seeds; nothing for fewer than two.
    pub spread: Option<f64>,
    /// Seeds that are complete.
    pub seeds: usize,
}

impl Summary {
    /// The summary of one value per complete seed.
    pub(crate) fn of(values: &[f64]) -> Self {
        let n = values.len();
        if n == 0 {
            return Self::default();
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Self { mean: Some(mean), spread: (n > 1).then(|| (squares / (n - 1) as f64).sqrt()), seeds: n }
    }
}

/// A suite's cells with their metrics, where they have been measured.
pub struct Results<'a> {
    plan: &'a Plan,
    metrics: Vec<Option<Metrics>>,
}

impl<'a> Results<'a> {
    /// Reads the metrics of every cell that has any.
    #[must_use]
    pub fn load(plan: &'a Plan) -> Self {
        let done = |cell: &Cell| plan.state(cell).is_ok_and(|state| state == crate::state::CellState::Done);
        Self {
            plan,
            metrics: plan.cells.iter().map(|cell| done(cell).then(|| plan.metrics(cell)).flatten()).collect(),
        }
    }

    /// Results that are already in memory, one entry per cell.
    #[must_use]
    pub fn new(plan: &'a Plan, metrics: Vec<Option<Metrics>>) -> Self {
        Self { plan, metrics }
    }

    /// The plan they belong to.
    #[must_use]
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// Number of cells with metrics.
    #[must_use]
    pub fn done(&self) -> usize {
        self.metrics.iter().flatten().count()
    }

    /// The metrics of one run.
    #[must_use]
    pub fn metrics(&self, scene: &str, method: &str, variant: &str, seed: u64) -> Option<&Metrics> {
        let is_it = |cell: &Cell| {
            cell.scene == scene && cell.method == method && cell.variant == variant && cell.seed == seed
        };
        let cell = self.plan.cells.iter().position(is_it)?;
        self.metrics.get(cell)?.as_ref()
    }

    /// A figure of a method's variant over all scenes.
    pub(crate) fn over_scenes(
        &self,
        method: &str,
        variant: &str,
        over: Over,
        read: impl Fn(&Metrics) -> Option<f64>,
    ) -> Summary {
        let of_seed = |&seed: &u64| {
            let runs: Option<Vec<&Metrics>> =
                self.scenes().map(|scene| self.metrics(scene, method, variant, seed)).collect();
            together(&runs?.into_iter().map(&read).collect::<Vec<_>>(), over)
        };
        Summary::of(&self.plan.suite.seeds.iter().filter_map(of_seed).collect::<Vec<_>>())
    }

    /// A variant's figure minus that of another, scene by scene and seed by seed.
    pub(crate) fn difference(
        &self,
        method: &str,
        (variant, other): (&str, &str),
        read: impl Fn(&Metrics) -> Option<f64>,
    ) -> Summary {
        let of_seed = |&seed: &u64| {
            let change = |scene: &str| {
                let of = |variant| self.metrics(scene, method, variant, seed).and_then(&read);
                Some(of(variant)? - of(other)?)
            };
            together(&self.scenes().map(change).collect::<Vec<_>>(), Over::Every)
        };
        Summary::of(&self.plan.suite.seeds.iter().filter_map(of_seed).collect::<Vec<_>>())
    }

    /// A figure of one scene.
    pub(crate) fn of_scene(
        &self,
        scene: &str,
        method: &str,
        variant: &str,
        read: impl Fn(&Metrics) -> Option<f64>,
    ) -> Summary {
        let of_seed = |&seed: &u64| self.metrics(scene, method, variant, seed).and_then(&read);
        Summary::of(&self.plan.suite.seeds.iter().filter_map(of_seed).collect::<Vec<_>>())
    }

    /// Number of runs that were measured by another protocol than the suite's.
    pub(crate) fn scored_otherwise(&self) -> usize {
        self.metrics
            .iter()
            .flatten()
            .filter(|m| m.protocol.half_resolution != self.plan.suite.half_resolution)
            .count()
    }

    /// Whether any run scored a split.
    pub(crate) fn has_split(&self, split: &str) -> bool {
        self.metrics
            .iter()
            .flatten()
            .any(|m| crate::figures::split_score(m, split, Model::Lagrangian).is_some())
    }

    fn scenes(&self) -> impl Iterator<Item = &'a str> {
        self.plan.suite.scenes.iter().map(String::as_str)
    }
}

/// One number of the scenes' figures.
fn together(figures: &[Option<f64>], over: Over) -> Option<f64> {
    let having: Vec<f64> = figures.iter().copied().flatten().collect();
    if having.is_empty() || (over == Over::Every && having.len() < figures.len()) {
        return None;
    }
    match over {
        Over::Largest => having.into_iter().reduce(f64::max),
        Over::Every | Over::Having => Some(having.iter().sum::<f64>() / having.len() as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_over_complete_seeds() {
        let two = Summary::of(&[29.0, 31.0]);
        assert_eq!((two.mean, two.seeds), (Some(30.0), 2));
        assert!((two.spread.expect("two") - 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(Summary::of(&[3.0]), Summary { mean: Some(3.0), spread: None, seeds: 1 });
        assert_eq!(Summary::of(&[]), Summary::default());
    }

    #[test]
    fn an_incomplete_set_of_scenes_has_no_mean() {
        let figures = [Some(1.0), None, Some(3.0)];
        assert_eq!(together(&figures, Over::Every), None);
        assert_eq!(together(&figures, Over::Having), Some(2.0));
        assert_eq!(together(&figures, Over::Largest), Some(3.0));
        assert_eq!(together(&[None, None], Over::Having), None);
    }
}
