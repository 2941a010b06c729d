//! The web server: the page, and the socket by which it asks for pictures.

use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use rand::RngExt;
use tokio::sync::watch;

use crate::desk::Desk;
use crate::error::ViewError;
use crate::exhibit::Exhibit;
use crate::guard::{COOKIE, Guard, token_in};
use crate::page;
use crate::shared::Shared;
use crate::socket;
use crate::thresholds::LARGEST_MESSAGE;
use crate::worker::work;

/// Where and for whom the viewer serves.
#[derive(Clone, Debug)]
pub struct Options {
    /// Address to listen on.
    pub host: IpAddr,
    /// Port to listen on; 0 for a free one.
    pub port: u16,
    /// Token that requests have to bring. Off a loopback address there always is one: a random one if none
    /// is given.
    pub token: Option<String>,
    /// Most memory of kept rollouts, bytes.
    pub cache_bytes: usize,
    /// Most pages at a time.
    pub most_pages: usize,
}

/// A server that listens and does not serve yet.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    guard: Guard,
    options: Options,
    stop: watch::Sender<bool>,
}

/// Ends a server from elsewhere.
#[derive(Clone)]
pub struct Stopper(watch::Sender<bool>);

impl Stopper {
    /// Ends the server: pages are told, and [`Server::run`] returns.
    pub fn stop(&self) {
        self.0.send_replace(true);
    }
}

impl Server {
    /// Listens.
    ///
    /// # Errors
    /// If the address cannot be had, or the token cannot stand in an address.
    pub fn bind(options: Options) -> Result<Self, ViewError> {
        let is_loopback = options.host.is_loopback();
        let token = options.token.clone().or_else(|| (!is_loopback).then(random_token));
        if token.as_deref().is_some_and(|token| !is_token(token)) {
            return Err(ViewError::Token);
        }
        let address = SocketAddr::new(options.host, options.port);
        let fault = |reason| ViewError::Address { address, reason };
        let listener = TcpListener::bind(address).map_err(fault)?;
        let address = listener.local_addr()?;
        let (stop, _) = watch::channel(false);
        Ok(Self { listener, address, guard: Guard { is_loopback, token }, options, stop })
    }

    /// The address to open, with the token if there is one.
    #[must_use]
    pub fn url(&self) -> String {
        let token = self.guard.token.as_ref().map_or(String::new(), |token| format!("?token={token}"));
        format!("http://{}/{token}", self.address)
    }

    /// A way to end the server.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(self.stop.clone())
    }

    /// Serves until it is stopped.
    ///
    /// # Errors
    /// If the server fails as a whole; faults of a single page end that page's connection alone.
    pub fn run(self, exhibit: &Arc<Exhibit>) -> Result<(), ViewError> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        let shared = Arc::new(Shared {
            desk: Desk::default(),
            exhibit: Arc::clone(exhibit),
            most_pages: self.options.most_pages,
            stop: self.stop.subscribe(),
            guard: self.guard,
        });
        self.listener.set_nonblocking(true)?;
        std::thread::scope(|scope| {
            scope.spawn(|| work(exhibit, &shared.desk, self.options.cache_bytes));
            let served = runtime.block_on(serve(self.listener, Arc::clone(&shared)));
            shared.desk.close();
            served
        })?;
        Ok(())
    }
}

async fn serve(listener: TcpListener, shared: Arc<Shared>) -> std::io::Result<()> {
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let stopped = stopped(shared.stop.clone());
    axum::serve(listener, router(shared)).with_graceful_shutdown(stopped).await
}

async fn stopped(mut stop: watch::Receiver<bool>) {
    let _ = stop.wait_for(|stopped| *stopped).await;
}

fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/socket", get(open_socket))
        .fallback(get(file))
        .layer(from_fn_with_state(Arc::clone(&shared), guarded))
        .with_state(shared)
}

async fn open_socket(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    upgrade.max_message_size(LARGEST_MESSAGE).on_upgrade(|socket| socket::serve(socket, shared))
}

/// A file of the page; nothing else is there.
async fn file(State(shared): State<Arc<Shared>>, uri: Uri) -> Response {
    let Some((mime, text)) = page::file(uri.path()) else {
        return (StatusCode::NOT_FOUND, "no such page\n").into_response();
    };
    let mut response = ([(header::CONTENT_TYPE, mime)], text).into_response();
    if let (Some(token), Some(_)) = (&shared.guard.token, token_in(&uri)) {
        let cookie = format!("{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/");
        if let Ok(value) = HeaderValue::from_str(&cookie) {
            response.headers_mut().insert(header::SET_COOKIE, value);
        }
    }
    response
}

/// Lets through what the guard allows, and tells browsers to load nothing from elsewhere.
async fn guarded(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let mut response = match shared.guard.check(request.uri(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => (StatusCode::FORBIDDEN, format!("{}\n", refusal.reason())).into_response(),
    };
    protect(response.headers_mut());
    response
}

fn protect(headers: &mut HeaderMap) {
    const POLICY: &str = "default-src 'self'; img-src 'self' blob:; object-src 'none'; \
                          base-uri 'none'; frame-ancestors 'none'";
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
}

/// 128 random bits in hexadecimal digits.
#[allow(clippy::disallowed_methods, reason = "a seed would let others foretell the token")]
fn random_token() -> String {
    format!("{:032x}", rand::rng().random::<u128>())
}

fn is_token(token: &str) -> bool {
    token.len() >= 8 && token.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_')
}
