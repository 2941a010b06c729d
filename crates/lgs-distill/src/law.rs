//! Laws of motion linear in position and velocity, and their rollout by Eq. 5 in double precision.
//!
//! `a = g + S (q − center) − d v + w × v`: a quadratic potential (uniform field `g`, symmetric stiffness `S`)
//! and the structured force of `findings.md` §2 with constant coefficients (damping `d ≥ 0`, gyroscopic rate
//! `w`). [`Terms`] says which parts a law has; a law with few parts extrapolates far better than one whose
//! extra parts have fitted noise.

use crate::dense::{M3, V3, add, cross, dot, inverse3, mat_vec, norm2, scale, sub, symmetric_eigen};
use serde::{Deserialize, Serialize};

/// Which form the stiffness matrix has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stiffness {
    /// No quadratic part.
    None,
    /// The same in all directions.
    Isotropic,
    /// A restoring force towards an axis: `S = [m]×²`, so that `|m|` is the angular frequency and `m` the
    /// axis.
    Axial,
    /// Any symmetric matrix.
    Full,
}

/// Which terms a law has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terms {
    /// A uniform field.
    pub gravity: bool,
    /// The quadratic part of the potential.
    pub stiffness: Stiffness,
    /// Damping.
    pub damping: bool,
    /// A gyroscopic force.
    pub gyration: bool,
}

impl Terms {
    /// Number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        let stiffness = match self.stiffness {
            Stiffness::None => 0,
            Stiffness::Isotropic => 1,
            Stiffness::Axial => 3,
            Stiffness::Full => 6,
        };
        3 * usize::from(self.gravity) + stiffness + usize::from(self.damping) + 3 * usize::from(self.gyration)
    }

    /// Whether the law has a force besides the potential.
    #[must_use]
    pub fn has_force(&self) -> bool {
        self.damping || self.gyration
    }
}

/// Constants of a law (world units and axes).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Where the stiffness part vanishes.
    pub center: [f64; 3],
    /// Uniform acceleration.
    pub gravity: [f64; 3],
    /// Symmetric matrix, acceleration per displacement from `center`.
    pub stiffness: [[f64; 3]; 3],
    /// Damping rate, ≥ 0.
    pub damping: f64,
    /// Gyroscopic rate: acceleration `gyration × v`.
    pub gyration: [f64; 3],
}

impl Law {
    /// No force at all.
    pub(crate) fn free(center: V3) -> Self {
        Self { center, gravity: [0.0; 3], stiffness: [[0.0; 3]; 3], damping: 0.0, gyration: [0.0; 3] }
    }

    /// The acceleration at a state.
    #[inline]
    pub(crate) fn acceleration(&self, q: V3, v: V3) -> V3 {
        let field = add(self.gravity, mat_vec(&self.stiffness, sub(q, self.center)));
        add(field, sub(cross(self.gyration, v), scale(v, self.damping)))
    }

    /// The velocity that Eq. 5 starts from so that its positions pass through `q` with the derivative
    /// `velocity` (half a kick back, G28).
    #[inline]
    pub(crate) fn starting_velocity(&self, q: V3, velocity: V3, dt: f64) -> V3 {
        sub(velocity, scale(self.acceleration(q, velocity), 0.5 * dt))
    }

    /// One step of Eq. 5.
    #[inline]
    pub(crate) fn step(&self, q: &mut V3, v: &mut V3, dt: f64) {
        *v = add(*v, scale(self.acceleration(*q, *v), dt));
        *q = add(*q, scale(*v, dt));
    }

    /// The exact inverse of [`Self::step`], with the inverse of [`Self::velocity_operator`].
    #[inline]
    pub(crate) fn step_back(&self, q: &mut V3, v: &mut V3, dt: f64, inverse: &M3) {
        *q = sub(*q, scale(*v, dt));
        let field = add(self.gravity, mat_vec(&self.stiffness, sub(*q, self.center)));
        *v = mat_vec(inverse, sub(*v, scale(field, dt)));
    }

    /// `(I + dt·B)⁻¹` where `B v` is the force; `None` if there is no inverse.
    pub(crate) fn velocity_operator(&self, dt: f64) -> Option<M3> {
        let (d, [x, y, z]) = (1.0 - dt * self.damping, scale(self.gyration, dt));
        inverse3(&[[d, -z, y], [z, d, -x], [-y, x, d]])
    }

    /// The constants of `terms` as a list of unknowns.
    pub(crate) fn unknowns(&self, terms: &Terms) -> Vec<f64> {
        let mut p = Vec::with_capacity(terms.unknowns());
        if terms.gravity {
            p.extend(self.gravity);
        }
        let s = &self.stiffness;
        match terms.stiffness {
            Stiffness::None => {}
            Stiffness::Isotropic => p.push((s[0][0] + s[1][1] + s[2][2]) / 3.0),
            Stiffness::Axial => p.extend(axial_vector(s)),
            Stiffness::Full => p.extend([s[0][0], s[1][1], s[2][2], s[0][1], s[0][2], s[1][2]]),
        }
        if terms.damping {
            p.push(self.damping);
        }
        if terms.gyration {
            p.extend(self.gyration);
        }
        p
    }

    /// The law with the unknowns `p` of `terms`, without the others.
    pub(crate) fn with_unknowns(center: V3, terms: &Terms, p: &[f64]) -> Self {
        let mut law = Self::free(center);
        let mut at = 0;
        let mut take = |count: usize| {
            at += count;
            &p[at - count..at]
        };
        if terms.gravity {
            law.gravity.copy_from_slice(take(3));
        }
        match terms.stiffness {
            Stiffness::None => {}
            Stiffness::Isotropic => {
                let s = take(1)[0];
                law.stiffness = [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]];
            }
            Stiffness::Axial => law.stiffness = axial_stiffness(take(3)),
            Stiffness::Full => {
                let s = take(6);
                law.stiffness = [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]];
            }
        }
        if terms.damping {
            law.damping = take(1)[0];
        }
        if terms.gyration {
            law.gyration.copy_from_slice(take(3));
        }
        law
    }
}

/// `[m]×² = m mᵀ − |m|² I`.
fn axial_stiffness(m: &[f64]) -> M3 {
    let square = m.iter().map(|v| v * v).sum::<f64>();
    std::array::from_fn(|i| std::array::from_fn(|j| m[i] * m[j] - if i == j { square } else { 0.0 }))
}

/// The `m` whose `[m]×²` is nearest to a symmetric matrix: along the eigenvector of the largest eigenvalue,
/// as long as the others say.
fn axial_vector(s: &M3) -> V3 {
    let (values, axes) = symmetric_eigen(*s);
    scale(axes[0], (-0.5 * (values[1] + values[2])).max(0.0).sqrt())
}

/// Rows of the acceleration's derivative by the 13 unknowns of the full law (g, S by xx yy zz xy xz yz, d, w)
/// at a state.
pub(crate) fn full_design(q: V3, v: V3) -> [[f64; 13]; 3] {
    let [x, y, z] = q;
    let [u, n, m] = v;
    [
        [1.0, 0.0, 0.0, x, 0.0, 0.0, y, z, 0.0, -u, 0.0, m, -n],
        [0.0, 1.0, 0.0, 0.0, y, 0.0, x, 0.0, z, -n, -m, 0.0, u],
        [0.0, 0.0, 1.0, 0.0, 0.0, z, 0.0, x, y, -m, n, -u, 0.0],
    ]
}

/// Columns of [`full_design`] that `terms` uses, summed within groups; an axial stiffness starts from the
/// full one.
pub(crate) fn active_columns(terms: &Terms) -> Vec<Vec<usize>> {
    let mut columns: Vec<Vec<usize>> = Vec::new();
    if terms.gravity {
        columns.extend((0..3).map(|c| vec![c]));
    }
    match terms.stiffness {
        Stiffness::None => {}
        Stiffness::Isotropic => columns.push(vec![3, 4, 5]),
        Stiffness::Axial | Stiffness::Full => columns.extend((3..9).map(|c| vec![c])),
    }
    if terms.damping {
        columns.push(vec![9]);
    }
    if terms.gyration {
        columns.extend((10..13).map(|c| vec![c]));
    }
    columns
}

/// The largest rate at which the law moves anything by itself, 1/time; a step of a few hundredths of its
/// inverse resolves it.
pub(crate) fn fastest_rate(law: &Law) -> f64 {
    let stiffness = law.stiffness.iter().map(|row| dot(*row, *row)).sum::<f64>().sqrt().sqrt();
    stiffness.max(law.damping.abs()).max(norm2(law.gyration).sqrt())
}

/// The exponent per time at which the potential alone drives positions apart, 0 for a stable one.
pub(crate) fn growth_rate(law: &Law) -> f64 {
    symmetric_eigen(law.stiffness).0[0].max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Law {
        Law {
            center: [0.1, 0.2, 0.3],
            gravity: [0.5, -1.0, -2.0],
            stiffness: [[-4.0, 0.5, 0.1], [0.5, -3.0, 0.2], [0.1, 0.2, 1.0]],
            damping: 0.7,
            gyration: [0.3, -0.8, 2.0],
        }
    }

    #[test]
    fn stepping_back_undoes_stepping() {
        let law = example();
        let inverse = law.velocity_operator(0.01).unwrap();
        let (mut q, mut v) = ([0.3, 0.1, -0.2], [1.0, 0.5, -2.0]);
        for _ in 0..50 {
            law.step(&mut q, &mut v, 0.01);
        }
        for _ in 0..50 {
            law.step_back(&mut q, &mut v, 0.01, &inverse);
        }
        assert!(norm2(sub(q, [0.3, 0.1, -0.2])) < 1e-20 && norm2(sub(v, [1.0, 0.5, -2.0])) < 1e-20);
    }

    #[test]
    fn the_design_matrix_is_the_acceleration() {
        let law = Law { center: [0.0; 3], ..example() };
        let terms = Terms { gravity: true, stiffness: Stiffness::Full, damping: true, gyration: true };
        let (q, v) = ([0.3, 0.1, -0.2], [1.0, 0.5, -2.0]);
        let p = law.unknowns(&terms);
        assert_eq!(Law::with_unknowns(law.center, &terms, &p), law);
        let by_design = full_design(q, v).map(|row| row.iter().zip(&p).map(|(a, b)| a * b).sum::<f64>());
        assert!(norm2(sub(by_design, law.acceleration(q, v))) < 1e-20);
    }

    #[test]
    fn an_axial_stiffness_gives_back_its_axis() {
        let terms = Terms { gravity: false, stiffness: Stiffness::Axial, damping: false, gyration: false };
        let law = Law::with_unknowns([0.0; 3], &terms, &[1.0, -2.0, 0.5]);
        let m = law.unknowns(&terms);
        assert!(
            (norm2(cross(scale([1.0, -2.0, 0.5], 1.0), [m[0], m[1], m[2]]))) < 1e-18
                && (norm2([m[0], m[1], m[2]]) - 5.25).abs() < 1e-9
        );
    }
}
