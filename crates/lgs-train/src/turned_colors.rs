//! Harmonics of bodies that have turned, on the device where training runs.

use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::TurnedHarmonics;

/// How the harmonics of some bodies have turned.
#[derive(Clone)]
pub(crate) struct TurnedColors {
    /// Rows of each body, ascending, and the matrix `[K − 1, K − 1]` that takes a row of its old coefficients
    /// above the constant one to the new ones.
    bodies: Vec<(Range<usize>, Tensor<2>)>,
}

impl TurnedColors {
    /// Those of bodies by their rows, ascending.
    pub(crate) fn new(
        bodies: impl Iterator<Item = (Range<usize>, TurnedHarmonics)>,
        device: &Device,
    ) -> Self {
        let on_device = |(rows, turned): (Range<usize>, TurnedHarmonics)| {
            let (size, matrix) = turned.matrix();
            let matrix = Tensor::from_data(TensorData::new(matrix.to_vec(), [size, size]), device);
            (rows, matrix.transpose())
        };
        Self { bodies: bodies.map(on_device).collect() }
    }

    /// The same as constants of a graph.
    pub(crate) fn autodiff(self) -> Self {
        Self { bodies: self.bodies.into_iter().map(|(rows, matrix)| (rows, matrix.autodiff())).collect() }
    }

    /// Coefficients `[n, K, 3]` as they were, turned.
    pub(crate) fn of(&self, sh: Tensor<3>) -> Tensor<3> {
        let [n, _, _] = sh.dims();
        let between = |from: usize, to: usize| (to > from).then(|| sh.clone().narrow(0, from, to - from));
        let (mut parts, mut end) = (Vec::new(), 0);
        for (rows, matrix) in self.bodies.iter().filter(|(rows, _)| !rows.is_empty()) {
            parts.extend(between(end, rows.start));
            parts.extend(between(rows.start, rows.end).map(|own| turned(own, matrix)));
            end = rows.end;
        }
        parts.extend(between(end, n));
        if end == 0 { sh } else { Tensor::cat(parts, 0) }
    }
}

/// Coefficients `[m, K, 3]` of a body, those above the constant one turned.
fn turned(sh: Tensor<3>, matrix: &Tensor<2>) -> Tensor<3> {
    let [m, coefficients, _] = sh.dims();
    let above = coefficients - 1;
    let by_channel = sh.clone().narrow(1, 1, above).swap_dims(1, 2).reshape([3 * m, above]);
    let turned = by_channel.matmul(matrix.clone()).reshape([m, 3, above]).swap_dims(1, 2);
    Tensor::cat(vec![sh.narrow(1, 0, 1), turned], 1)
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
        for degree in 1..=3 {
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
