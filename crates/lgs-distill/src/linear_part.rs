//! The linear part of a system's law, read back from its parameters in the fewest unknowns that hold it, to
//! be changed and written again.

use crate::dense::{M3, V3};
use crate::law::{Law, Stiffness, Terms};
use crate::law_system::{are_silent, law_of_system, set_law};
use lgs_dynamics::{ForceKind, PotentialKind, System};

/// What 32-bit parameters of a law of fewer terms may differ by, as a part of the largest.
const ROUNDING: f64 = 1e-4;
/// Rates below this part of the largest acceleration per speed are none.
const NO_RATE: f64 = 1e-4;

/// The constants of a law that a system has beside its networks, as a list of unknowns of order one.
#[derive(Clone, Debug)]
pub struct LinearPart {
    law: Law,
    terms: Terms,
    /// World units of each unknown.
    units: Vec<f64>,
}

impl LinearPart {
    /// That of a system; without unknowns where the system has only networks.
    #[must_use]
    pub fn of(system: &System) -> Self {
        let config = &system.config;
        let law = law_of_system(system);
        let n = config.normalisation;
        let [length, speed, acceleration] = [n.length, n.speed, n.acceleration].map(f64::from);
        let rate = acceleration / speed;
        let has_potential = config.potential == PotentialKind::QuadraticMlp;
        let has_force = config.force == ForceKind::Structured;
        let terms = Terms {
            gravity: has_potential && largest(&law.gravity) > ROUNDING * acceleration,
            stiffness: if has_potential {
                kind_of(&law.stiffness, acceleration / length)
            } else {
                Stiffness::None
            },
            damping: has_force && law.damping > NO_RATE * rate,
            gyration: has_force && largest(&law.gyration) > NO_RATE * rate,
        };
        let stiffness = if terms.stiffness == Stiffness::Axial {
            (acceleration / length).sqrt()
        } else {
            acceleration / length
        };
        let mut units = vec![acceleration; 3 * usize::from(terms.gravity)];
        units.resize(
            units.len() + Terms { gravity: false, damping: false, gyration: false, ..terms }.unknowns(),
            stiffness,
        );
        units.resize(terms.unknowns(), rate);
        Self { law, terms, units }
    }

    /// Whether a system has nothing else: its networks give nothing.
    #[must_use]
    pub fn is_all_of(system: &System) -> bool {
        let config = &system.config;
        let has_place = config.potential == PotentialKind::QuadraticMlp && config.force != ForceKind::Mlp;
        has_place && are_silent(system)
    }

    /// Number of unknowns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.units.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// Writes the law with changed unknowns into a system like the one it was read from. Changes are in units
    /// of the system's normalisation; no damping becomes negative.
    ///
    /// # Panics
    /// If `change` has not [`Self::len`] values.
    pub fn write_changed(&self, change: &[f64], system: &mut System) {
        assert_eq!(change.len(), self.len(), "changes of the law");
        if self.is_empty() {
            return;
        }
        let unknowns: Vec<f64> = self
            .law
            .unknowns(&self.terms)
            .iter()
            .zip(change)
            .zip(&self.units)
            .map(|((p, c), unit)| p + c * unit)
            .collect();
        let mut law = Law::with_unknowns(self.law.center, &self.terms, &unknowns);
        law.damping = law.damping.max(0.0);
        set_law(system, &law);
    }
}

/// The least general form that a stiffness has; `scale` is one that shows.
fn kind_of(stiffness: &M3, scale: f64) -> Stiffness {
    let norm = largest(stiffness.as_flattened());
    if norm <= ROUNDING * scale {
        return Stiffness::None;
    }
    let fits = |kind| {
        let terms = Terms { gravity: false, stiffness: kind, damping: false, gyration: false };
        let law = Law { stiffness: *stiffness, ..Law::free(V3::default()) };
        let again = Law::with_unknowns(law.center, &terms, &law.unknowns(&terms)).stiffness;
        let pairs = again.as_flattened().iter().zip(stiffness.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) <= ROUNDING * norm
    };
    [Stiffness::Isotropic, Stiffness::Axial].into_iter().find(|&kind| fits(kind)).unwrap_or(Stiffness::Full)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::wide;
    use crate::law_system::system_of_law;
    use lgs_dynamics::{Normalisation, SystemConfig};

    fn system(law: &Law) -> System {
        let normalisation =
            Normalisation { center: [0.5, -0.25, 1.0], length: 0.7, speed: 1.3, acceleration: 2.5 };
        let (potential, force) = (PotentialKind::QuadraticMlp, ForceKind::Structured);
        system_of_law(SystemConfig { potential, force, hidden: 8, hidden_layers: 2, normalisation }, law, 1)
    }

    fn law(stiffness: M3) -> Law {
        Law { stiffness, ..Law::free(wide([0.5, -0.25, 1.0])) }
    }

    #[test]
    fn a_law_is_read_in_its_own_terms() {
        let axial =
            [[-1.25, 0.5, 0.25], [0.5, -0.5, 0.5], [0.25, 0.5, -1.25]].map(|row: V3| row.map(|s| 1.7 * s));
        let full = [[-1.25, 0.5, 0.25], [0.5, -0.6, 0.5], [0.25, 0.5, -1.25]];
        let kinds = [
            ([[0.0; 3]; 3], Stiffness::None),
            ([[-2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, -2.0]], Stiffness::Isotropic),
            ([[-3.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.0, 0.0, 0.0]], Stiffness::Axial),
            (axial, Stiffness::Axial),
            (full, Stiffness::Full),
        ];
        for (stiffness, kind) in kinds {
            let part = LinearPart::of(&system(&law(stiffness)));
            assert_eq!(
                part.terms,
                Terms { gravity: false, stiffness: kind, damping: false, gyration: false }
            );
            assert_eq!(part.len(), part.terms.unknowns());
        }
        let all =
            Law { gravity: [0.1, 0.0, -1.0], damping: 0.3, gyration: [0.0, 2.0, 0.1], ..law([[0.0; 3]; 3]) };
        assert_eq!(LinearPart::of(&system(&all)).len(), 7);
        assert!(LinearPart::is_all_of(&system(&all)));
        assert!(!LinearPart::is_all_of(&System::init(system(&all).config, 0)), "a network's last layer");
    }

    #[test]
    fn a_changed_law_is_written_in_world_units() {
        let mut changed = system(&Law { gravity: [0.1, 0.0, -1.0], damping: 0.3, ..law([[0.0; 3]; 3]) });
        let part = LinearPart::of(&changed);
        part.write_changed(&[0.0, 0.0, 0.1, -1.0], &mut changed);
        let read = law_of_system(&changed);
        assert!((read.gravity[2] + 0.75).abs() < 1e-6 && (read.gravity[0] - 0.1).abs() < 1e-6, "{read:?}");
        assert!(read.damping < 1e-3, "never negative: {}", read.damping);
    }
}
