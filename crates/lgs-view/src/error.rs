//! Errors of the server.

use std::io;
use std::net::SocketAddr;

/// Why the viewer does not run.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {reason}; choose another --port, or --port 0 for a free one")]
    Address {
        /// The address.
        address: SocketAddr,
        /// The reason.
        #[source]
        reason: io::Error,
    },
    /// The server stopped.
    #[error("the server stopped")]
    Server(#[from] io::Error),
    /// The token cannot stand in an address.
    #[error("a token has letters, digits, `-` and `_` alone, and at least 8 of them")]
    Token,
}
