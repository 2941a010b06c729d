//! Systems with laws in closed form, for tests.

use crate::system::{ForceKind, Normalisation, PotentialKind, System, SystemConfig};

/// A system with `U = g·q + ½ qᵀ S q` (S as xx, yy, zz, xy, xz, yz), and constant structured damping and
/// spin.
#[must_use]
pub fn linear_law(linear: [f32; 3], matrix: [f32; 6], damping: f32, spin: [f32; 3]) -> System {
    let force = if damping == 0.0 && spin == [0.0; 3] { ForceKind::None } else { ForceKind::Structured };
    let normalisation = Normalisation::identity();
    let config = SystemConfig {
        potential: PotentialKind::QuadraticMlp,
        force,
        hidden: 4,
        hidden_layers: 1,
        normalisation,
    };
    let mut system = System::init(config, 1);
    system.params.fill(0.0);
    for entry in system.layout() {
        let own = &mut system.params[entry.range];
        match entry.name.as_str() {
            "potential.linear" => own.copy_from_slice(&linear),
            "potential.quadratic" => own.copy_from_slice(&matrix),
            // softplus(raw − 6) = damping
            "force.1.bias" => {
                own.copy_from_slice(&[6.0 + damping.max(1e-30).exp_m1().ln(), spin[0], spin[1], spin[2]])
            }
            _ => {}
        }
    }
    system
}

/// A system with `U = g·q + ½ qᵀ S q` alone.
#[must_use]
pub fn quadratic(linear: [f32; 3], matrix: [f32; 6]) -> System {
    linear_law(linear, matrix, 0.0, [0.0; 3])
}
