//! Steps of Adam down clipped gradients, as both trainings of the networks take them.

use lgs_core::optim::{Adam, cosine_decay};

/// Added to the root of Adam's second moment (its authors' value).
const EPSILON: f32 = 1e-8;

/// A step that is done.
pub(crate) struct Tick {
    /// Index of the step.
    pub(crate) step: usize,
    /// Loss before the step.
    pub(crate) loss: f32,
}

/// Descent of a vector by Adam, whose learning rate falls along a cosine.
pub(crate) struct Descent {
    adam: Adam,
    learning_rate: f32,
    steps: usize,
}

impl Descent {
    /// A descent of `len` values from a first learning rate, in `steps` steps.
    pub(crate) fn new(len: usize, learning_rate: f32, steps: usize) -> Self {
        Self { adam: Adam::new(len, EPSILON), learning_rate, steps }
    }

    /// Step number `step` down a gradient, which is shortened to length 1 if it is longer.
    pub(crate) fn step(&mut self, step: usize, values: &mut [f32], mut gradient: Vec<f32>) {
        let length = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        if length > 1.0 {
            gradient.iter_mut().for_each(|g| *g /= length);
        }
        let rate = f64::from(self.learning_rate) * cosine_decay(step, self.steps);
        self.adam.step(values, &gradient, rate as f32);
    }
}
