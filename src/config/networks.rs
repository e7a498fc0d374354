//! Networks of addresses, as settings name them.

use std::net::IpAddr;

use ipnet::IpNet;

use super::value::{SettingValue, Unit, listed};

/// Networks, written as addresses with the length of their prefix; an address by itself is a network of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Networks(pub Vec<IpNet>);

impl Networks {
    /// Whether one of them has the address.
    #[must_use]
    pub fn have(&self, address: IpAddr) -> bool {
        self.0.iter().any(|network| network.contains(&address))
    }
}

impl SettingValue for Networks {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "10.0.0.0/8,fd00::/8";

    fn parse(text: &str) -> Result<Self, String> {
        let network = |text: &str| text.parse().or_else(|_| text.parse::<IpAddr>().map(IpNet::from));
        let networks = listed(text).map(network).collect::<Result<_, _>>();
        networks.map(Self).map_err(|_| {
            "expected networks with commas between them, each an address and the bits of its prefix".to_owned()
        })
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_have_what_their_prefix_says() {
        let networks = Networks::parse("10.0.0.0/8, 192.0.2.7,fd00::/8").expect("three");
        let has = |text: &str| networks.have(text.parse().expect("an address"));
        assert!(has("10.255.0.1") && has("192.0.2.7") && has("fdff::1"), "inside");
        assert!(!has("11.0.0.1") && !has("192.0.2.8") && !has("fe00::1"), "outside");
        assert_eq!(Networks::parse(""), Ok(Networks::default()), "none");
        for text in ["localhost", "10.0.0.0/33", "10.0.0.0/8;11.0.0.0/8", "*"] {
            assert!(Networks::parse(text).is_err(), "{text:?}");
        }
    }
}
