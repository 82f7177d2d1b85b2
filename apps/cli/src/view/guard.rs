//! Who may ask: whoever has the token, under a name that is this machine's, from this page and no other.
//!
//! A page of another site can make a browser send requests here, and by rebinding its own name to this address even read
//! the answers. The `Host` such a browser sends has that site's name, so only addresses, `localhost` and the name that was
//! given by `--host` are answered; its `Origin` is the other site, so only our own may open the socket.

use axum::http::{HeaderMap, HeaderValue, header};
use std::fmt::Write;
use std::net::IpAddr;

/// Bytes of the token: more than anybody tries.
const TOKEN: usize = 16;

/// What is asked of every request.
pub struct Guard {
    token: String,
    /// A name besides addresses and `localhost`.
    name: Option<String>,
}

/// Why a request is refused.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It went to another name.
    #[error("this server is not asked by that name; open the address that `radiosity view` printed")]
    Host,
    /// It came from another page.
    #[error("requests from other pages are refused")]
    Origin,
    /// It lacks the token.
    #[error("the address lacks its token, or has an old one; open the address that `radiosity view` printed")]
    Token,
}

impl Guard {
    /// With a new token; `host` as the user gave it.
    pub fn new(host: &str) -> Result<Guard, getrandom::Error> {
        let mut bytes = [0; TOKEN];
        getrandom::fill(&mut bytes)?;
        let mut token = String::new();
        for byte in bytes {
            let _ = write!(token, "{byte:02x}");
        }
        let name = host.parse::<IpAddr>().is_err().then(|| host.to_ascii_lowercase());
        Ok(Guard { token, name })
    }

    /// The token.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Whether a request is answered; one that opens a socket must say where it comes from.
    pub fn check(&self, path: &str, headers: &HeaderMap, opens_socket: bool) -> Result<(), Refusal> {
        let host = single(headers, header::HOST).and_then(|host| host.to_str().ok()).ok_or(Refusal::Host)?;
        if !self.is_ours(host) {
            return Err(Refusal::Host);
        }
        let has_origin = headers.contains_key(header::ORIGIN);
        let origin = single(headers, header::ORIGIN).and_then(|origin| origin.to_str().ok());
        let is_own = origin.is_some_and(|origin| origin.eq_ignore_ascii_case(&format!("http://{host}")));
        if (has_origin || opens_socket) && !is_own {
            return Err(Refusal::Origin);
        }
        let first = path.strip_prefix('/').and_then(|path| path.split('/').next()).unwrap_or("");
        if !is_same(first.as_bytes(), self.token.as_bytes()) {
            return Err(Refusal::Token);
        }
        Ok(())
    }

    fn is_ours(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|c| c.is_ascii_digit()) => name,
            _ => host,
        };
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let is_address = bare.parse::<IpAddr>().is_ok();
        is_address || name.eq_ignore_ascii_case("localhost") || self.name.as_deref() == Some(&name.to_ascii_lowercase())
    }
}

/// A header that stands there once.
fn single(headers: &HeaderMap, name: header::HeaderName) -> Option<&HeaderValue> {
    let mut values = headers.get_all(name).iter();
    values.next().filter(|_| values.next().is_none())
}

/// Compares in a time that does not tell where the first difference is.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |all, (x, y)| all | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(header::HeaderName, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(name.clone(), value.parse().unwrap());
        }
        headers
    }

    #[test]
    fn only_our_own_page_with_the_token_is_answered() {
        let guard = Guard::new("127.0.0.1").unwrap();
        let path = format!("/{}/socket", guard.token());
        let check = |path: &str, pairs: &[_]| guard.check(path, &headers(pairs), true);
        let (host, origin) = (header::HOST, header::ORIGIN);
        let ours = [(host.clone(), "127.0.0.1:8000"), (origin.clone(), "http://127.0.0.1:8000")];
        assert_eq!(check(&path, &ours), Ok(()));
        let ours = [(host.clone(), "localhost:8000"), (origin.clone(), "http://localhost:8000")];
        assert_eq!(check(&path, &ours), Ok(()));
        let ours = [(host.clone(), "[::1]:8000"), (origin.clone(), "http://[::1]:8000")];
        assert_eq!(check(&path, &ours), Ok(()));
        for wrong in ["/", "/socket", "/0123/socket", "//socket", &path[..path.len() - 8]] {
            assert_eq!(check(wrong, &ours), Err(Refusal::Token), "{wrong}");
        }
        for name in ["evil.example", "evil.example:8000", "127.0.0.1.evil.example:8000", "localhost.evil.example", ""] {
            let rebound = [(host.clone(), name), (origin.clone(), "http://127.0.0.1:8000")];
            assert_eq!(check(&path, &rebound), Err(Refusal::Host), "{name}");
        }
        for from in ["http://evil.example", "https://127.0.0.1:8000", "http://127.0.0.1:8001", "null", ""] {
            let foreign = [(host.clone(), "127.0.0.1:8000"), (origin.clone(), from)];
            assert_eq!(check(&path, &foreign), Err(Refusal::Origin), "{from}");
        }
        assert_eq!(check(&path, &[(host.clone(), "127.0.0.1:8000")]), Err(Refusal::Origin));
        assert_eq!(guard.check(&path, &headers(&[(host.clone(), "127.0.0.1:8000")]), false), Ok(()));
        let twice = [(host.clone(), "127.0.0.1:8000"), (host, "evil.example"), (origin, "http://127.0.0.1:8000")];
        assert_eq!(check(&path, &twice), Err(Refusal::Host));
    }

    #[test]
    fn a_name_is_answered_where_it_was_given() {
        let ask = |guard: &Guard, name: &str| {
            let path = format!("/{}/", guard.token());
            guard.check(&path, &headers(&[(header::HOST, name)]), false)
        };
        assert_eq!(ask(&Guard::new("Studio.local").unwrap(), "studio.local:80"), Ok(()));
        assert_eq!(ask(&Guard::new("0.0.0.0").unwrap(), "studio.local:80"), Err(Refusal::Host));
        assert_eq!(ask(&Guard::new("0.0.0.0").unwrap(), "192.168.1.7:80"), Ok(()));
    }

    #[test]
    fn every_token_is_another() {
        let [a, b] = [(); 2].map(|()| Guard::new("::1").unwrap());
        assert_eq!(a.token().len(), 32);
        assert_ne!(a.token(), b.token());
    }
}
