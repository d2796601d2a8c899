//! Hosts and ports: `10.0.0.2:14550`, `gcs.local:14550`, `[fe80::1%wlan0]:14550`.
//!
//! Names are read, never resolved.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use super::error::AddressProblem;
use super::value;

/// Where to listen or to send: a host and a port.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct HostPort {
    /// The host.
    pub host: Host,
    /// The UDP or TCP port; 0 means "any free one" and stands only where somebody listens or binds.
    pub port: u16,
}

/// A host as the user named it.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Host {
    /// An address that says all there is to say.
    Ip(IpAddr),
    /// A link-local or multicast IPv6 address and the interface it is meant on: a name like
    /// `wlan0`, or a number.
    Zoned(Ipv6Addr, String),
    /// A name to be resolved: letters, digits, `-`, `_` and `.`, at most 253 characters.
    Name(String),
}

impl Host {
    /// All IPv4 addresses of this computer: what a listener listens on unless told otherwise.
    pub(super) const UNSPECIFIED: Self = Self::Ip(IpAddr::V4(Ipv4Addr::UNSPECIFIED));

    /// The address, unless the host is a name.
    pub fn ip(&self) -> Option<IpAddr> {
        match self {
            Self::Ip(ip) => Some(*ip),
            Self::Zoned(ip, _) => Some(IpAddr::V6(*ip)),
            Self::Name(_) => None,
        }
    }

    /// The address, if it is a link-local one that does not say on which interface.
    pub(super) fn without_zone(&self) -> Option<Ipv6Addr> {
        match self {
            Self::Ip(IpAddr::V6(ip)) if ip.is_unicast_link_local() => Some(*ip),
            _ => None,
        }
    }

    /// What stands without brackets: a name or an IPv4 address.
    fn parse_plain(text: &str) -> Result<Self, AddressProblem> {
        if let Ok(ip) = text.parse() {
            return Ok(Self::Ip(IpAddr::V4(ip)));
        }
        if is_host_name(text) {
            return Ok(Self::Name(text.to_owned()));
        }
        Err(AddressProblem::BadHost(text.to_owned()))
    }

    /// What stands in brackets: an IPv6 address, with or without a zone.
    fn parse_ipv6(text: &str) -> Option<Result<Self, AddressProblem>> {
        let Some((ip, zone)) = text.split_once('%') else {
            return Some(Ok(Self::Ip(IpAddr::V6(text.parse().ok()?))));
        };
        let ip: Ipv6Addr = ip.parse().ok()?;
        let may_have_zone = ip.is_unicast_link_local() || ip.is_multicast();
        match value::interface(zone) {
            Some(zone) if may_have_zone => Some(Ok(Self::Zoned(ip, zone))),
            _ => Some(Err(AddressProblem::BadZone(zone.to_owned()))),
        }
    }
}

impl fmt::Display for Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ip(IpAddr::V4(ip)) => ip.fmt(f),
            Self::Ip(IpAddr::V6(ip)) => write!(f, "[{ip}]"),
            Self::Zoned(ip, zone) => write!(f, "[{ip}%{zone}]"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

impl fmt::Display for HostPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// What the user wrote of a host and a port: either may be left out.
pub(super) type Written = (Option<Host>, Option<u16>);

/// Reads `HOST:PORT`, `HOST`, `:PORT`, `PORT` or nothing.
///
/// `scheme` goes before the suggestion of a problem: `udpin:`.
pub(super) fn parse(text: &str, scheme: &str) -> Result<Written, AddressProblem> {
    if let Some(text) = text.strip_prefix('[') {
        return parse_bracketed(text);
    }
    if let Some(correct) = with_brackets(text) {
        let correct = format!("{scheme}{correct}");
        return Err(AddressProblem::UnbracketedIpv6(correct));
    }
    let (host, port) = match text.rsplit_once(':') {
        Some((host, port)) => (host, Some(port)),
        None if value::is_digits(text) => ("", Some(text)),
        None => (text, None),
    };
    let port = port.map(parse_port).transpose()?;
    let host = (!host.is_empty()).then(|| Host::parse_plain(host));
    Ok((host.transpose()?, port))
}

/// Reads a local address to send from; what is left out is any of this computer's.
pub(super) fn parse_local(text: &str) -> Option<HostPort> {
    if text.is_empty() {
        return None;
    }
    let (host, port) = parse(text, "").ok()?;
    let host = host.unwrap_or(Host::UNSPECIFIED);
    // A name would have to be resolved first; whoever binds knows the address.
    host.ip()?;
    Some(HostPort { host, port: port.unwrap_or(0) })
}

/// Reads what follows the opening bracket.
fn parse_bracketed(text: &str) -> Result<Written, AddressProblem> {
    let bad = || AddressProblem::BadIpv6(format!("[{text}"));
    let (host, port) = text.split_once(']').ok_or_else(bad)?;
    let host = Host::parse_ipv6(host).ok_or_else(bad)??;
    if port.is_empty() {
        return Ok((Some(host), None));
    }
    let port = port.strip_prefix(':').ok_or_else(bad)?;
    Ok((Some(host), Some(parse_port(port)?)))
}

fn parse_port(text: &str) -> Result<u16, AddressProblem> {
    if text.is_empty() {
        return Err(AddressProblem::NoPort);
    }
    if !value::is_digits(text) {
        return Err(AddressProblem::BadPort(text.to_owned()));
    }
    text.parse().map_err(|_| AddressProblem::PortTooLarge(text.to_owned()))
}

/// How to write an IPv6 address that stands without brackets, if `text` has one.
fn with_brackets(text: &str) -> Option<String> {
    let (host, port) = text.rsplit_once(':')?;
    if is_ipv6(host) && value::is_digits(port) {
        return Some(format!("[{host}]:{port}"));
    }
    // "::14550" is hardly an address that ends in 1:4550, and "::5760" is hardly one at all.
    if host == ":" && value::is_digits(port) && port.len() >= 4 {
        return Some(format!("[::]:{port}"));
    }
    is_ipv6(text).then(|| format!("[{text}]"))
}

fn is_ipv6(text: &str) -> bool {
    let ip = text.split_once('%').map_or(text, |(ip, _)| ip);
    ip.parse::<Ipv6Addr>().is_ok()
}

/// Whether `text` is a host name. A name whose last part is a number is a misspelt IPv4 address.
fn is_host_name(text: &str) -> bool {
    let name = text.strip_suffix('.').unwrap_or(text);
    let is_part = |part: &str| {
        let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
        (1..=63).contains(&part.len()) && part.bytes().all(is_allowed)
    };
    let last = name.rsplit('.').next().unwrap_or(name);
    name.len() <= 253 && name.split('.').all(is_part) && !value::is_digits(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_name_is_told_from_a_misspelt_address() {
        for name in ["localhost", "gcs.local", "a-b_c.example.", "3d.example"] {
            assert!(is_host_name(name), "{name}");
        }
        for name in ["", ".", "a..b", "10.0.0", "10.0.0.256", "a b", "ä.example"] {
            assert!(!is_host_name(name), "{name}");
        }
        assert!(!is_host_name(&"a".repeat(64)));
        assert!(!is_host_name(&"a.".repeat(128)));
    }

    #[test]
    fn either_part_may_be_left_out() {
        let name = Host::Name("gcs".to_owned());
        assert_eq!(parse("", ""), Ok((None, None)));
        assert_eq!(parse("14550", ""), Ok((None, Some(14550))));
        assert_eq!(parse(":14550", ""), Ok((None, Some(14550))));
        assert_eq!(parse("gcs", ""), Ok((Some(name.clone()), None)));
        assert_eq!(parse("gcs:1", ""), Ok((Some(name), Some(1))));
        let localhost = Host::Ip(IpAddr::V6(Ipv6Addr::LOCALHOST));
        assert_eq!(parse("[::1]", ""), Ok((Some(localhost.clone()), None)));
        assert_eq!(parse("[::1]:1", ""), Ok((Some(localhost), Some(1))));
    }

    #[test]
    fn ipv6_without_brackets_is_written_with_them() {
        for (text, correct) in [
            ("::1:14550", "[::1]:14550"),
            ("::14550", "[::]:14550"),
            ("::5760", "[::]:5760"),
            ("::1", "[::1]"),
            ("::", "[::]"),
            ("fe80::1", "[fe80::1]"),
            ("fe80::1%wlan0:14550", "[fe80::1%wlan0]:14550"),
            ("2001:db8::5:5760", "[2001:db8::5]:5760"),
        ] {
            assert_eq!(with_brackets(text).as_deref(), Some(correct), "{text}");
        }
        for text in ["10.0.0.1:14550", ":14550", "14550", "a:b:14550", ""] {
            assert_eq!(with_brackets(text), None, "{text}");
        }
    }
}
