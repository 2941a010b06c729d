//! A system: the kinds and sizes of its two networks, the normalisation and one flat vector of parameters.
//!
//! `U = σ_a σ_o û(x̂)` and `Q` are those of method §4.1 with `x̂ = (q − μ)/σ_o`, so that `∇U = σ_a ∇û`
//! exactly. The `Mlp` force is `σ_a q̂(x̂, v/σ_v)`; the `Structured` one is `(σ_a/σ_v)(−softplus(d̂ − 6) v +
//! ŵ × v)` with `[d̂, ŵ]` a network of position alone: Rayleigh damping and a gyroscopic term, whose power is
//! never positive. Neither takes a time: the flow is autonomous.

use lgs_core::stream;
use lgs_nn::{MlpLayout, MlpSizes, ParamRange, init_uniform};
use serde::{Deserialize, Serialize};

/// Shift of the raw damping, so that a zero output means (almost) no damping: `softplus(−6) = 0.0025`.
pub const DAMPING_SHIFT: f32 = 6.0;

/// Last layer of U at the start, relative to the usual initialisation: motion begins close to straight lines
/// (method §4.1).
const POTENTIAL_OUTPUT_SCALE: f32 = 0.01;

/// The function class of the potential.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PotentialKind {
    /// A network, as in the paper.
    Mlp,
    /// A network plus `g·x̂ + ½ x̂ᵀ S x̂`, with which uniform gravity and springs are exact.
    QuadraticMlp,
}

/// The function class of the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForceKind {
    /// No force: the system is conservative.
    None,
    /// A network of position and velocity, as in the paper.
    Mlp,
    /// Damping and a gyroscopic term, with coefficients that are a network of position.
    Structured,
}

/// The fixed affine map between world units and the O(1) numbers that the networks see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normalisation {
    /// μ: centre of the trajectories, world units.
    pub center: [f32; 3],
    /// σ_o: half diagonal of the trajectories' box, world units.
    pub length: f32,
    /// σ_v: root mean square speed, world units per unit of time.
    pub speed: f32,
    /// σ_a: root mean square acceleration, world units per squared unit of time.
    pub acceleration: f32,
}

impl Normalisation {
    /// The networks see world coordinates.
    #[must_use]
    pub const fn identity() -> Self {
        Self { center: [0.0; 3], length: 1.0, speed: 1.0, acceleration: 1.0 }
    }
}

impl Default for Normalisation {
    fn default() -> Self {
        Self::identity()
    }
}

/// Kinds, sizes and normalisation of a system.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SystemConfig {
    /// Function class of U.
    pub potential: PotentialKind,
    /// Function class of Q.
    pub force: ForceKind,
    /// Units of each hidden layer (paper: 128).
    pub hidden: usize,
    /// Hidden layers of each network (paper: 3).
    pub hidden_layers: usize,
    /// Scales of the motion.
    pub normalisation: Normalisation,
}

impl SystemConfig {
    /// The paper's networks on world coordinates.
    #[must_use]
    pub const fn paper() -> Self {
        Self {
            potential: PotentialKind::Mlp,
            force: ForceKind::Mlp,
            hidden: 128,
            hidden_layers: 3,
            normalisation: Normalisation::identity(),
        }
    }

    /// Number of parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        Layout::of(self).len
    }

    /// The named arrays of the parameter vector, in order, without gaps.
    #[must_use]
    pub fn layout(&self) -> Vec<ParamRange> {
        let layout = Layout::of(self);
        let mut entries = network_entries("potential", &layout.potential);
        if let Some(start) = layout.quadratic {
            entries.push(ParamRange {
                name: "potential.linear".into(),
                range: start..start + 3,
                shape: vec![3],
            });
            entries.push(ParamRange {
                name: "potential.quadratic".into(),
                range: start + 3..start + 9,
                shape: vec![6],
            });
        }
        if let Some(force) = &layout.force {
            entries.extend(network_entries("force", force));
        }
        entries
    }
}

/// Places of the networks in the parameter vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) potential: MlpLayout,
    /// Start of the linear (3) and quadratic (xx, yy, zz, xy, xz, yz) coefficients.
    pub(crate) quadratic: Option<usize>,
    pub(crate) force: Option<MlpLayout>,
    pub(crate) len: usize,
}

impl Layout {
    pub(crate) fn of(config: &SystemConfig) -> Self {
        let mlp = |inputs, outputs, len: &mut usize| {
            let SystemConfig { hidden: width, hidden_layers: depth, .. } = *config;
            MlpLayout::new(MlpSizes { inputs, depth, width, outputs, skip_layer: MlpSizes::NO_SKIP }, len)
        };
        let mut len = 0;
        let potential = mlp(3, 1, &mut len);
        let quadratic = (config.potential == PotentialKind::QuadraticMlp).then_some(len);
        len += if quadratic.is_some() { 9 } else { 0 };
        let force = match config.force {
            ForceKind::None => None,
            ForceKind::Mlp => Some(mlp(6, 3, &mut len)),
            ForceKind::Structured => Some(mlp(3, 4, &mut len)),
        };
        Self { potential, quadratic, force, len }
    }
}

/// A Lagrangian system: `a = −β ∇U(q) + γ Q(q, v)` (Eq. 4 and 9).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct System {
    /// Kinds, sizes and normalisation.
    pub config: SystemConfig,
    /// All parameters, laid out as [`System::layout`] says.
    pub params: Vec<f32>,
}

impl System {
    /// A system before training: hidden layers uniform in ±1/√inputs, the last layer of U a hundredth of
    /// that, the last layer of Q and the quadratic terms zero.
    #[must_use]
    pub fn init(config: SystemConfig, seed: u64) -> Self {
        let layout = Layout::of(&config);
        let mut params = vec![0.0; layout.len];
        let networks = [
            ("potential", Some(&layout.potential), POTENTIAL_OUTPUT_SCALE),
            ("force", layout.force.as_ref(), 0.0),
        ];
        for (name, network, head_scale) in networks {
            let Some(network) = network else { continue };
            init_uniform(network.linears(), &mut params, &mut stream(seed, name, 0));
            params[network.head.range()].iter_mut().for_each(|value| *value *= head_scale);
        }
        Self { config, params }
    }

    /// The named arrays of the parameter vector, in order, without gaps.
    #[must_use]
    pub fn layout(&self) -> Vec<ParamRange> {
        self.config.layout()
    }

    /// Whether networks have a part in U or Q: without one, all that counts are the constants of a linear
    /// law, for which the system has a place, and the last layers of its networks are zero.
    #[must_use]
    pub fn has_networks(&self) -> bool {
        let SystemConfig { potential, force, hidden_layers, .. } = self.config;
        let has_constants = potential == PotentialKind::QuadraticMlp && force != ForceKind::Mlp;
        let last = ["potential", "force"].map(|network| format!("{network}.{hidden_layers}.weight"));
        let entries = self.layout().into_iter().filter(|entry| last.contains(&entry.name));
        let are_silent = entries.into_iter().all(|entry| self.params[entry.range].iter().all(|&w| w == 0.0));
        !(has_constants && are_silent)
    }
}

fn network_entries(network: &str, layout: &MlpLayout) -> Vec<ParamRange> {
    let layers = layout.linears().enumerate();
    layers.flat_map(|(index, layer)| layer.params(&format!("{network}.{index}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_covers_every_parameter_once_and_has_the_papers_sizes() {
        for potential in [PotentialKind::Mlp, PotentialKind::QuadraticMlp] {
            for force in [ForceKind::None, ForceKind::Mlp, ForceKind::Structured] {
                let system =
                    System::init(SystemConfig { potential, force, hidden: 16, ..SystemConfig::paper() }, 1);
                let mut at = 0;
                for entry in system.layout() {
                    assert_eq!(entry.range.start, at, "{}", entry.name);
                    assert_eq!(entry.range.len(), entry.shape.iter().product::<usize>(), "{}", entry.name);
                    at = entry.range.end;
                }
                assert_eq!(at, system.params.len());
            }
        }
        assert_eq!(SystemConfig::paper().parameters(), 33_665 + 34_307);
    }

    #[test]
    fn the_seed_decides_the_start_and_the_force_starts_at_zero() {
        let config = SystemConfig { hidden: 8, ..SystemConfig::paper() };
        assert_eq!(System::init(config, 5), System::init(config, 5));
        assert_ne!(System::init(config, 5), System::init(config, 6));
        let system = System::init(config, 5);
        let last = system.layout().into_iter().find(|e| e.name == "force.3.weight").unwrap();
        assert!(system.params[last.range].iter().all(|&w| w == 0.0));
    }
}
