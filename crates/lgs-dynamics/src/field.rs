//! The acceleration of a block of particles, `a = −β ∇U(q) + γ Q(q, v)` (Eq. 4 and 9), and its backward pass.
//!
//! All functions take and give world units; normalisation is undone here and nowhere else.

mod force;

use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS};
use crate::state::Edit;
use crate::system::{Layout, System, SystemConfig};
use lgs_nn::{Activation, CallArrays, Keep, Mlp, MlpGradients, MlpLayout, MlpShape, Scratch, Tape};

/// A system ready to be evaluated on blocks.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) config: SystemConfig,
    layout: Layout,
    edit: Edit,
    potential: Mlp,
    /// Linear (3) and quadratic (xx, yy, zz, xy, xz, yz) coefficients, where the potential has them.
    quadratic: Option<[f32; 9]>,
    force: Option<Mlp>,
}

/// Buffers of one worker.
#[derive(Debug)]
pub(crate) struct Workspace {
    /// Normalised position and velocity, `[6, WIDTH]`.
    inputs: [f32; 6 * WIDTH],
    potential: NetworkArrays,
    force: Option<NetworkArrays>,
    /// Output of the force network, at most `[4, WIDTH]`, and its cotangent.
    outputs: [f32; 4 * WIDTH],
    v_outputs: [f32; 4 * WIDTH],
    v_inputs: [f32; 6 * WIDTH],
}

/// The arrays of a network's calls.
#[derive(Debug)]
struct NetworkArrays {
    tape: Tape,
    scratch: Scratch,
}

impl NetworkArrays {
    fn new(mlp: &Mlp, tape: fn(&Mlp, usize) -> Tape) -> Self {
        Self { tape: tape(mlp, WIDTH), scratch: Scratch::new(mlp, WIDTH) }
    }

    fn lend(&mut self) -> CallArrays<'_> {
        CallArrays { tape: &mut self.tape, scratch: &mut self.scratch }
    }
}

/// Sums of parameter gradients.
#[derive(Debug)]
pub(crate) struct Gradients {
    potential: MlpGradients,
    quadratic: [f32; 9],
    force: Option<MlpGradients>,
}

impl Field {
    pub(crate) fn new(system: &System, edit: &Edit) -> Self {
        Self::from_parts(&system.config, &system.params, edit)
    }

    pub(crate) fn from_parts(config: &SystemConfig, params: &[f32], edit: &Edit) -> Self {
        let layout = Layout::of(config);
        assert_eq!(params.len(), layout.len, "parameters of the system");
        let mlp = |network: &MlpLayout| Mlp::new(MlpShape::new(network.clone(), Activation::Silu), params);
        let potential = mlp(&layout.potential);
        let quadratic = layout.quadratic.map(|start| std::array::from_fn(|i| params[start + i]));
        let force = layout.force.as_ref().map(mlp);
        Self { config: *config, layout, edit: *edit, potential, quadratic, force }
    }

    pub(crate) fn workspace(&self) -> Workspace {
        Workspace {
            inputs: [0.0; 6 * WIDTH],
            potential: NetworkArrays::new(&self.potential, Tape::with_curvature),
            force: self.force.as_ref().map(|mlp| NetworkArrays::new(mlp, Tape::new)),
            outputs: [0.0; 4 * WIDTH],
            v_outputs: [0.0; 4 * WIDTH],
            v_inputs: [0.0; 6 * WIDTH],
        }
    }

    /// Gradients of zero.
    pub(crate) fn gradients(&self) -> Gradients {
        Gradients {
            potential: MlpGradients::zeros(self.potential.shape()),
            quadratic: [0.0; 9],
            force: self.force.as_ref().map(|mlp| MlpGradients::zeros(mlp.shape())),
        }
    }

    /// The flat gradient: the sum of partial ones, added in order.
    pub(crate) fn sum_in_order(&self, partials: &[Gradients]) -> Vec<f32> {
        let mut flat = vec![0.0; self.layout.len];
        for partial in partials {
            partial.potential.add_to(&mut flat);
            if let Some(start) = self.layout.quadratic {
                flat[start..].iter_mut().zip(partial.quadratic).for_each(|(sum, value)| *sum += value);
            }
            if let Some(force) = &partial.force {
                force.add_to(&mut flat);
            }
        }
        flat
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

    /// The symmetric matrix and the linear part of the quadratic term.
    fn quadratic(&self) -> Option<([[f32; 3]; 3], [f32; 3])> {
        let [gx, gy, gz, xx, yy, zz, xy, xz, yz] = self.quadratic?;
        Some(([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], [gx, gy, gz]))
    }

    /// `∇U`.
    pub(crate) fn potential_gradient(&self, w: &mut Workspace, q: &Vec3Rows) -> Vec3Rows {
        self.set_inputs(w, q, &ZERO_ROWS);
        self.potential_gradient_of_inputs(w, Keep::Result)
    }

    fn potential_gradient_of_inputs(&self, w: &mut Workspace, keep: Keep) -> Vec3Rows {
        let mut gradient = ZERO_ROWS;
        let x = &w.inputs[..3 * WIDTH];
        self.potential.input_gradient(x, w.potential.lend(), keep, gradient.as_flattened_mut());
        if let Some((matrix, linear)) = self.quadratic() {
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

    /// The backward pass of [`Self::potential_gradient_of_inputs`]; writes the cotangent of the normalised
    /// position to `w.v_inputs`.
    fn potential_gradient_vjp(&self, w: &mut Workspace, v_gradient: &Vec3Rows, gradients: &mut Gradients) {
        let scale = self.config.normalisation.acceleration;
        let v_gradient = v_gradient.map(|row| row.map(|value| value * scale));
        let (x, v_x) = (&w.inputs[..3 * WIDTH], &mut w.v_inputs[..3 * WIDTH]);
        let (arrays, own) = (w.potential.lend(), &mut gradients.potential);
        self.potential.input_gradient_vjp([x, v_gradient.as_flattened()], arrays, own, v_x);
        let Some((matrix, _)) = self.quadratic() else { return };
        let v_quadratic = &mut gradients.quadratic;
        for axis in 0..3 {
            let row = &v_gradient[axis];
            v_quadratic[axis] += row.iter().sum::<f32>();
            v_quadratic[3 + axis] += (0..WIDTH).map(|l| row[l] * x[axis * WIDTH + l]).sum::<f32>();
            for lane in 0..WIDTH {
                v_x[axis * WIDTH + lane] +=
                    (0..3).map(|j| matrix[axis][j] * v_gradient[j][lane]).sum::<f32>();
            }
        }
        for (slot, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let mixed = |l: usize| v_gradient[i][l] * x[j * WIDTH + l] + v_gradient[j][l] * x[i * WIDTH + l];
            v_quadratic[6 + slot] += (0..WIDTH).map(mixed).sum::<f32>();
        }
    }

    /// `U`, up to a constant.
    pub(crate) fn potential(&self, w: &mut Workspace, q: &Vec3Rows) -> [f32; WIDTH] {
        self.set_inputs(w, q, &ZERO_ROWS);
        let x = &w.inputs[..3 * WIDTH];
        let mut values = [0.0; WIDTH];
        self.potential.output(&[x], w.potential.lend(), Keep::Result, &mut values);
        if let Some((matrix, linear)) = self.quadratic() {
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

    /// `a = −β ∇U(q) + γ Q(q, v)`.
    pub(crate) fn acceleration(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows) -> Vec3Rows {
        self.acceleration_keeping(w, q, v, Keep::Result)
    }

    fn acceleration_keeping(&self, w: &mut Workspace, q: &Vec3Rows, v: &Vec3Rows, keep: Keep) -> Vec3Rows {
        self.set_inputs(w, q, v);
        let gradient = self.potential_gradient_of_inputs(w, keep);
        let mut a = gradient.map(|row| row.map(|g| -self.edit.potential_scale * g));
        if self.force.is_some() {
            let force = self.force_of_inputs(w, v, keep);
            crate::block::add_scaled(&mut a, &force, self.edit.force_scale);
        }
        a
    }

    /// The backward pass of [`Self::acceleration`], whose activations are computed again: adds to
    /// `gradients`, returns the cotangents of `q` and `v`.
    pub(crate) fn acceleration_vjp(
        &self,
        w: &mut Workspace,
        [q, v]: [&Vec3Rows; 2],
        v_a: &Vec3Rows,
        gradients: &mut Gradients,
    ) -> (Vec3Rows, Vec3Rows) {
        self.acceleration_keeping(w, q, v, Keep::Tape);
        let v_gradient = v_a.map(|row| row.map(|value| -self.edit.potential_scale * value));
        self.potential_gradient_vjp(w, &v_gradient, gradients);
        let v_force = v_a.map(|row| row.map(|value| self.edit.force_scale * value));
        let v_velocity = self.force_vjp(w, v, &v_force, gradients);
        let per_length = 1.0 / self.config.normalisation.length;
        let v_position = std::array::from_fn(|axis| {
            std::array::from_fn(|lane| w.v_inputs[axis * WIDTH + lane] * per_length)
        });
        (v_position, v_velocity)
    }

    pub(crate) fn edit(&self) -> &Edit {
        &self.edit
    }
}
