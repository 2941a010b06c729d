//! Harmonics of bodies that have turned, on the device where training runs.

use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::TurnedHarmonics;

/// How the harmonics of some bodies have turned.
#[derive(Clone)]
pub(crate) struct TurnedColors {
    /// Rows of each body, ascending, and the matrix `[3 K, 3 K]` that takes a row of its old coefficients to
    /// the new ones.
    bodies: Vec<(Range<usize>, Tensor<2>)>,
}

impl TurnedColors {
    /// Those of bodies by their rows, ascending.
    pub(crate) fn new(
        bodies: impl Iterator<Item = (Range<usize>, TurnedHarmonics)>,
        device: &Device,
    ) -> Self {
        let on_device =
            |(rows, turned): (Range<usize>, TurnedHarmonics)| (rows, matrix_of_rows(&turned, device));
        let has_directions = |(_, turned): &(_, TurnedHarmonics)| turned.matrix().0 > 0;
        Self { bodies: bodies.filter(has_directions).map(on_device).collect() }
    }

    /// The same as constants of a graph.
    pub(crate) fn autodiff(self) -> Self {
        Self { bodies: self.bodies.into_iter().map(|(rows, matrix)| (rows, matrix.autodiff())).collect() }
    }

    /// Coefficients `[n, K, 3]` as they were, turned.
    pub(crate) fn of(&self, sh: Tensor<3>) -> Tensor<3> {
        let [n, coefficients, _] = sh.dims();
        let flat = sh.reshape([n, 3 * coefficients]);
        let between = |from: usize, to: usize| {
            let is_all = to - from == n;
            (to > from).then(|| if is_all { flat.clone() } else { flat.clone().narrow(0, from, to - from) })
        };
        let (mut parts, mut end) = (Vec::new(), 0);
        for (rows, matrix) in self.bodies.iter().filter(|(rows, _)| !rows.is_empty()) {
            parts.extend(between(end, rows.start));
            parts.extend(between(rows.start, rows.end).map(|own| own.matmul(matrix.clone())));
            end = rows.end;
        }
        parts.extend(between(end, n));
        let turned = if parts.len() < 2 { parts.pop().unwrap_or(flat) } else { Tensor::cat(parts, 0) };
        turned.reshape([n, coefficients, 3])
    }
}

/// The matrix `[3 K, 3 K]` by which a row of K coefficients of three channels each is multiplied from the
/// right; the constant one stays.
fn matrix_of_rows(turned: &TurnedHarmonics, device: &Device) -> Tensor<2> {
    let (above, matrix) = turned.matrix();
    let width = 3 * (above + 1);
    let mut entries = vec![0.0; width * width];
    (0..3).for_each(|channel| entries[channel * width + channel] = 1.0);
    for (at, &weight) in matrix.iter().enumerate() {
        let (new, old) = (3 * (at / above + 1), 3 * (at % above + 1));
        (0..3).for_each(|channel| entries[(old + channel) * width + new + channel] = weight);
    }
    Tensor::from_data(TensorData::new(entries, [width, width]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_tensors::CloudTensors;
    use lgs_core::GaussianCloud;

    #[test]
    fn harmonics_turn_on_a_device_as_on_the_host() {
        let device = Device::default();
        let turns = [(1..3, [0.5, 0.1, -0.8, 0.3]), (4..5, [0.9, -0.3, 0.1, 0.2])];
        for degree in 0..=3 {
            let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 6], 0.1, [0.4; 3], 0.5);
            cloud.sh_degree = degree;
            cloud.sh = (0..6 * cloud.sh_stride()).map(|i| ((i * 37) % 11) as f32 / 5.0 - 1.0).collect();
            let bodies = turns.clone().map(|(rows, turn)| (rows, TurnedHarmonics::new(turn, degree)));
            let before = CloudTensors::new(&cloud, &device);
            let sh = TurnedColors::new(bodies.into_iter(), &device).of(before.sh.clone());
            let found = CloudTensors { sh, ..before }.cloud(degree);
            turns.iter().for_each(|(rows, turn)| cloud.turn_harmonics(rows.clone(), *turn));
            let far = found.sh.iter().zip(&cloud.sh).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(far < 1e-5, "degree {degree}: {far}");
        }
    }
}
