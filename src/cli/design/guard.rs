//! Who is served: requests to this machine by the page itself, with the token of the address.

use crate::cli::failure::{Failure, Result};

/// The token, and the names by which the page is reached.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    token: String,
}

/// Why a request is not served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refused {
    /// The request was meant for another machine, so a name of a stranger leads here.
    Host,
    /// Another page asks.
    Origin,
    /// The token of the address is missing or wrong.
    Token,
}

impl Refused {
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Host => "this page is served to 127.0.0.1 and localhost only",
            Self::Origin => "only the page of this program may ask",
            Self::Token => "the token in the address is missing or wrong: open the address that `cittert design` printed",
        }
    }
}

impl Guard {
    /// A new random token of 128 bits.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub(super) fn new() -> Result<Self> {
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(|e| Failure::message(format!("the system gives no random numbers: {e}")))?;
        Ok(Self { token: bytes.iter().map(|b| format!("{b:02x}")).collect() })
    }

    /// The token.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// A name for files that does not give the token away.
    pub(super) fn name(&self) -> String {
        format!("{}-{}", std::process::id(), &self.token[..4])
    }

    /// Check a request. `needs_origin` is set for sockets, which browsers open for any page.
    ///
    /// # Errors
    /// Why it is refused.
    pub(super) fn check(
        &self,
        port: u16,
        token: &str,
        host: Option<&str>,
        origin: Option<&str>,
        needs_origin: bool,
    ) -> std::result::Result<(), Refused> {
        let here = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
        if !host.is_some_and(|h| here.iter().any(|own| own.eq_ignore_ascii_case(h))) {
            return Err(Refused::Host);
        }
        let own = |o: &str| here.iter().any(|h| o.strip_prefix("http://").is_some_and(|o| h.eq_ignore_ascii_case(o)));
        if !origin.map_or(!needs_origin, own) {
            return Err(Refused::Origin);
        }
        if !same(token, &self.token) {
            return Err(Refused::Token);
        }
        Ok(())
    }
}

/// Compare without telling by the time how many characters agree.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_page_itself_is_served() {
        let g = Guard::new().unwrap();
        let t = g.token();
        assert_eq!(t.len(), 32);
        assert_ne!(t, Guard::new().unwrap().token());
        let check = |token: &str, host, origin, socket| g.check(80, token, host, origin, socket);
        assert_eq!(check(t, Some("127.0.0.1:80"), None, false), Ok(()));
        assert_eq!(check(t, Some("localhost:80"), Some("http://localhost:80"), true), Ok(()));
        // A name of a stranger that leads to this machine.
        assert_eq!(check(t, Some("evil.example:80"), None, false), Err(Refused::Host));
        assert_eq!(check(t, None, None, false), Err(Refused::Host));
        assert_eq!(check(t, Some("127.0.0.1:81"), None, false), Err(Refused::Host));
        // A page of a stranger.
        for origin in ["http://evil.example", "https://127.0.0.1:80", "null", "http://127.0.0.1:8080", "http://127.0.0.1:80.evil.example"] {
            assert_eq!(check(t, Some("127.0.0.1:80"), Some(origin), false), Err(Refused::Origin), "{origin}");
        }
        assert_eq!(check(t, Some("127.0.0.1:80"), None, true), Err(Refused::Origin));
        // A token that is guessed.
        for token in ["", "x", &t[1..], &format!("{t}0"), &"0".repeat(32)] {
            assert_eq!(check(token, Some("127.0.0.1:80"), None, false), Err(Refused::Token));
        }
    }
}
