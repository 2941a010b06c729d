//! What all requests share.

use std::sync::Arc;

use tokio::sync::watch;

use crate::desk::Desk;
use crate::exhibit::Exhibit;
use crate::guard::Guard;

/// The state of a server.
pub(crate) struct Shared {
    pub(crate) desk: Desk,
    pub(crate) exhibit: Arc<Exhibit>,
    pub(crate) most_pages: usize,
    pub(crate) stop: watch::Receiver<bool>,
    pub(crate) guard: Guard,
}
