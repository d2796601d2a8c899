//! An endpoint of mavlink-router as one of ours.

use std::net::{IpAddr, Ipv6Addr};

use super::endpoint_keys::{EndpointDraft, Mode, SectionKind};
use crate::config::address::Address;
use crate::config::device::Device;
use crate::config::endpoint::EndpointConfig;
use crate::config::host_port::{Host, HostPort};
use crate::config::merge::Endpoint;
use crate::config::options::EndpointOptions;
use crate::config::place::ConfigProblem;

/// The baud rate of a serial port unless told otherwise.
const BAUD: u32 = 115_200;

/// Where a UDP endpoint without a port sends, if no other sends there already.
const FIRST_UDP_PORT: u16 = 14_550;

/// What the TCP server is called.
const TCP_SERVER: &str = "tcp-server";

/// Gives those that send by UDP and have no port one that no other of the same address has.
pub(super) fn give_ports(drafts: &mut [EndpointDraft]) {
    for index in 0..drafts.len() {
        let draft = &drafts[index];
        let needs_one = draft.kind == SectionKind::Udp && draft.mode == Mode::Normal;
        if !needs_one || draft.port.is_some() || draft.host.is_none() {
            continue;
        }
        let is_taken = |port: u16| {
            let mut others = drafts.iter().filter(|it| it.kind == SectionKind::Udp);
            others.any(|other| other.host == draft.host && other.port == Some(port))
        };
        drafts[index].port = (FIRST_UDP_PORT..).find(|port| !is_taken(*port));
    }
}

/// Makes our endpoint. One that lacks a key that it must have gives none: that is told elsewhere.
pub(super) fn settle(draft: &EndpointDraft) -> Result<Option<Endpoint>, ConfigProblem> {
    let address = match draft.kind {
        SectionKind::Uart => serial(draft)?,
        SectionKind::Udp => udp(draft)?,
        SectionKind::Tcp => at(draft).map(Address::TcpOut),
    };
    let options = EndpointOptions { name: draft.name.clone(), ..draft.options.clone() };
    Ok(address.map(|address| {
        let config = EndpointConfig { address, options };
        Endpoint { config, place: draft.place.clone(), keys: Vec::new() }
    }))
}

/// The TCP server: whoever connects, by IPv4 or IPv6.
pub(super) fn tcp_server(port: u16) -> Endpoint {
    let host = Host::Ip(Ipv6Addr::UNSPECIFIED.into());
    let address = Address::TcpIn(HostPort { host, port });
    let name = Some(TCP_SERVER.to_owned());
    let options = EndpointOptions { name, ..EndpointOptions::default() };
    Endpoint::from(EndpointConfig { address, options })
}

fn refuse(draft: &EndpointDraft, text: String) -> ConfigProblem {
    match &draft.place {
        Some(place) => ConfigProblem::at(place, text),
        None => ConfigProblem::of_command_line(text),
    }
}

fn at(draft: &EndpointDraft) -> Option<HostPort> {
    Some(HostPort { host: draft.host.clone()?, port: draft.port? })
}

fn serial(draft: &EndpointDraft) -> Result<Option<Address>, ConfigProblem> {
    let Some(device) = &draft.device else { return Ok(None) };
    let bauds = if draft.bauds.is_empty() { vec![BAUD] } else { draft.bauds.clone() };
    let address = Address::Serial { device: Device::Path(device.into()), bauds };
    // There are names that the grammar of addresses cannot tell from a baud rate or an option.
    let read = address.to_string().parse::<EndpointConfig>();
    if read.is_ok_and(|read| read.address == address) {
        return Ok(Some(address));
    }
    let text = format!("cannot use the device name `{device}`: make a symbolic link to it");
    Err(refuse(draft, text))
}

fn udp(draft: &EndpointDraft) -> Result<Option<Address>, ConfigProblem> {
    let Some(at) = at(draft) else {
        let has_address = draft.host.is_some();
        let text = "a UdpEndpoint of mode server has no `Port`: add one".to_owned();
        return if has_address { Err(refuse(draft, text)) } else { Ok(None) };
    };
    let is_multicast = at.host.ip().is_some_and(|ip| ip.is_multicast());
    Ok(Some(match draft.mode {
        _ if is_multicast => Address::Multicast(at),
        Mode::Server => Address::UdpIn(at),
        Mode::Normal if is_broadcast(&at.host) => Address::UdpBroadcast(at),
        Mode::Normal => Address::UdpOut(at),
    }))
}

/// Whether an address is, in all likelihood, the broadcast address of a network: the netmask is not
/// known here, but nearly all networks end at 255.
fn is_broadcast(host: &Host) -> bool {
    matches!(host.ip(), Some(IpAddr::V4(ip)) if ip.octets()[3] == 255)
}
