//! One object in stage 2: its trainable tensors, and the rollout of a subset of its particles.

use std::ops::Range;
use std::sync::Arc;

use burn::tensor::{Device, Tensor};
use lgs_core::{Stream, linear};
use lgs_dynamics::tensor::{RolloutCall, rollout};
use lgs_dynamics::{Edit, RolloutSpec, Supports, SystemConfig, VelocityPolicy};
use lgs_model::{LagrangianScene, ParticleDynamics, SceneState, TensorFile, TensorFileError};

use super::config::InitialVelocity;
use super::initial_pose::{Displacement, InitialPose};
use super::subset::{choose, supports_of};
use crate::adam::{AdamGroup, values};
use crate::cloud_tensors::{quat_mul, row_indices, rows};

/// Steps that are rolled with gradients.
pub(super) struct Window {
    pub(super) first: usize,
    pub(super) steps: usize,
    pub(super) dt: f32,
}

impl Window {
    pub(super) fn contains(&self, time: f32) -> bool {
        RolloutSpec::until(time.max(0.0), self.dt).steps >= self.first
    }
}

/// What is rolled of an object in a step.
pub(super) struct Roll<'a> {
    /// The scene's state at the start of the window.
    pub(super) start: &'a SceneState,
    pub(super) window: &'a Window,
    /// Most particles, drawn at random; 0: all.
    pub(super) subset: usize,
}

/// One object's trainable tensors.
pub(super) struct TrainableObject {
    /// Its place among the scene's objects.
    pub(super) index: usize,
    members: Range<usize>,
    pub(super) network: AdamGroup<1>,
    /// `[6, 1]` twist (linear, angular about the centre) or `[n, 3]` change of every velocity, on top of
    /// `base_velocity`.
    pub(super) velocity: AdamGroup<2>,
    pub(super) pose: InitialPose,
    base_points: Tensor<2>,
    base_velocity: Tensor<2>,
    /// `[3 n, 6]`, velocities from a twist; none if every velocity is free.
    twist_basis: Option<Tensor<2>>,
    pub(super) rms_speed: f32,
    config: SystemConfig,
    velocity_policy: VelocityPolicy,
    /// Supports of all particles, if none are left out.
    supports: Option<Arc<Supports>>,
}

/// One object's leaves in a step's graph, and the states of its subset.
pub(super) struct ObjectPath {
    pub(super) network: Tensor<1>,
    pub(super) velocity: Tensor<2>,
    /// Of the pose at t = 0, if the window starts there.
    pub(super) pose: Option<Tensor<1>>,
    /// The rotation in its displacement, `[1, 4]`.
    turn: Option<Tensor<2>>,
    /// Rows of the scene's dynamic Gaussians that were rolled.
    pub(super) rows: Vec<usize>,
    /// States `[steps + 1, n, 10]`: position, velocity, rotation since the window's start.
    states: Tensor<3>,
    /// Rotation up to the window's start, `[n, 4]`.
    start_rotation: Tensor<2>,
    supports: Option<Arc<Supports>>,
}

impl TrainableObject {
    pub(super) fn new(
        index: usize,
        dynamics: &ParticleDynamics,
        scene: &LagrangianScene,
        (kind, device): (InitialVelocity, &Device),
    ) -> Self {
        let members = scene.objects[index].members.clone();
        let velocities = &scene.velocities[members.clone()];
        let points = &scene.dynamic_gaussians.means[members.clone()];
        let mean_square =
            velocities.iter().flatten().map(|v| v * v).sum::<f32>() / points.len().max(1) as f32;
        let twist_basis = (kind == InitialVelocity::Twist).then(|| twist_basis(points, device));
        let shape = if twist_basis.is_some() { [6, 1] } else { [points.len(), 3] };
        Self {
            network: AdamGroup::new(dynamics.system.params.clone(), [dynamics.system.params.len()], device),
            velocity: AdamGroup::new(vec![0.0; shape[0] * shape[1]], shape, device),
            pose: InitialPose::new(points, velocities, device),
            base_points: rows(points, device),
            base_velocity: rows(velocities, device),
            twist_basis,
            rms_speed: mean_square.sqrt(),
            config: dynamics.system.config,
            velocity_policy: dynamics.velocity_policy,
            supports: dynamics.supports.clone(),
            index,
            members,
        }
    }

    /// Reads what a checkpoint holds under a name.
    pub(super) fn restore(&mut self, file: &TensorFile, name: &str) -> Result<(), TensorFileError> {
        self.network.restore(file, &format!("{name}.network"))?;
        self.velocity.restore(file, &format!("{name}.velocity"))?;
        self.pose.restore(file, &format!("{name}.pose"))
    }

    /// Adds what a checkpoint holds of it under a name.
    pub(super) fn insert_into(&self, file: &mut TensorFile, name: &str) {
        self.network.insert_into(file, &format!("{name}.network"));
        self.velocity.insert_into(file, &format!("{name}.velocity"));
        self.pose.insert_into(file, &format!("{name}.pose"));
    }

    /// Brings what has been learned into the scene that the object was made from.
    pub(super) fn write_to(&self, scene: &mut LagrangianScene) {
        let members = self.members.clone();
        if let Some(particles) = scene.objects[self.index].dynamics.particles_mut() {
            particles.system.params = self.network.values();
        }
        let displacement = self.pose.displacement();
        let velocities = self.velocity_from(self.velocity.leaf(), &displacement);
        scene.velocities[members.clone()].copy_from_slice(values(&velocities.inner()).as_chunks().0);
        let points = values(&self.points(&displacement).inner());
        scene.dynamic_gaussians.means[members.clone()].copy_from_slice(points.as_chunks().0);
        let turn = values(&displacement.turn.inner());
        for rotation in &mut scene.dynamic_gaussians.rotations[members] {
            *rotation = linear::quat_mul([turn[0], turn[1], turn[2], turn[3]], *rotation);
        }
    }

    /// Positions of all particles at t = 0.
    fn points(&self, displacement: &Displacement) -> Tensor<2> {
        self.base_points.clone().autodiff() + displacement.change.clone()
    }

    /// Their velocities.
    fn velocity_from(&self, change: Tensor<2>, displacement: &Displacement) -> Tensor<2> {
        let base = self.base_velocity.clone().autodiff();
        let (change, spin) = match &self.twist_basis {
            Some(basis) => {
                let spin = change.clone().narrow(0, 3, 3).reshape([3]);
                (basis.clone().autodiff().matmul(change).reshape(self.base_velocity.dims()), Some(spin))
            }
            None => (change, None),
        };
        base + change + self.pose.velocity_change(&displacement.change, spin)
    }

    /// Rolls a random subset of the particles over a window.
    pub(super) fn roll(&self, roll: &Roll<'_>, rng: &mut Stream, device: &Device) -> ObjectPath {
        let &Roll { start, window, subset } = roll;
        let common = self.supports.as_deref().and_then(Supports::common);
        let chosen = choose(self.members.len(), common, subset, rng);
        let rolled: Vec<usize> = chosen.iter().map(|&i| self.members.start + i as usize).collect();
        let pick = |from: &[[f32; 3]]| rolled.iter().map(|&i| from[i]).collect::<Vec<_>>();
        let kept_q = pick(&start.q);
        let supports = self.supports_among(&chosen, &kept_q);
        let (network, velocity) = (self.network.leaf(), self.velocity.leaf());
        let displacement = (window.first == 0).then(|| self.pose.displacement());
        let (q, v) = match &displacement {
            Some(displacement) => {
                let rows = row_indices(chosen.iter().map(|&i| i as usize), device);
                let velocities = self.velocity_from(velocity.clone(), displacement);
                (self.points(displacement).select(0, rows.clone()), velocities.select(0, rows))
            }
            None => (rows(&kept_q, device), rows(&pick(&start.v), device)),
        };
        let rotation: Vec<[f32; 4]> = rolled.iter().map(|&i| start.rotation[i]).collect();
        let states = rollout(network.clone(), q, v, self.call(window.dt, window.steps, supports.clone()));
        let (pose, turn) = displacement.map(|d| (d.leaf, d.turn)).unzip();
        ObjectPath {
            network,
            velocity,
            pose,
            turn,
            rows: rolled,
            states,
            start_rotation: rows(&rotation, device),
            supports,
        }
    }

    /// Supports of chosen particles at positions, in their numbering.
    fn supports_among(&self, chosen: &[u32], q: &[[f32; 3]]) -> Option<Arc<Supports>> {
        let all = self.supports.as_ref()?;
        let is_whole = chosen.len() == all.particles();
        Some(if is_whole { Arc::clone(all) } else { Arc::new(supports_of(chosen, all, q)) })
    }

    fn call(&self, dt: f32, steps: usize, supports: Option<Arc<Supports>>) -> RolloutCall {
        let velocity_policy = self.velocity_policy;
        RolloutCall {
            config: self.config,
            dt,
            steps,
            last_dt: None,
            edit: Edit::default(),
            supports,
            velocity_policy,
        }
    }
}

impl ObjectPath {
    /// Whether the displacement at t = 0 is part of the graph, and not of what the window starts from.
    pub(super) fn is_displaced(&self) -> bool {
        self.turn.is_some()
    }

    /// Positions and quaternions of the subset at a time of the window, from quaternions at t = 0.
    pub(super) fn poses_at(
        &self,
        object: &TrainableObject,
        window: &Window,
        time: f32,
        at_start: &Tensor<2>,
    ) -> (Tensor<2>, Tensor<2>) {
        let at_start = &self.turn.as_ref().map_or(at_start.clone(), |turn| quat_mul(turn, at_start));
        let n = self.rows.len();
        let until = RolloutSpec::until(time, window.dt);
        let mut state = self.states.clone().narrow(0, until.steps - window.first, 1).reshape([n, 10]);
        let mut rotation = quat_mul(&state.clone().narrow(1, 6, 4), &self.start_rotation);
        if let Some(rest) = until.last_dt {
            let (q, v) = (state.clone().narrow(1, 0, 3), state.narrow(1, 3, 3));
            let states = rollout(self.network.clone(), q, v, object.call(rest, 1, self.supports.clone()));
            state = states.narrow(0, 1, 1).reshape([n, 10]);
            rotation = quat_mul(&state.clone().narrow(1, 6, 4), &rotation);
        }
        (state.narrow(1, 0, 3), quat_mul(&rotation, at_start))
    }
}

/// `[3 n, 6]`: row 3j + i gives component i of particle j's velocity from a twist (u, ω) about the object's
/// centre, u + ω × r.
fn twist_basis(points: &[[f32; 3]], device: &Device) -> Tensor<2> {
    let n = points.len().max(1) as f32;
    let center: [f32; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).sum::<f32>() / n);
    let mut basis = Vec::with_capacity(3 * points.len());
    for p in points {
        let [x, y, z] = std::array::from_fn(|i| p[i] - center[i]);
        basis.push([1.0, 0.0, 0.0, 0.0, z, -y]);
        basis.push([0.0, 1.0, 0.0, -z, 0.0, x]);
        basis.push([0.0, 0.0, 1.0, y, -x, 0.0]);
    }
    rows(&basis, device)
}
