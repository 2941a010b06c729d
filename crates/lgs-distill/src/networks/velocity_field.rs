//! A correction of starting velocities that is linear in the position: twelve unknowns for a whole object, so
//! that it cannot fit the noise of its particles.

use crate::motion::paths::Paths;
use lgs_core::geometry::narrow;
use lgs_core::linear;
use lgs_dynamics::{State, System};

/// Unknowns of a linear velocity field.
pub(crate) const UNKNOWNS: usize = 12;

/// A linear field of velocity corrections.
#[derive(Clone, Debug)]
pub(crate) struct VelocityField {
    /// Shift, then the linear map row by row, in units of the speed scale at distances of the length scale.
    pub(crate) values: [f32; UNKNOWNS],
}

impl VelocityField {
    /// No correction.
    pub(crate) const NONE: Self = Self { values: [0.0; UNKNOWNS] };

    /// The start of some particles of the paths, velocities corrected.
    pub(crate) fn start(&self, system: &System, paths: &Paths, particles: &[usize]) -> State {
        let q: Vec<[f32; 3]> = particles.iter().map(|&j| narrow(paths.position(j, 0))).collect();
        let velocities = particles.iter().map(|&j| narrow(paths.velocity(j, 0)));
        let v = q.iter().zip(velocities).map(|(&q, v)| self.corrected(system, q, v)).collect();
        State::at_start(q, v)
    }

    /// The corrected velocity of a particle.
    fn corrected(&self, system: &System, q: [f32; 3], v: [f32; 3]) -> [f32; 3] {
        let n = &system.config.normalisation;
        let x: [f32; 3] = std::array::from_fn(|i| (q[i] - n.center[i]) / n.length);
        std::array::from_fn(|i| v[i] + n.speed * (self.values[i] + linear::dot(x, self.row(i))))
    }

    fn row(&self, i: usize) -> [f32; 3] {
        [self.values[3 + 3 * i], self.values[4 + 3 * i], self.values[5 + 3 * i]]
    }

    /// Cotangents of the values, given those of the starting velocities at positions `q`.
    pub(crate) fn start_vjp(system: &System, q: &[[f32; 3]], v_v0: &[[f32; 3]]) -> Vec<f32> {
        let n = &system.config.normalisation;
        let mut out = vec![0.0; UNKNOWNS];
        for (q, v) in q.iter().zip(v_v0) {
            for i in 0..3 {
                out[i] += n.speed * v[i];
                for j in 0..3 {
                    out[3 + 3 * i + j] += n.speed * v[i] * (q[j] - n.center[j]) / n.length;
                }
            }
        }
        out
    }
}
