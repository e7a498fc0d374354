//! Which addresses are public: the table that keeps callers from reaching what only the service can reach.
//!
//! After the registries of special-purpose addresses (IANA, RFC 6890 and its updates). An IPv4 address inside an IPv6 address is judged
//! as itself, since that is where a translator on the way sends it.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use ipnet::{Ipv4Net, Ipv6Net};

const fn v4(a: u8, b: u8, c: u8, d: u8, bits: u8) -> Ipv4Net {
    Ipv4Net::new_assert(Ipv4Addr::new(a, b, c, d), bits)
}

const fn v6(a: u16, b: u16, c: u16, bits: u8) -> Ipv6Net {
    Ipv6Net::new_assert(Ipv6Addr::new(a, b, c, 0, 0, 0, 0, 0), bits)
}

/// IPv4 networks that are not public, with the kind that they are of.
const SPECIAL_V4: [(Ipv4Net, &str); 18] = [
    (v4(0, 0, 0, 0, 8), "unspecified"),
    (v4(127, 0, 0, 0, 8), "loopback"),
    (v4(10, 0, 0, 0, 8), "private"),
    (v4(172, 16, 0, 0, 12), "private"),
    (v4(192, 168, 0, 0, 16), "private"),
    // Carriers' networks; one cloud has its metadata there.
    (v4(100, 64, 0, 0, 10), "private"),
    // Most clouds have their metadata here.
    (v4(169, 254, 0, 0, 16), "link_local"),
    // The metadata of a cloud, at an address that looks public.
    (v4(168, 63, 129, 16, 32), "link_local"),
    (v4(192, 0, 0, 0, 24), "reserved"),
    (v4(192, 0, 2, 0, 24), "reserved"),
    (v4(192, 31, 196, 0, 24), "reserved"),
    (v4(192, 52, 193, 0, 24), "reserved"),
    (v4(192, 88, 99, 0, 24), "reserved"),
    (v4(198, 18, 0, 0, 15), "reserved"),
    (v4(198, 51, 100, 0, 24), "reserved"),
    (v4(203, 0, 113, 0, 24), "reserved"),
    (v4(224, 0, 0, 0, 4), "multicast"),
    (v4(240, 0, 0, 0, 4), "reserved"),
];

/// The same for IPv6. What is in none of them must be in [`GLOBAL_V6`].
const SPECIAL_V6: [(Ipv6Net, &str); 8] = [
    (v6(0xfc00, 0, 0, 7), "private"),
    (v6(0xfec0, 0, 0, 10), "private"),
    (v6(0xfe80, 0, 0, 10), "link_local"),
    (v6(0xff00, 0, 0, 8), "multicast"),
    // Protocol assignments, Teredo among them, whose addresses hold two of IPv4.
    (v6(0x2001, 0, 0, 23), "reserved"),
    (v6(0x2001, 0xdb8, 0, 32), "reserved"),
    (v6(0x2620, 0x4f, 0x8000, 48), "reserved"),
    (v6(0x3fff, 0, 0, 20), "reserved"),
];

/// Where public IPv6 addresses are.
const GLOBAL_V6: Ipv6Net = v6(0x2000, 0, 0, 3);
/// Translators between the two (RFC 6052).
const NAT64: Ipv6Net = v6(0x64, 0xff9b, 0, 96);
/// IPv6 over IPv4 (RFC 3056).
const SIX_TO_FOUR: Ipv6Net = v6(0x2002, 0, 0, 16);

/// The address that packets to this one really go to: an IPv4 address that is written as IPv6.
pub(super) fn unmapped(address: IpAddr) -> IpAddr {
    address.to_canonical()
}

/// Why the address is not public, as one of a few words; nothing where it is.
pub(super) fn not_public(address: IpAddr) -> Option<&'static str> {
    match unmapped(address) {
        IpAddr::V4(address) => not_public_v4(address),
        IpAddr::V6(address) => not_public_v6(address),
    }
}

fn not_public_v4(address: Ipv4Addr) -> Option<&'static str> {
    SPECIAL_V4.iter().find(|(network, _)| network.contains(&address)).map(|(_, kind)| *kind)
}

fn not_public_v6(address: Ipv6Addr) -> Option<&'static str> {
    if address.is_loopback() {
        return Some("loopback");
    }
    if address.is_unspecified() {
        return Some("unspecified");
    }
    if let Some((_, kind)) = SPECIAL_V6.iter().find(|(network, _)| network.contains(&address)) {
        return Some(kind);
    }
    let embedded = embedded(address);
    match embedded.map(not_public_v4) {
        Some(Some(kind)) => Some(kind),
        _ if GLOBAL_V6.contains(&address) || NAT64.contains(&address) => None,
        _ => Some("reserved"),
    }
}

/// The IPv4 address inside an IPv6 address that is made to hold one.
fn embedded(address: Ipv6Addr) -> Option<Ipv4Addr> {
    let bytes = address.octets();
    let at = |start: usize| Ipv4Addr::new(bytes[start], bytes[start + 1], bytes[start + 2], bytes[start + 3]);
    // ISATAP (RFC 5214): an interface that is named after its IPv4 address.
    let is_isatap = matches!(bytes[8..12], [0 | 2, 0, 0x5e, 0xfe]);
    if SIX_TO_FOUR.contains(&address) {
        Some(at(2))
    } else if NAT64.contains(&address) || is_isatap {
        Some(at(12))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_an_address_is_judged() {
        let table = [
            // Public.
            ("8.8.8.8", None),
            ("172.15.255.255", None),
            ("172.32.0.0", None),
            ("100.63.255.255", None),
            ("100.128.0.0", None),
            ("2606:4700::1111", None),
            ("2001:4860:4860::8888", None),
            ("::ffff:8.8.8.8", None),
            ("64:ff9b::8.8.8.8", None),
            ("2002:808:808::1", None),
            // The machine itself.
            ("127.0.0.1", Some("loopback")),
            ("127.255.255.254", Some("loopback")),
            ("::1", Some("loopback")),
            ("::ffff:127.0.0.1", Some("loopback")),
            ("::ffff:7f00:1", Some("loopback")),
            ("64:ff9b::7f00:1", Some("loopback")),
            ("2002:7f00:1::", Some("loopback")),
            ("2606:4700::5efe:127.0.0.1", Some("loopback")),
            ("2606:4700::200:5efe:127.0.0.1", Some("loopback")),
            ("0.0.0.0", Some("unspecified")),
            ("0.1.2.3", Some("unspecified")),
            ("::", Some("unspecified")),
            ("::ffff:0.0.0.0", Some("unspecified")),
            // Its neighbors.
            ("10.0.0.1", Some("private")),
            ("172.16.0.1", Some("private")),
            ("172.31.255.255", Some("private")),
            ("192.168.1.1", Some("private")),
            ("100.64.0.1", Some("private")),
            ("fc00::1", Some("private")),
            ("fdff:ffff::1", Some("private")),
            ("fec0::1", Some("private")),
            ("::ffff:192.168.0.1", Some("private")),
            ("2002:c0a8:1::1", Some("private")),
            ("64:ff9b::10.0.0.1", Some("private")),
            // Metadata of clouds.
            ("169.254.169.254", Some("link_local")),
            ("::ffff:169.254.169.254", Some("link_local")),
            ("64:ff9b::a9fe:a9fe", Some("link_local")),
            ("168.63.129.16", Some("link_local")),
            ("192.0.0.192", Some("reserved")),
            ("100.100.100.200", Some("private")),
            ("fd00:ec2::254", Some("private")),
            ("fe80::1", Some("link_local")),
            ("febf::1", Some("link_local")),
            // Everybody, nobody, and what is only written about.
            ("224.0.0.1", Some("multicast")),
            ("239.255.255.255", Some("multicast")),
            ("ff02::1", Some("multicast")),
            ("255.255.255.255", Some("reserved")),
            ("240.0.0.1", Some("reserved")),
            ("192.0.2.1", Some("reserved")),
            ("198.18.0.1", Some("reserved")),
            ("198.19.255.255", Some("reserved")),
            ("198.51.100.1", Some("reserved")),
            ("203.0.113.1", Some("reserved")),
            ("192.88.99.1", Some("reserved")),
            ("2001:db8::1", Some("reserved")),
            ("3fff::1", Some("reserved")),
            // Teredo, IPv4-compatible, discard, a translator's own network, and what nobody has been given.
            ("2001:0:4136:e378:8000:63bf:3fff:fdd2", Some("reserved")),
            ("::8.8.8.8", Some("reserved")),
            ("::127.0.0.1", Some("reserved")),
            ("100::1", Some("reserved")),
            ("64:ff9b:1::8.8.8.8", Some("reserved")),
            ("5f00::1", Some("reserved")),
            ("4000::1", Some("reserved")),
        ];
        for (text, expected) in table {
            let address: IpAddr = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(not_public(address), expected, "{text}");
        }
    }
}
