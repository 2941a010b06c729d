//! A linear law acting on a rigid body, stepped exactly as a rollout with one support for the whole object
//! steps its particles.
//!
//! With a twist `ω`, kicked velocities around the support's centroid are `N r`, `N = [ω]× + dt (S + B [ω]×)`,
//! and candidates `(I + dt N) r` for a law linear in position and velocity, so that Eq. 6 needs only the
//! anchors' covariance, not the anchors. The next velocities are the twist of the kicked ones, taken at the
//! aligned positions: a free spin stays as it is for ever. A spring pulls all of a ball towards its centre,
//! yet the ball keeps its shape: only with the constraint is such a motion one U and one Q for all particles.

use crate::dense::{
    IDENTITY, M3, V3, add, inverse3, mat_mul, mat_vec, nearest_rotation, rotation_of_vector, scale, sub,
};
use crate::law::Law;

/// Newton steps towards the aligned rotation; it is at rounding after three.
const NEWTON_STEPS: usize = 6;
/// Fixed-point iterations of a step back; each gains a factor of (spin · dt).
const INVERSE_ITERATIONS: usize = 12;

/// Which points of the shape hold the body together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchoring {
    /// Centroid of the anchors, shape axes.
    pub(crate) centroid: V3,
    /// Their covariance, shape axes.
    pub(crate) covariance: M3,
}

impl Anchoring {
    /// Of these shape points.
    pub(crate) fn of(points: &[V3]) -> Self {
        let part = 1.0 / points.len().max(1) as f64;
        let centroid = scale(points.iter().fold([0.0; 3], |sum, &p| add(sum, p)), part);
        let mut covariance = [[0.0; 3]; 3];
        for p in points {
            let r = sub(*p, centroid);
            for i in 0..3 {
                for j in 0..3 {
                    covariance[i][j] += part * r[i] * r[j];
                }
            }
        }
        Self { centroid, covariance }
    }
}

/// State of a rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// World axes from shape axes.
    pub(crate) rotation: M3,
    /// Anchors' centroid, world.
    pub(crate) center: V3,
    /// Velocity of the centroid that Eq. 5 starts from.
    pub(crate) velocity: V3,
    /// Twist rate.
    pub(crate) spin: V3,
}

impl Body {
    /// Position of a shape point.
    #[inline]
    pub(crate) fn position(&self, shape: V3, anchoring: &Anchoring) -> V3 {
        add(self.center, mat_vec(&self.rotation, sub(shape, anchoring.centroid)))
    }

    /// Velocity of a shape point.
    #[inline]
    pub(crate) fn velocity_at(&self, shape: V3, anchoring: &Anchoring) -> V3 {
        add(self.velocity, crate::dense::cross(self.spin, sub(self.position(shape, anchoring), self.center)))
    }

    /// One step of Eq. 5 and Eq. 6.
    pub(crate) fn step(&mut self, law: &Law, anchoring: &Anchoring, dt: f64) {
        law.step(&mut self.center, &mut self.velocity, dt);
        let (turn, spin) = turned(law, &self.rotated_covariance(anchoring), self.spin, dt);
        self.rotation = mat_mul(&turn, &self.rotation);
        self.spin = spin;
    }

    /// The inverse of a step; rotation and spin before it by a fixed point of the forward map.
    pub(crate) fn step_back(&mut self, law: &Law, anchoring: &Anchoring, dt: f64) {
        let Some(inverse) = law.velocity_operator(dt) else { return };
        law.step_back(&mut self.center, &mut self.velocity, dt, &inverse);
        let after = *self;
        for _ in 0..INVERSE_ITERATIONS {
            let (turn, spin) = turned(law, &self.rotated_covariance(anchoring), self.spin, dt);
            self.rotation = mat_mul(&transposed(&turn), &after.rotation);
            self.spin = add(self.spin, sub(after.spin, spin));
        }
    }

    /// The anchors' covariance in world axes.
    fn rotated_covariance(&self, anchoring: &Anchoring) -> M3 {
        mat_mul(&self.rotation, &mat_mul(&anchoring.covariance, &transposed(&self.rotation)))
    }
}

/// Rotation over a step, and the spin after it.
fn turned(law: &Law, covariance: &M3, spin: V3, dt: f64) -> (M3, V3) {
    let map = kicked_map(law, spin, dt);
    let momentum = mat_mul(&map, covariance);
    let candidate: M3 =
        std::array::from_fn(|i| std::array::from_fn(|j| covariance[i][j] + dt * momentum[i][j]));
    let axial =
        [momentum[2][1] - momentum[1][2], momentum[0][2] - momentum[2][0], momentum[1][0] - momentum[0][1]];
    let trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
    let inertia: M3 = std::array::from_fn(|i| {
        std::array::from_fn(|j| if i == j { trace - covariance[i][i] } else { -covariance[i][j] })
    });
    let spin = inverse3(&inertia).map_or(spin, |inverse| mat_vec(&inverse, axial));
    (aligned(&candidate), spin)
}

/// The linear map from offsets to kicked velocities.
fn kicked_map(law: &Law, spin: V3, dt: f64) -> M3 {
    let turning = skew(spin);
    let mut force = skew(law.gyration);
    for (i, row) in force.iter_mut().enumerate() {
        row[i] -= law.damping;
    }
    let forced = mat_mul(&force, &turning);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| turning[i][j] + dt * (law.stiffness[i][j] + forced[i][j]))
    })
}

/// `[a]×`.
fn skew([x, y, z]: V3) -> M3 {
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}

fn transposed(m: &M3) -> M3 {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

/// The rotation that maximises `tr(Rᵀ a)` near the identity: Newton on `RᵀA = AᵀR` (reference §8.4 solved for
/// the rotation itself).
fn aligned(a: &M3) -> M3 {
    let mut rotation = IDENTITY;
    for _ in 0..NEWTON_STEPS {
        let k = mat_mul(&transposed(&rotation), a);
        let trace = k[0][0] + k[1][1] + k[2][2];
        let b = [k[2][1] - k[1][2], k[0][2] - k[2][0], k[1][0] - k[0][1]];
        let system: M3 = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i == j { trace - k[i][i] + 1e-12 * trace } else { -0.5 * (k[i][j] + k[j][i]) }
            })
        });
        let Some(inverse) = inverse3(&system) else { return nearest_rotation(a) };
        let y = mat_vec(&inverse, b);
        let turn2 = y[0] * y[0] + y[1] * y[1] + y[2] * y[2];
        if turn2.is_nan() || turn2 >= 1.0 {
            return nearest_rotation(a);
        }
        rotation = mat_mul(&rotation, &rotation_of_vector(y));
        if y.iter().all(|v| v.abs() < 1e-13) {
            break;
        }
    }
    rotation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::norm2;

    #[test]
    fn a_body_steps_back_where_it_came_from() {
        let mut law = Law::free([0.0; 3]);
        law.gravity = [0.1, 0.0, -2.0];
        law.stiffness = [[-3.0, 0.2, 0.0], [0.2, -1.0, 0.1], [0.0, 0.1, -2.0]];
        law.damping = 0.3;
        law.gyration = [0.2, 0.5, -0.7];
        let anchoring = Anchoring::of(&crate::testing::block([0.3, 0.2, 0.1], 16, 1));
        let start = Body {
            rotation: IDENTITY,
            center: [0.2, 0.1, 0.0],
            velocity: [1.0, 0.0, 0.5],
            spin: [1.0, 2.0, -3.0],
        };
        let mut body = start;
        (0..40).for_each(|_| body.step(&law, &anchoring, 0.01));
        (0..40).for_each(|_| body.step_back(&law, &anchoring, 0.01));
        assert!(
            norm2(sub(body.center, start.center)) < 1e-18 && norm2(sub(body.spin, start.spin)) < 1e-14,
            "{body:?}"
        );
        assert!(norm2(sub(body.rotation[0], IDENTITY[0])) < 1e-12);
    }
}
