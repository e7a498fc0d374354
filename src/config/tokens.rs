//! The settings of tokens: whose are taken, where the keys are that they are checked with, and what settings rule out together.

use std::{net::IpAddr, path::PathBuf};

use super::value::{SettingValue, Unit, listed};

/// In which ways tokens may be signed, as RFC 7518 and RFC 8037 name them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TokenAlgorithms(pub Vec<&'static str>);

impl TokenAlgorithms {
    /// All that can be chosen. Each has a private key to sign with and a public one to check by: with a secret that both sides
    /// share, whoever can check tokens could make them.
    pub const ALL: [&'static str; 9] =
        ["RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "EdDSA"];
}

impl SettingValue for TokenAlgorithms {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "RS256,ES256";

    fn parse(text: &str) -> Result<Self, String> {
        let known = |name: &str| Self::ALL.into_iter().find(|known| *known == name);
        let chosen: Option<Vec<_>> = listed(text).map(known).collect();
        let chosen = chosen.filter(|chosen| !chosen.is_empty());
        chosen.map(Self).ok_or_else(|| format!("expected some of {} with commas between them", Self::ALL.join(", ")))
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// Texts with commas between them; may be none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names(pub Vec<String>);

impl SettingValue for Names {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "https://retarget.studio.example";

    fn parse(text: &str) -> Result<Self, String> {
        Ok(Self(listed(text).map(str::to_owned).collect()))
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// Where the keys are that an issuer signs with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum KeyPlace {
    /// Where the issuer's discovery document says.
    Discovered,
    /// At a URL.
    Url(String),
    /// In a file.
    File(PathBuf),
}

impl SettingValue for KeyPlace {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "https://id.studio.example/keys.json";

    fn parse(text: &str) -> Result<Self, String> {
        match text {
            "" => Ok(Self::Discovered),
            url if is_guarded_url(url) => Ok(Self::Url(url.to_owned())),
            url if url.contains("://") => {
                Err("expected an https URL (http only to this machine), or the path of a file".to_owned())
            }
            path => Ok(Self::File(PathBuf::from(path))),
        }
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// Whether nobody on the way can change what comes from that URL: `https`, or `http` inside this machine.
#[must_use]
pub fn is_guarded_url(text: &str) -> bool {
    let Ok(url) = text.parse::<http::Uri>() else { return false };
    match url.scheme_str() {
        Some("https") => url.host().is_some_and(|host| !host.is_empty()),
        Some("http") => is_this_machine(text),
        _ => false,
    }
}

/// Whether the host of a URL is the machine that the program runs on.
#[must_use]
pub fn is_this_machine(url: &str) -> bool {
    let url = url.parse::<http::Uri>().ok();
    let host = url.as_ref().and_then(http::Uri::host).unwrap_or_default();
    let address: Option<IpAddr> = host.trim_matches(['[', ']']).parse().ok();
    host == "localhost" || address.is_some_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Setting, SettingErrors, Settings};

    fn read(given: &[(&str, &str)]) -> Result<Settings, SettingErrors> {
        let given: Vec<_> = given.to_vec();
        let text = |setting: &Setting| {
            let row = given.iter().find(|(name, _)| *name == setting.name);
            row.map(|(_, text)| (*text).to_owned())
        };
        Settings::read(text)
    }

    #[test]
    fn tokens_are_checked_by_public_keys_only() {
        let chosen = TokenAlgorithms::parse("ES256, EdDSA").expect("both can be chosen");
        assert_eq!(chosen.0, ["ES256", "EdDSA"], "each by itself");
        for refused in ["", "none", "HS256", "RS256,HS256", "rs256"] {
            assert!(TokenAlgorithms::parse(refused).is_err(), "{refused:?}");
        }
    }

    #[test]
    fn keys_come_from_where_nobody_can_change_them() {
        let url = |text: &str| KeyPlace::parse(text).ok().filter(|place| matches!(place, KeyPlace::Url(_)));
        for good in
            ["https://id.example/keys", "http://127.0.0.1:8081/keys", "http://localhost/keys", "http://[::1]:1/"]
        {
            assert!(url(good).is_some(), "{good}");
        }
        for bad in ["http://id.example/keys", "http://localhost.example/", "ftp://id.example/keys", "https://"] {
            assert!(KeyPlace::parse(bad).is_err(), "{bad}");
        }
        assert_eq!(KeyPlace::parse("/run/keys.json"), Ok(KeyPlace::File("/run/keys.json".into())), "a path");
    }

    #[test]
    fn what_is_given_halfway_is_refused_with_everything_that_is_missing() {
        let whole = [("token_issuer", "https://id.example"), ("token_audience", "retargetd")];
        assert!(read(&whole).expect("can stand together").asks_who_calls(), "also on this machine alone");
        assert!(!read(&[]).expect("the defaults").asks_who_calls(), "without an issuer as before");
        let flags = |given: &[(&str, &str)]| {
            let errors = read(given).expect_err("does not fit together").0;
            errors.into_iter().map(|error| error.flag).collect::<Vec<_>>()
        };
        assert_eq!(flags(&[("token_issuer", "farm")]), ["--token-audience", "--token-keys"], "both at once");
        assert_eq!(flags(&[("token_audience", "retargetd")]), ["--token-issuer"], "whose tokens");
        let nobody = [whole[0], whole[1], ("authentication", "none")];
        assert_eq!(flags(&nobody), ["--authentication"], "tokens that nobody looks at");
    }
}
