//! The acceleration of a block of particles, `a = −β ∇U(q) + γ Q(q, v)` (Eq. 4 and 9), and its backward pass.
//!
//! All functions take and give world units; normalisation is undone here and nowhere else.

use crate::block::activation::softplus;
use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS};
use crate::network::{Mlp, Tape};
use crate::state::Edit;
use crate::system::{DAMPING_SHIFT, ForceKind, Layout, System, SystemConfig};

/// A system ready to be evaluated on blocks.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub(crate) config: &'a SystemConfig,
    params: &'a [f32],
    layout: Layout,
    edit: Edit,
}

/// Buffers of one worker.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    /// Normalised position and velocity, `[6, WIDTH]`.
    inputs: Vec<f32>,
    potential: Tape,
    force: Option<Tape>,
    /// Output of the force network, at most `[4, WIDTH]`, and its cotangent.
    outputs: Vec<f32>,
    v_outputs: Vec<f32>,
    v_inputs: Vec<f32>,
}

impl<'a> Field<'a> {
    pub(crate) fn new(system: &'a System, edit: &Edit) -> Self {
        Self::from_parts(&system.config, &system.params, edit)
    }

    pub(crate) fn from_parts(config: &'a SystemConfig, params: &'a [f32], edit: &Edit) -> Self {
        let layout = Layout::of(config);
        assert_eq!(params.len(), layout.len, "parameters of the system");
        Self { config, params, layout, edit: *edit }
    }

    pub(crate) fn parameters(&self) -> usize {
        self.layout.len
    }

    pub(crate) fn workspace(&self) -> Workspace {
        Workspace {
            inputs: vec![0.0; 6 * WIDTH],
            potential: Tape::new(&self.layout.potential),
            force: self.layout.force.as_ref().map(Tape::new),
            outputs: vec![0.0; 4 * WIDTH],
            v_outputs: vec![0.0; 4 * WIDTH],
            v_inputs: vec![0.0; 6 * WIDTH],
        }
    }

    fn potential_network(&self) -> Mlp<'a> {
        Mlp { shape: self.layout.potential, params: self.params }
    }

    fn force_network(&self) -> Option<Mlp<'a>> {
        self.layout.force.map(|shape| Mlp { shape, params: self.params })
    }

    fn set_inputs(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows) {
        let n = &self.config.normalisation;
        for axis in 0..3 {
            let (per_length, per_speed) = (1.0 / n.length, 1.0 / n.speed);
            for lane in 0..WIDTH {
                w.inputs[axis * WIDTH + lane] = (q[axis][lane] - n.center[axis]) * per_length;
                w.inputs[(3 + axis) * WIDTH + lane] = v[axis][lane] * per_speed;
            }
        }
    }

    /// The symmetric matrix of the quadratic term and the start of its coefficients.
    fn quadratic(&self) -> Option<([[f32; 3]; 3], [f32; 3], usize)> {
        self.layout.quadratic.map(|start| {
            let [gx, gy, gz, xx, yy, zz, xy, xz, yz] = std::array::from_fn(|i| self.params[start + i]);
            ([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], [gx, gy, gz], start)
        })
    }

    /// `∇U`.
    pub(crate) fn potential_gradient(&self, w: &mut Workspace, q: &Vec3Rows) -> Vec3Rows {
        self.set_inputs(w, q, &ZERO_ROWS);
        self.potential_gradient_of_inputs(w)
    }

    fn potential_gradient_of_inputs(&self, w: &mut Workspace) -> Vec3Rows {
        let mut gradient = ZERO_ROWS;
        let x = &w.inputs[..3 * WIDTH];
        self.potential_network().input_gradient(x, &mut w.potential, gradient.as_flattened_mut());
        if let Some((matrix, linear, _)) = self.quadratic() {
            for axis in 0..3 {
                for lane in 0..WIDTH {
                    let product: f32 = (0..3).map(|j| matrix[axis][j] * x[j * WIDTH + lane]).sum();
                    gradient[axis][lane] += linear[axis] + product;
                }
            }
        }
        for value in gradient.as_flattened_mut() {
            *value *= self.config.normalisation.acceleration;
        }
        gradient
    }

    /// Backwards through [`Self::potential_gradient_of_inputs`]; writes the cotangent of the normalised position to `w.v_inputs`.
    fn potential_gradient_vjp(&self, w: &mut Workspace, v_gradient: &Vec3Rows, v_params: &mut [f32]) {
        let scale = self.config.normalisation.acceleration;
        let v_gradient = v_gradient.map(|row| row.map(|value| value * scale));
        let (x, v_x) = (&w.inputs[..3 * WIDTH], &mut w.v_inputs[..3 * WIDTH]);
        self.potential_network().input_gradient_vjp(x, &mut w.potential, v_gradient.as_flattened(), v_params, v_x);
        let Some((matrix, _, start)) = self.quadratic() else { return };
        for axis in 0..3 {
            let row = &v_gradient[axis];
            v_params[start + axis] += row.iter().sum::<f32>();
            v_params[start + 3 + axis] += (0..WIDTH).map(|l| row[l] * x[axis * WIDTH + l]).sum::<f32>();
            for lane in 0..WIDTH {
                v_x[axis * WIDTH + lane] += (0..3).map(|j| matrix[axis][j] * v_gradient[j][lane]).sum::<f32>();
            }
        }
        for (slot, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let mixed = |l: usize| v_gradient[i][l] * x[j * WIDTH + l] + v_gradient[j][l] * x[i * WIDTH + l];
            v_params[start + 6 + slot] += (0..WIDTH).map(mixed).sum::<f32>();
        }
    }

    /// `U`, up to a constant.
    pub(crate) fn potential(&self, w: &mut Workspace, q: &Vec3Rows) -> [f32; WIDTH] {
        self.set_inputs(w, q, &ZERO_ROWS);
        let x = &w.inputs[..3 * WIDTH];
        let mut values = [0.0; WIDTH];
        self.potential_network().value(x, &mut w.potential, &mut values);
        if let Some((matrix, linear, _)) = self.quadratic() {
            for (lane, value) in values.iter_mut().enumerate() {
                let at: [f32; 3] = std::array::from_fn(|axis| x[axis * WIDTH + lane]);
                for i in 0..3 {
                    *value += at[i] * (linear[i] + 0.5 * (0..3).map(|j| matrix[i][j] * at[j]).sum::<f32>());
                }
            }
        }
        let n = &self.config.normalisation;
        values.map(|value| value * n.acceleration * n.length)
    }

    /// `Q`.
    pub(crate) fn force(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows) -> Vec3Rows {
        self.set_inputs(w, q, v);
        self.force_of_inputs(w, v)
    }

    fn force_of_inputs(&self, w: &mut Workspace, v: &Vec3Rows) -> Vec3Rows {
        let (Some(network), Some(tape)) = (self.force_network(), w.force.as_mut()) else { return ZERO_ROWS };
        let shape = network.shape;
        let outputs = &mut w.outputs[..shape.outputs * WIDTH];
        network.output(&w.inputs[..shape.inputs * WIDTH], tape, outputs);
        let n = &self.config.normalisation;
        if self.config.force == ForceKind::Mlp {
            return std::array::from_fn(|axis| std::array::from_fn(|lane| n.acceleration * outputs[axis * WIDTH + lane]));
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

    /// Backwards through [`Self::force_of_inputs`]: adds to `w.v_inputs[..3]` (normalised position) and returns the cotangent of `v`.
    fn force_vjp(&self, w: &mut Workspace, v: &Vec3Rows, v_force: &Vec3Rows, v_params: &mut [f32]) -> Vec3Rows {
        let (Some(network), Some(tape)) = (self.force_network(), w.force.as_mut()) else { return ZERO_ROWS };
        let shape = network.shape;
        let n = &self.config.normalisation;
        let v_outputs = &mut w.v_outputs[..shape.outputs * WIDTH];
        let mut v_velocity = ZERO_ROWS;
        if self.config.force == ForceKind::Mlp {
            for (out, &value) in v_outputs.iter_mut().zip(v_force.as_flattened()) {
                *out = n.acceleration * value;
            }
        } else {
            structured_vjp(&w.outputs, v, v_force, n.acceleration / n.speed, v_outputs, &mut v_velocity);
        }
        let mut v_x = vec![0.0; shape.inputs * WIDTH];
        network.output_vjp(&w.inputs[..shape.inputs * WIDTH], tape, v_outputs, v_params, &mut v_x);
        for (sum, &value) in w.v_inputs[..3 * WIDTH].iter_mut().zip(&v_x) {
            *sum += value;
        }
        for (sum, &value) in v_velocity.as_flattened_mut().iter_mut().zip(v_x.get(3 * WIDTH..).unwrap_or(&[])) {
            *sum += value / n.speed;
        }
        v_velocity
    }

    /// `a = −β ∇U(q) + γ Q(q, v)`.
    pub(crate) fn acceleration(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows) -> Vec3Rows {
        self.set_inputs(w, q, v);
        let gradient = self.potential_gradient_of_inputs(w);
        let mut a = gradient.map(|row| row.map(|g| -self.edit.potential_scale * g));
        if self.layout.force.is_some() {
            let force = self.force_of_inputs(w, v);
            crate::block::add_scaled(&mut a, &force, self.edit.force_scale);
        }
        a
    }

    /// Backwards through [`Self::acceleration`] at the same arguments, which must have been its last call with this workspace: adds to
    /// `v_params`, returns the cotangents of `q` and `v`.
    pub(crate) fn acceleration_vjp(&self, w: &mut Workspace, v: &Vec3Rows, v_a: &Vec3Rows, v_params: &mut [f32]) -> (Vec3Rows, Vec3Rows) {
        let v_gradient = v_a.map(|row| row.map(|value| -self.edit.potential_scale * value));
        self.potential_gradient_vjp(w, &v_gradient, v_params);
        let v_force = v_a.map(|row| row.map(|value| self.edit.force_scale * value));
        let v_velocity = self.force_vjp(w, v, &v_force, v_params);
        let per_length = 1.0 / self.config.normalisation.length;
        let v_position = std::array::from_fn(|axis| std::array::from_fn(|lane| w.v_inputs[axis * WIDTH + lane] * per_length));
        (v_position, v_velocity)
    }

    /// Damping coefficients and spins `[1 + 3, WIDTH]` in inverse units of time, times γ: what makes the structured force linear in `v`.
    pub(crate) fn structured_coefficients(&self, w: &mut Workspace, q: &Vec3Rows) -> Option<[[f32; WIDTH]; 4]> {
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

    pub(crate) fn edit(&self) -> &Edit {
        &self.edit
    }
}

/// Damping, spin and velocity of a lane.
fn structured(outputs: &[f32], v: &Vec3Rows, lane: usize) -> (f32, [f32; 3], [f32; 3]) {
    let (damping, _) = softplus(outputs[lane] - DAMPING_SHIFT);
    let spin = std::array::from_fn(|axis| outputs[(1 + axis) * WIDTH + lane]);
    (damping, spin, std::array::from_fn(|axis| v[axis][lane]))
}

/// Backwards through `scale (−softplus(d − 6) v + w × v)`.
fn structured_vjp(outputs: &[f32], v: &Vec3Rows, v_force: &Vec3Rows, scale: f32, v_outputs: &mut [f32], v_velocity: &mut Vec3Rows) {
    for lane in 0..WIDTH {
        let (damping, spin, velocity) = structured(outputs, v, lane);
        let (_, slope) = softplus(outputs[lane] - DAMPING_SHIFT);
        let v_f: [f32; 3] = std::array::from_fn(|axis| scale * v_force[axis][lane]);
        let power: f32 = (0..3).map(|axis| v_f[axis] * velocity[axis]).sum();
        v_outputs[lane] = -slope * power;
        for axis in 0..3 {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            // ⟨f̄, w × v⟩ = ⟨w, v × f̄⟩ = ⟨v, f̄ × w⟩
            v_outputs[(1 + axis) * WIDTH + lane] = velocity[j] * v_f[k] - velocity[k] * v_f[j];
            v_velocity[axis][lane] = v_f[j] * spin[k] - v_f[k] * spin[j] - damping * v_f[axis];
        }
    }
}
