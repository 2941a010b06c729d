//! Contact of a body with a plane: impacts with restitution and Coulomb friction, and rest (method §5.7).
//!
//! A body touches the plane with the extreme points of its hull, or with a sphere around its centre. Between
//! impacts it moves by its law as if there were no plane. An impact is found in time where the first point
//! touches; impulses at all touching points then stop the approach, faster ones with restitution. Points that
//! close more slowly than the resting speed stay closed, held by impulses in small steps: a body at rest
//! neither jitters nor sinks.

mod impact;
mod impulses;
mod manifold;
mod observed;
mod plane;
mod points;
mod surfaces;

pub(crate) use impact::impacts_above;
pub use impact::{Impact, impacts, noticeable, pieces};
pub use observed::{Ground, planes};
pub use plane::Plane;
pub use points::{Surface, extreme_points};
pub use surfaces::{Contact, Origin};

pub(crate) use impact::check_order;
pub(crate) use impulses::{Body, Touch, solve};
pub(crate) use manifold::carrying;
