//! Control nodes as training moves, adds and drops them (method §3.6).
//!
//! The parameters are those of the network, then a row per node. Nodes are chosen when the Gaussians begin to
//! move, and again every so many iterations; until then there are none, and everything rests.

use std::sync::Arc;

use burn::tensor::Tensor;
use lgs_core::{GaussianCloud, stream};
use rand::RngExt;

use super::choose::{Choice, Discord, Places, first_features, first_nodes, rechoose};
use super::model::{ControlNodes, node_poses};
use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE, Node};
use super::priors::{acceleration, unturned};
use super::structure::Structure;
use super::tensor::{Followers, blend};
use crate::source::config::{DeformationConfig, NodesConfig, ScaleMode};
use crate::source::model::SourceModel;
use crate::source::motion::{Canonical, Captured, Learned, Moment, MotionConfig, Remade, SourceMotion};
use crate::source::network::Deformation;
use crate::source::pose_network::PoseNetwork;
use crate::source::registry::{Imports, Kind, Training};
use crate::source::tensor::{NetworkCall, deform};
use crate::tensor_file::{TensorFile, TensorFileError};
use crate::thresholds::{ACCELERATION_STEP, ACCELERATION_STRIDE, MOTION_SAMPLES, RESTING};

pub(in crate::source) const KIND: Kind = Kind {
    name: "nodes",
    format: "lagrangegs-nodes/1",
    read: |file, path| Ok(Box::new(ControlNodes::from_tensors(file, path)?)),
    imports: Imports::Impossible,
    training: Some(Training { validate, motion }),
};

fn validate(config: &MotionConfig<'_>) -> Result<(), (String, String)> {
    config.without_velocity()?;
    let Some(nodes) = config.nodes else {
        return Err(("kind".to_owned(), "the source `nodes` needs `nodes`".to_owned()));
    };
    nodes.validate().map_err(|(field, reason)| (format!("nodes.{field}"), reason))?;
    config.deformation.validate().map_err(|(field, reason)| (format!("deformation.{field}"), reason))?;
    let refuse = |field: &str, reason: &str| Err((format!("deformation.{field}"), reason.to_owned()));
    match config.deformation {
        DeformationConfig { code: 1.., .. } => refuse("code", "the source `nodes` has no code"),
        DeformationConfig { scale_mode: ScaleMode::Fixed, .. } => Ok(()),
        _ => refuse("scale_mode", "the source `nodes` never changes scales: `fixed`"),
    }
}

fn motion(config: &MotionConfig<'_>, captured: Captured) -> Box<dyn SourceMotion> {
    Box::new(NodesMotion {
        network: Arc::new(config.deformation.clone()),
        config: config.nodes.cloned().unwrap_or_default(),
        captured,
        structure: Structure::default(),
        discord: None,
    })
}

/// The values of a tensor, on the host.
fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f32> {
    tensor.to_data().try_to_vec::<f32>().expect("a tensor of 32-bit floats")
}

/// The motion of nodes.
struct NodesMotion {
    network: Arc<DeformationConfig>,
    config: NodesConfig,
    captured: Captured,
    structure: Structure,
    /// The structure's discord `[m]`, while it is summed on a device that is not the processor.
    discord: Option<Tensor<1>>,
}

impl NodesMotion {
    fn own(&self) -> usize {
        self.network.layout().len
    }

    /// The parameters of the network, and the nodes `[m, NODE]`.
    fn parts(&self, parameters: &Tensor<1>) -> (Tensor<1>, Tensor<2>) {
        let own = self.own();
        let nodes = parameters
            .clone()
            .narrow(0, own, self.structure.count * NODE)
            .reshape([self.structure.count, NODE]);
        (parameters.clone().narrow(0, 0, own), nodes)
    }

    /// Pose rows of nodes at a time.
    fn node_poses(&self, network: Tensor<1>, nodes: &Tensor<2>, time: f32) -> Tensor<2> {
        let positions = nodes.clone().detach().narrow(1, 0, 3);
        let call = NetworkCall { config: Arc::clone(&self.network), frame: self.captured.frame, time };
        deform(network, positions, unturned(self.structure.count, nodes), call)
    }

    fn discord_on_host(&self) -> Discord {
        let gathered = |sums: &Tensor<1>| Discord { of_nodes: values(sums) };
        self.discord.as_ref().map_or_else(|| self.structure.discord.clone(), gathered)
    }

    fn deformation(&self, parameters: &[f32]) -> Deformation {
        let params = parameters[..self.own()].to_vec();
        Deformation { config: (*self.network).clone(), frame: self.captured.frame, params }
    }

    /// Whether each node is ever away from its place up to a time.
    fn moving(&self, parameters: &[f32], nodes: &[[f32; NODE]], until: f32) -> Vec<bool> {
        let (deformation, resting) = (self.deformation(parameters), RESTING * self.captured.frame.scale);
        let mut moves = vec![false; nodes.len()];
        for sample in 0..MOTION_SAMPLES {
            let time = until * sample as f32 / (MOTION_SAMPLES - 1) as f32;
            let poses = node_poses(&deformation, nodes, time);
            for (moves, (node, pose)) in moves.iter_mut().zip(nodes.iter().zip(&poses)) {
                let place = Node::of(node).position;
                *moves |= (0..3).any(|i| (pose[i] - place[i]).abs() > resting);
            }
        }
        moves
    }

    /// Nodes where there were none, with the features of Gaussians.
    fn begin(&self, learned: &Learned) -> (Remade, Vec<[f32; NODE]>) {
        let features = first_features(&learned.cloud);
        let nodes = first_nodes(&learned.cloud, &features, self.captured.frame.scale, self.config.initial);
        let kept = (0..self.own()).collect();
        let features = Some(features.into_flattened());
        (Remade { kept, added: nodes.as_flattened().to_vec(), features }, nodes)
    }

    /// Drops idle nodes and adds some where Gaussians want to part.
    fn rechosen(
        &self,
        learned: &Learned,
        nodes: &[[f32; NODE]],
        at: Moment,
    ) -> Option<(Remade, Vec<[f32; NODE]>)> {
        let places = Places { means: &learned.cloud.means, features: learned.features.as_chunks().0 };
        let neighbors = Neighbors::search(nodes, places.means, places.features, self.config.neighbors);
        let moves = self.moving(&learned.parameters, nodes, at.window_end);
        let discord = self.discord_on_host();
        let Choice { kept, added } =
            rechoose(nodes, places, &neighbors, (&discord, &moves), self.config.most);
        if kept.len() == nodes.len() && added.is_empty() {
            return None;
        }
        let own = self.own();
        let rows = kept.iter().flat_map(|k| own + k * NODE..own + (k + 1) * NODE);
        let remade = Remade {
            kept: (0..own).chain(rows).collect(),
            added: added.as_flattened().to_vec(),
            features: None,
        };
        Some((remade, kept.iter().map(|&k| nodes[k]).chain(added).collect()))
    }
}

impl SourceMotion for NodesMotion {
    fn init(&self, seed: u64) -> Vec<f32> {
        self.network.fresh(seed)
    }

    fn parameters(&self) -> usize {
        self.own() + self.structure.count * NODE
    }

    fn features(&self) -> usize {
        FEATURES
    }

    fn fresh_features(&self, cloud: &GaussianCloud) -> Vec<f32> {
        first_features(cloud).into_flattened()
    }

    fn poses(&self, parameters: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2> {
        let (network, nodes) = self.parts(&parameters);
        let poses = self.node_poses(network, &nodes, at.time);
        let Canonical { means, rotations, features } = canonical;
        let features =
            features.unwrap_or_else(|| Tensor::zeros([means.dims()[0], FEATURES], &means.device()));
        let neighbors = self.structure.neighbors.clone().unwrap_or_default();
        blend(nodes, poses, Followers { means, rotations, features }, &neighbors)
    }

    /// Near nodes move as one rigid body at a random time, and at times all of them gently.
    fn prior(&self, parameters: &Tensor<1>, _canonical: &Canonical, at: Moment) -> Option<Tensor<1>> {
        let (rigidity, gentle) = (self.config.rigidity_at(at.iteration), self.config.acceleration);
        if self.structure.edges.second.is_empty() || at.window_end <= 2.0 * ACCELERATION_STEP {
            return None;
        }
        let mut random = stream(self.captured.seed, "time of a node prior", at.iteration as u64);
        let time = random.random_range(ACCELERATION_STEP..at.window_end - ACCELERATION_STEP);
        let (network, nodes) = self.parts(parameters);
        let poses = |time: f32| self.node_poses(network.clone(), &nodes, time);
        let now = poses(time);
        let mut prior =
            (rigidity > 0.0).then(|| self.structure.edges.stretch(&nodes, &now, &self.config) * rigidity);
        if gentle > 0.0 && at.iteration.is_multiple_of(ACCELERATION_STRIDE) {
            let around = [poses(time - ACCELERATION_STEP), now, poses(time + ACCELERATION_STEP)];
            let cost = acceleration(around, ACCELERATION_STEP, self.captured.frame.scale)
                * (gentle * ACCELERATION_STRIDE as f32);
            prior = Some(prior.map_or_else(|| cost.clone(), |prior| prior + cost.clone()));
        }
        prior
    }

    fn is_due(&self, iteration: usize) -> bool {
        self.structure.neighbors.is_none() || iteration >= self.structure.adapted + self.config.interval
    }

    fn adapt(&mut self, learned: &Learned, at: Moment) -> Option<Remade> {
        let nodes = learned.parameters[self.own()..].as_chunks::<NODE>().0.to_vec();
        let is_chosen = at.iteration >= self.structure.adapted + self.config.interval;
        let change = if nodes.is_empty() {
            Some(self.begin(learned))
        } else if is_chosen && at.iteration < self.config.chosen_before {
            self.rechosen(learned, &nodes, at)
        } else {
            None
        };
        let (remade, nodes) = change.map_or((None, nodes), |(remade, nodes)| (Some(remade), nodes));
        let features = remade.as_ref().and_then(|remade| remade.features.as_ref());
        let features = features.unwrap_or(&learned.features).as_chunks().0;
        let found = Neighbors::search(&nodes, &learned.cloud.means, features, self.config.neighbors);
        self.structure.neighbors = Some(found);
        if is_chosen || remade.is_some() {
            let neighbors = self.structure.neighbors.take();
            self.discord = None;
            self.structure = Structure {
                neighbors,
                ..Structure::new(&nodes, self.config.rigidity_neighbors, at.iteration)
            };
        }
        remade
    }

    fn forget_gaussians(&mut self) {
        self.structure.neighbors = None;
    }

    fn observe(&mut self, gradients: &Tensor<2>) {
        let Some(neighbors) = &self.structure.neighbors else { return };
        #[cfg(feature = "gpu")]
        if lgs_tensor::cube::is_cube(&gradients.device()) {
            let begin = || Tensor::from_floats(&*self.structure.discord.of_nodes, &gradients.device());
            let before = self.discord.take().unwrap_or_else(begin);
            self.discord = Some(super::cube::discord(before, gradients.clone(), neighbors));
            return;
        }
        self.structure.discord.observe(values(gradients).as_chunks().0, neighbors);
    }

    fn observes(&self) -> bool {
        self.structure.neighbors.is_some()
    }

    fn insert_into(&self, file: &mut TensorFile) {
        Structure { discord: self.discord_on_host(), ..self.structure.clone() }.insert_into(file);
    }

    fn restore(&mut self, file: &TensorFile, gaussians: usize) -> Result<(), TensorFileError> {
        (self.structure, self.discord) = (Structure::read_from(file, gaussians)?, None);
        Ok(())
    }

    fn scale_mode(&self) -> ScaleMode {
        ScaleMode::Fixed
    }

    fn model(&self, learned: Learned) -> Box<dyn SourceModel> {
        let deformation = self.deformation(&learned.parameters);
        let nodes = learned.parameters[self.own()..].as_chunks::<NODE>().0.to_vec();
        let Learned { cloud, features, .. } = learned;
        let features = features.as_chunks().0.to_vec();
        Box::new(ControlNodes::new(cloud, features, nodes, deformation, self.config.neighbors))
    }
}
