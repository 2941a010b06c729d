//! A parameter tensor with its Adam moments; a matrix has a row per Gaussian, which densification can copy,
//! drop and append.
//!
//! Values live outside autodiff: each iteration takes a tracked leaf and gives back its gradient.

#[cfg(feature = "gpu")]
mod cube;
mod steps;

pub(crate) use steps::AdamSteps;

use crate::thresholds::ADAM_EPSILON;
use burn::optim::{AdamConfig, AdamState, AdaptiveMomentumState, Optimizer};
use burn::tensor::{Device, Int, Shape, Tensor, TensorData};
use lgs_model::{TensorFile, TensorFileError};

/// The values of a tensor, row by row.
///
/// # Panics
/// If the device fails to deliver 32-bit floats (a bug).
pub(crate) fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f32> {
    tensor.to_data().try_to_vec::<f32>().unwrap_or_else(|e| panic!("a tensor of 32-bit floats: {e:?}"))
}

/// A parameter tensor and what Adam (β 0.9 and 0.999, method §3.4) remembers of it.
#[derive(Clone)]
pub(crate) struct AdamGroup<const D: usize> {
    value: Tensor<D>,
    state: Option<AdamState<D>>,
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values, shape), device)
}

impl<const D: usize> AdamGroup<D> {
    /// Fresh values without moments, on a device without autodiff.
    pub(crate) fn new(values: Vec<f32>, shape: [usize; D], device: &Device) -> Self {
        Self { value: tensor(values, shape, device), state: None }
    }

    /// A tracked leaf with the current values.
    pub(crate) fn leaf(&self) -> Tensor<D> {
        self.value.clone().autodiff().require_grad()
    }

    /// The current values, untracked.
    pub(crate) fn value(&self) -> Tensor<D> {
        self.value.clone()
    }

    /// Where the values lie.
    pub(crate) fn device(&self) -> Device {
        self.value.device()
    }

    /// The current values, row by row.
    pub(crate) fn values(&self) -> Vec<f32> {
        values(&self.value)
    }

    /// One step of Adam of this group alone; nothing happens without a gradient.
    pub(crate) fn step(&mut self, learning_rate: f64, gradient: Option<Tensor<D>>) {
        let mut steps = AdamSteps::default();
        steps.add(self, learning_rate, gradient);
        steps.take();
    }

    fn step_on_processor(&mut self, learning_rate: f64, gradient: Tensor<D>) {
        let adam = AdamConfig::new().with_epsilon(ADAM_EPSILON).build();
        (self.value, self.state) = adam.step(learning_rate, self.value.clone(), gradient, self.state.take());
    }

    /// Replaces the values and forgets the moments, keeping the count of steps.
    ///
    /// # Panics
    /// If the shape changes (a bug).
    pub(crate) fn replace(&mut self, value: Tensor<D>) {
        assert_eq!(value.dims(), self.value.dims(), "shapes of a group's values");
        self.value = value;
        if let Some(state) = self.state.take() {
            let zeros = self.value.zeros_like();
            self.state = Some(with_moments(state.momentum.time, zeros.clone(), zeros));
        }
    }

    /// Adds to the values; the moments stay.
    pub(crate) fn shift(&mut self, by: Tensor<D>) {
        self.value = self.value.clone() + by;
    }

    /// Adds values, moments and count of steps to a file.
    pub(crate) fn insert_into(&self, file: &mut TensorFile, name: &str) {
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
    pub(crate) fn read_from(
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
            group.state =
                Some(with_moments(time, tensor(first, shape, device), tensor(second, shape, device)));
        }
        Ok(group)
    }

    /// Reads what [`Self::insert_into`] wrote, if it has the shape of these values.
    ///
    /// # Errors
    /// If something is absent, not finite or of another shape.
    pub(crate) fn restore(&mut self, file: &TensorFile, name: &str) -> Result<(), TensorFileError> {
        *self = Self::read_from(file, name, self.value.dims().map(Some), &self.device())?;
        Ok(())
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

impl AdamGroup<1> {
    /// Keeps the values of given numbers, and appends others, which start without moments.
    pub(crate) fn remake(&mut self, kept: &[usize], added: Vec<f32>) {
        let device = self.device();
        let kept: Vec<i32> = kept.iter().map(|&i| i as i32).collect();
        let kept = Tensor::<1, Int>::from_ints(kept.as_slice(), &device);
        let count = added.len();
        let followed_by = |from: Tensor<1>, last: Vec<f32>| {
            let parts = vec![from.select(0, kept.clone()), tensor(last, [count], &device)];
            if count > 0 { Tensor::cat(parts, 0) } else { parts[0].clone() }
        };
        self.value = followed_by(self.value.clone(), added);
        if let Some(state) = self.state.take() {
            let AdaptiveMomentumState { time, moment_1, moment_2, .. } = state.momentum;
            let [first, second] = [moment_1, moment_2].map(|moment| followed_by(moment, vec![0.0; count]));
            self.state = Some(with_moments(time, first, second));
        }
    }
}

impl AdamGroup<2> {
    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.value.dims()[0]
    }

    /// Selects rows; those from number `kept` on start without moments.
    pub(crate) fn reselect(&mut self, rows: &Tensor<1, Int>, kept: usize) {
        let n = rows.dims()[0];
        let select = |from: Tensor<2>| from.select(0, rows.clone());
        self.value = select(self.value.clone());
        if let Some(state) = self.state.take() {
            let has_moments: Vec<f32> = (0..n).map(|row| f32::from(u8::from(row < kept))).collect();
            let has_moments = tensor(has_moments, [n, 1], &self.value.device());
            let AdaptiveMomentumState { time, moment_1, moment_2, .. } = state.momentum;
            self.state = Some(with_moments(
                time,
                select(moment_1) * has_moments.clone(),
                select(moment_2) * has_moments,
            ));
        }
    }

    /// Overwrites the last rows; their moments stay.
    pub(crate) fn set_last(&mut self, last: Tensor<2>) {
        let ([n, width], [count, _]) = (self.value.dims(), last.dims());
        if count > 0 {
            self.value = self.value.clone().slice_assign([n - count..n, 0..width], last);
        }
    }
}

fn with_moments<const D: usize>(time: usize, first: Tensor<D>, second: Tensor<D>) -> AdamState<D> {
    AdamState::new(AdaptiveMomentumState::new(time, first, second))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceName;
    use lgs_core::optim::Adam;

    #[test]
    fn steps_are_those_of_adam_on_slices() {
        let device = DeviceName::Cpu.device();
        let mut group = AdamGroup::new(vec![1.0, -2.0], [2], &device);
        let (mut adam, mut expected) = (Adam::new(2, ADAM_EPSILON), [1.0, -2.0]);
        for step in 1..=5 {
            let gradient = [0.1 * step as f32, -3e-7];
            group.step(1e-2, Some(Tensor::from_data(TensorData::from(gradient), &device)));
            adam.step(&mut expected, &gradient, 1e-2);
        }
        for (found, expected) in group.values().iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn surgery_moves_moments_with_their_rows_and_files_keep_them() {
        let device = DeviceName::Cpu.device();
        let mut group = AdamGroup::new(vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0], [3, 2], &device);
        let gradient = Tensor::from_data(TensorData::from([[1.0_f32, 2.0], [3.0, 4.0], [5.0, 6.0]]), &device);
        group.step(0.0, Some(gradient));
        group.reselect(&Tensor::from_ints([2, 0, 1], &device), 2);
        group.set_last(Tensor::from_data(TensorData::from([[9.0_f32, 9.0]]), &device));
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
        group.replace(group.value().mul_scalar(0.5));
        assert_eq!(momentum(&group), [0.0; 6]);
    }
}
