//! Which pages a browser may have open when it calls a service that asks nobody for a key.
//!
//! Such a service trusts whoever reaches it, and the browser of somebody who does is reached by every page on the web: directly, and by a
//! name of the page's own that suddenly leads to this address (DNS rebinding). The first is seen by `Origin`, the second by `Host`.

use std::net::IpAddr;

use axum::http::{HeaderMap, Uri, header};

use super::{code::Code, extract, problem::Problem};
use crate::config::Settings;

/// Refuses a request that a page of somebody else has made.
///
/// # Errors
/// When its `Host` is no name of this service, or its `Origin` another place than this one and those the operator allows.
pub(super) fn check(uri: &Uri, headers: &HeaderMap, settings: &Settings) -> Result<(), Problem> {
    let host = extract::text(headers, &header::HOST);
    let hosts = uri.authority().map(|authority| authority.as_str()).into_iter().chain(Some(host));
    for host in hosts.filter(|host| !host.is_empty()) {
        if !is_own(host, &settings.allowed_hosts.0) {
            let shown: String = host.chars().take(64).collect();
            return Err(Problem::new(Code::ForeignPage, format!("'{shown}' is not a name of this service")).with_hint(
                "the operator allows names with '--allowed-hosts', or asks for keys with '--authentication keys'",
            ));
        }
    }
    let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
    let origin = origin.to_str().unwrap_or_default();
    let is_own = origin.split_once("://").is_some_and(|(_, place)| place.eq_ignore_ascii_case(host));
    if is_own || settings.cors_origins.0.iter().any(|allowed| allowed == origin) {
        return Ok(());
    }
    let shown: String = origin.chars().take(64).collect();
    Err(Problem::new(Code::ForeignPage, format!("pages of '{shown}' may not call this service"))
        .with_hint("the operator allows origins with '--cors-origins'"))
}

/// Whether nobody else can have a page there: addresses are no names, and `localhost` is everybody's own.
fn is_own(host: &str, allowed: &[String]) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    let name = name.trim_end_matches('.').to_ascii_lowercase();
    name.parse::<IpAddr>().is_ok()
        || name == "localhost"
        || name.ends_with(".localhost")
        || allowed.iter().any(|allowed| allowed.eq_ignore_ascii_case(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_localhost_are_own_and_names_are_not() {
        let allowed = ["Retarget.lan".to_owned()];
        for own in
            ["127.0.0.1:8080", "127.0.0.1", "[::1]:8080", "localhost:80", "a.localhost", "10.0.0.7", "retarget.lan:1"]
        {
            assert!(is_own(own, &allowed), "{own}");
        }
        for foreign in
            ["evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.nip.io", "[evil]:1", "retarget"]
        {
            assert!(!is_own(foreign, &allowed), "{foreign}");
        }
    }
}
