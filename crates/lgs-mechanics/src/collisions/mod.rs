//! Fits of laws with a contact to tracks that bounce, and of laws to tracks that something strikes (method
//! §5.7).

mod body;
mod bounced;
mod bouncing;
mod drawn;
mod effort;
mod explain;
mod fit;
mod flights;
mod freedom;
mod grounds;
mod laws;
mod meeting;
mod plane_of_impact;
mod samples;
mod struck;
mod thresholds;
mod walls;

pub use body::{Body, Observed};
pub use bounced::Bounced;
pub use explain::explain;
pub use fit::fit;
