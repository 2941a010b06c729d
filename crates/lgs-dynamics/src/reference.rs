//! Plain twins of the fast functions in Burn tensor operations, whose gradients come from autodiff.
//!
//! They are for tests and for reading. `∇U` is written as the chain of method §4.1, so that one backward
//! pass gives its derivative. The rotation of a support comes from repeated squaring of Horn's 4×4 matrix,
//! which leaves the projector `p pᵀ` on the best quaternion; rotation matrices are linear in it. Degenerate
//! supports, where two eigenvalues meet, are not handled.

use crate::state::{Edit, VelocityPolicy};
use crate::supports::Supports;
use crate::system::{DAMPING_SHIFT, ForceKind, SystemConfig};
use crate::tensor::RolloutCall;
use burn::tensor::activation::{sigmoid, softplus};
use burn::tensor::{Int, Tensor, TensorData};

/// Squarings of Horn's matrix: the ratio of eigenvalues enters with the power 2¹².
const SQUARINGS: usize = 12;

struct Parameters<'a> {
    config: &'a SystemConfig,
    flat: Tensor<1>,
}

impl Parameters<'_> {
    fn array(&self, name: &str) -> Tensor<1> {
        let entry = self
            .config
            .layout()
            .into_iter()
            .find(|e| e.name == name)
            .unwrap_or_else(|| panic!("no parameter {name}"));
        self.flat.clone().slice([entry.range])
    }

    /// Weight `[out, in]` and bias `[1, out]`.
    fn layer(&self, network: &str, layer: usize) -> (Tensor<2>, Tensor<2>) {
        let bias = self.array(&format!("{network}.{layer}.bias"));
        let weight = self.array(&format!("{network}.{layer}.weight"));
        let outputs = bias.dims()[0];
        let inputs = weight.dims()[0] / outputs;
        (weight.reshape([outputs, inputs]), bias.reshape([1, outputs]))
    }

    fn network(&self, name: &str, x: Tensor<2>) -> Tensor<2> {
        let mut h = x;
        for layer in 0..=self.config.hidden_layers {
            let (weight, bias) = self.layer(name, layer);
            let z = h.matmul(weight.transpose()) + bias;
            h = if layer < self.config.hidden_layers { z.clone() * sigmoid(z) } else { z };
        }
        h
    }

    /// `∇û` of the network by its normalised input.
    fn potential_gradient(&self, x: Tensor<2>) -> Tensor<2> {
        let mut h = x;
        let mut slopes = Vec::new();
        for layer in 0..self.config.hidden_layers {
            let (weight, bias) = self.layer("potential", layer);
            let z = h.matmul(weight.transpose()) + bias;
            let s = sigmoid(z.clone());
            slopes.push(s.clone() * (z.clone() * (-s.clone() + 1.0) + 1.0));
            h = z * s;
        }
        let (mut g, _) = self.layer("potential", self.config.hidden_layers);
        for (layer, slope) in slopes.into_iter().enumerate().rev() {
            let (weight, _) = self.layer("potential", layer);
            g = (slope * g).matmul(weight);
        }
        g
    }
}

/// Accelerations `[n, 3]`: the twin of [`crate::System::accelerations`].
#[must_use]
pub fn acceleration(
    config: &SystemConfig,
    edit: &Edit,
    params: Tensor<1>,
    q: Tensor<2>,
    v: Tensor<2>,
) -> Tensor<2> {
    let p = Parameters { config, flat: params };
    let n = &config.normalisation;
    let center = Tensor::<2>::from_data(TensorData::new(n.center.to_vec(), [1, 3]), &q.device());
    let x = (q - center) / n.length;
    let mut gradient = p.potential_gradient(x.clone());
    if config.layout().iter().any(|e| e.name == "potential.linear") {
        let s = p.array("potential.quadratic");
        let at = |i: usize| s.clone().narrow(0, i, 1);
        let matrix = Tensor::cat(vec![at(0), at(3), at(4), at(3), at(1), at(5), at(4), at(5), at(2)], 0)
            .reshape([3, 3]);
        gradient = gradient + p.array("potential.linear").reshape([1, 3]) + x.clone().matmul(matrix);
    }
    let a = gradient * (-edit.potential_scale * n.acceleration);
    let force = match config.force {
        ForceKind::None => return a,
        ForceKind::Mlp => p.network("force", Tensor::cat(vec![x, v / n.speed], 1)) * n.acceleration,
        ForceKind::Structured => {
            let y = p.network("force", x);
            let damping = softplus(columns(&y, 0, 1) - DAMPING_SHIFT, 1.0);
            (cross(&columns(&y, 1, 4), &v) - damping * v) * (n.acceleration / n.speed)
        }
    };
    a + force * edit.force_scale
}

fn columns(x: &Tensor<2>, from: usize, to: usize) -> Tensor<2> {
    x.clone().slice([0..x.dims()[0], from..to])
}

fn cross(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let turn = |x: &Tensor<2>, first: usize| {
        let at = |i: usize| columns(x, i % 3, i % 3 + 1);
        Tensor::cat(vec![at(first), at(first + 1), at(first + 2)], 1)
    };
    turn(a, 1) * turn(b, 2) - turn(a, 2) * turn(b, 1)
}

/// The members of every support, `[n, k, 3]`.
fn members(x: &Tensor<2>, supports: &Supports) -> Tensor<3> {
    let indices: Vec<i64> = supports.indices().iter().map(|&i| i64::from(i)).collect();
    let len = indices.len();
    let indices = Tensor::<1, Int>::from_data(TensorData::new(indices, [len]), &x.device());
    x.clone().select(0, indices).reshape([supports.particles(), supports.k(), 3])
}

/// Means `[n, 3]` and deviations `[n, k, 3]` of the supports.
fn centred(x: &Tensor<2>, supports: &Supports) -> (Tensor<2>, Tensor<3>) {
    let all = members(x, supports);
    let mean = all.clone().mean_dim(1);
    (mean.clone().reshape([supports.particles(), 3]), all - mean)
}

/// The projector `p pᵀ`, `[n, 4, 4]`, on the quaternion of the best rotation for `A`, `[n, 3, 3]`.
fn quaternion_projector(a: Tensor<3>) -> Tensor<3> {
    let n = a.dims()[0];
    let flat = a.reshape([n, 9]);
    let at = |target: usize, source: usize| columns(&flat, 3 * target + source, 3 * target + source + 1);
    let (x, y, z) = (0, 1, 2);
    let off = [at(z, y) - at(y, z), at(x, z) - at(z, x), at(y, x) - at(x, y)];
    let mixed = |i: usize, j: usize| at(i, j) + at(j, i);
    let trace = at(x, x) + at(y, y) + at(z, z);
    let diagonal = |i: usize| at(i, i) * 2.0 - trace.clone();
    let entries = vec![
        trace.clone(),
        off[0].clone(),
        off[1].clone(),
        off[2].clone(),
        off[0].clone(),
        diagonal(x),
        mixed(x, y),
        mixed(x, z),
        off[1].clone(),
        mixed(x, y),
        diagonal(y),
        mixed(y, z),
        off[2].clone(),
        mixed(x, z),
        mixed(y, z),
        diagonal(z),
    ];
    let horn = Tensor::cat(entries, 1).reshape([n, 4, 4]);
    let size = norm4(&horn);
    let unit = Tensor::<2>::eye(4, &horn.device()).reshape([1, 4, 4]);
    // Shifted by a bound of the spectrum, the largest eigenvalue is also the largest in magnitude.
    let mut m = horn / size + unit;
    for _ in 0..SQUARINGS {
        let squared = m.clone().matmul(m);
        m = squared.clone() / norm4(&squared);
    }
    let flat = m.clone().reshape([n, 16]);
    let at = |i: usize| columns(&flat, 5 * i, 5 * i + 1);
    m / (at(0) + at(1) + at(2) + at(3)).reshape([n, 1, 1])
}

/// Frobenius norms, `[n, 1, 1]`.
fn norm4(m: &Tensor<3>) -> Tensor<3> {
    let n = m.dims()[0];
    let flat = m.clone().reshape([n, 16]);
    (flat.clone() * flat).sum_dim(1).sqrt().reshape([n, 1, 1])
}

/// The result of [`align`].
pub struct AlignmentTensors {
    /// Aligned positions `[n, 3]`.
    pub aligned: Tensor<2>,
    /// Rotation matrices `[n, 3, 3]`.
    pub rotations: Tensor<3>,
    /// Unit quaternions `[n, 4]`, w > 0.
    pub quaternions: Tensor<2>,
}

/// Local rigid alignment (Eq. 6): the twin of [`crate::align`].
#[must_use]
pub fn align(position: &Tensor<2>, candidate: &Tensor<2>, supports: &Supports) -> AlignmentTensors {
    let n = supports.particles();
    let (mean, from_mean) = centred(position, supports);
    let (candidate_mean, from_candidate_mean) = centred(candidate, supports);
    let projector =
        quaternion_projector(from_candidate_mean.swap_dims(1, 2).matmul(from_mean)).reshape([n, 16]);
    let p = |i: usize, j: usize| columns(&projector, 4 * i + j, 4 * i + j + 1);
    let diagonal = |i: usize| p(0, 0) + p(i, i) * 2.0 - (p(1, 1) + p(2, 2) + p(3, 3));
    let rotations = Tensor::cat(
        vec![
            diagonal(1),
            (p(1, 2) - p(0, 3)) * 2.0,
            (p(1, 3) + p(0, 2)) * 2.0,
            (p(1, 2) + p(0, 3)) * 2.0,
            diagonal(2),
            (p(2, 3) - p(0, 1)) * 2.0,
            (p(1, 3) - p(0, 2)) * 2.0,
            (p(2, 3) + p(0, 1)) * 2.0,
            diagonal(3),
        ],
        1,
    )
    .reshape([n, 3, 3]);
    let quaternions = columns(&projector, 0, 4) / p(0, 0).sqrt();
    let offset = (position.clone() - mean).reshape([n, 3, 1]);
    let aligned = rotations.clone().matmul(offset).reshape([n, 3]) + candidate_mean;
    AlignmentTensors { aligned, rotations, quaternions }
}

/// Velocities of the supports' twists at the midpoints `m`, from angular momenta about `q`: the `Rigid`
/// policy.
fn rigid_velocity(q: &Tensor<2>, m: &Tensor<2>, v: &Tensor<2>, supports: &Supports) -> Tensor<2> {
    let (n, k) = (supports.particles(), supports.k());
    let (_, arm) = centred(q, supports);
    let (mean, r) = centred(m, supports);
    let (mean_velocity, u) = centred(v, supports);
    let rows = |x: Tensor<3>| x.reshape([n * k, 3]);
    let momentum = cross(&rows(arm), &rows(u)).reshape([n, k, 3]).sum_dim(1).reshape([n, 3]);
    let second = r.clone().swap_dims(1, 2).matmul(r).reshape([n, 9]);
    let trace = columns(&second, 0, 1) + columns(&second, 4, 5) + columns(&second, 8, 9);
    let unit = Tensor::<2>::eye(3, &m.device());
    let row =
        |i: usize| trace.clone() * unit.clone().slice([i..i + 1, 0..3]) - columns(&second, 3 * i, 3 * i + 3);
    // Cramer's rule; the matrix is symmetric, so its rows are its columns.
    let minors = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| cross(&row(i), &row(j)));
    let dot = |a: Tensor<2>, b: Tensor<2>| (a * b).sum_dim(1);
    let determinant = dot(row(0), minors[0].clone());
    let spin = Tensor::cat(minors.map(|minor| dot(momentum.clone(), minor)).to_vec(), 1) / determinant;
    mean_velocity + cross(&spin, &(m.clone() - mean))
}

/// States `[states, n, 10]`: the twin of [`crate::rollout`], packed as by [`crate::tensor::rollout`].
#[must_use]
pub fn rollout(params: &Tensor<1>, q0: Tensor<2>, v0: Tensor<2>, call: &RolloutCall) -> Tensor<3> {
    let n = q0.dims()[0];
    let identity: Vec<f32> = [1.0, 0.0, 0.0, 0.0].repeat(n);
    let mut rotation = Tensor::<2>::from_data(TensorData::new(identity, [n, 4]), &q0.device());
    let (mut q, mut v) = (q0, v0 * call.edit.velocity_scale);
    let mut states = vec![Tensor::cat(vec![q.clone(), v.clone(), rotation.clone()], 1)];
    for h in vec![call.dt; call.steps].into_iter().chain(call.last_dt) {
        v = v.clone() + acceleration(&call.config, &call.edit, params.clone(), q.clone(), v) * h;
        let candidate = q.clone() + v.clone() * h;
        q = match &call.supports {
            None => candidate,
            Some(supports) => {
                let fitted = align(&q, &candidate, supports);
                v = match call.velocity_policy {
                    VelocityPolicy::Keep => v,
                    VelocityPolicy::FromPositions => (fitted.aligned.clone() - q.clone()) / h,
                    VelocityPolicy::Rigid => {
                        rigid_velocity(&q, &((q.clone() + fitted.aligned.clone()) * 0.5), &v, supports)
                    }
                };
                rotation = quaternion_product(&fitted.quaternions, &rotation);
                fitted.aligned
            }
        };
        states.push(Tensor::cat(vec![q.clone(), v.clone(), rotation.clone()], 1));
    }
    Tensor::stack(states, 0)
}

/// `a ⊗ b`, `[n, 4]`.
fn quaternion_product(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let (a0, b0) = (columns(a, 0, 1), columns(b, 0, 1));
    let (a_vector, b_vector) = (columns(a, 1, 4), columns(b, 1, 4));
    let scalar = a0.clone() * b0.clone() - (a_vector.clone() * b_vector.clone()).sum_dim(1);
    let vector = a0 * b_vector.clone() + b0 * a_vector.clone() + cross(&a_vector, &b_vector);
    Tensor::cat(vec![scalar, vector], 1)
}
