//! The acceleration of vector coordinates and its derivatives.

use super::applied::{Applied, applied_terms};
use super::kick_field::{KickField, Linearised};
use super::solve::add_scaled;
use super::stepper::Tangent;
use crate::coordinates::{Coordinates, Site, State, Tree};
use crate::edit::Edit;
use crate::law::Law;
use crate::terms::{At, Block, Derivatives};

/// The acceleration field of a law in vector coordinates.
#[derive(Debug)]
pub(crate) struct VectorField<'a> {
    parameters: &'a [f64],
    terms: Vec<Applied>,
    freedoms: usize,
    tree: bool,
    depends_on_velocity: bool,
    derivatives: Derivatives,
    force: Vec<f64>,
    read: Read,
}

/// What terms read at their sites, where it is no part of the state.
#[derive(Debug, Default)]
struct Read {
    y: Vec<f64>,
    w: Vec<f64>,
}

impl<'a> VectorField<'a> {
    pub(crate) fn new(law: &'a Law, edit: &Edit) -> Self {
        let terms = applied_terms(law, edit);
        Self {
            parameters: &law.parameters,
            freedoms: law.coordinates.freedoms(),
            tree: matches!(law.coordinates, Coordinates::Tree(_)),
            depends_on_velocity: terms.iter().any(|term| term.kind.depends_on_velocity()),
            terms,
            derivatives: Derivatives::default(),
            force: Vec::new(),
            read: Read::default(),
        }
    }
}

impl KickField for VectorField<'_> {
    fn freedoms(&self) -> usize {
        self.freedoms
    }

    fn depends_on_velocity(&self) -> bool {
        self.depends_on_velocity
    }

    fn acceleration(&mut self, x: &[f64], v: &[f64], a: &mut [f64]) {
        a.fill(0.0);
        for term in &self.terms {
            let p = &self.parameters[term.parameters.clone()];
            self.force.resize(term.dimension, 0.0);
            for site in &term.sites {
                let at = self.read.at((term, site), (x, v), self.parameters);
                term.kind.force(p, at, &mut self.force);
                push(term, site, (&self.force, self.parameters), a);
            }
        }
        if self.tree {
            tree_acceleration(self.parameters, x, v, a);
        }
    }

    fn linearise(&mut self, x: &[f64], v: &[f64], out: &mut Linearised) {
        let n = self.freedoms;
        out.reset(n, self.parameters.len());
        out.a.fill(0.0);
        for term in &self.terms {
            for site in &term.sites {
                let at = self.read.at((term, site), (x, v), self.parameters);
                term.differentiate(self.parameters, at, &mut self.derivatives);
                self.force.resize(term.dimension, 0.0);
                term.kind.force(&self.parameters[term.parameters.clone()], at, &mut self.force);
                let inverse_mass = site.mass.map(|mass| (mass, 1.0 / self.parameters[mass]));
                scatter(term, site, inverse_mass, (&self.derivatives, &self.force), out);
                push(term, site, (&self.force, self.parameters), &mut out.a);
            }
        }
        if self.tree {
            tree_acceleration(self.parameters, x, v, &mut out.a);
            tree_derivatives(self.parameters, x, v, out);
        }
    }

    fn linearise_by_velocity(&mut self, x: &[f64], v: &[f64], out: &mut Linearised) {
        if self.tree {
            return self.linearise(x, v, out);
        }
        out.v.reset(self.freedoms, self.freedoms);
        for term in self.terms.iter().filter(|term| term.kind.depends_on_velocity()) {
            for site in &term.sites {
                let at = self.read.at((term, site), (x, v), self.parameters);
                term.differentiate(self.parameters, at, &mut self.derivatives);
                let reaction = site.mass.map_or(1.0, |mass| 1.0 / self.parameters[mass]);
                scatter_blocks(term, site, reaction, [(&self.derivatives.w, &mut out.v)]);
            }
        }
    }

    fn drift(&self, state: &mut State, h: f64) {
        add_scaled(&mut state.x, &state.v, h);
    }

    fn drift_tangent(&self, _state: &State, tangent: &mut Tangent, h: f64) {
        add_scaled(&mut tangent.x, &tangent.v, h);
    }
}

impl Read {
    /// Position and velocity at a site of a term.
    fn at<'b>(
        &'b mut self,
        (term, site): (&Applied, &Site),
        (x, v): (&'b [f64], &'b [f64]),
        parameters: &[f64],
    ) -> At<'b> {
        let y = read(site, (x, Some(parameters)), term.dimension, &mut self.y);
        let w = read(site, (v, None), term.dimension, &mut self.w);
        At { y, w }
    }
}

/// The vector of a site, in place if it is a part of the state; of a position with the parameters that hold
/// its offset.
fn read<'b>(
    site: &Site,
    (from, parameters): (&'b [f64], Option<&[f64]>),
    dimension: usize,
    buffer: &'b mut Vec<f64>,
) -> &'b [f64] {
    let plus = &from[site.plus..site.plus + dimension];
    let Some(minus) = site.minus else { return plus };
    let offset = |axis| parameters.map_or(0.0, |parameters| site.offset_in(parameters, axis));
    let apart = plus.iter().zip(&from[minus..minus + dimension]).enumerate();
    buffer.clear();
    buffer.extend(apart.map(|(axis, (a, b))| a - b - offset(axis)));
    buffer
}

/// Adds one application of a term, whose force is known, to an acceleration.
fn push(term: &Applied, site: &Site, (force, parameters): (&[f64], &[f64]), a: &mut [f64]) {
    let reaction = site.mass.map_or(1.0, |mass| 1.0 / parameters[mass]);
    for (axis, force) in force.iter().enumerate() {
        a[site.plus + axis] += term.factor * force;
        if let Some(minus) = site.minus {
            a[minus + axis] -= term.factor * reaction * force;
        }
    }
}

/// The first rows that one application of a term acts on, with its weight there.
fn acted_on(term: &Applied, site: &Site, reaction: f64) -> impl Iterator<Item = (usize, f64)> {
    let minus = site.minus.map(|minus| (minus, -term.factor * reaction));
    [Some((site.plus, term.factor)), minus].into_iter().flatten()
}

/// Adds derivatives of the force of one application of a term by position or velocity, `[d, d]` each.
fn scatter_blocks<const N: usize>(
    term: &Applied,
    site: &Site,
    reaction: f64,
    blocks: [(&Block, &mut Block); N],
) {
    let d = term.dimension;
    for (from, out) in blocks {
        for (first, weight) in acted_on(term, site, reaction) {
            let places = [Some((site.plus, weight)), site.minus.map(|minus| (minus, -weight))];
            for (place, weight) in places.into_iter().flatten() {
                for i in 0..d {
                    add_scaled(&mut out.row_mut(first + i)[place..place + d], from.row(i), weight);
                }
            }
        }
    }
}

/// Adds the derivatives of one application of a term.
fn scatter(
    term: &Applied,
    site: &Site,
    inverse_mass: Option<(usize, f64)>,
    (from, force): (&Derivatives, &[f64]),
    out: &mut Linearised,
) {
    let d = term.dimension;
    let reaction = inverse_mass.map_or(1.0, |(_, inverse)| inverse);
    scatter_blocks(term, site, reaction, [(&from.y, &mut out.x), (&from.w, &mut out.v)]);
    for (first, weight) in acted_on(term, site, reaction) {
        for i in 0..d {
            add_scaled(&mut out.p.row_mut(first + i)[term.parameters.clone()], from.p.row(i), weight);
            for (offset, j) in site.offset.iter().flat_map(|offset| (0..d).map(move |j| (offset + j, j))) {
                out.p[(first + i, offset)] -= weight * from.y[(i, j)];
            }
        }
    }
    if let (Some((mass, inverse)), Some(minus)) = (inverse_mass, site.minus) {
        for (i, f) in force.iter().enumerate() {
            out.p[(minus + i, mass)] += term.factor * inverse * inverse * f;
        }
    }
}

/// Turns generalised forces into accelerations: `a = M⁻¹ (G − s (v₂², −v₁²)ᵀ)`, with `s = −∂(c cos)/∂θ₁`.
fn tree_acceleration(p: &[f64], x: &[f64], v: &[f64], a: &mut [f64]) {
    let [ratio, mixed, slope] = Tree::mass(p, x);
    // d/dt(M v) − ½ ∂(v·Mv)/∂x: only c cos(θ₁ − θ₂ + φ) depends on the angles.
    let first = a[0] + slope * v[1] * v[1];
    let second = a[1] - slope * v[0] * v[0];
    let determinant = ratio - mixed * mixed;
    a[0] = (ratio * first - mixed * second) / determinant;
    a[1] = (second - mixed * first) / determinant;
}

/// Turns derivatives of generalised forces into those of the accelerations `a`, which are known: `M δa = δG −
/// δc − δM a`.
fn tree_derivatives(p: &[f64], x: &[f64], v: &[f64], out: &mut Linearised) {
    let [ratio, mixed, slope] = Tree::mass(p, x);
    let (a1, a2) = (out.a[0], out.a[1]);
    // By the angle θ₁ − θ₂ + φ: mixed' = slope, slope' = −mixed.
    let by_angle = [-mixed * v[1] * v[1] - slope * a2, mixed * v[0] * v[0] - slope * a1];
    for (row, value) in by_angle.into_iter().enumerate() {
        out.x[(row, 0)] += value;
        out.x[(row, 1)] -= value;
        out.p[(row, 2)] += value;
    }
    out.v[(0, 1)] += 2.0 * slope * v[1];
    out.v[(1, 0)] -= 2.0 * slope * v[0];
    // Both are proportional to the coupling and to the root of the ratio.
    let by_mixed = [slope * v[1] * v[1] - mixed * a2, -slope * v[0] * v[0] - mixed * a1];
    let [_, unit_mixed, unit_slope] = Tree::mass(&[ratio, 1.0, p[2]], x);
    out.p[(0, 1)] += unit_slope * v[1] * v[1] - unit_mixed * a2;
    out.p[(1, 1)] -= unit_slope * v[0] * v[0] + unit_mixed * a1;
    (0..2).for_each(|row| out.p[(row, 0)] += 0.5 * by_mixed[row] / ratio);
    out.p[(1, 0)] -= a2;
    let determinant = ratio - mixed * mixed;
    for block in [&mut out.x, &mut out.v, &mut out.p] {
        for column in 0..block.columns() {
            let (first, second) = (block[(0, column)], block[(1, column)]);
            block[(0, column)] = (ratio * first - mixed * second) / determinant;
            block[(1, column)] = (second - mixed * first) / determinant;
        }
    }
}
