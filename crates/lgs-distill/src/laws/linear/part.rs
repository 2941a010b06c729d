//! The linear part of a system's law, read back from its parameters in the fewest unknowns that hold it, to
//! be changed and written again.

use super::law::Law;
use super::system::{law_of_system, set_law};
use super::terms::Terms;
use crate::thresholds::PARAMETER_ROUNDING;
use lgs_dynamics::System;

/// The constants of a law that a system has beside its networks, as a list of unknowns of order one.
#[derive(Clone, Debug)]
pub struct LinearPart {
    law: Law,
    terms: Terms,
    /// World units of each unknown.
    units: Vec<f64>,
}

impl LinearPart {
    /// The linear part of a system; without unknowns where the system has only networks.
    #[must_use]
    pub fn of(system: &System) -> Self {
        let scales = &system.config.normalisation;
        // A kind of system that has no place for a term reads as a law without it.
        let law = law_of_system(system);
        let terms = Terms::of_law(&law, scales, PARAMETER_ROUNDING);
        Self { law, terms, units: terms.units(scales) }
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
        let unknowns = self.terms.unknowns_of(&self.law);
        let changed = unknowns.iter().zip(change).zip(&self.units).map(|((p, c), unit)| p + c * unit);
        let law = self.terms.law(self.law.center, &changed.collect::<Vec<f64>>());
        set_law(system, &law.made_passive());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::linear::system::system_of_law;
    use glam::DVec3;
    use lgs_dynamics::{ForceKind, PotentialKind};
    use lgs_dynamics::{Normalisation, SystemConfig};

    fn system(law: &Law) -> System {
        let normalisation =
            Normalisation { center: [0.5, -0.25, 1.0], length: 0.7, speed: 1.3, acceleration: 2.5 };
        let (potential, force) = (PotentialKind::QuadraticMlp, ForceKind::Structured);
        system_of_law(SystemConfig { potential, force, hidden: 8, hidden_layers: 2, normalisation }, law, 1)
    }

    fn law() -> Law {
        let gravity = DVec3::new(0.1, 0.0, -1.0);
        Law { gravity, damping: 0.3, ..Law::free(DVec3::new(0.5, -0.25, 1.0)) }
    }

    #[test]
    fn a_law_is_read_in_its_own_terms() {
        assert!(LinearPart::of(&system(&Law::free(law().center))).is_empty());
        let all = Law { gyration: DVec3::new(0.0, 2.0, 0.1), ..law() };
        let part = LinearPart::of(&system(&all));
        assert_eq!(part.terms, Terms { gravity: true, damping: true, gyration: true, ..Terms::NONE });
        assert_eq!(part.len(), 7);
        assert!(!system(&all).has_networks());
        assert!(System::init(system(&all).config, 0).has_networks(), "a network's last layer");
    }

    #[test]
    fn a_changed_law_is_written_in_world_units() {
        let mut changed = system(&law());
        let part = LinearPart::of(&changed);
        part.write_changed(&[0.0, 0.0, 0.1, -1.0], &mut changed);
        let read = law_of_system(&changed);
        assert!((read.gravity.z + 0.75).abs() < 1e-6 && (read.gravity.x - 0.1).abs() < 1e-6, "{read:?}");
        assert!(read.damping < 1e-3, "never negative: {}", read.damping);
    }
}
