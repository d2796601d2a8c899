//! Why the daemon cannot start: which endpoint, what failed, and what to do about it.

use std::io;

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
    #[error("{endpoint}: no message is called {name} (load its definition with --dialect)")]
    UnknownMessage {
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
    /// An endpoint that cannot be opened.
    pub(super) fn endpoint(config: &EndpointConfig, action: String, error: io::Error) -> Self {
        let remedy = remedy(config, &error);
        Self::Endpoint { endpoint: config.name(), action, error, remedy }
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

fn is_not_a_tty(error: &io::Error) -> bool {
    error.raw_os_error() == Some(libc::ENOTTY)
}

/// What to do about an error, as a parenthesis behind it.
fn remedy(config: &EndpointConfig, error: &io::Error) -> String {
    let is_udp = !matches!(config.address.kind(), AddressKind::TcpIn | AddressKind::TcpOut);
    let text = match (error.kind(), &config.address) {
        (io::ErrorKind::PermissionDenied, Address::Serial { .. }) => {
            "is the user in group dialout?".to_owned()
        }
        (io::ErrorKind::PermissionDenied, _) => {
            "ports below 1024 are for root: choose a higher one".to_owned()
        }
        (io::ErrorKind::ResourceBusy, Address::Serial { device: Device::Path(path), .. }) => {
            format!("another program has it open: `fuser -v {}` tells which", path.display())
        }
        (io::ErrorKind::AddrInUse, address) => {
            // Who sends or calls has another's port in its address, and its own in `bind`.
            let own = config.options.bind.as_ref().or_else(|| address.host_port());
            let port = own.map_or(0, |host_port| host_port.port);
            let flag = if is_udp { 'u' } else { 't' };
            format!("another program is there: `ss -l{flag}np sport = :{port}` tells which")
        }
        _ if is_not_a_tty(error) => "it is no serial port".to_owned(),
        _ => return String::new(),
    };
    format!(" ({text})")
}
