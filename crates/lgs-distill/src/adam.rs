//! Adam on a flat vector, with the learning rate of each step given.

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moments of the gradient.
pub(crate) struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    step: i32,
}

impl Adam {
    /// For vectors of a length.
    pub(crate) fn new(len: usize) -> Self {
        Self { first: vec![0.0; len], second: vec![0.0; len], step: 0 }
    }

    /// One step down a gradient.
    pub(crate) fn step(&mut self, params: &mut [f32], gradient: &[f32], learning_rate: f32) {
        self.step += 1;
        let (c1, c2) = (1.0 - BETA1.powi(self.step), 1.0 - BETA2.powi(self.step));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, &g), (m, s)) in params.iter_mut().zip(gradient).zip(moments) {
            *m += (1.0 - BETA1) * (g - *m);
            *s += (1.0 - BETA2) * (g * g - *s);
            *p -= learning_rate * (*m / c1) / ((*s / c2).sqrt() + EPSILON);
        }
    }
}

/// A rate that falls from `first` to a hundredth of it along a cosine.
pub(crate) fn cosine(first: f32, step: usize, steps: usize) -> f32 {
    let part = step as f32 / steps.max(1) as f32;
    first * (0.01 + 0.99 * 0.5 * (1.0 + (std::f32::consts::PI * part).cos()))
}

/// Scales a gradient so that its length is at most 1.
pub(crate) fn clip(gradient: &mut [f32]) {
    let length = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
    if length > 1.0 {
        gradient.iter_mut().for_each(|g| *g /= length);
    }
}
