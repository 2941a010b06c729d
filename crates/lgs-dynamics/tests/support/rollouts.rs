//! Rollouts of every kind, which operations, their twins and devices are asked for.

use std::sync::Arc;

use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{Edit, ForceKind, PotentialKind, Supports, System, VelocityPolicy};

use super::{Vector, random_points};

/// An edit of everything.
pub(crate) const EDIT: Edit = Edit { velocity_scale: 0.7, potential_scale: 1.2, force_scale: 0.8 };

/// A kind of rollout.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) potential: PotentialKind,
    pub(crate) force: ForceKind,
    pub(crate) supports: Option<Arc<Supports>>,
    pub(crate) velocity_policy: VelocityPolicy,
}

/// Every kind of potential and force, and every treatment of velocities.
pub(crate) fn cases(q: &[[f32; 3]]) -> Vec<Case> {
    let (mlp, quadratic) = (PotentialKind::Mlp, PotentialKind::QuadraticMlp);
    let near = Some(Arc::new(Supports::nearest(q, 12)));
    let case =
        |(potential, force, supports, velocity_policy)| Case { potential, force, supports, velocity_policy };
    let cases = [
        (mlp, ForceKind::None, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Mlp, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Structured, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Structured, near.clone(), VelocityPolicy::Keep),
        (mlp, ForceKind::Mlp, near.clone(), VelocityPolicy::FromPositions),
        (mlp, ForceKind::Structured, near, VelocityPolicy::Rigid),
    ];
    cases.map(case).into()
}

impl Case {
    /// What a message calls it.
    pub(crate) fn name(&self) -> String {
        let Self { potential, force, supports, velocity_policy } = self;
        format!("{potential:?} {force:?} {} {velocity_policy:?}", supports.is_some())
    }

    /// Four steps, of which the last is shorter.
    pub(crate) fn call(&self, system: &System) -> RolloutCall {
        RolloutCall {
            supports: self.supports.clone(),
            velocity_policy: self.velocity_policy,
            last_dt: Some(0.02),
            ..free_call(system, 4)
        }
    }
}

/// So many equal steps of particles that nothing holds together.
pub(crate) fn free_call(system: &System, steps: usize) -> RolloutCall {
    RolloutCall {
        config: system.config,
        dt: 0.05,
        steps,
        last_dt: None,
        edit: EDIT,
        supports: None,
        velocity_policy: VelocityPolicy::Keep,
    }
}

/// Numbers in ±1.
pub(crate) fn weights(count: usize, seed: u64) -> Vec<f32> {
    random_points(count.div_ceil(3), 1.0, seed).as_flattened()[..count].to_vec()
}

/// The call of a vector of kind `dynamics`.
pub(crate) fn call_of(vector: &Vector, system: &System) -> RolloutCall {
    let supports = vector.constants["lra"].as_bool().unwrap().then(|| {
        let (indices, k) = vector.indices("neighbours");
        Arc::new(Supports::from_rows(indices, k).unwrap())
    });
    RolloutCall {
        config: system.config,
        dt: vector.number("dt") as f32,
        steps: vector.number("steps") as usize,
        last_dt: None,
        edit: Edit::default(),
        supports,
        velocity_policy: VelocityPolicy::Keep,
    }
}
