//! Gradient descent by Adam on slices, and the decay of its learning rate.

/// Log-linear interpolation between the ends of a schedule; `part` of it is done, in [0, 1].
#[must_use]
pub fn log_linear(part: f64, [start, end]: [f64; 2]) -> f64 {
    let u = part.clamp(0.0, 1.0);
    ((1.0 - u) * start.ln() + u * end.ln()).exp()
}

/// Decay of the first moment.
const BETA1: f32 = 0.9;
/// Decay of the second moment.
const BETA2: f32 = 0.999;

/// Moments of a vector's gradients that Adam keeps (Kingma and Ba 2015, β 0.9 and 0.999).
#[derive(Clone, Debug)]
pub struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    step: i32,
    epsilon: f32,
}

impl Adam {
    /// No steps yet of a vector of `len` values; `epsilon` is added to the root of the second moment.
    #[must_use]
    pub fn new(len: usize, epsilon: f32) -> Self {
        Self { first: vec![0.0; len], second: vec![0.0; len], step: 0, epsilon }
    }

    /// Takes one step of the parameters down a gradient.
    pub fn step(&mut self, params: &mut [f32], gradient: &[f32], learning_rate: f32) {
        self.step += 1;
        let (c1, c2) = (1.0 - BETA1.powi(self.step), 1.0 - BETA2.powi(self.step));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, &g), (m, s)) in params.iter_mut().zip(gradient).zip(moments) {
            *m += (1.0 - BETA1) * (g - *m);
            *s += (1.0 - BETA2) * (g * g - *s);
            *p -= learning_rate * (*m / c1) / ((*s / c2).sqrt() + self.epsilon);
        }
    }
}

/// Cosine decay of a learning rate: its factor falls from 1 at step 0 to 0.01 at step `steps`.
#[must_use]
pub fn cosine_decay(step: usize, steps: usize) -> f64 {
    const LAST: f64 = 0.01;
    let progress = (step as f64 / steps.max(1) as f64).min(1.0);
    LAST + (1.0 - LAST) * 0.5 * (1.0 + (std::f64::consts::PI * progress).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decay_runs_from_one_to_a_hundredth() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(cosine_decay(0, 10), 1.0) && near(cosine_decay(5, 10), 0.505));
        assert!(near(cosine_decay(10, 10), 0.01) && near(cosine_decay(11, 10), 0.01));
    }

    #[test]
    fn first_steps_are_as_long_as_the_learning_rate() {
        let (mut adam, mut params) = (Adam::new(2, 1e-15), [1.0, -2.0]);
        adam.step(&mut params, &[3.0, -1e-6], 0.1);
        assert!((params[0] - 0.9).abs() < 1e-6 && (params[1] + 1.9).abs() < 1e-6, "{params:?}");
    }
}
