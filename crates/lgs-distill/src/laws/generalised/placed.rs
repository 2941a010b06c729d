//! A law with its start and the places of its bodies, as functions of everything that was estimated: start,
//! parameters, and the geometry of coordinates and bodies.

use super::kinematics::Configured;
use crate::motion::pose::Pose;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{quaternion, rotation_by};
use lgs_mechanics::coordinates::{Coordinates, Embedding, Placement, Port, State};
use lgs_mechanics::fit::Fitted;
use lgs_mechanics::{Edit, Law, System};

/// A law with its start and the places of its bodies.
#[derive(Clone)]
pub(super) struct Placed {
    pub(super) law: Law,
    pub(super) start: State,
    /// The configuration in which the bodies have their known poses.
    reference: Vec<f64>,
    /// Pose of the shape of each body there, in the order of the coordinates.
    pub(super) bases: Vec<Pose>,
    /// Whether the centre of mass of a free body is a point of its shape to be found.
    finds_center: bool,
}

impl Placed {
    /// A fitted law in its system of coordinates.
    pub(super) fn new(system: &Configured, fitted: &Fitted) -> Self {
        let finds_center = system.constants > 0 && matches!(system.coordinates, Coordinates::Rigid(_));
        Self { finds_center, ..Self::at(fitted, system.poses_in(&fitted.start.x)) }
    }

    /// A fitted law whose bodies have these poses at the start.
    pub(super) fn at(fitted: &Fitted, bases: Vec<Pose>) -> Self {
        Self {
            law: fitted.law.clone(),
            start: fitted.start.clone(),
            reference: fitted.start.x.clone(),
            bases,
            finds_center: false,
        }
    }

    /// The same bodies under another law in coordinates of the same kind.
    pub(super) fn with_law(&self, law: &Law) -> Self {
        Self { law: law.clone(), ..self.clone() }
    }

    /// Poses of the bodies at some times, `[times][bodies]`; `None` if the motion cannot be followed.
    pub(super) fn poses(&self, times: &[f64]) -> Option<Vec<Vec<Pose>>> {
        let states = System::new(&self.law, Edit::NONE).states(&self.start, times).ok()?;
        Some(states.iter().map(|state| self.poses_in(&state.x)).collect())
    }

    /// The same at ascending times, as far as past and future can be followed.
    pub(super) fn poses_followed(&self, times: &[f64]) -> Vec<Option<Vec<Pose>>> {
        let states = System::new(&self.law, Edit::NONE).states_followed(&self.start, times);
        states.into_iter().map(|state| state.map(|state| self.poses_in(&state.x))).collect()
    }

    /// Poses of the bodies at the start.
    pub(super) fn bases_at_start(&self) -> Vec<Pose> {
        self.poses_in(&self.start.x)
    }

    fn poses_in(&self, x: &[f64]) -> Vec<Pose> {
        let placed = Embedding::new(&self.law.coordinates, &self.reference).placements(x);
        placed.iter().zip(&self.bases).map(|(place, base)| after(place, base)).collect()
    }

    /// Unknowns of start and parameters, which come first.
    pub(super) fn motion(&self) -> usize {
        2 * self.start.v.len() + self.law.parameters.len()
    }

    /// Whether each of the constants of the geometry is an angle or a share, and not a length: those of the
    /// coordinates, then those of each body in them. A body's turn along the coordinates is one of the start.
    /// Points have none that move with their law, nor have free bodies about the centre of their particles.
    pub(super) fn geometry(&self) -> Vec<bool> {
        let own = self.law.coordinates.geometry_turns();
        let of_body: &[bool] = match &self.law.coordinates {
            Coordinates::Hinge(_) | Coordinates::Rolling(_) | Coordinates::Tree(_) => {
                &[true, true, false, false, false]
            }
            Coordinates::Ball(_) => &[false; 3],
            Coordinates::Rigid(_) if self.finds_center => &[],
            Coordinates::Modal(_) if self.has_normal_modes() => &[],
            _ => return Vec::new(),
        };
        [own, of_body.repeat(self.bases.len())].concat()
    }

    /// The same bodies by another fit of the law, or of one in the same coordinates.
    pub(super) fn with_fit(&self, fitted: &Fitted) -> Self {
        Self { law: fitted.law.clone(), start: fitted.start.clone(), ..self.clone() }
    }

    /// The centre of mass in shape axes, where it was to be found.
    pub(super) fn center_of_mass(&self) -> Option<DVec3> {
        let base = &self.bases[0];
        let center = || DVec3::from_slice(&self.reference[4..]);
        self.finds_center.then(|| base.linear.transpose() * (center() - base.shift))
    }

    /// Places of the centre of mass among the constants of the geometry. Rotations about one axis tell
    /// nothing of it along that.
    pub(super) fn center(&self) -> std::ops::Range<usize> {
        match &self.law.coordinates {
            Coordinates::Rigid(_) if self.finds_center => 0..3,
            Coordinates::Modal(modal) if modal.flies() && self.has_normal_modes() => {
                let all = self.law.coordinates.geometry();
                all - 3..all
            }
            _ => 0..0,
        }
    }

    /// The configuration in which the bodies have their known poses.
    pub(super) fn reference(&self) -> &[f64] {
        &self.reference
    }

    /// Whether each mode moves by itself, so that modes need not be orthogonal in the particles.
    pub(super) fn has_normal_modes(&self) -> bool {
        let own = || self.law.terms.iter().filter(|term| term.port != Port::Center);
        own().count() > 0 && own().all(|term| term.kind.name().ends_with("-diagonal"))
    }

    /// The number of these modes.
    pub(super) fn modes(&self) -> usize {
        let Coordinates::Modal(modal) = &self.law.coordinates else { return 0 };
        modal.deformation().len()
    }

    /// The same with other values: changes of the configuration at the start, of the velocities, of the
    /// parameters and of the geometry.
    pub(super) fn changed(&self, by: &[f64]) -> Self {
        let mut changed = self.clone();
        let n = self.start.v.len();
        let (motion, geometry) = by.split_at(self.motion());
        if !geometry.is_empty() {
            changed.change_geometry(geometry);
        }
        let Self { law, start, .. } = &mut changed;
        start.x = law.coordinates.retract(&start.x, &motion[..n]);
        start.v.iter_mut().zip(&motion[n..2 * n]).for_each(|(v, change)| *v += change);
        law.parameters.iter_mut().zip(&motion[2 * n..]).for_each(|(p, change)| *p += change);
        changed
    }

    fn change_geometry(&mut self, by: &[f64]) {
        let (of_joint, of_bodies) = by.split_at(self.law.coordinates.geometry());
        let Self { law, start, reference, bases, .. } = self;
        if let Coordinates::Modal(_) = law.coordinates {
            // What stays is the body at rest.
            let zero = vec![0.0; reference.len()];
            let rest = after(&Embedding::new(&law.coordinates, reference).placements(&zero)[0], &bases[0]);
            law.coordinates.change_geometry(start, of_joint);
            let placed = Embedding::new(&law.coordinates, &zero).placements(reference);
            bases[0] = after(&placed[0], &rest);
            return;
        }
        law.coordinates.change_geometry(start, of_joint);
        if let Coordinates::Rigid(_) = law.coordinates {
            // The body stays where it is while another point of it is followed.
            let offset = quaternion(reference).normalize() * DVec3::from_slice(of_joint);
            reference[4..].iter_mut().zip(offset.to_array()).for_each(|(x, by)| *x += by);
            return;
        }
        let count = of_bodies.len() / bases.len().max(1);
        for (base, by) in bases.iter_mut().zip(of_bodies.chunks_exact(count.max(1))) {
            match &mut law.coordinates {
                Coordinates::Hinge(hinge) => move_body(base, hinge.axis, by),
                Coordinates::Rolling(rolling) => move_body(base, rolling.axis, by),
                Coordinates::Tree(tree) => move_body(base, tree.axis, by),
                Coordinates::Ball(ball) => {
                    base.shift += DVec3::from_slice(by);
                    if DVec3::from(ball.arm) != DVec3::ZERO {
                        // The centre of mass is the particles'.
                        let own = quaternion(reference).normalize().inverse() * DVec3::from_slice(by);
                        ball.arm = (DVec3::from(ball.arm) + own).to_array();
                    }
                }
                _ => {}
            }
        }
    }
}

/// Turns a body by the first two of some changes across an axis, and shifts it by the others.
fn move_body(base: &mut Pose, axis: [f64; 3], by: &[f64]) {
    let (first, second) = DVec3::from_array(axis).any_orthonormal_pair();
    base.linear = rotation_by(first * by[0] + second * by[1]) * base.linear;
    base.shift += DVec3::from_slice(&by[2..]);
}

fn after(place: &Placement, pose: &Pose) -> Pose {
    let linear: DMat3 = place.linear;
    Pose { linear: linear * pose.linear, shift: place.apply(pose.shift) }
}
