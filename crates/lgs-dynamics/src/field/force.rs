//! The force `Q(q, v)` of a block (method §4.1, §4.2) and its backward pass.

use super::{Field, Gradients, NetworkArrays, Workspace};
use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS};
use crate::structured::{structured, structured_vjp};
use crate::system::ForceKind;
use lgs_nn::{Keep, Mlp, OutputCotangents};

impl Field {
    /// `Q`.
    pub(crate) fn force(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows) -> Vec3Rows {
        self.set_inputs(w, q, v);
        self.force_of_inputs(w, v, Keep::Result)
    }

    pub(super) fn force_of_inputs(&self, w: &mut Workspace, v: &Vec3Rows, keep: Keep) -> Vec3Rows {
        let (Some(network), Some(arrays)) = (&self.force, w.force.as_mut()) else {
            return ZERO_ROWS;
        };
        let [inputs, outputs] = force_features(network);
        let outputs = &mut w.outputs[..outputs * WIDTH];
        network.output(&[&w.inputs[..inputs * WIDTH]], arrays.lend(), keep, outputs);
        let n = &self.config.normalisation;
        if self.config.force == ForceKind::Mlp {
            return std::array::from_fn(|axis| {
                std::array::from_fn(|lane| n.acceleration * outputs[axis * WIDTH + lane])
            });
        }
        let mut force = ZERO_ROWS;
        #[expect(clippy::needless_range_loop, reason = "a lane of several rows")]
        for lane in 0..WIDTH {
            let (damping, spin, velocity) = structured(outputs, v, lane);
            for axis in 0..3 {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                let turn = spin[j] * velocity[k] - spin[k] * velocity[j];
                force[axis][lane] = n.acceleration / n.speed * (turn - damping * velocity[axis]);
            }
        }
        force
    }

    /// Backwards through [`Self::force_of_inputs`]: adds to `w.v_inputs[..3]` (normalised position) and
    /// returns the cotangent of `v`.
    pub(super) fn force_vjp(
        &self,
        w: &mut Workspace,
        v: &Vec3Rows,
        v_force: &Vec3Rows,
        gradients: &mut Gradients,
    ) -> Vec3Rows {
        let (Some(network), Some(NetworkArrays { tape, scratch }), Some(own)) =
            (&self.force, w.force.as_mut(), gradients.force.as_mut())
        else {
            return ZERO_ROWS;
        };
        let [inputs, outputs] = force_features(network);
        let n = &self.config.normalisation;
        let v_outputs = &mut w.v_outputs[..outputs * WIDTH];
        let mut v_velocity = if self.config.force == ForceKind::Mlp {
            for (out, &value) in v_outputs.iter_mut().zip(v_force.as_flattened()) {
                *out = n.acceleration * value;
            }
            ZERO_ROWS
        } else {
            structured_vjp(&w.outputs, v, v_force, n.acceleration / n.speed, v_outputs)
        };
        let v_x = &mut [0.0; 6 * WIDTH][..inputs * WIDTH];
        let x = [&w.inputs[..inputs * WIDTH]];
        let block = OutputCotangents { inputs: &x, tape, v_y: v_outputs };
        network.output_vjp(block, scratch, own, &mut [&mut *v_x]);
        for (sum, &value) in w.v_inputs[..3 * WIDTH].iter_mut().zip(v_x.iter()) {
            *sum += value;
        }
        for (sum, &value) in v_velocity.as_flattened_mut().iter_mut().zip(v_x.get(3 * WIDTH..).unwrap_or(&[]))
        {
            *sum += value / n.speed;
        }
        v_velocity
    }

    /// Damping coefficients and spins `[1 + 3, WIDTH]` in inverse units of time, times γ: what makes the
    /// structured force linear in `v`.
    pub(crate) fn structured_coefficients(
        &self,
        w: &mut Workspace,
        q: &Vec3Rows,
    ) -> Option<[[f32; WIDTH]; 4]> {
        if self.config.force != ForceKind::Structured {
            return None;
        }
        self.force(w, q, &ZERO_ROWS);
        let n = &self.config.normalisation;
        let scale = self.edit.force_scale * n.acceleration / n.speed;
        let mut rows = [[0.0; WIDTH]; 4];
        #[expect(clippy::needless_range_loop, reason = "a lane of several rows")]
        for lane in 0..WIDTH {
            let (damping, spin, _) = structured(&w.outputs, &ZERO_ROWS, lane);
            rows[0][lane] = scale * damping;
            for axis in 0..3 {
                rows[1 + axis][lane] = scale * spin[axis];
            }
        }
        Some(rows)
    }
}

/// Inputs and outputs of the force's network.
fn force_features(network: &Mlp) -> [usize; 2] {
    let layout = &network.shape().layout;
    [layout.hidden[0].inputs, layout.head.outputs]
}
