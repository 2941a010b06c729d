//! The field on any number of particles: blocks of particles in parallel, parameter gradients in a fixed
//! order.
//!
//! Particles are cut into blocks, blocks into at most [`GROUPS`] groups. Each group adds its blocks'
//! parameter gradients in order into a buffer of its own, and the buffers are added in order: the cut depends
//! on the number of particles alone, so the bits of a result do not depend on the number of threads.

use crate::block::{Vec3Rows, WIDTH, add_scaled, gather, gather_or_zero, scatter};
use crate::field::{Field, Gradients, Workspace};
use crate::state::Edit;
use crate::system::System;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Most partial sums of a parameter gradient.
const GROUPS: usize = 16;

/// Particles per group.
pub(crate) fn group_size(particles: usize) -> usize {
    particles.div_ceil(WIDTH).div_ceil(GROUPS).max(1) * WIDTH
}

/// Workspaces that tasks share; they carry nothing from one use to the next.
pub(crate) struct Pool<'a> {
    field: &'a Field,
    free: Mutex<Vec<Workspace>>,
}

impl<'a> Pool<'a> {
    pub(crate) fn new(field: &'a Field) -> Self {
        Self { field, free: Mutex::new(Vec::new()) }
    }

    /// Runs a task with the field and a workspace.
    pub(crate) fn run<T>(&self, task: impl FnOnce(&Field, &mut Workspace) -> T) -> T {
        let free = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = free().pop();
        let mut workspace = taken.unwrap_or_else(|| self.field.workspace());
        let result = task(self.field, &mut workspace);
        free().push(workspace);
        result
    }

    /// A function of position and velocity for every particle, block by block.
    pub(crate) fn map(
        &self,
        q: &[[f32; 3]],
        v: &[[f32; 3]],
        f: impl Fn(&Field, &mut Workspace, &Vec3Rows, &Vec3Rows) -> Vec3Rows + Sync,
    ) -> Vec<[f32; 3]> {
        let mut out = Vec::new();
        self.map_into(q, v, &mut out, f);
        out
    }

    /// As [`Pool::map`], in an array that is there.
    fn map_into(
        &self,
        q: &[[f32; 3]],
        v: &[[f32; 3]],
        out: &mut Vec<[f32; 3]>,
        f: impl Fn(&Field, &mut Workspace, &Vec3Rows, &Vec3Rows) -> Vec3Rows + Sync,
    ) {
        assert_eq!(q.len(), v.len(), "positions and velocities");
        out.resize(q.len(), [0.0; 3]);
        out.par_chunks_mut(WIDTH).zip(q.par_chunks(WIDTH)).zip(v.par_chunks(WIDTH)).for_each(
            |((out, q), v)| {
                let rows = self.run(|field, workspace| f(field, workspace, &gather(q), &gather(v)));
                scatter(&rows, out);
            },
        );
    }

    /// Velocities after the kick of a step, `v + h a(q, v)` (Eq. 5).
    pub(crate) fn kick(&self, q: &[[f32; 3]], v: &[[f32; 3]], h: f32, kicked: &mut Vec<[f32; 3]>) {
        self.map_into(q, v, kicked, |field, workspace, q, v| {
            let mut kicked = *v;
            add_scaled(&mut kicked, &field.acceleration(workspace, q, v), h);
            kicked
        });
    }
}

/// Cotangents of positions and velocities through `scale · a(q, v)`, with parameter gradients added to one
/// buffer per group.
pub(crate) fn acceleration_vjp_grouped(
    pool: &Pool,
    [q, v, v_a]: [&[[f32; 3]]; 3],
    scale: f32,
    gradients: &mut [Gradients],
    [v_q, v_v]: [&mut Vec<[f32; 3]>; 2],
) {
    let size = group_size(q.len());
    v_q.resize(q.len(), [0.0; 3]);
    v_v.resize(q.len(), [0.0; 3]);
    let outputs = v_q.par_chunks_mut(size).zip(v_v.par_chunks_mut(size)).zip(gradients.par_iter_mut());
    let inputs = q.par_chunks(size).zip(v.par_chunks(size)).zip(v_a.par_chunks(size));
    outputs.zip(inputs).for_each(|(((v_q, v_v), gradients), ((q, v), v_a))| {
        let blocks = q
            .chunks(WIDTH)
            .zip(v.chunks(WIDTH))
            .zip(v_a.chunks(WIDTH))
            .zip(v_q.chunks_mut(WIDTH).zip(v_v.chunks_mut(WIDTH)));
        for (((q, v), v_a), (v_q, v_v)) in blocks {
            let v_a = gather_or_zero(v_a).map(|row| row.map(|value| scale * value));
            let (q, v) = (gather(q), gather(v));
            let (of_q, of_v) =
                pool.run(|field, workspace| field.acceleration_vjp(workspace, [&q, &v], &v_a, gradients));
            scatter(&of_q, v_q);
            scatter(&of_v, v_v);
        }
    });
}

/// Gradients of zero, one per group.
pub(crate) fn group_gradients(field: &Field, particles: usize) -> Vec<Gradients> {
    (0..particles.div_ceil(group_size(particles))).map(|_| field.gradients()).collect()
}

impl System {
    /// Accelerations `a = −β ∇U(q) + γ Q(q, v)` of particles `[n, 3]` (Eq. 4 and 9).
    #[must_use]
    pub fn accelerations(&self, q: &[[f32; 3]], v: &[[f32; 3]], edit: &Edit) -> Vec<[f32; 3]> {
        Pool::new(&Field::new(self, edit))
            .map(q, v, |field, workspace, q, v| field.acceleration(workspace, q, v))
    }

    /// `∇U` at positions `[n, 3]`.
    #[must_use]
    pub fn potential_gradients(&self, q: &[[f32; 3]]) -> Vec<[f32; 3]> {
        Pool::new(&self.field()).map(q, q, |field, workspace, q, _| field.potential_gradient(workspace, q))
    }

    /// Forces `Q` on particles `[n, 3]`.
    #[must_use]
    pub fn forces(&self, q: &[[f32; 3]], v: &[[f32; 3]]) -> Vec<[f32; 3]> {
        Pool::new(&self.field()).map(q, v, |field, workspace, q, v| field.force(workspace, q, v))
    }

    /// Potentials per unit of mass at positions `[n, 3]`, up to a constant.
    #[must_use]
    pub fn potentials(&self, q: &[[f32; 3]]) -> Vec<f32> {
        let field = self.field();
        let pool = Pool::new(&field);
        let mut values = vec![0.0; q.len()];
        values.par_chunks_mut(WIDTH).zip(q.par_chunks(WIDTH)).for_each(|(values, q)| {
            let row = pool.run(|field, workspace| field.potential(workspace, &gather(q)));
            values.copy_from_slice(&row[..values.len()]);
        });
        values
    }

    fn field(&self) -> Field {
        Field::new(self, &Edit::default())
    }
}

/// Gradients through accelerations.
#[derive(Clone, Debug, PartialEq)]
pub struct AccelerationGradients {
    /// Gradient by the flat parameter vector.
    pub params: Vec<f32>,
    /// Gradient by positions `[n, 3]`.
    pub q: Vec<[f32; 3]>,
    /// Gradient by velocities `[n, 3]`.
    pub v: Vec<[f32; 3]>,
}

/// The backward pass of [`System::accelerations`], given the cotangents `[n, 3]` of the accelerations.
#[must_use]
pub fn acceleration_vjp(
    system: &System,
    q: &[[f32; 3]],
    v: &[[f32; 3]],
    edit: &Edit,
    v_acceleration: &[[f32; 3]],
) -> AccelerationGradients {
    assert!(q.len() == v.len() && q.len() == v_acceleration.len(), "positions, velocities, cotangents");
    let field = Field::new(system, edit);
    let mut partials = group_gradients(&field, q.len());
    let (mut v_q, mut v_v) = (Vec::new(), Vec::new());
    acceleration_vjp_grouped(
        &Pool::new(&field),
        [q, v, v_acceleration],
        1.0,
        &mut partials,
        [&mut v_q, &mut v_v],
    );
    AccelerationGradients { params: field.sum_in_order(&partials), q: v_q, v: v_v }
}
