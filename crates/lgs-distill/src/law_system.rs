//! A linear law as a [`System`]: its constants become the quadratic part of U and the biases of the
//! structured force.
//!
//! The last layers of both networks are zero, so that the system is the law exactly; their hidden layers are
//! ready to learn a remainder.

use crate::dense::{V3, norm2, sub, wide};
use crate::law::Law;
use lgs_dynamics::{ForceKind, Normalisation, PotentialKind, System, SystemConfig};
use std::ops::Range;

/// Shift of the raw damping in a structured force, `d = (σ_a/σ_v) softplus(d̂ − 6)`.
const DAMPING_SHIFT: f64 = 6.0;
/// Raw damping of a law without any: softplus(−12) = 6e-6, a hundredth of a per cent over any window; not so
/// low that it cannot learn.
const NO_DAMPING: f64 = -6.0;

/// Scales of an object's motion (reference G5) from positions, velocities and accelerations at visited
/// states.
pub(crate) fn normalisation(
    positions: &[V3],
    velocities: &[V3],
    accelerations: &[V3],
    duration: f64,
) -> Normalisation {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in positions {
        for i in 0..3 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    let rms = |list: &[V3]| (list.iter().map(|&v| norm2(v)).sum::<f64>() / list.len().max(1) as f64).sqrt();
    let length = (0.5 * norm2(sub(high, low)).sqrt()).max(1e-6);
    let speed = rms(velocities).max(1e-3 * length / duration);
    let acceleration = rms(accelerations).max(1e-2 * speed / duration);
    let center = std::array::from_fn(|i| (0.5 * (low[i] + high[i])) as f32);
    Normalisation { center, length: length as f32, speed: speed as f32, acceleration: acceleration as f32 }
}

/// The system that is the law. A law's stiffness is taken about the normalisation's centre, which has to be
/// the law's.
///
/// What the configuration's kinds cannot hold is left out: the quadratic part without
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
        let entries = [s[0][0], s[1][1], s[2][2], s[0][1], s[0][2], s[1][2]];
        set(system, "potential.linear", |i| (-law.gravity[i] / acceleration) as f32);
        set(system, "potential.quadratic", |i| (-entries[i] * length / acceleration) as f32);
    }
    if config.force == ForceKind::Structured {
        let rate = acceleration / speed;
        let damping = law.damping / rate;
        // softplus⁻¹(x) = ln(eˣ − 1)
        let raw =
            if damping > 1e-5 { DAMPING_SHIFT + damping + (-(-damping).exp()).ln_1p() } else { NO_DAMPING };
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
        law.gravity = [x, y, z].map(|g| -g * acceleration);
    }
    if let [xx, yy, zz, xy, xz, yz] = values("potential.quadratic")[..] {
        law.stiffness =
            [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| row.map(|s| -s * acceleration / length));
    }
    if config.force == ForceKind::Structured
        && let [raw, gyration @ ..] = &values(&force_bias(&config))[..]
    {
        let rate = acceleration / speed;
        law.damping = rate * (raw - DAMPING_SHIFT).exp().ln_1p();
        gyration.iter().zip(&mut law.gyration).for_each(|(g, to)| *to = g * rate);
    }
    law
}

/// Whether the last layers of both networks are zero, so that only constants count.
pub(crate) fn are_silent(system: &System) -> bool {
    let last = system.config.hidden_layers;
    let weights = [format!("potential.{last}.weight"), format!("force.{last}.weight")];
    weights
        .iter()
        .filter_map(|name| range_of(system, name))
        .all(|range| system.params[range].iter().all(|&w| w == 0.0))
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
    use crate::dense::narrow;
    use lgs_dynamics::Edit;

    #[test]
    fn the_system_accelerates_as_the_law_does() {
        let law = Law {
            center: [0.5, -0.25, 1.0],
            gravity: [0.5, -1.0, -2.0],
            stiffness: [[-4.0, 0.5, 0.1], [0.5, -3.0, 0.2], [0.1, 0.2, 1.0]],
            damping: 0.7,
            gyration: [0.3, -0.8, 2.0],
        };
        let normalisation =
            Normalisation { center: narrow(law.center), length: 0.7, speed: 1.3, acceleration: 2.5 };
        let config = SystemConfig {
            potential: PotentialKind::QuadraticMlp,
            force: ForceKind::Structured,
            hidden: 16,
            hidden_layers: 3,
            normalisation,
        };
        let (q, v) = ([0.3, 0.1, -0.2], [1.0, 0.5, -2.0]);
        let found = system_of_law(config, &law, 1).accelerations(&[q], &[v], &Edit::default())[0];
        let expected = law.acceleration(wide(q), wide(v));
        assert!(norm2(sub(wide(found), expected)) < 1e-10, "{found:?} {expected:?}");
        let read = law_of_system(&system_of_law(config, &law, 1));
        for (read, law) in [
            (read.damping, law.damping),
            (read.gravity[2], law.gravity[2]),
            (read.stiffness[0][1], law.stiffness[0][1]),
        ] {
            assert!((read - law).abs() < 1e-5, "{read} {law}");
        }
        let free = Law { damping: 0.0, ..law };
        let found = system_of_law(config, &free, 1).accelerations(&[q], &[v], &Edit::default())[0];
        assert!(norm2(sub(wide(found), free.acceleration(wide(q), wide(v)))) < 1e-8);
    }
}
