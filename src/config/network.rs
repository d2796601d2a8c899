//! Networks of IP addresses: `192.168.0.0/16`, `fd00::/8`, or one address alone.

use std::fmt;
use std::net::IpAddr;

use super::value;

/// A network, or one address.
///
/// Invariant: no bit is set behind the prefix, and IPv4 is never in the clothes of IPv6.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Network {
    base: IpAddr,
    /// How many bits all its addresses have in common, 0..=32 for IPv4, 0..=128 for IPv6.
    prefix: u8,
}

impl Network {
    /// Whether an address belongs to it. An IPv4 address does to no network of IPv6, also where it
    /// came over a socket of IPv6 and looks like it (`::ffff:10.0.0.2`).
    pub fn contains(&self, ip: IpAddr) -> bool {
        let ip = ip.to_canonical();
        let free = u32::from(width(self.base) - self.prefix);
        // All bits are free in a network of everybody.
        let difference = (bits(self.base) ^ bits(ip)).checked_shr(free).unwrap_or(0);
        self.base.is_ipv4() == ip.is_ipv4() && difference == 0
    }

    /// Reads `ADDRESS/PREFIX` or `ADDRESS`; `None` if it is neither, or has bits behind the prefix.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let (ip, prefix) = match text.split_once('/') {
            Some((ip, prefix)) => (ip, Some(prefix)),
            None => (text, None),
        };
        let ip: IpAddr = ip.parse().ok()?;
        let written = match prefix {
            Some(prefix) => value::number(prefix, 0..=width(ip))?,
            None => width(ip),
        };
        let base = ip.to_canonical();
        // As IPv4 it is 96 bits shorter; a network that is larger than all of IPv4 has bits behind.
        let prefix = written.checked_sub(width(ip) - width(base))?;
        let free = u32::from(width(base) - prefix);
        (bits(base).trailing_zeros() >= free).then_some(Self { base, prefix })
    }
}

/// As [`Network::parse`] reads it, an address alone without prefix.
impl fmt::Display for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { base, prefix } = self;
        if *prefix == width(*base) { base.fmt(f) } else { write!(f, "{base}/{prefix}") }
    }
}

fn width(ip: IpAddr) -> u8 {
    if ip.is_ipv4() { 32 } else { 128 }
}

fn bits(ip: IpAddr) -> u128 {
    match ip {
        IpAddr::V4(ip) => u32::from(ip).into(),
        IpAddr::V6(ip) => ip.into(),
    }
}

/// Reads networks with commas between.
pub(super) fn networks(text: &str) -> Option<Vec<Network>> {
    text.split(',').map(Network::parse).collect()
}

/// For a fuzzer: reads a network, and if it is one, holds that its text reads back as the same and
/// that it contains its own first address.
pub(super) fn fuzz_network(text: &str) {
    if let Some(network) = Network::parse(text) {
        assert_eq!(Network::parse(&network.to_string()), Some(network), "{text}");
        assert!(network.contains(network.base), "{text}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(text: &str) -> Network {
        Network::parse(text).unwrap_or_else(|| panic!("{text} is a network"))
    }

    #[test]
    fn a_network_has_its_addresses_and_no_others() {
        for (text, inside, outside) in [
            ("192.168.0.0/16", "192.168.0.0 192.168.255.255", "192.167.255.255 192.169.0.0 ::"),
            ("10.1.2.3", "10.1.2.3 ::ffff:10.1.2.3", "10.1.2.2 10.1.2.4 ::10.1.2.3"),
            ("10.0.0.128/25", "10.0.0.128 10.0.0.255", "10.0.0.127 10.0.1.0"),
            ("0.0.0.0/0", "0.0.0.0 255.255.255.255 ::ffff:1.2.3.4", "::1 fd00::1"),
            ("fd00::/8", "fd00:: fdff:ffff::1", "fc00::1 fe00::1 127.0.0.1"),
            ("::1", "::1", "::2 127.0.0.1 0.0.0.1"),
            ("::/0", "::1 2001:db8::1", "127.0.0.1 ::ffff:127.0.0.1"),
            ("fe80::/10", "fe80::1 febf::1", "fec0::1"),
            ("::ffff:10.0.0.0/104", "10.255.0.1 ::ffff:10.0.0.1", "11.0.0.0 ::10.0.0.1"),
        ] {
            let holds = |ip: &str| network(text).contains(ip.parse().unwrap());
            assert!(inside.split(' ').all(holds), "{text}: {inside}");
            assert!(!outside.split(' ').any(holds), "{text}: {outside}");
        }
    }

    #[test]
    fn a_network_is_written_in_one_way() {
        for (text, shown) in [
            ("192.168.0.0/16", "192.168.0.0/16"),
            ("127.0.0.1/32", "127.0.0.1"),
            ("FD00:0::/8", "fd00::/8"),
            ("::1/128", "::1"),
            ("::ffff:10.0.0.0/104", "10.0.0.0/8"),
            ("::ffff:10.0.0.1", "10.0.0.1"),
            ("0.0.0.0/0", "0.0.0.0/0"),
        ] {
            assert_eq!(network(text).to_string(), shown);
        }
    }

    #[test]
    fn what_is_no_network_is_none() {
        for text in [
            "",
            "/",
            "10.0.0.0/",
            "/8",
            "10.0.0.0/33",
            "10.0.0.0/-1",
            "10.0.0.0/8/8",
            "10.0.0.1/8",
            "fd00::1/8",
            "fd00::/129",
            "[fd00::]/8",
            "fe80::1%eth0",
            "gcs.local",
            "10.0.0",
            "::ffff:0.0.0.0/95",
            "::ffff:10.0.0.1/104",
            "192.168.0.0/255.255.0.0",
            " 10.0.0.1",
        ] {
            assert_eq!(Network::parse(text), None, "{text}");
            fuzz_network(text);
        }
    }
}
