//! A linear law as a [`System`]: its constants become the quadratic part of U and the biases of the
//! structured force.
//!
//! The last layers of both networks are zero, so that the system is the law exactly; their hidden layers are
//! ready to learn a remainder.

use super::law::Law;
use glam::DVec3;
use lgs_core::geometry::{symmetric, wide};
use lgs_dynamics::{DAMPING_SHIFT, ForceKind, PotentialKind, System, SystemConfig};
use std::ops::Range;

/// Raw damping of a law without any: softplus(−12) = 6e-6, a hundredth of a per cent over any window; not so
/// low that it cannot learn.
const NO_DAMPING: f64 = -6.0;

/// The system that is the law. A law's stiffness is taken about the normalisation's centre, which has to be
/// the law's.
///
/// Terms that the configuration's kinds cannot hold are left out: the quadratic part without
/// [`PotentialKind::QuadraticMlp`], damping and gyration without [`ForceKind::Structured`].
pub(crate) fn system_of_law(config: SystemConfig, law: &Law, seed: u64) -> System {
    let mut system = System::init(config, seed);
    let last = config.hidden_layers;
    if config.potential == PotentialKind::QuadraticMlp {
        set(&mut system, &format!("potential.{last}.weight"), |_| 0.0);
    }
    set_law(&mut system, law);
    system
}

/// Writes a law's constants over those that a system has beside its networks.
pub(crate) fn set_law(system: &mut System, law: &Law) {
    let (config, n) = (system.config, system.config.normalisation);
    let (length, speed, acceleration) = (f64::from(n.length), f64::from(n.speed), f64::from(n.acceleration));
    if config.potential == PotentialKind::QuadraticMlp {
        let s = &law.stiffness;
        let entries = [s.x_axis.x, s.y_axis.y, s.z_axis.z, s.y_axis.x, s.z_axis.x, s.z_axis.y];
        set(system, "potential.linear", |i| (-law.gravity[i] / acceleration) as f32);
        set(system, "potential.quadratic", |i| (-entries[i] * length / acceleration) as f32);
    }
    if config.force == ForceKind::Structured {
        let rate = acceleration / speed;
        let damping = law.damping / rate;
        // softplus⁻¹(x) = ln(eˣ − 1)
        let shift = f64::from(DAMPING_SHIFT);
        let raw = if damping > 1e-5 { shift + damping + (-(-damping).exp()).ln_1p() } else { NO_DAMPING };
        set(system, &force_bias(&config), |i| (if i == 0 { raw } else { law.gyration[i - 1] / rate }) as f32);
    }
}

/// The constants that a system has beside its networks; none where its kinds have no place for them.
pub(crate) fn law_of_system(system: &System) -> Law {
    let (config, n) = (system.config, system.config.normalisation);
    let (length, speed, acceleration) = (f64::from(n.length), f64::from(n.speed), f64::from(n.acceleration));
    let values = |name: &str| -> Vec<f64> {
        range_of(system, name)
            .map_or(Vec::new(), |range| system.params[range].iter().map(|&p| f64::from(p)).collect())
    };
    let mut law = Law::free(wide(n.center));
    if let [x, y, z] = values("potential.linear")[..] {
        law.gravity = -acceleration * DVec3::new(x, y, z);
    }
    if let entries @ [_, _, _, _, _, _] = &values("potential.quadratic")[..] {
        law.stiffness = -acceleration / length * symmetric(entries);
    }
    if config.force == ForceKind::Structured
        && let [raw, x, y, z] = values(&force_bias(&config))[..]
    {
        let rate = acceleration / speed;
        law.damping = rate * (raw - f64::from(DAMPING_SHIFT)).exp().ln_1p();
        law.gyration = rate * DVec3::new(x, y, z);
    }
    law
}

fn force_bias(config: &SystemConfig) -> String {
    format!("force.{}.bias", config.hidden_layers)
}

/// The range of a named array.
pub(crate) fn range_of(system: &System, name: &str) -> Option<Range<usize>> {
    system.layout().into_iter().find(|entry| entry.name == name).map(|entry| entry.range)
}

/// Sets every value of a named array.
fn set(system: &mut System, name: &str, value: impl Fn(usize) -> f32) {
    if let Some(range) = range_of(system, name) {
        system.params[range].iter_mut().enumerate().for_each(|(i, p)| *p = value(i));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::linear::law::example;
    use lgs_core::geometry::narrow;
    use lgs_dynamics::{Edit, Normalisation};

    #[test]
    fn the_system_accelerates_as_the_law_does() {
        let law = example();
        let config = SystemConfig {
            potential: PotentialKind::QuadraticMlp,
            force: ForceKind::Structured,
            hidden: 16,
            hidden_layers: 3,
            normalisation: Normalisation {
                center: narrow(law.center),
                length: 0.7,
                speed: 1.3,
                acceleration: 2.5,
            },
        };
        let (q, v) = ([0.3, 0.1, -0.2], [1.0, 0.5, -2.0]);
        let difference = |law: &Law| {
            let found = system_of_law(config, law, 1).accelerations(&[q], &[v], &Edit::default())[0];
            wide(found).distance(law.acceleration(wide(q), wide(v)))
        };
        assert!(difference(&law) < 1e-5);
        assert!(difference(&Law { damping: 0.0, ..law }) < 1e-4);
        let read = law_of_system(&system_of_law(config, &law, 1));
        assert!((read.damping - law.damping).abs() < 1e-5, "{read:?}");
        assert!(read.gravity.abs_diff_eq(law.gravity, 1e-5), "{read:?}");
        assert!(read.stiffness.abs_diff_eq(law.stiffness, 1e-5), "{read:?}");
        assert!(read.gyration.abs_diff_eq(law.gyration, 1e-5), "{read:?}");
    }
}
