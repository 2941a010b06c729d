//! What all requests share.

use tokio::sync::watch;

use crate::desk::Desk;
use crate::guard::Guard;

/// The state of a server.
pub(crate) struct Shared {
    pub(crate) desk: Desk,
    pub(crate) hello: String,
    pub(crate) most_pages: usize,
    pub(crate) stop: watch::Receiver<bool>,
    pub(crate) guard: Guard,
}
