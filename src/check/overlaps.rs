//! Addresses and devices that two endpoints want for themselves.

use std::net::IpAddr;

use super::Finding;
use crate::config::{Address, Device, Endpoint, EndpointConfig, Host, HostPort};

/// What only one endpoint can have.
#[derive(PartialEq, Debug)]
enum Claim<'a> {
    Udp(&'a HostPort),
    Tcp(&'a HostPort),
    Device(&'a Device),
}

/// Tells of each endpoint that wants what an earlier one has.
pub(super) fn check(endpoints: &[Endpoint]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let is_enabled = |endpoint: &&Endpoint| endpoint.config.options.enabled;
    for (number, endpoint) in endpoints.iter().enumerate().filter(|(_, it)| is_enabled(it)) {
        let Some(claim) = claim(&endpoint.config) else { continue };
        let earlier = endpoints[..number].iter().filter(is_enabled);
        let rival = earlier.map(|other| &other.config).find(|other| {
            conflicts(&claim, other) && !are_on_other_interfaces(&endpoint.config, other)
        });
        if let Some(rival) = rival {
            let text = format!("{} is taken by endpoint {} already", name(&claim), rival.name());
            // A device may yet be another one, or be gone; a port is the same everywhere.
            let may_pass = matches!(claim, Claim::Device(_));
            let tell = if may_pass { Finding::warning } else { Finding::wrong };
            findings.push(tell(endpoint, "address", text));
        }
    }
    findings
}

fn claim(config: &EndpointConfig) -> Option<Claim<'_>> {
    let is_fixed = |at: &&HostPort| at.port != 0;
    match &config.address {
        Address::UdpIn(at) => Some(at).filter(is_fixed).map(Claim::Udp),
        Address::TcpIn(at) => Some(at).filter(is_fixed).map(Claim::Tcp),
        Address::Serial { device, .. } => Some(Claim::Device(device)),
        Address::UdpOut(_) | Address::UdpBroadcast(_) => {
            config.options.bind.as_ref().filter(is_fixed).map(Claim::Udp)
        }
        Address::Multicast(_)
        | Address::TcpOut(_)
        | Address::Tlog(_)
        | Address::Sim
        | Address::Internal(_) => None,
    }
}

/// Whether each has an interface of its own: then both can have the port.
fn are_on_other_interfaces(one: &EndpointConfig, other: &EndpointConfig) -> bool {
    matches!((&one.options.dev, &other.options.dev), (Some(a), Some(b)) if a != b)
}

fn conflicts(wanted: &Claim<'_>, other: &EndpointConfig) -> bool {
    match (wanted, claim(other)) {
        (Claim::Udp(a), Some(Claim::Udp(b))) | (Claim::Tcp(a), Some(Claim::Tcp(b))) => {
            a.port == b.port && is_same_place(&a.host, &b.host)
        }
        (Claim::Device(a), Some(Claim::Device(b))) => *a == b,
        _ => false,
    }
}

/// Whether nobody can listen at `b` when somebody listens at `a`.
fn is_same_place(a: &Host, b: &Host) -> bool {
    match (a.ip(), b.ip()) {
        (Some(a), Some(b)) if takes_all(a, b) || takes_all(b, a) => true,
        _ => a == b,
    }
}

/// Whether `a` is every address of the kind that `b` has. `[::]` leaves IPv4 to who asks for it.
fn takes_all(a: IpAddr, b: IpAddr) -> bool {
    a.is_unspecified() && a.is_ipv4() == b.is_ipv4()
}

fn name(claim: &Claim<'_>) -> String {
    match claim {
        Claim::Udp(at) => format!("UDP {at}"),
        Claim::Tcp(at) => format!("TCP {at}"),
        Claim::Device(device) => device.to_string(),
    }
}
