//! The address of an endpoint: which kind of link, and where.
//!
//! | canonical spelling | also read |
//! |---|---|
//! | `udpin:HOST:PORT` | `udp:`, `udps:`, `udpserver:` |
//! | `udpout:HOST:PORT` | `udpc:`, `udpclient:` |
//! | `udpbcast:ADDR:PORT` | `udpb:` |
//! | `mcast:GROUP:PORT` | |
//! | `tcpin:HOST:PORT` | `tcps:`, `tcpserver:` |
//! | `tcpout:HOST:PORT` | `tcp:`, `tcpc:`, `tcpclient:` |
//! | `tlog:FILE` | |
//! | `serial:DEVICE:BAUD,...` | `/dev/ttyACM0`, `/dev/ttyACM0:BAUD`, `/dev/ttyACM0,BAUD` |
//! | `sim:` | `sim` |
//!
//! Schemes are read in any case and may be followed by `//`. A port left out is 14550 for UDP and
//! 5760 for TCP, a baud rate 57600. A listener without a host listens on 0.0.0.0, which is every
//! IPv4 address; `[::]` is every IPv6 address. A group left out is 239.255.145.50, as in pymavlink.
//! Port 0 is for listeners alone: any free port.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

use super::device::{self, Device};
use super::error::AddressProblem;
use super::host_port::{self, Host, HostPort, Written};
use super::suggest;

const UDP_PORT: u16 = 14550;
const TCP_PORT: u16 = 5760;
/// The group that ArduPilot and pymavlink use.
const GROUP: IpAddr = IpAddr::V4(Ipv4Addr::new(239, 255, 145, 50));

/// Where an endpoint is.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Address {
    /// Listens on UDP and answers whoever sends.
    UdpIn(HostPort),
    /// Sends UDP to one place, from the start. The port is not 0.
    UdpOut(HostPort),
    /// Sends UDP to everybody on a network, by IPv4 broadcast. The port is not 0.
    UdpBroadcast(HostPort),
    /// Sends UDP to a multicast group and listens to it. The host is an address, the port not 0.
    Multicast(HostPort),
    /// Listens for TCP connections.
    TcpIn(HostPort),
    /// Makes a TCP connection. The port is not 0.
    TcpOut(HostPort),
    /// Opens a serial port.
    Serial {
        /// Which one.
        device: Device,
        /// The baud rates to try in turn, in bits a second, 50..=20,000,000; at least one.
        bauds: Vec<u32>,
    },
    /// Plays back a telemetry log.
    Tlog(PathBuf),
    /// Simulates vehicles. All that there is to say of them is in the options.
    Sim,
    /// A part of the program itself, by its name. Nothing that the user writes is read as one.
    Internal(&'static str),
}

/// The kinds of address.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum AddressKind {
    /// [`Address::UdpIn`]
    UdpIn,
    /// [`Address::UdpOut`]
    UdpOut,
    /// [`Address::UdpBroadcast`]
    UdpBroadcast,
    /// [`Address::Multicast`]
    Multicast,
    /// [`Address::TcpIn`]
    TcpIn,
    /// [`Address::TcpOut`]
    TcpOut,
    /// [`Address::Serial`]
    Serial,
    /// [`Address::Tlog`]
    Tlog,
    /// [`Address::Sim`]
    Sim,
    /// [`Address::Internal`]
    Internal,
}

/// Every spelling of every scheme.
const SCHEMES: &[(&str, AddressKind)] = &[
    ("udpin", AddressKind::UdpIn),
    ("udpout", AddressKind::UdpOut),
    ("udpbcast", AddressKind::UdpBroadcast),
    ("mcast", AddressKind::Multicast),
    ("tcpin", AddressKind::TcpIn),
    ("tcpout", AddressKind::TcpOut),
    ("serial", AddressKind::Serial),
    ("tlog", AddressKind::Tlog),
    ("sim", AddressKind::Sim),
    // pymavlink, MAVProxy
    ("udp", AddressKind::UdpIn),
    ("tcp", AddressKind::TcpOut),
    // mavp2p
    ("udps", AddressKind::UdpIn),
    ("udpc", AddressKind::UdpOut),
    ("udpb", AddressKind::UdpBroadcast),
    ("tcps", AddressKind::TcpIn),
    ("tcpc", AddressKind::TcpOut),
    // mavlink-server
    ("udpserver", AddressKind::UdpIn),
    ("udpclient", AddressKind::UdpOut),
    ("tcpserver", AddressKind::TcpIn),
    ("tcpclient", AddressKind::TcpOut),
];

impl AddressKind {
    /// Every kind that can be configured, in the order in which they are explained.
    pub const ALL: &[Self] = &[
        Self::UdpIn,
        Self::UdpOut,
        Self::UdpBroadcast,
        Self::Multicast,
        Self::TcpIn,
        Self::TcpOut,
        Self::Serial,
        Self::Tlog,
        Self::Sim,
    ];

    /// Those that stay open while peers come and go, each with a link of its own.
    pub const SERVERS: &[Self] = &[Self::UdpIn, Self::TcpIn];

    /// Whether it is one of [`AddressKind::SERVERS`].
    pub fn is_server(self) -> bool {
        Self::SERVERS.contains(&self)
    }

    /// Whether the other side is a part of this program, so that nobody's frames come from there but
    /// its own.
    pub fn is_inside(self) -> bool {
        matches!(self, Self::Tlog | Self::Sim | Self::Internal)
    }

    /// The canonical scheme: `udpin`.
    pub fn scheme(self) -> &'static str {
        match self {
            Self::UdpIn => "udpin",
            Self::UdpOut => "udpout",
            Self::UdpBroadcast => "udpbcast",
            Self::Multicast => "mcast",
            Self::TcpIn => "tcpin",
            Self::TcpOut => "tcpout",
            Self::Serial => "serial",
            Self::Tlog => "tlog",
            Self::Sim => "sim",
            Self::Internal => "internal",
        }
    }

    /// Every spelling of every scheme.
    pub(crate) fn spellings() -> impl Iterator<Item = &'static str> {
        SCHEMES.iter().map(|(spelling, _)| *spelling)
    }

    /// The kind that a scheme stands for, in any of its spellings.
    pub(crate) fn from_scheme(scheme: &str) -> Option<Self> {
        let is_it = |known: &str| known.eq_ignore_ascii_case(scheme);
        let known = SCHEMES.iter().find(|(known, _)| is_it(known));
        known.map(|(_, kind)| *kind)
    }
}

impl Address {
    /// Which kind of address this is.
    pub fn kind(&self) -> AddressKind {
        match self {
            Self::UdpIn(_) => AddressKind::UdpIn,
            Self::UdpOut(_) => AddressKind::UdpOut,
            Self::UdpBroadcast(_) => AddressKind::UdpBroadcast,
            Self::Multicast(_) => AddressKind::Multicast,
            Self::TcpIn(_) => AddressKind::TcpIn,
            Self::TcpOut(_) => AddressKind::TcpOut,
            Self::Serial { .. } => AddressKind::Serial,
            Self::Tlog(_) => AddressKind::Tlog,
            Self::Sim => AddressKind::Sim,
            Self::Internal(_) => AddressKind::Internal,
        }
    }

    /// Host and port of what is reached over a network.
    pub fn host_port(&self) -> Option<&HostPort> {
        match self {
            Self::UdpIn(at)
            | Self::UdpOut(at)
            | Self::UdpBroadcast(at)
            | Self::Multicast(at)
            | Self::TcpIn(at)
            | Self::TcpOut(at) => Some(at),
            Self::Serial { .. } | Self::Tlog(_) | Self::Sim | Self::Internal(_) => None,
        }
    }

    /// Reads what stands before the `?`. A serial port has no bauds if none are written.
    pub(super) fn parse(text: &str) -> Result<Self, AddressProblem> {
        if text.starts_with('/') {
            return parse_serial(text);
        }
        let (scheme, rest) = text.split_once(':').unwrap_or((text, ""));
        let rest = rest.strip_prefix("//").unwrap_or(rest);
        let kind = AddressKind::from_scheme(scheme).ok_or_else(|| unknown_scheme(scheme, text))?;
        match kind {
            AddressKind::UdpIn => parse_listener(kind, rest, UDP_PORT).map(Self::UdpIn),
            AddressKind::UdpOut => parse_sender(kind, rest, UDP_PORT).map(Self::UdpOut),
            AddressKind::UdpBroadcast => parse_broadcast(rest).map(Self::UdpBroadcast),
            AddressKind::Multicast => parse_multicast(rest).map(Self::Multicast),
            AddressKind::TcpIn => parse_listener(kind, rest, TCP_PORT).map(Self::TcpIn),
            AddressKind::TcpOut => parse_sender(kind, rest, TCP_PORT).map(Self::TcpOut),
            AddressKind::Serial => parse_serial(rest),
            // No `//` is taken off: the name may be a whole path.
            AddressKind::Tlog => parse_tlog(text[scheme.len()..].trim_start_matches(':')),
            AddressKind::Sim if rest.is_empty() => Ok(Self::Sim),
            AddressKind::Sim => Err(AddressProblem::SimHasNoPlace(rest.to_owned())),
            // No scheme means it.
            AddressKind::Internal => Err(unknown_scheme(scheme, text)),
        }
    }
}

/// The canonical text.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.kind().scheme())?;
        match self {
            Self::UdpIn(at)
            | Self::UdpOut(at)
            | Self::UdpBroadcast(at)
            | Self::Multicast(at)
            | Self::TcpIn(at)
            | Self::TcpOut(at) => at.fmt(f),
            Self::Serial { device, bauds } => {
                let bauds: Vec<String> = bauds.iter().map(ToString::to_string).collect();
                write!(f, "{device}:{}", bauds.join(","))
            }
            Self::Tlog(file) => file.display().fmt(f),
            Self::Sim => Ok(()),
            Self::Internal(name) => f.write_str(name),
        }
    }
}

/// A file name that can be printed.
fn parse_tlog(text: &str) -> Result<Address, AddressProblem> {
    if text.is_empty() || text.contains(char::is_control) {
        return Err(AddressProblem::NoFile);
    }
    Ok(Address::Tlog(text.into()))
}

fn parse_serial(text: &str) -> Result<Address, AddressProblem> {
    let (device, bauds) = device::parse(text)?;
    Ok(Address::Serial { device, bauds })
}

fn parse_listener(kind: AddressKind, text: &str, port: u16) -> Result<HostPort, AddressProblem> {
    let (host, written) = parse_host_port(kind, text)?;
    Ok(HostPort { host: host.unwrap_or(Host::UNSPECIFIED), port: written.unwrap_or(port) })
}

fn parse_sender(kind: AddressKind, text: &str, port: u16) -> Result<HostPort, AddressProblem> {
    let (host, written) = parse_host_port(kind, text)?;
    let port = written.unwrap_or(port);
    if port == 0 {
        return Err(AddressProblem::PortZero);
    }
    let host = host.ok_or_else(|| AddressProblem::NoHost(kind.scheme(), port))?;
    Ok(HostPort { host, port })
}

fn parse_broadcast(text: &str) -> Result<HostPort, AddressProblem> {
    let at = parse_sender(AddressKind::UdpBroadcast, text, UDP_PORT)?;
    match at.host.ip() {
        Some(IpAddr::V6(_)) => Err(AddressProblem::Ipv6Broadcast),
        _ => Ok(at),
    }
}

fn parse_multicast(text: &str) -> Result<HostPort, AddressProblem> {
    let (host, port) = parse_host_port(AddressKind::Multicast, text)?;
    let host = host.unwrap_or(Host::Ip(GROUP));
    if !host.ip().is_some_and(|ip| ip.is_multicast()) {
        return Err(AddressProblem::NotMulticast(host.to_string()));
    }
    match port.unwrap_or(UDP_PORT) {
        0 => Err(AddressProblem::PortZero),
        port => Ok(HostPort { host, port }),
    }
}

fn parse_host_port(kind: AddressKind, text: &str) -> Result<Written, AddressProblem> {
    host_port::parse(text, &format!("{}:", kind.scheme()))
}

/// What to write instead of `scheme`, the beginning of `text`.
fn unknown_scheme(scheme: &str, text: &str) -> AddressProblem {
    let near = suggest::nearest(scheme, AddressKind::spellings());
    let hint = match near {
        _ if scheme.starts_with("tty") => format!("write /dev/{text}"),
        _ if scheme.starts_with("dev/") => format!("write /{text}"),
        _ if text.ends_with(".tlog") => format!("write tlog:{text} to play it back"),
        Some(near) => format!("did you mean `{near}`?"),
        None if is_host_port(text) => return AddressProblem::NoScheme(text.to_owned()),
        None => {
            let schemes = AddressKind::ALL.iter().map(|kind| kind.scheme());
            format!("write {}", suggest::list(schemes, "or"))
        }
    };
    AddressProblem::UnknownScheme(scheme.to_owned(), hint)
}

/// Whether `text` has no scheme at all, but is a host and a port, or one that cannot be a word.
fn is_host_port(text: &str) -> bool {
    match host_port::parse(text, "") {
        Ok((Some(Host::Name(_)), port)) => port.is_some(),
        Ok(_) => true,
        Err(_) => text.starts_with(':'),
    }
}
