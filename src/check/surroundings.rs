//! What an endpoint needs of this computer and its network: devices, interfaces, names.

use std::net::ToSocketAddrs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::{fs, io};

use super::Finding;
use crate::config::{Address, Device, Endpoint, Host, HostPort};
use crate::link::{find_flight_controller, interface_index};
use crate::record::look_at_log;

pub(super) fn check(endpoint: &Endpoint) -> Vec<Finding> {
    let address = match &endpoint.config.address {
        Address::Serial { device: Device::Path(path), .. } => device(path),
        Address::Serial { device: Device::Auto, .. } => flight_controller(),
        other => other.host_port().and_then(name),
    };
    let address = address.map(|text| Finding::warning(endpoint, "address", text));
    let dev = endpoint.config.options.dev.as_deref().and_then(interface);
    let dev = dev.map(|text| Finding::warning(endpoint, "dev", text));
    let zone = match endpoint.config.address.host_port().map(|at| &at.host) {
        Some(Host::Zoned(_, zone)) => interface(zone),
        _ => None,
    };
    let zone = zone.map(|text| Finding::warning(endpoint, "address", text));
    [address, dev, zone].into_iter().flatten().collect()
}

fn device(path: &Path) -> Option<String> {
    let shown = path.display();
    match fs::metadata(path) {
        Ok(metadata) if metadata.file_type().is_char_device() => None,
        Ok(_) => Some(format!("{shown} is no serial port (`mavswitch ports` lists them)")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Some(format!("{shown} is not there: it will be waited for (is the cable in?)"))
        }
        Err(error) => Some(format!("cannot look at {shown}: {error}")),
    }
}

/// A log that cannot be played back. It is there from the start, or the program does not start.
pub(super) fn log(endpoint: &Endpoint) -> Option<Finding> {
    let Address::Tlog(file) = &endpoint.config.address else { return None };
    let error = look_at_log(file).err()?;
    let tell = if endpoint.config.options.enabled { Finding::wrong } else { Finding::warning };
    Some(tell(endpoint, "address", format!("cannot play back {}: {error}", file.display())))
}

fn flight_controller() -> Option<String> {
    let text = "no flight controller is found: it will be waited for (`mavswitch ports` lists what is there)";
    find_flight_controller().is_none().then(|| text.to_owned())
}

fn interface(name: &str) -> Option<String> {
    let error = interface_index(name).err()?;
    // Numbers are interfaces too, of those that have no name for us.
    let is_number = name.bytes().all(|byte| byte.is_ascii_digit());
    (!is_number).then(|| format!("interface {name} is not there: it will be waited for ({error})"))
}

fn name(at: &HostPort) -> Option<String> {
    let Host::Name(name) = &at.host else { return None };
    match (name.as_str(), at.port).to_socket_addrs().map(|mut found| found.next()) {
        Ok(Some(_)) => None,
        Ok(None) => Some(format!("{name} has no address: it will be asked for again")),
        Err(error) => Some(format!("cannot resolve {name}: {error} (it will be asked for again)")),
    }
}
