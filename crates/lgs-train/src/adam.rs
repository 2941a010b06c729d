//! A parameter tensor with its Adam moments; a matrix has a row per Gaussian, which densification can copy,
//! drop and append.
//!
//! Values live outside autodiff: each iteration takes a tracked leaf and gives back its gradient.

use burn::optim::{AdamConfig, AdamState, AdaptiveMomentumState, Optimizer};
use burn::tensor::{Device, Shape, Tensor, TensorData};
use lgs_model::{TensorFile, TensorFileError};

/// Added to the root of the second moment (§2.6): so small that steps do not depend on the loss's scale.
const EPSILON: f32 = 1e-15;

/// The values of a tensor, row by row.
///
/// # Panics
/// If the device fails to deliver 32-bit floats (a bug).
#[must_use]
pub fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f32> {
    tensor.to_data().try_to_vec::<f32>().unwrap_or_else(|e| panic!("a tensor of 32-bit floats: {e:?}"))
}

/// A parameter tensor and what Adam (β 0.9 and 0.999, §2.6) remembers of it.
#[derive(Clone)]
pub struct AdamGroup<const D: usize> {
    value: Tensor<D>,
    state: Option<AdamState<D>>,
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values, shape), device)
}

impl<const D: usize> AdamGroup<D> {
    /// Fresh values without moments, on a device without autodiff.
    #[must_use]
    pub fn new(values: Vec<f32>, shape: [usize; D], device: &Device) -> Self {
        Self { value: tensor(values, shape, device), state: None }
    }

    /// A tracked leaf with the current values.
    #[must_use]
    pub fn leaf(&self) -> Tensor<D> {
        self.value.clone().autodiff().require_grad()
    }

    /// The current values, untracked.
    #[must_use]
    pub fn value(&self) -> Tensor<D> {
        self.value.clone()
    }

    /// Where the values lie.
    #[must_use]
    pub fn device(&self) -> Device {
        self.value.device()
    }

    /// The current values, row by row.
    #[must_use]
    pub fn values(&self) -> Vec<f32> {
        values(&self.value)
    }

    /// One step of Adam; nothing happens without a gradient.
    pub fn step(&mut self, learning_rate: f64, gradient: Option<Tensor<D>>) {
        let Some(gradient) = gradient else { return };
        let _span = tracing::trace_span!("Adam").entered();
        let adam = AdamConfig::new().with_epsilon(EPSILON).build();
        (self.value, self.state) = adam.step(learning_rate, self.value.clone(), gradient, self.state.take());
    }

    /// Replaces the values and forgets the moments, keeping the count of steps.
    ///
    /// # Panics
    /// If the number of values changes (a bug).
    pub fn replace(&mut self, values: Vec<f32>) {
        self.value = tensor(values, self.value.dims(), &self.value.device());
        if let Some(state) = self.state.take() {
            let zeros = self.value.zeros_like();
            self.state =
                Some(AdamState::new(AdaptiveMomentumState::new(state.momentum.time, zeros.clone(), zeros)));
        }
    }

    /// Adds values, moments and count of steps to a file.
    pub fn insert_into(&self, file: &mut TensorFile, name: &str) {
        let shape = self.value.dims();
        file.insert(name, &shape, &self.values());
        if let Some(state) = &self.state {
            file.insert(format!("{name}.moment_1"), &shape, &values(&state.momentum.moment_1));
            file.insert(format!("{name}.moment_2"), &shape, &values(&state.momentum.moment_2));
        }
        let time = self.state.as_ref().map_or(0, |s| s.momentum.time);
        file.set_metadata(&format!("{name}.time"), time.to_string());
    }

    /// Reads what [`Self::insert_into`] wrote; an extent of `None` may be any.
    ///
    /// # Errors
    /// If something is absent, not finite or of another shape.
    pub fn read_from(
        file: &TensorFile,
        name: &str,
        shape: [Option<usize>; D],
        device: &Device,
    ) -> Result<Self, TensorFileError> {
        let (shape, value) = read(file, name, shape)?;
        let mut group = Self::new(value, shape, device);
        let time: usize = file.metadata_json(&format!("{name}.time"))?;
        if time > 0 {
            let (_, first) = read(file, &format!("{name}.moment_1"), shape.map(Some))?;
            let (_, second) = read(file, &format!("{name}.moment_2"), shape.map(Some))?;
            let momentum =
                AdaptiveMomentumState::new(time, tensor(first, shape, device), tensor(second, shape, device));
            group.state = Some(AdamState::new(momentum));
        }
        Ok(group)
    }
}

fn read<const D: usize>(
    file: &TensorFile,
    name: &str,
    wanted: [Option<usize>; D],
) -> Result<([usize; D], Vec<f32>), TensorFileError> {
    let (shape, values) = file.values(name)?;
    match <[usize; D]>::try_from(shape) {
        Ok(found) if wanted.iter().zip(found).all(|(w, f)| w.is_none_or(|w| w == f)) => {
            Ok((found, values.to_vec()))
        }
        _ => {
            let wanted: Vec<String> =
                wanted.iter().map(|w| w.map_or("n".to_owned(), |w| w.to_string())).collect();
            Err(file.field(
                name,
                &format!("shape [{}]", wanted.join(", ")),
                format!("{:?}", Shape::from(shape.to_vec())),
            ))
        }
    }
}

impl AdamGroup<2> {
    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.value.dims()[0]
    }

    /// Values per row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.value.dims()[1]
    }

    /// Keeps some rows and appends others, which start without moments.
    pub fn reselect(&mut self, keep: &[usize], appended: &[f32]) {
        let [_, width] = self.value.dims();
        let (device, added) = (self.value.device(), appended.len() / width);
        let choose = |from: &Tensor<2>, appended: &mut dyn Iterator<Item = f32>| {
            let rows = values(from);
            let kept = keep.iter().flat_map(|&i| &rows[i * width..(i + 1) * width]).copied();
            tensor(kept.chain(appended).collect(), [keep.len() + added, width], &device)
        };
        self.value = choose(&self.value, &mut appended.iter().copied());
        if let Some(state) = self.state.take() {
            let momentum = state.momentum;
            let zeros = || std::iter::repeat_n(0.0, appended.len());
            let (first, second) =
                (choose(&momentum.moment_1, &mut zeros()), choose(&momentum.moment_2, &mut zeros()));
            self.state = Some(AdamState::new(AdaptiveMomentumState::new(momentum.time, first, second)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_matches_the_formula() {
        let device = Device::flex();
        let mut group = AdamGroup::new(vec![1.0, -2.0], [2], &device);
        let (mut m, mut v, mut x) = ([0.0_f64; 2], [0.0_f64; 2], [1.0_f64, -2.0]);
        for step in 1..=5_i32 {
            let gradient = [0.1 * f64::from(step), -3e-7];
            group.step(
                1e-2,
                Some(Tensor::from_data(TensorData::from([gradient[0] as f32, gradient[1] as f32]), &device)),
            );
            for i in 0..2 {
                m[i] = 0.9 * m[i] + 0.1 * gradient[i];
                v[i] = 0.999 * v[i] + 0.001 * gradient[i] * gradient[i];
                x[i] -= 1e-2 * (m[i] / (1.0 - 0.9_f64.powi(step)))
                    / ((v[i] / (1.0 - 0.999_f64.powi(step))).sqrt() + 1e-15);
            }
        }
        for (found, expected) in group.values().iter().zip(x) {
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn surgery_moves_moments_with_their_rows_and_files_keep_them() {
        let device = Device::flex();
        let mut group = AdamGroup::new(vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0], [3, 2], &device);
        let gradient = Tensor::from_data(TensorData::from([[1.0_f32, 2.0], [3.0, 4.0], [5.0, 6.0]]), &device);
        group.step(0.0, Some(gradient));
        group.reselect(&[2, 0], &[9.0, 9.0]);
        assert_eq!(group.values(), [2.0, 2.0, 0.0, 0.0, 9.0, 9.0]);
        let momentum = |g: &AdamGroup<2>| values(&g.state.as_ref().expect("state").momentum.moment_1);
        let expected = [0.5, 0.6, 0.1, 0.2, 0.0, 0.0];
        assert!(momentum(&group).iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6));
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("group");
        let mut file = TensorFile::new("test/1");
        group.insert_into(&mut file, "means");
        file.save(&path).expect("save");
        let file = TensorFile::load(&path, "test/1").expect("load");
        let back = AdamGroup::read_from(&file, "means", [None, Some(2)], &device).expect("read");
        assert_eq!(back.values(), group.values());
        assert_eq!(momentum(&back), momentum(&group));
        let width = AdamGroup::<2>::read_from(&file, "means", [None, Some(3)], &device)
            .err()
            .expect("width")
            .to_string();
        assert!(width.contains("means") && width.contains("[n, 3]"), "{width}");
        group.replace(vec![0.5; 6]);
        assert_eq!(momentum(&group), [0.0; 6]);
    }
}
