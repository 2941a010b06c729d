//! Stage 1 where paths carry things: those that fly freely for parts of the window and are handled else are
//! distilled by themselves, all other objects as if they were not there (method §5.4).

use lgs_distill::{
    DistillConfig, DistillError, DistillObserver, Distilled, DynamicsKind, Partition, SceneDistillation,
    Trajectories, distill_handled, distill_objects, is_handled,
};
use lgs_model::source::SourceModel;

/// Things of a source that are handled.
pub(super) struct HandledThings<'a> {
    source: &'a dyn SourceModel,
    /// Their numbers.
    numbers: Vec<u32>,
}

impl<'a> HandledThings<'a> {
    /// The handled things of a source in a window; none where the configuration asks for the paper's
    /// networks.
    pub(super) fn of(source: &'a dyn SourceModel, window: [f32; 2], config: &DistillConfig) -> Self {
        let all = 1..=source.carried().iter().copied().max().unwrap_or(0);
        let is_one = |number: &u32| {
            source.carried().contains(number) && is_handled(source.free_flights(*number), window)
        };
        let has_networks = config.dynamics == DynamicsKind::Networks;
        let numbers = if has_networks { Vec::new() } else { all.filter(is_one).collect() };
        Self { source, numbers }
    }

    /// Whether a Gaussian belongs to one of them.
    pub(super) fn has(&self, row: usize) -> bool {
        self.source.carried().get(row).is_some_and(|thing| self.numbers.contains(thing))
    }

    /// Stage 1 of a scene with them; `observer` is told of the other objects.
    pub(super) fn distilled(
        &self,
        trajectories: &Trajectories,
        partition: Partition,
        (config, seed): (&DistillConfig, u64),
        observer: &mut dyn DistillObserver,
    ) -> Result<SceneDistillation, DistillError> {
        if self.numbers.is_empty() {
            return distill_objects(trajectories, partition, config, seed, observer);
        }
        let others: Vec<usize> = (0..trajectories.len()).filter(|&row| !self.has(row)).collect();
        let found = distill_objects(
            &trajectories.select(&others),
            among(&partition, &others),
            config,
            seed,
            observer,
        )?;
        let of_all = |(members, distilled): (Vec<usize>, Distilled)| {
            (members.into_iter().map(|i| others[i]).collect::<Vec<usize>>(), distilled)
        };
        let mut objects: Vec<(Vec<usize>, Distilled)> = found.objects.into_iter().map(of_all).collect();
        for &number in &self.numbers {
            let own: Vec<usize> =
                (0..trajectories.len()).filter(|&row| self.source.carried()[row] == number).collect();
            let flights = self.source.free_flights(number);
            let thing = trajectories.select(&own);
            objects.push((own, distill_handled(&thing, flights, (config, seed), &mut |_| {})?));
        }
        objects.sort_by_key(|(own, _)| (std::cmp::Reverse(own.len()), own.first().copied()));
        let mut object = vec![-1; trajectories.len()];
        for (label, (members, _)) in (0..).zip(&objects) {
            members.iter().for_each(|&row| object[row] = label);
        }
        Ok(SceneDistillation { partition: Partition { object, objects: objects.len() }, objects })
    }
}

/// The partition of some of the particles, with the objects that have any of them.
fn among(partition: &Partition, rows: &[usize]) -> Partition {
    let object: Vec<i32> = rows.iter().map(|&row| partition.object[row]).collect();
    let kept: Vec<bool> = (0..partition.objects).map(|label| object.contains(&(label as i32))).collect();
    Partition { object, objects: partition.objects }.with_only(&kept)
}
