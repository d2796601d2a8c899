//! Why the daemon cannot start: which endpoint, what failed, and what to do about it.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use super::endpoint::{Endpoint, Failure, State};
use super::event_loop::Daemon;
use crate::config::{Address, AddressKind, Device, EndpointConfig};

/// The daemon cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// An endpoint cannot be opened, and waiting would not help.
    #[error("{endpoint}: cannot {action}: {error}{remedy}")]
    Endpoint {
        /// What the user calls it.
        endpoint: String,
        /// What was tried: `listen on 0.0.0.0:14550`.
        action: String,
        /// What the system said.
        error: io::Error,
        /// What to do about it, in parentheses, or nothing.
        remedy: String,
    },
    /// An option names a message that no definition has.
    #[error("{endpoint}: no message is called {name}: {hint}")]
    UnknownMessage {
        /// The endpoint with the option.
        endpoint: String,
        /// The name.
        name: String,
        /// What to do about it.
        hint: String,
    },
    /// An option names a key that was not read.
    #[error("{endpoint}: no key is called {name} (say where it is, with `keys` or --key)")]
    UnreadKey {
        /// The endpoint with the option.
        endpoint: String,
        /// The name.
        name: String,
    },
    /// There are more groups than can be told apart.
    #[error("there are more than 256 groups")]
    TooManyGroups,
    /// There are more endpoints than anybody has links for.
    #[error("there are more than 4096 endpoints")]
    TooManyEndpoints,
    /// The system refused what the loop needs.
    #[error("cannot set up the event loop: {0}")]
    System(io::Error),
}

impl StartError {
    /// Whether the configuration is wrong, so that to start again would not help.
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::Endpoint { .. } | Self::System(_))
    }

    /// An endpoint that cannot be opened; `holder`: who of ours has the port already.
    pub(super) fn endpoint(
        config: &EndpointConfig,
        action: String,
        error: io::Error,
        holder: Option<&str>,
    ) -> Self {
        let remedy = remedy(config, &error, holder);
        Self::Endpoint { endpoint: config.name(), action, error, remedy }
    }
}

impl Failure {
    /// What could not be done, and why; `holder`: who of ours has the port already.
    pub(super) fn new(
        config: &EndpointConfig,
        action: &str,
        error: &io::Error,
        holder: Option<&str>,
    ) -> Self {
        let text = format!("cannot {action}: {error}{}", remedy(config, error, holder));
        Self { text, may_pass: may_pass(config, error) }
    }
}

/// Whether an endpoint that cannot be opened for this reason may yet be, if one waits: a device
/// that is plugged in later, an interface that comes up.
pub(super) fn may_pass(config: &EndpointConfig, error: &io::Error) -> bool {
    use io::ErrorKind::{AddrInUse, PermissionDenied, ResourceBusy};
    let is_serial = config.address.kind() == AddressKind::Serial;
    match error.kind() {
        AddrInUse | PermissionDenied | ResourceBusy => false,
        _ if is_serial => !is_not_a_tty(error),
        _ => true,
    }
}

fn is_not_allowed(error: &io::Error) -> bool {
    error.raw_os_error() == Some(libc::EPERM)
}

/// The address and port that an endpoint has or wants for itself; port 0: any.
fn own_address(config: &EndpointConfig) -> Option<SocketAddr> {
    // Who sends or calls has another's port in its address, and its own in `bind`.
    let own = config.options.bind.as_ref().or_else(|| config.address.host_port())?;
    // Which address a name leads to is not known here: it may be any.
    let ip = own.host.ip().unwrap_or(IpAddr::V4(Ipv4Addr::UNSPECIFIED));
    Some(SocketAddr::new(ip, own.port))
}

fn own_port(config: &EndpointConfig) -> u16 {
    own_address(config).map_or(0, |own| own.port())
}

/// Whether two sockets of one kind cannot have these addresses at the same time.
pub(super) fn collide(one: SocketAddr, other: SocketAddr) -> bool {
    let is_any = one.ip().is_unspecified() || other.ip().is_unspecified();
    one.port() == other.port() && (is_any || one.ip() == other.ip())
}

/// That one of ours has the port already, behind an error.
pub(super) fn already(holder: Option<&str>) -> String {
    holder.map_or_else(String::new, |holder| format!(" ({holder} already)"))
}

fn is_not_a_tty(error: &io::Error) -> bool {
    error.raw_os_error() == Some(libc::ENOTTY)
}

fn is_udp(config: &EndpointConfig) -> bool {
    !matches!(config.address.kind(), AddressKind::TcpIn | AddressKind::TcpOut)
}

impl Daemon {
    /// Who of ours has the port that an endpoint cannot have, if it is one of us.
    pub(super) fn holder(&self, config: &EndpointConfig, error: &io::Error) -> Option<String> {
        let wanted = own_address(config).filter(|wanted| wanted.port() != 0)?;
        if error.kind() != io::ErrorKind::AddrInUse {
            return None;
        }
        let of_metrics = !is_udp(config) && self.http.listens_at(wanted);
        let of_metrics = of_metrics.then(|| "the metrics have this port".to_owned());
        self.endpoint_at(is_udp(config), wanted).or(of_metrics)
    }

    /// Which endpoint has a port of UDP or TCP that is wanted at this address, if one does.
    pub(super) fn endpoint_at(&self, is_udp: bool, wanted: SocketAddr) -> Option<String> {
        let has_it = |other: &&Endpoint| {
            let local = match &other.state {
                State::Datagrams(datagrams) if is_udp => datagrams.socket.local_addr(),
                State::Listening(listener, _) if !is_udp => listener.local_addr(),
                _ => return false,
            };
            local.is_ok_and(|local| collide(local, wanted))
        };
        let endpoint = self.io.endpoints.iter().find(has_it)?;
        Some(format!("endpoint {} has this port", endpoint.name))
    }
}

/// What to do about an error, as a parenthesis behind it.
fn remedy(config: &EndpointConfig, error: &io::Error, holder: Option<&str>) -> String {
    let text = match (error.kind(), &config.address) {
        // Not the permissions of the file, but a sandbox around the program.
        (io::ErrorKind::PermissionDenied, Address::Serial { .. }) if is_not_allowed(error) => {
            "the service may not open such devices: add their kind, `systemctl edit mavswitch` and \
             DeviceAllow="
                .to_owned()
        }
        (io::ErrorKind::PermissionDenied, Address::Serial { .. }) => {
            "is the user in group dialout?".to_owned()
        }
        (io::ErrorKind::PermissionDenied, _)
            if is_not_allowed(error) && config.options.dev.is_some() =>
        {
            "`dev` takes Linux 5.7, or the capability CAP_NET_RAW".to_owned()
        }
        (io::ErrorKind::PermissionDenied, _) if (1..1_024).contains(&own_port(config)) => {
            "ports below 1024 are for root: choose a higher one".to_owned()
        }
        (io::ErrorKind::ResourceBusy, Address::Serial { device: Device::Path(path), .. }) => {
            format!("another program has it open: `fuser -v {}` tells which", path.display())
        }
        (io::ErrorKind::AddrInUse, _) => {
            if let Some(holder) = holder {
                return format!(" ({holder} already: choose another one)");
            }
            let port = own_port(config);
            let flag = if is_udp(config) { 'u' } else { 't' };
            format!("another program is there: `ss -l{flag}np sport = :{port}` tells which")
        }
        _ if is_not_a_tty(error) => "it is no serial port".to_owned(),
        _ => return String::new(),
    };
    format!(" ({text})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::General;
    use crate::daemon::stage::daemon;

    #[test]
    fn what_is_not_permitted_is_told_with_what_would_help() {
        let remedy = |endpoint: &str, code: i32| {
            remedy(&endpoint.parse().unwrap(), &io::Error::from_raw_os_error(code), None)
        };
        assert!(remedy("serial:/dev/ttyS0:57600", libc::EACCES).contains("dialout"));
        assert!(remedy("serial:/dev/ttyXX0:57600", libc::EPERM).contains("DeviceAllow="));
        assert!(remedy("udpin::80", libc::EACCES).contains("below 1024"));
        assert!(remedy("udpin::14550?dev=eth0", libc::EPERM).contains("CAP_NET_RAW"));
        // A firewall, or whatever else it is.
        assert_eq!(remedy("udpin::14550", libc::EPERM), "");
    }

    #[test]
    fn a_port_that_another_program_has_at_another_address_is_none_of_ours() {
        let server = "tcpin:127.0.0.1:0?name=one".parse().unwrap();
        let mut daemon = daemon(General::default(), vec![server]);
        daemon.open_all().unwrap();
        let one = daemon.io.endpoints.ids()[0];
        let State::Listening(listener, _) = &daemon.io.endpoints[one].state else { panic!() };
        let port = listener.local_addr().unwrap().port();
        let in_use = io::Error::from(io::ErrorKind::AddrInUse);
        let holder = |address: &str| {
            let config = format!("tcpin:{address}:{port}").parse().unwrap();
            daemon.holder(&config, &in_use)
        };
        assert_eq!(holder("127.0.0.2"), None);
        for address in ["127.0.0.1", "0.0.0.0", "localhost"] {
            assert_eq!(holder(address).as_deref(), Some("endpoint one has this port"));
        }
    }
}
