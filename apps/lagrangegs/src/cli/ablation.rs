//! Flags of `lagrangegs train` that leave out or change a part of the method. Each stands for settings of the
//! configuration, where it is documented; `--set` wins over them.

use clap::ValueEnum;
use lgs_train::config::LastStage;

/// Parts of the method.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "Ablations and windows")]
pub(super) struct Ablations {
    /// Leave out later stages: `distill` (or 1), `tune-dynamics` (2), `tune-gaussians` (3)
    #[arg(long, value_name = "STAGE")]
    last_stage: Option<LastStage>,
    /// No local rigid alignment, neither of neighbourhoods nor of whole objects
    #[arg(long)]
    without_alignment: bool,
    /// No force Q: a potential alone
    #[arg(long)]
    without_force: bool,
    /// Networks learn from rollouts alone, as in the paper
    #[arg(long)]
    without_matching: bool,
    /// Velocities after an alignment [default: keep]
    #[arg(long, value_enum, value_name = "POLICY")]
    velocity_policy: Option<Policy>,
    /// Learn only from training images with a time below this
    #[arg(long, value_name = "TIME")]
    train_before: Option<f32>,
    /// Group moving Gaussians into K objects by k-means instead of by the graph of neighbours
    #[arg(long, value_name = "K")]
    k_means: Option<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Policy {
    /// As integrated; alignment moves positions only (the paper)
    Keep,
    /// Displacements of the aligned positions over the step
    FromPositions,
    /// Those of the neighbourhood's rigid motion
    Rigid,
}

impl Ablations {
    /// The settings that the flags stand for.
    pub(super) fn settings(&self) -> Vec<String> {
        let mut settings: Vec<String> = Vec::new();
        settings.extend(self.last_stage.map(|stage| format!("last_stage={}", stage.name())));
        settings.extend(self.without_alignment.then(|| "motion.alignment=false".to_owned()));
        settings.extend(self.without_force.then(|| "distill.force=none".to_owned()));
        settings.extend(self.without_matching.then(|| "distill.matching.steps=0".to_owned()));
        let name = |policy: Policy| policy.to_possible_value().map(|value| value.get_name().to_owned());
        settings
            .extend(self.velocity_policy.and_then(name).map(|name| format!("motion.velocity_policy={name}")));
        settings.extend(self.train_before.map(|time| format!("data.train_before={time}")));
        settings.extend(
            self.k_means
                .iter()
                .flat_map(|k| ["partition.method=k-means".to_owned(), format!("partition.clusters={k}")]),
        );
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_train::{Preset, TrainConfig};

    #[test]
    fn every_flag_changes_the_setting_it_stands_for() {
        let flags = Ablations {
            last_stage: Some(LastStage::TuneDynamics),
            without_alignment: true,
            without_force: true,
            without_matching: true,
            velocity_policy: Some(Policy::FromPositions),
            train_before: Some(0.5),
            k_means: Some(3),
        };
        let config = TrainConfig::resolve(Preset::Quick, None, &flags.settings()).expect("settings");
        assert_eq!(
            (config.last_stage, config.motion.alignment, config.distill.matching.steps),
            (LastStage::TuneDynamics, false, 0)
        );
        assert_eq!((config.data.train_before, config.partition.clusters), (0.5, 3));
        assert_eq!(config.distill.force, lgs_dynamics::ForceKind::None);
        assert_eq!(config.motion.velocity_policy, lgs_dynamics::VelocityPolicy::FromPositions);
        assert_eq!(Ablations::default().settings(), Vec::<String>::new());
    }
}
