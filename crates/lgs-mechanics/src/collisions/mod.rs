//! Fits of laws with a contact to tracks that bounce, and of laws to tracks that something strikes (method
//! §5.7).

mod body;
mod bounced;
mod bouncing;
mod effort;
mod fit;
mod flights;
mod freedom;
mod grounds;
mod laws;
mod plane_of_impact;
mod samples;
mod struck;

pub use body::{Body, Observed};
pub use bounced::Bounced;
pub use fit::{explain, fit};
