//! The preset `paper` holds the published values; what differs is listed at `Preset::Paper`.

use lgs_distill::{
    DistillConfig, DynamicsKind, PartitionMethod, RolloutConfig, SharedMotionKind, TargetKind,
};
use lgs_dynamics::{ForceKind, PotentialKind, VelocityPolicy};
use lgs_model::source::SourceKind;
use lgs_train::config::LastStage;
use lgs_train::stages::InitialVelocity;
use lgs_train::{Preset, TrainConfig};

fn paper() -> TrainConfig {
    TrainConfig::preset(Preset::Paper)
}

#[test]
fn networks_and_motion_are_as_published() {
    let config = paper();
    let distill = &config.distill;
    assert_eq!((distill.potential, distill.force), (PotentialKind::Mlp, ForceKind::Mlp));
    assert_eq!((distill.hidden, distill.hidden_layers), (128, 3));
    assert_eq!(
        (config.motion.dt, config.motion.alignment, config.motion.alignment_neighbors),
        (0.01, true, 19)
    );
    assert_eq!(config.motion.velocity_policy, VelocityPolicy::Keep);
    assert_eq!((config.last_stage, config.data.train_before), (LastStage::TuneGaussians, 0.0));
    assert_eq!((distill.rollout.force_penalty, distill.rollout.first_horizon), (1e-4, 10));
}

#[test]
fn stage_1_is_eq_7_alone() {
    let distill = paper().distill;
    assert_eq!((distill.dynamics, distill.rollout.targets), (DynamicsKind::Networks, TargetKind::Source));
    assert_eq!((distill.matching.steps, distill.shared_motion), (0, SharedMotionKind::None));
    assert!(!distill.rigid_constraint, "Eq. 6 with nearest neighbours alone");
    let rollout = &distill.rollout;
    assert_eq!((rollout.steps, rollout.particles, rollout.window_steps), (10_000, 4_096, 15));
    assert_eq!((rollout.learning_rate, rollout.velocity_learning_rate), (1e-3, 1e-2));
    let quick = TrainConfig::of(Preset::Quick, SourceKind::Defgs, DynamicsKind::Networks);
    let lengths = RolloutConfig { steps: 10_000, particles: 4_096, ..quick.distill.rollout.clone() };
    assert_eq!(DistillConfig { rollout: lengths, ..quick.distill }, distill, "shorter, and else the same");
}

#[test]
fn the_partition_is_as_published() {
    let partition = paper().partition;
    assert_eq!(
        (partition.method, partition.neighbors, partition.smallest_object),
        (PartitionMethod::Graph, 16, 50)
    );
    assert_eq!(
        (partition.length_tolerance, partition.length_slack, partition.displacement_tolerance),
        (0.1, 0.002, 0.25)
    );
    assert_eq!((partition.static_displacement, partition.clusters), (0.01, 1));
}

#[test]
fn photometric_stages_are_as_published() {
    let config = paper();
    let (dynamics, gaussians) = (&config.tune_dynamics, &config.tune_gaussians);
    assert_eq!((dynamics.iterations, dynamics.frames_per_step, dynamics.ssim_weight), (5_000, 1, 0.2));
    assert_eq!((dynamics.learning_rate, dynamics.velocity_learning_rate), (1e-4, 1e-3));
    assert_eq!(
        (dynamics.refresh_every, dynamics.subset, dynamics.window_steps, dynamics.full_window_every),
        (10, 8_192, 15, 4)
    );
    assert_eq!((dynamics.initial_velocity, dynamics.pose_learning_rate), (InitialVelocity::Free, 0.0));
    assert_eq!(
        (config.refine_gaussians.iterations, config.fit_dynamics.steps),
        (0, 0),
        "stage 2 follows stage 1"
    );
    assert_eq!(
        (gaussians.iterations, gaussians.stretch, gaussians.refresh_every, gaussians.ssim_weight),
        (10_000, 1.0, 100, 0.2)
    );
    assert_eq!((gaussians.means_learning_rate, gaussians.scales_learning_rate), (8e-6, 5e-4));
    assert_eq!((gaussians.rotations_learning_rate, gaussians.opacities_learning_rate), (1e-4, 5e-3));
    assert_eq!(gaussians.colors_learning_rate, 2.5e-3);
}

#[test]
fn the_source_is_as_published() {
    let source = paper().source;
    assert_eq!((source.iterations, source.warmup_iterations, source.stretch), (40_000, 3_000, 1.0));
    assert_eq!((source.sh_degree, source.sh_interval, source.ssim_weight), (3, 1_000, 0.2));
    let rates = &source.learning_rates;
    assert_eq!((rates.position_start, rates.position_end, rates.position_steps), (8e-4, 8e-6, 30_000));
    assert_eq!(
        (rates.sh, rates.sh_rest, rates.opacity, rates.scale, rates.rotation),
        (2.5e-3, 1.25e-4, 0.05, 5e-3, 1e-3)
    );
    assert_eq!(
        (rates.deformation_start, rates.deformation_end, rates.deformation_steps),
        (8e-4, 1.6e-6, 40_000)
    );
    let densify = &source.densify;
    assert_eq!(
        (densify.after, densify.before, densify.interval, densify.gradient_threshold),
        (500, 15_000, 100, 2e-4)
    );
    assert_eq!(
        (densify.clone_extent, densify.min_opacity, densify.prune_extent, densify.prune_large_after),
        (0.01, 0.005, 0.1, 3_000)
    );
    assert_eq!((densify.opacity_reset_interval, densify.white_reset_at), (3_000, 500));
    assert_eq!(source.near, 0.2);
    assert_eq!(TrainConfig::of(Preset::Paper, SourceKind::Freegave, DynamicsKind::Networks).source.near, 0.8);
}
