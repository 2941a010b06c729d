//! Fits of laws with a contact to tracks that bounce (method §5.7).

mod bounced;
mod fit;

pub use bounced::Bounced;
pub use fit::fit;
