//! Who may talk to the server.
//!
//! On a loopback address the `Host` of a request has to be a loopback name, so that no foreign name that was
//! pointed at this machine (DNS rebinding) reaches it. Elsewhere a token is asked for. A request that says
//! where it comes from has to come from the page itself, so that no other site opens a socket.

use axum::http::{HeaderMap, Uri, header};
use std::net::IpAddr;

/// Cookie that holds the token once a page was opened with it.
pub(crate) const COOKIE: &str = "lagrangegs_token";

/// Rules for requests.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    pub(crate) is_loopback: bool,
    pub(crate) token: Option<String>,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// The host is no name of this machine.
    Host,
    /// The request comes from another site.
    Origin,
    /// The token is missing or wrong.
    Token,
}

impl Refusal {
    pub(crate) fn reason(self) -> &'static str {
        match self {
            Self::Host => "this server answers to localhost alone",
            Self::Origin => "the request comes from another site",
            Self::Token => "open the address with the token that the server printed",
        }
    }
}

impl Guard {
    pub(crate) fn check(&self, uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(header::HOST).unwrap_or_default();
        if self.is_loopback && !is_loopback_name(host) {
            return Err(Refusal::Host);
        }
        if let Some(origin) = text(header::ORIGIN) {
            let authority = origin.split_once("://").map(|(_, authority)| authority);
            if authority != Some(host) {
                return Err(Refusal::Origin);
            }
        }
        let Some(token) = &self.token else { return Ok(()) };
        let given = token_in(uri).or_else(|| token_of_cookies(text(header::COOKIE)?));
        if given.is_some_and(|given| is_equal(given, token)) { Ok(()) } else { Err(Refusal::Token) }
    }
}

/// The token in the query of an address.
pub(crate) fn token_in(uri: &Uri) -> Option<&str> {
    uri.query()?.split('&').find_map(|pair| pair.strip_prefix("token="))
}

fn token_of_cookies(cookies: &str) -> Option<&str> {
    cookies.split(';').find_map(|pair| pair.trim().strip_prefix(COOKIE)?.strip_prefix('='))
}

/// Compares in a time that does not tell how much is right.
fn is_equal(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |all, (x, y)| all | (x ^ y)) == 0
}

/// Whether a `Host` names this machine; the port may be that of a tunnel.
fn is_loopback_name(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(guard: &Guard, uri: &str, pairs: &[(header::HeaderName, &str)]) -> Result<(), Refusal> {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.insert(name, value.parse().expect("a header"));
        }
        guard.check(&uri.parse().expect("an address"), &headers)
    }

    #[test]
    fn on_a_loopback_address_only_loopback_names_and_the_page_itself_are_served() {
        let guard = Guard { is_loopback: true, token: None };
        for host in ["localhost:7007", "127.0.0.1:7007", "[::1]:7007", "localhost", "LOCALHOST:1"] {
            assert_eq!(check(&guard, "/", &[(header::HOST, host)]), Ok(()), "{host}");
        }
        for host in ["evil.example:7007", "localhost.evil.example", "", "192.168.0.4:7007"] {
            assert_eq!(check(&guard, "/", &[(header::HOST, host)]), Err(Refusal::Host), "{host}");
        }
        let from =
            |origin| check(&guard, "/socket", &[(header::HOST, "localhost:7007"), (header::ORIGIN, origin)]);
        assert_eq!(from("http://localhost:7007"), Ok(()));
        for origin in ["http://evil.example", "null", "http://localhost:8000"] {
            assert_eq!(from(origin), Err(Refusal::Origin), "{origin}");
        }
    }

    #[test]
    fn elsewhere_a_token_is_asked_for() {
        let guard = Guard { is_loopback: false, token: Some("secret".to_owned()) };
        let host = (header::HOST, "render.example:7007");
        assert_eq!(check(&guard, "/?token=secret", std::slice::from_ref(&host)), Ok(()));
        assert_eq!(check(&guard, "/?a=b&token=secret", std::slice::from_ref(&host)), Ok(()));
        let cookie = (header::COOKIE, "a=b; lagrangegs_token=secret");
        assert_eq!(check(&guard, "/app.js", &[host.clone(), cookie]), Ok(()));
        for uri in ["/", "/?token=", "/?token=secre", "/?token=secret2", "/?nottoken=secret"] {
            assert_eq!(check(&guard, uri, std::slice::from_ref(&host)), Err(Refusal::Token), "{uri}");
        }
    }
}
