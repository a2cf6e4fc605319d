//! Who may talk to the server: the checks of Host, Origin and token.
//!
//! A web page of any site can send requests to loopback, and a name of its owner can point there. Such a page does not
//! know the token, and the cookie with it goes only to the name under which it was set. So a request with the token may
//! name the server as it likes (a tunnel from another port does); any other has to name this server in `Host`. Either
//! way it may come only from the page of the name that it asks (`Origin`).

use super::{TOKEN_MIN, Token};
use crate::error::{Error, Result};
use rand::TryRngCore;
use rand::rngs::OsRng;
use std::net::{IpAddr, SocketAddr};

/// Bytes of a token.
const TOKEN_BYTES: usize = 16;

/// The rules for requests.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    /// Values of `Host` that name this server.
    hosts: Vec<String>,
    token: Option<String>,
    cookie: String,
}

impl Guard {
    /// Makes the rules of a server at `address`, which the user named `host`.
    pub(super) fn new(address: SocketAddr, host: &str, token: &Token) -> Result<Self> {
        let port = address.port();
        // Every address of the machine is no address to open; loopback is one of them.
        let mut names = match address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => vec!["127.0.0.1".to_owned()],
            IpAddr::V6(ip) if ip.is_unspecified() => vec!["::1".to_owned()],
            ip => vec![host.to_owned(), ip.to_string()],
        };
        if address.ip().is_loopback() || address.ip().is_unspecified() {
            names.push("localhost".to_owned());
        }
        let bracketed = |name: &String| match name.parse() {
            Ok(IpAddr::V6(_)) => format!("[{name}]:{port}"),
            _ => format!("{}:{port}", name.to_ascii_lowercase()),
        };
        let token = match token {
            Token::New => Some(new_token()?),
            Token::Given(token) => Some(checked(token)?),
            Token::Off => None,
        };
        // A browser shares cookies between the ports of a host.
        Ok(Self { hosts: names.iter().map(bracketed).collect(), token, cookie: format!("labelgs-{port}") })
    }

    /// The address to open in a browser.
    pub(super) fn address(&self) -> String {
        let query = self.token.as_ref().map_or(String::new(), |token| format!("?token={token}"));
        format!("http://{}/{query}", self.hosts[0])
    }

    /// Returns true if `Host` names this server. A name that points at loopback does not.
    pub(super) fn knows_host(&self, host: Option<&str>) -> bool {
        host.is_some_and(|host| self.hosts.iter().any(|own| own.eq_ignore_ascii_case(host)))
    }

    /// Returns true if a request to `host` comes from the page of that host. Browsers leave `Origin` out when a user
    /// opens a page; `is_needed` says that it may not be missing.
    pub(super) fn is_same_origin(origin: Option<&str>, host: Option<&str>, is_needed: bool) -> bool {
        match (origin, host) {
            (Some(origin), Some(host)) => {
                origin.strip_prefix("http://").is_some_and(|from| from.eq_ignore_ascii_case(host))
            }
            (Some(_), None) => false,
            (None, _) => !is_needed,
        }
    }

    /// Returns true if this server has a token and the request knows it, by its address or its cookies.
    pub(super) fn is_proven(&self, given: Option<&str>, cookies: Option<&str>) -> bool {
        self.token.is_some() && (given.is_some_and(|_| self.knows_token(given)) || self.knows_cookie(cookies))
    }

    /// Returns true if no token is needed, or `given` is it.
    pub(super) fn knows_token(&self, given: Option<&str>) -> bool {
        match &self.token {
            None => true,
            Some(token) => given.is_some_and(|given| is_equal(given.as_bytes(), token.as_bytes())),
        }
    }

    /// Returns true if the cookie of this server is among `cookies` and has the token.
    pub(super) fn knows_cookie(&self, cookies: Option<&str>) -> bool {
        let pairs = cookies.unwrap_or_default().split(';').filter_map(|pair| pair.trim().split_once('='));
        let own = pairs.filter(|(name, _)| *name == self.cookie).map(|(_, value)| value);
        self.knows_token(None) || own.into_iter().any(|value| self.knows_token(Some(value)))
    }

    /// The header that makes a browser send the token from now on.
    pub(super) fn set_cookie(&self) -> Option<String> {
        let token = self.token.as_ref()?;
        Some(format!("Set-Cookie: {}={token}; Path=/; HttpOnly; SameSite=Strict\r\n", self.cookie))
    }
}

/// Compares in a time that does not depend on the content.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |different, (a, b)| different | (a ^ b)) == 0
}

/// Returns a token that was given, if it can stand in an address and is hard to guess.
fn checked(token: &str) -> Result<String> {
    let is_plain = token.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
    if is_plain && token.len() >= TOKEN_MIN {
        return Ok(token.to_owned());
    }
    let problem =
        format!("expected at least {TOKEN_MIN} letters, digits, - and _, such as the output of `openssl rand -hex 16`");
    Err(Error::usage("the token of the viewer", problem))
}

fn new_token() -> Result<String> {
    let mut bytes = [0_u8; TOKEN_BYTES];
    let failed = |error| Error::Bug(format!("the system has no random numbers: {error}"));
    OsRng.try_fill_bytes(&mut bytes).map_err(failed)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(has_token: bool) -> Guard {
        let token = if has_token { Token::New } else { Token::Off };
        Guard::new("127.0.0.1:4321".parse().expect("an address"), "127.0.0.1", &token).expect("rules")
    }

    #[test]
    fn a_given_token_is_long_and_plain() {
        let with = |token: &str| {
            Guard::new("127.0.0.1:80".parse().expect("an address"), "127.0.0.1", &Token::Given(token.to_owned()))
        };
        let guard = with("0123456789-abc_DEF").expect("rules");
        assert!(
            guard.address().ends_with("?token=0123456789-abc_DEF") && guard.knows_token(Some("0123456789-abc_DEF"))
        );
        for token in ["", "0123456789abcde", "0123456789abcdef&x", "0123456789abcdef\r\nX: y"] {
            let error = with(token).expect_err("refused").to_string();
            assert!(error.contains("at least 16"), "{error}");
        }
    }

    #[test]
    fn only_names_of_this_server_are_hosts() {
        let guard = guard(true);
        for host in ["127.0.0.1:4321", "localhost:4321", "LOCALHOST:4321"] {
            assert!(guard.knows_host(Some(host)), "{host}");
        }
        for host in ["rebind.test:4321", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.evil.test:4321", "", "[::1]:4321"] {
            assert!(!guard.knows_host(Some(host)), "{host}");
        }
        assert!(!guard.knows_host(None));
        let six = Guard::new("[::1]:80".parse().expect("an address"), "::1", &Token::Off).expect("rules");
        assert!(six.knows_host(Some("[::1]:80")) && six.address() == "http://[::1]:80/");
    }

    #[test]
    fn another_origin_is_refused() {
        let host = Some("127.0.0.1:4321");
        let is_same = |origin, is_needed| Guard::is_same_origin(origin, host, is_needed);
        assert!(is_same(Some("http://127.0.0.1:4321"), true) && is_same(None, false));
        for origin in ["http://evil.test", "https://127.0.0.1:4321", "http://127.0.0.1:4322", "null", ""] {
            assert!(!is_same(Some(origin), false), "{origin}");
        }
        assert!(!is_same(None, true) && !Guard::is_same_origin(Some("http://a"), None, false));
    }

    #[test]
    fn a_token_proves_a_request_and_its_absence_does_not() {
        let guard = guard(true);
        let address = guard.address();
        let token = address.split("token=").nth(1).expect("a token");
        assert!(guard.is_proven(Some(token), None));
        assert!(guard.is_proven(None, Some(&format!("labelgs-4321={token}"))));
        assert!(!guard.is_proven(None, None) && !guard.is_proven(Some("0"), Some("labelgs-4321=0")));
        assert!(!self::guard(false).is_proven(Some("0"), None), "without a token nothing proves a request");
    }

    #[test]
    fn every_address_of_the_machine_is_printed_as_loopback() {
        for (address, host, printed) in
            [("0.0.0.0:80", "0.0.0.0", "http://127.0.0.1:80/?token="), ("[::]:80", "::", "http://[::1]:80/?token=")]
        {
            let guard = Guard::new(address.parse().expect("an address"), host, &Token::New).expect("rules");
            assert!(guard.address().starts_with(printed), "{}", guard.address());
        }
    }

    #[test]
    fn the_token_is_needed_whole() {
        let guard = guard(true);
        let address = guard.address();
        let token = address.split("token=").nth(1).expect("a token");
        assert_eq!(token.len(), 32);
        assert!(guard.knows_token(Some(token)) && guard.knows_cookie(Some(&format!("a=b; labelgs-4321={token}; c=d"))));
        assert!(!guard.knows_token(None) && !guard.knows_token(Some(&token[..31])) && !guard.knows_cookie(None));
        assert!(
            !guard.knows_cookie(Some(&format!("labelgs-4322={token}"))) && !guard.knows_cookie(Some("labelgs-4321="))
        );
        assert!(self::guard(false).knows_cookie(None));
        assert_ne!(self::guard(true).address(), address);
    }
}
