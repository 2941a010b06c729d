//! The terms of a linear law: the one type that knows which unknowns a law has. Fits and choices of laws ask
//! it and name no term.

use super::law::Law;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, principal_axes, scalar, symmetric, trace};
use lgs_dynamics::{ForceKind, Normalisation};
use serde::{Deserialize, Serialize};

/// The form of the stiffness matrix.
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

/// The terms that a law has.
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

/// Number of unknowns of the law with every term: g, S by xx yy zz xy xz yz, d, w.
pub(crate) const ALL_UNKNOWNS: usize = 13;
/// Places of the stiffness among them.
const STIFFNESS: std::ops::Range<usize> = 3..9;
/// Place of the damping among them.
const DAMPING: usize = 9;

impl Terms {
    /// No term.
    pub(crate) const NONE: Self =
        Self { gravity: false, stiffness: Stiffness::None, damping: false, gyration: false };
    /// Every term, the stiffness in its most general form.
    pub(crate) const ALL: Self =
        Self { gravity: true, stiffness: Stiffness::Full, damping: true, gyration: true };

    /// Laws to choose from, in order of preference: fewer unknowns first, potentials before forces except for
    /// plain damping. Without a structured force none has one.
    pub(crate) fn candidates(force: ForceKind) -> Vec<Self> {
        use Stiffness::{Axial, Full, Isotropic};
        let field = Self { gravity: true, ..Self::NONE };
        let elastic = |stiffness| Self { stiffness, ..field };
        let damped = |terms| Self { damping: true, ..terms };
        let gyroscopic = |terms| Self { gyration: true, ..terms };
        let (isotropic, axial, full) = (elastic(Isotropic), elastic(Axial), elastic(Full));
        if force != ForceKind::Structured {
            return vec![Self::NONE, field, isotropic, axial, full];
        }
        let mut all = vec![Self::NONE, field, damped(Self::NONE), damped(field), isotropic, axial, full];
        all.extend([damped(isotropic), damped(axial), damped(full)]);
        all.extend([gyroscopic(Self::NONE), gyroscopic(field), gyroscopic(damped(field))]);
        all.extend([isotropic, axial, full, damped(full)].map(gyroscopic));
        all
    }

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

    /// Whether nothing in the law keeps an object near where it was seen.
    pub(crate) fn is_unconfined(&self) -> bool {
        self.stiffness == Stiffness::None && !self.gyration
    }

    /// The unknowns of a law, those of terms that it does not have left out.
    pub(crate) fn unknowns_of(&self, law: &Law) -> Vec<f64> {
        let mut unknowns = Vec::with_capacity(self.unknowns());
        if self.gravity {
            unknowns.extend(law.gravity.to_array());
        }
        let s = &law.stiffness;
        match self.stiffness {
            Stiffness::None => {}
            Stiffness::Isotropic => unknowns.push(trace(s) / 3.0),
            Stiffness::Axial => unknowns.extend(axial_vector(s).to_array()),
            Stiffness::Full => {
                unknowns.extend([s.x_axis.x, s.y_axis.y, s.z_axis.z, s.y_axis.x, s.z_axis.x, s.z_axis.y]);
            }
        }
        if self.damping {
            unknowns.push(law.damping);
        }
        if self.gyration {
            unknowns.extend(law.gyration.to_array());
        }
        unknowns
    }

    /// The law about a centre with these unknowns; `unknowns` has [`Self::unknowns`] values.
    pub(crate) fn law(&self, center: DVec3, unknowns: &[f64]) -> Law {
        let mut law = Law::free(center);
        let mut at = 0;
        let mut take = |count: usize| {
            at += count;
            &unknowns[at - count..at]
        };
        if self.gravity {
            law.gravity = DVec3::from_slice(take(3));
        }
        law.stiffness = match self.stiffness {
            Stiffness::None => DMat3::ZERO,
            Stiffness::Isotropic => scalar(take(1)[0]),
            Stiffness::Axial => axial_stiffness(DVec3::from_slice(take(3))),
            Stiffness::Full => symmetric(take(6)),
        };
        if self.damping {
            law.damping = take(1)[0];
        }
        if self.gyration {
            law.gyration = DVec3::from_slice(take(3));
        }
        law
    }

    /// For each unknown of a linear fit the places among [`ALL_UNKNOWNS`] that it stands for; an axial
    /// stiffness is fitted as a full one.
    pub(crate) fn columns(&self) -> Vec<Vec<usize>> {
        let single = |places: std::ops::Range<usize>| places.map(|c| vec![c]);
        let mut columns: Vec<Vec<usize>> = Vec::new();
        if self.gravity {
            columns.extend(single(0..3));
        }
        match self.stiffness {
            Stiffness::None => {}
            Stiffness::Isotropic => columns.push(vec![3, 4, 5]),
            Stiffness::Axial | Stiffness::Full => columns.extend(single(STIFFNESS)),
        }
        if self.damping {
            columns.push(vec![DAMPING]);
        }
        if self.gyration {
            columns.extend(single(10..13));
        }
        columns
    }

    /// The places that share the ridge of the largest of them with this one: stiffness along directions that
    /// are hardly visited is noise.
    pub(crate) fn ridge_group(place: usize) -> std::ops::Range<usize> {
        if STIFFNESS.contains(&place) { STIFFNESS } else { place..place + 1 }
    }

    /// The law that a linear fit of all unknowns has found, reduced to these terms and to what a body can
    /// have.
    pub(crate) fn law_of_fit(&self, center: DVec3, mut all: [f64; ALL_UNKNOWNS]) -> Law {
        all[DAMPING] = all[DAMPING].max(0.0);
        self.law(center, &self.unknowns_of(&Self::ALL.law(center, &all)))
    }

    /// The size of each unknown that changes an object's motion noticeably, world units.
    pub(crate) fn units(&self, scales: &Normalisation) -> Vec<f64> {
        let [length, speed, acceleration] = [scales.length, scales.speed, scales.acceleration].map(f64::from);
        let stiffness = acceleration / length;
        let stiffness = if self.stiffness == Stiffness::Axial { stiffness.sqrt() } else { stiffness };
        let elastic = Self { stiffness: self.stiffness, ..Self::NONE }.unknowns();
        let mut units = vec![acceleration; 3 * usize::from(self.gravity)];
        units.resize(units.len() + elastic, stiffness);
        units.resize(self.unknowns(), acceleration / speed);
        units
    }

    /// The fewest terms that hold a law to within a part `rounding` of its scales.
    pub(crate) fn of_law(law: &Law, scales: &Normalisation, rounding: f64) -> Self {
        let [length, speed, acceleration] = [scales.length, scales.speed, scales.acceleration].map(f64::from);
        let rate = acceleration / speed;
        Self {
            gravity: law.gravity.abs().max_element() > rounding * acceleration,
            stiffness: Stiffness::of(&law.stiffness, acceleration / length, rounding),
            damping: law.damping > rounding * rate,
            gyration: law.gyration.abs().max_element() > rounding * rate,
        }
    }
}

impl Stiffness {
    /// The least general form of a matrix, to within a part `rounding` of its largest entry; none if that is
    /// below the same part of `scale`.
    fn of(stiffness: &DMat3, scale: f64, rounding: f64) -> Self {
        let largest = |m: &DMat3| m.to_cols_array().iter().fold(0.0_f64, |most, v| v.abs().max(most));
        let norm = largest(stiffness);
        if norm <= rounding * scale {
            return Self::None;
        }
        let holds = |form: Self| {
            let terms = Terms { stiffness: form, ..Terms::NONE };
            let law = Law { stiffness: *stiffness, ..Law::free(DVec3::ZERO) };
            let again = terms.law(law.center, &terms.unknowns_of(&law)).stiffness;
            largest(&(again - *stiffness)) <= rounding * norm
        };
        [Self::Isotropic, Self::Axial].into_iter().find(|&form| holds(form)).unwrap_or(Self::Full)
    }
}

/// `[m]×² = m mᵀ − |m|² I`.
fn axial_stiffness(m: DVec3) -> DMat3 {
    outer(m, m) - scalar(m.length_squared())
}

/// The `m` whose `[m]×²` is nearest to a symmetric matrix: along the eigenvector of the largest eigenvalue,
/// as long as the others say.
fn axial_vector(s: &DMat3) -> DVec3 {
    let [(_, axis), (second, _), (third, _)] = principal_axes(s);
    (-0.5 * (second + third)).max(0.0).sqrt() * axis
}

/// Rows of the acceleration's derivative by all unknowns at a state, positions from the law's centre.
pub(crate) fn design(q: DVec3, v: DVec3) -> [[f64; ALL_UNKNOWNS]; 3] {
    let ([x, y, z], [u, n, m]) = (q.to_array(), v.to_array());
    [
        [1.0, 0.0, 0.0, x, 0.0, 0.0, y, z, 0.0, -u, 0.0, m, -n],
        [0.0, 1.0, 0.0, 0.0, y, 0.0, x, 0.0, z, -n, -m, 0.0, u],
        [0.0, 0.0, 1.0, 0.0, 0.0, z, 0.0, x, y, -m, n, -u, 0.0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::linear::law::example;

    #[test]
    fn the_design_matrix_is_the_acceleration() {
        let law = Law { center: DVec3::ZERO, ..example() };
        let (q, v) = (DVec3::new(0.3, 0.1, -0.2), DVec3::new(1.0, 0.5, -2.0));
        let unknowns = Terms::ALL.unknowns_of(&law);
        assert_eq!(Terms::ALL.law(law.center, &unknowns), law);
        let product = |row: [f64; ALL_UNKNOWNS]| row.iter().zip(&unknowns).map(|(a, b)| a * b).sum::<f64>();
        let by_design = DVec3::from(design(q, v).map(product));
        assert!(by_design.distance(law.acceleration(q, v)) < 1e-10);
    }

    #[test]
    fn an_axial_stiffness_gives_back_its_axis() {
        let terms = Terms { stiffness: Stiffness::Axial, ..Terms::NONE };
        let axis = DVec3::new(1.0, -2.0, 0.5);
        let found = DVec3::from_slice(&terms.unknowns_of(&terms.law(DVec3::ZERO, &axis.to_array())));
        assert!(axis.cross(found).length() < 1e-9 && (found.length_squared() - 5.25).abs() < 1e-9);
    }

    #[test]
    fn a_stiffness_is_read_in_its_least_general_form() {
        let diagonal = |x, y, z| DMat3::from_diagonal(DVec3::new(x, y, z));
        let axial = axial_stiffness(DVec3::new(0.6, -1.1, 0.3));
        let full = axial + diagonal(0.0, -0.1, 0.0);
        let forms = [
            (DMat3::ZERO, Stiffness::None),
            (scalar(-2.0), Stiffness::Isotropic),
            (diagonal(-3.0, -3.0, 0.0), Stiffness::Axial),
            (axial, Stiffness::Axial),
            (full, Stiffness::Full),
        ];
        for (stiffness, form) in forms {
            assert_eq!(Stiffness::of(&stiffness, 1.0, 1e-4), form, "{stiffness}");
        }
    }
}
