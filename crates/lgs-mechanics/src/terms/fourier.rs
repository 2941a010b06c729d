//! Fourier terms in an angle: gravity on a pendulum is `Q = −s sin θ + c cos θ = −k sin(θ − θ₀)`, with
//! `U = −s cos θ − c sin θ`; a second harmonic describes two equal sides.

use super::kind::{At, Derivatives, Label, Role, TermKind};
use crate::parameter::{Parameter, Quantity, Space};

/// The kind `fourier`: the first harmonic.
pub(super) const FIRST: Fourier = Fourier { name: "fourier", harmonics: 1 };
/// The kind `fourier-two`: the first two harmonics.
pub(super) const SECOND: Fourier = Fourier { name: "fourier-two", harmonics: 2 };

/// Fourier terms.
#[derive(Debug)]
pub(super) struct Fourier {
    name: &'static str,
    harmonics: usize,
}

impl Fourier {
    /// Each harmonic's order with the place of its sine amplitude.
    fn orders(&self) -> impl Iterator<Item = (f64, usize)> {
        (0..self.harmonics).map(|index| ((index + 1) as f64, 2 * index))
    }
}

impl TermKind for Fourier {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.quantity == Quantity::Angle
    }

    fn parameters(&self, _space: Space) -> Vec<Parameter> {
        let pair = |n: usize| [format!("sine-{n}"), format!("cosine-{n}")];
        (1..=self.harmonics).flat_map(pair).map(|name| Parameter::linear(name, 0, -2)).collect()
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let part = |(n, at): (f64, usize)| -(p[at] * (n * y[0]).cos() + p[at + 1] * (n * y[0]).sin()) / n;
        self.orders().map(part).sum()
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let part = |(n, i): (f64, usize)| p[i + 1] * (n * at.y[0]).cos() - p[i] * (n * at.y[0]).sin();
        force[0] = self.orders().map(part).sum();
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        for (n, i) in self.orders() {
            let (sine, cosine) = (n * at.y[0]).sin_cos();
            out.y[(0, 0)] -= n * (p[i] * cosine + p[i + 1] * sine);
            out.p[(0, i)] = -sine;
            out.p[(0, i + 1)] = cosine;
        }
    }
}
