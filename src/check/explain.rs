//! A configuration in words: what each endpoint does, and what of it is not as by default.

use std::fmt::Write;
use std::net::{SocketAddr, ToSocketAddrs};

use crate::config::{Address, Config, EndpointConfig, GENERAL, Host, HostPort, OPTIONS};

/// What the configuration means, some lines for each endpoint. Asks for host names.
pub fn explain(config: &Config) -> String {
    let mut text = String::new();
    for spec in GENERAL {
        let value = config.general.show(spec);
        if let Some(value) = value.filter(|value| Some(value.as_str()) != spec.default) {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{} = {value}: {}", spec.name, spec.help);
        }
    }
    for endpoint in &config.endpoints {
        explain_endpoint(&mut text, &endpoint.config);
    }
    text
}

fn explain_endpoint(text: &mut String, config: &EndpointConfig) {
    let _ = writeln!(text, "{}: {}", config.name(), what_it_does(config));
    for spec in OPTIONS.iter().filter(|spec| spec.name != "name") {
        let value = spec.show(&config.options);
        if let Some(value) = value.filter(|value| Some(value.as_str()) != spec.default) {
            let _ = writeln!(text, "  {} = {value}: {}", spec.name, spec.help);
        }
    }
}

fn what_it_does(config: &EndpointConfig) -> String {
    match &config.address {
        Address::UdpIn(at) => format!("listens for UDP at {}", place(at)),
        Address::UdpOut(at) => format!("sends UDP to {}", place(at)),
        Address::UdpBroadcast(at) => format!("sends UDP to everybody at {}", place(at)),
        Address::Multicast(at) => format!("sends UDP to the group {} and listens to it", place(at)),
        Address::TcpIn(at) => format!("listens for TCP connections at {}", place(at)),
        Address::TcpOut(at) => format!("connects by TCP to {}", place(at)),
        Address::Serial { device, bauds } => {
            let bauds: Vec<String> = bauds.iter().map(ToString::to_string).collect();
            format!("opens {device} at {} baud", bauds.join(" or "))
        }
        Address::Tlog(file) => format!("plays back {}", file.display()),
        Address::Internal(name) => format!("is {name}, inside the program"),
    }
}

/// The host and port, and what the name means today.
fn place(at: &HostPort) -> String {
    let Host::Name(name) = &at.host else { return at.to_string() };
    let found = (name.as_str(), at.port).to_socket_addrs();
    let found: Vec<SocketAddr> = found.map(Iterator::collect).unwrap_or_default();
    let found: Vec<String> = found.iter().map(|address| address.ip().to_string()).collect();
    if found.is_empty() { at.to_string() } else { format!("{at} ({})", found.join(", ")) }
}
