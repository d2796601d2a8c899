//! The command line of mavlink-router: what it adds to the files, still as text.

use super::endpoint_keys::{EndpointDraft, Mode, SectionKind};
use super::value;
use crate::config::device::{self, Device};
use crate::config::error::AddressProblem;
use crate::config::host_port;

/// What the command line says, as it was typed.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct RouterdArguments {
    /// Positional: `DEVICE[:BAUD]` of a serial port, or `IP:PORT` to listen at by UDP.
    pub masters: Vec<String>,
    /// `-e`: `IP[:PORT]` to send to by UDP.
    pub udp: Vec<String>,
    /// `-p`: `IP:PORT` to connect to by TCP.
    pub tcp: Vec<String>,
    /// Flags that say what a key of `[General]` says: flag, key, value.
    pub general: Vec<(&'static str, &'static str, String)>,
}

impl RouterdArguments {
    /// Flags, keys of `[General]` and values, in the order in which they hold.
    pub(super) fn general(&self) -> impl Iterator<Item = (&'static str, &'static str, &str)> {
        self.general.iter().map(|(flag, key, text)| (*flag, *key, text.as_str()))
    }

    /// The endpoints, or what is wrong with them.
    pub(super) fn endpoints(&self) -> impl Iterator<Item = Result<EndpointDraft, String>> {
        let told = |flag: &'static str, text: &str, problem| format!("{flag}`{text}`: {problem}");
        let masters = self.masters.iter().map(move |it| master(it).map_err(|e| told("", it, e)));
        let udp = self.udp.iter().map(move |it| udp(it).map_err(|e| told("-e ", it, e)));
        let tcp = self.tcp.iter().map(move |it| tcp(it).map_err(|e| told("-p ", it, e)));
        masters.chain(udp).chain(tcp)
    }
}

/// A serial port if it begins like a path; else a UDP server.
fn master(text: &str) -> Result<EndpointDraft, String> {
    if text.starts_with('/') {
        let (device, bauds) = device::parse(text).map_err(|problem| problem.to_string())?;
        let mut draft = EndpointDraft::new(SectionKind::Uart);
        draft.device = match device {
            Device::Path(path) => path.to_str().map(str::to_owned),
            Device::Auto => None,
        };
        draft.bauds = bauds;
        return Ok(draft);
    }
    let mut draft = with_port(text, SectionKind::Udp, "write DEVICE[:BAUD] or IP:PORT")?;
    draft.mode = Mode::Server;
    Ok(draft)
}

fn udp(text: &str) -> Result<EndpointDraft, String> {
    host_and_port(text, SectionKind::Udp)
}

fn tcp(text: &str) -> Result<EndpointDraft, String> {
    with_port(text, SectionKind::Tcp, "write IP:PORT")
}

fn with_port(text: &str, kind: SectionKind, remedy: &str) -> Result<EndpointDraft, String> {
    let draft = host_and_port(text, kind)?;
    if draft.port.is_none() {
        return Err(format!("no port: {remedy}"));
    }
    Ok(draft)
}

fn host_and_port(text: &str, kind: SectionKind) -> Result<EndpointDraft, String> {
    let (host, port) = host_port::parse(text, "").map_err(|problem| problem.to_string())?;
    let host = host.ok_or("no address: write IP:PORT")?;
    if port == Some(0) {
        return Err(AddressProblem::PortZero.to_string());
    }
    let mut draft = EndpointDraft::new(kind);
    draft.host = Some(value::settle_host(host).ok_or(NO_ZONE)?);
    draft.port = port;
    Ok(draft)
}

/// Why [`value::settle_host`] refuses a host.
const NO_ZONE: &str = "link-local address without interface: write it like [fe80::1%wlan0]:14550";
