//! Who may be talked to: schemes, hosts, and the addresses that names stand for.

use std::{
    net::{IpAddr, SocketAddr},
    sync::Arc,
};

use reqwest::{
    Url,
    dns::{Addrs, Name, Resolve, Resolving},
};

use super::address::{not_public, unmapped};
use crate::{
    config::{Networks, Settings},
    telemetry::Metric,
};

/// The longest URL that is taken, in bytes.
const MAX_URL_BYTES: usize = 2048;

/// Why the service does not talk to a place. What its callers are told; which address it was is for the log alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Blocked {
    /// It is no URL, or a very long one.
    #[error("it is not a URL of at most {MAX_URL_BYTES} bytes with a host")]
    NoUrl,
    /// Neither `https` nor, where it may be, `http`.
    #[error("its scheme must be https; plain http goes to networks alone that the operator names (--outbound-allow)")]
    Scheme,
    /// A user or a password is in it.
    #[error("it has a user or a password in it, which would end up in logs")]
    Credentials,
    /// It stands for an address that is not public, and the operator has not named its network.
    #[error(
        "it leads to an address that is not public, and whose network the operator does not name (--outbound-allow)"
    )]
    Address(&'static str),
}

impl Blocked {
    /// A word for metrics, of a closed set.
    #[must_use]
    pub const fn reason(self) -> &'static str {
        match self {
            Self::NoUrl => "no_url",
            Self::Scheme => "scheme",
            Self::Credentials => "credentials",
            Self::Address(kind) => kind,
        }
    }

    /// The same, counted.
    fn counted(self) -> Self {
        Metric::OutboundBlocked.count([("reason", self.reason().to_owned())], 1);
        self
    }
}

/// What the operator lets the service talk to.
#[derive(Debug)]
pub(super) struct Guard {
    allowed: Networks,
    denied: Networks,
}

impl Guard {
    pub(super) fn new(settings: &Settings) -> Self {
        Self { allowed: settings.outbound_allow.clone(), denied: settings.outbound_deny.clone() }
    }

    /// Checks everything about a URL that can be checked without asking what its host's name stands for.
    pub(super) fn check(&self, text: &str) -> Result<Url, Blocked> {
        self.judge_url(text).map_err(Blocked::counted)
    }

    fn judge_url(&self, text: &str) -> Result<Url, Blocked> {
        let url = Url::parse(text).ok().filter(|_| text.len() <= MAX_URL_BYTES).ok_or(Blocked::NoUrl)?;
        let reach = match url.scheme() {
            "https" => Reach::Public,
            "http" if !self.allowed.0.is_empty() => Reach::Allowed,
            _ => return Err(Blocked::Scheme),
        };
        if !url.username().is_empty() || url.password().is_some() {
            return Err(Blocked::Credentials);
        }
        let host = url.host_str().filter(|host| !host.is_empty()).ok_or(Blocked::NoUrl)?;
        // The parser has brought every way of writing an address into one: "0x7f.1" and "2130706433" are 127.0.0.1 by now.
        match host.trim_matches(['[', ']']).parse() {
            Ok(address) => self.judge(address, reach).map(|()| url),
            Err(_) => Ok(url),
        }
    }

    /// Whether the service may talk to that address.
    fn judge(&self, address: IpAddr, reach: Reach) -> Result<(), Blocked> {
        let has = |networks: &Networks| networks.have(address) || networks.have(unmapped(address));
        if has(&self.denied) {
            return Err(Blocked::Address("denied"));
        }
        match not_public(address) {
            _ if has(&self.allowed) => Ok(()),
            Some(kind) => Err(Blocked::Address(kind)),
            None if reach == Reach::Allowed => Err(Blocked::Scheme),
            None => Ok(()),
        }
    }
}

/// How far a request may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// To public addresses, and to networks that the operator names.
    Public,
    /// To networks that the operator names.
    Allowed,
}

/// Finds out what names stand for, and lets nobody dial what must not be reached. All addresses of a name must pass: one that is forbidden
/// among others is a trap.
#[derive(Clone, Debug)]
pub(super) struct GuardedResolver {
    pub(super) guard: Arc<Guard>,
    pub(super) reach: Reach,
}

impl Resolve for GuardedResolver {
    fn resolve(&self, name: Name) -> Resolving {
        let resolver = self.clone();
        Box::pin(async move {
            let found: Vec<SocketAddr> = tokio::net::lookup_host((name.as_str(), 0)).await?.collect();
            for address in &found {
                resolver.guard.judge(address.ip(), resolver.reach).map_err(|blocked| {
                    tracing::warn!(host = name.as_str(), address = %address.ip(), "a name leads where the service does not go");
                    blocked.counted()
                })?;
            }
            Ok(Box::new(found.into_iter()) as Addrs)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SettingValue;

    fn guard(allowed: &str, denied: &str) -> Guard {
        let networks = |text| Networks::parse(text).expect("networks");
        Guard { allowed: networks(allowed), denied: networks(denied) }
    }

    #[test]
    fn urls_that_lead_astray_are_refused_however_they_are_written() {
        let guard = guard("", "");
        for url in ["https://studio.example/hook", "https://8.8.8.8:8443/x?y=z", "https://[2606:4700::1111]/"] {
            assert!(guard.check(url).is_ok(), "{url}");
        }
        for url in [
            "https://127.0.0.1/",
            "https://127.1/",
            "https://0x7f.1/",
            "https://2130706433/",
            "https://0177.0.0.1/",
            "https://[::1]/",
            "https://[::ffff:127.0.0.1]/",
            "https://１２７.0.0.1/",
        ] {
            assert_eq!(guard.check(url).err(), Some(Blocked::Address("loopback")), "{url}");
        }
        assert_eq!(
            guard.check("https://169.254.169.254/latest").err(),
            Some(Blocked::Address("link_local")),
            "metadata"
        );
        for url in ["http://studio.example/", "ftp://studio.example/", "file:///etc/passwd", "gopher://127.0.0.1/"] {
            assert_eq!(guard.check(url).err(), Some(Blocked::Scheme), "{url}");
        }
        for url in
            ["https://ann@studio.example/", "https://ann:sesame@studio.example/", "https://:sesame@studio.example/"]
        {
            assert_eq!(guard.check(url).err(), Some(Blocked::Credentials), "{url}");
        }
        let long = format!("https://studio.example/{}", "a".repeat(MAX_URL_BYTES));
        for url in ["", "studio.example", "https://", "https:///hook", "//studio.example", long.as_str()] {
            let is_another = guard.check(url).is_ok_and(|url| url.host_str() == Some("hook"));
            assert!(is_another || guard.check(url).is_err(), "{url:?}");
        }
    }

    #[test]
    fn networks_that_are_named_are_open_and_what_is_denied_stays_closed() {
        let guard = guard("10.0.0.0/8,127.0.0.0/8", "10.0.0.1,8.8.8.8");
        for url in ["http://10.0.0.2/", "https://10.0.0.2/", "http://127.0.0.1:8080/", "http://[::ffff:127.0.0.1]/"] {
            assert!(guard.check(url).is_ok(), "{url}");
        }
        assert_eq!(guard.check("http://9.9.9.9/").err(), Some(Blocked::Scheme), "in plain text only to these");
        assert_eq!(guard.check("https://10.0.0.1/").err(), Some(Blocked::Address("denied")), "denied in spite of that");
        assert_eq!(guard.check("https://8.8.8.8/").err(), Some(Blocked::Address("denied")), "public, and denied");
        assert_eq!(guard.check("https://192.168.0.1/").err(), Some(Blocked::Address("private")), "not named");
    }

    #[tokio::test]
    async fn a_name_is_judged_by_what_it_stands_for() {
        let resolve = async |guard: Guard, reach: Reach| {
            let resolver = GuardedResolver { guard: Arc::new(guard), reach };
            resolver.resolve("localhost".parse().expect("a name")).await.map(Iterator::count)
        };
        let refused = resolve(guard("", ""), Reach::Public).await.expect_err("this machine");
        assert_eq!(refused.downcast_ref(), Some(&Blocked::Address("loopback")), "{refused}");
        let named = || guard("127.0.0.0/8,::1", "");
        assert!(resolve(named(), Reach::Public).await.is_ok_and(|count| count > 0), "named");
        assert!(resolve(named(), Reach::Allowed).await.is_ok(), "in plain text too");
    }
}
