//! An endpoint, from its text and back: address and options together.

use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

use super::address::{Address, AddressKind};
use super::device::DEFAULT_BAUD;
use super::error::{AddressError, AddressProblem};
use super::host_port::Host;
use super::network::fuzz_network;
use super::option_spec::OptionSpec;
use super::option_table::OPTIONS;
use super::options::EndpointOptions;
use super::query;
use crate::sim::SwarmOptions;

/// One endpoint as the user configured it.
#[derive(Clone, PartialEq, Debug)]
pub struct EndpointConfig {
    /// Where it is.
    pub address: Address,
    /// How it is to behave.
    pub options: EndpointOptions,
}

impl EndpointConfig {
    /// What to call it: its `name`, else its canonical address without options, and without a colon
    /// at the end.
    pub fn name(&self) -> String {
        let name = self.options.name.clone();
        name.unwrap_or_else(|| self.address.to_string().trim_end_matches(':').to_owned())
    }

    /// Whether it leaves IPv4 to one of `others`: a server at `[::]` is for IPv4 peers, too, unless
    /// another of its kind has the same port for them.
    pub fn leaves_ipv4_to<'a>(&self, mut others: impl Iterator<Item = &'a Self>) -> bool {
        let Some(own) = self.address.host_port() else { return false };
        own.host.ip() == Some(Ipv6Addr::UNSPECIFIED.into())
            && others.any(|other| {
                let place = other.address.host_port().filter(|place| place.port == own.port);
                let ip = place.and_then(|place| place.host.ip());
                other.address.kind() == self.address.kind() && ip.is_some_and(|ip| ip.is_ipv4())
            })
    }

    /// An endpoint with the address `text`, without a query, and no options yet.
    pub(super) fn bare(text: &str) -> Result<Self, AddressProblem> {
        Ok(Self { address: Address::parse(text)?, options: EndpointOptions::default() })
    }

    /// Fills in and checks what depends on address and options together.
    pub(super) fn complete(mut self) -> Result<Self, AddressProblem> {
        if let Address::Serial { bauds, .. } = &mut self.address
            && bauds.is_empty()
        {
            bauds.push(DEFAULT_BAUD);
        }
        if self.address == Address::Sim && !self.options.sim.has_ids() {
            let SwarmOptions { system, count, .. } = self.options.sim;
            return Err(AddressProblem::TooManySystems(system, count));
        }
        let host = self.address.host_port().map(|at| &at.host);
        match host.and_then(Host::without_zone) {
            Some(ip) if self.options.dev.is_none() => Err(AddressProblem::NoZone(ip)),
            _ => Ok(self),
        }
    }
}

/// The options of `query`, each at most once, with their values decoded.
pub(super) fn read_query(
    query: &str,
    kind: AddressKind,
) -> Result<Vec<(&'static OptionSpec, String)>, AddressProblem> {
    let mut written: Vec<(&OptionSpec, String)> = Vec::new();
    for (name, value) in query::pairs(query) {
        let spec = OptionSpec::find(name, kind)?;
        if written.iter().any(|(other, _)| other.name == spec.name) {
            return Err(AddressProblem::DuplicateOption(spec.name));
        }
        let value = value.ok_or(AddressProblem::NoValue(spec.name, spec.value))?;
        written.push((spec, query::decode(spec.name, value)?));
    }
    Ok(written)
}

/// Holds that with `spec` there is the option that it needs.
pub(super) fn check_needs<'a>(
    spec: &OptionSpec,
    mut written: impl Iterator<Item = &'a OptionSpec>,
) -> Result<(), AddressProblem> {
    match spec.needs {
        Some(needed) if !written.any(|other| other.name == needed) => {
            Err(AddressProblem::NeedsOption(spec.name, needed))
        }
        _ => Ok(()),
    }
}

/// Cuts an endpoint's text into address and query.
pub(super) fn split(text: &str) -> Result<(&str, &str), AddressProblem> {
    if text.is_empty() {
        return Err(AddressProblem::Empty);
    }
    if text.contains(char::is_control) {
        return Err(AddressProblem::ControlCharacter);
    }
    Ok(text.split_once('?').unwrap_or((text, "")))
}

impl FromStr for EndpointConfig {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        parse(text).map_err(|problem| AddressError::new(text, problem))
    }
}

/// The canonical text: it reads back as an equal value, and leaves out what is default.
impl fmt::Display for EndpointConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.address.fmt(f)?;
        let mut separator = '?';
        for spec in OPTIONS {
            let value = spec.show(&self.options);
            if let Some(value) = value.filter(|value| Some(value.as_str()) != spec.default) {
                write!(f, "{separator}{}={}", spec.name, query::encode(&value))?;
                separator = '&';
            }
        }
        Ok(())
    }
}

fn parse(text: &str) -> Result<EndpointConfig, AddressProblem> {
    let (address, query) = split(text)?;
    let mut endpoint = EndpointConfig::bare(address)?;
    let written = read_query(query, endpoint.address.kind())?;
    for (spec, value) in &written {
        spec.set(&mut endpoint, value)?;
    }
    for (spec, _) in &written {
        check_needs(spec, written.iter().map(|(spec, _)| *spec))?;
    }
    endpoint.complete()
}

/// For a fuzzer: reads an endpoint, and if it is one, holds that its canonical text is the same; and
/// a network likewise.
///
/// # Panics
///
/// If the canonical text reads back as anything else.
pub fn fuzz_endpoint(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    fuzz_network(text);
    match text.parse::<EndpointConfig>() {
        Ok(endpoint) => {
            let canonical = endpoint.to_string();
            assert_eq!(canonical.parse(), Ok(endpoint), "{canonical}");
        }
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Device, HostPort};

    const BY_PATH: &str = "/dev/serial/by-path/platform-3f980000.usb-usb-0:1.2:1.0-port0";

    /// What users type, and its canonical text; the first rows are canonical themselves.
    const SPELLINGS: &[(&str, &str)] = &[
        ("udpin:0.0.0.0:14550", "udpin:0.0.0.0:14550"),
        ("udpout:10.0.0.2:14550", "udpout:10.0.0.2:14550"),
        ("udpout:gcs.local:14550", "udpout:gcs.local:14550"),
        ("udpbcast:192.168.1.255:14550", "udpbcast:192.168.1.255:14550"),
        ("mcast:239.1.2.3:14551", "mcast:239.1.2.3:14551"),
        ("tcpin:127.0.0.1:5760", "tcpin:127.0.0.1:5760"),
        ("tcpout:[2001:db8::1]:5760", "tcpout:[2001:db8::1]:5760"),
        ("serial:/dev/ttyACM0:57600", "serial:/dev/ttyACM0:57600"),
        ("serial:auto:921600,57600", "serial:auto:921600,57600"),
        // Parts left out.
        ("udpin", "udpin:0.0.0.0:14550"),
        ("udpin:", "udpin:0.0.0.0:14550"),
        ("udpin:14540", "udpin:0.0.0.0:14540"),
        ("udpin::14540", "udpin:0.0.0.0:14540"),
        ("udpin:127.0.0.1", "udpin:127.0.0.1:14550"),
        ("udpin:0", "udpin:0.0.0.0:0"),
        ("tcpin:5761", "tcpin:0.0.0.0:5761"),
        ("tcpin:[::]", "tcpin:[::]:5760"),
        ("tcpin:[::]:0", "tcpin:[::]:0"),
        ("udpout:gcs", "udpout:gcs:14550"),
        ("tcpout:gcs", "tcpout:gcs:5760"),
        ("mcast:", "mcast:239.255.145.50:14550"),
        ("mcast:14551", "mcast:239.255.145.50:14551"),
        ("mcast:[ff02::1%eth0]", "mcast:[ff02::1%eth0]:14550"),
        ("serial:auto", "serial:auto:57600"),
        ("serial:/dev/ttyS1", "serial:/dev/ttyS1:57600"),
        // pymavlink and MAVProxy.
        ("udp:127.0.0.1:14550", "udpin:127.0.0.1:14550"),
        ("tcp:127.0.0.1:5762", "tcpout:127.0.0.1:5762"),
        ("UdpIn:0.0.0.0:14550", "udpin:0.0.0.0:14550"),
        ("/dev/ttyACM0", "serial:/dev/ttyACM0:57600"),
        ("/dev/ttyACM0,115200", "serial:/dev/ttyACM0:115200"),
        // MAVSDK.
        ("udpin://0.0.0.0:14540", "udpin:0.0.0.0:14540"),
        ("udp://:14540", "udpin:0.0.0.0:14540"),
        ("udpout://10.0.0.2:14550", "udpout:10.0.0.2:14550"),
        ("tcpin://0.0.0.0:5760", "tcpin:0.0.0.0:5760"),
        ("tcpout://10.0.0.2:5760", "tcpout:10.0.0.2:5760"),
        ("serial:///dev/ttyACM0:57600", "serial:/dev/ttyACM0:57600"),
        // mavp2p.
        ("udps:0.0.0.0:5600", "udpin:0.0.0.0:5600"),
        ("udpc:1.2.3.4:5600", "udpout:1.2.3.4:5600"),
        ("udpb:192.168.7.255:5601", "udpbcast:192.168.7.255:5601"),
        ("tcps:0.0.0.0:5600", "tcpin:0.0.0.0:5600"),
        ("tcpc:example.com:5600", "tcpout:example.com:5600"),
        ("serial:/dev/ttyAMA0:57600", "serial:/dev/ttyAMA0:57600"),
        // mavlink-server.
        ("udpserver://0.0.0.0:14550", "udpin:0.0.0.0:14550"),
        ("udpclient://10.0.0.2:14550", "udpout:10.0.0.2:14550"),
        ("tcpserver://0.0.0.0:5760", "tcpin:0.0.0.0:5760"),
        ("tcpclient://10.0.0.2:5760", "tcpout:10.0.0.2:5760"),
        // mavlink-router.
        ("/dev/ttyS1:1500000", "serial:/dev/ttyS1:1500000"),
        ("serial:/dev/ttyACM0?baudrate=115200", "serial:/dev/ttyACM0:115200"),
        ("serial:///dev/ttyAMA0?baudrate=921600", "serial:/dev/ttyAMA0:921600"),
        // Options.
        ("udpin:14550?", "udpin:0.0.0.0:14550"),
        ("sim", "sim:"),
        ("SIM://", "sim:"),
        ("sim:?rate=10&count=50&system=1", "sim:?rate=10&count=50"),
        ("sim:?vehicle=plane&rate=ATTITUDE:2", "sim:?rate=ATTITUDE:2&vehicle=plane"),
        (
            "udpout:10.0.0.2?bind=14551&name=my%20gcs",
            "udpout:10.0.0.2:14550?name=my%20gcs&bind=0.0.0.0:14551",
        ),
        (
            "udpout:[fe80::1%wlan0]?bind=[fe80::2%25wlan0]",
            "udpout:[fe80::1%wlan0]:14550?bind=[fe80::2%25wlan0]:0",
        ),
        (
            "udpin:14550?allow_from=127.0.0.1/32,FD00::/8",
            "udpin:0.0.0.0:14550?allow_from=127.0.0.1,fd00::/8",
        ),
        ("/dev/ttyACM0?name=fc&", "serial:/dev/ttyACM0:57600?name=fc"),
    ];

    fn endpoint(text: &str) -> EndpointConfig {
        text.parse().unwrap()
    }

    #[test]
    fn every_spelling_has_one_canonical_text() {
        for (text, canonical) in SPELLINGS {
            let read = endpoint(text);
            assert_eq!(read.to_string(), *canonical, "{text}");
            assert_eq!(endpoint(canonical), read);
        }
    }

    #[test]
    fn an_endpoint_without_a_name_is_called_by_its_address() {
        let mut gcs = endpoint("udpout:10.0.0.2?bind=:14551");
        assert_eq!(gcs.name(), "udpout:10.0.0.2:14550");
        gcs.options.name = Some("gcs".to_owned());
        assert_eq!(gcs.name(), "gcs");
    }

    #[test]
    fn a_device_path_with_colons_is_read_whole() {
        for (text, expected) in [
            (BY_PATH.to_owned(), vec![DEFAULT_BAUD]),
            (format!("serial:{BY_PATH}:115200"), vec![115_200]),
            (format!("serial://{BY_PATH},921600,57600"), vec![921_600, 57_600]),
        ] {
            let device = Device::Path(BY_PATH.into());
            let bauds = expected;
            assert_eq!(endpoint(&text).address, Address::Serial { device, bauds });
        }
    }

    #[test]
    fn a_zone_is_kept_with_its_address() {
        let host = Host::Zoned("fe80::1".parse().unwrap(), "wlan0".to_owned());
        let at = HostPort { host, port: 14550 };
        let read = endpoint("udpout:[fe80::1%wlan0]:14550");
        assert_eq!(read.address, Address::UdpOut(at));
    }

    #[test]
    fn nasty_text_is_read_back_or_refused() {
        for (text, _) in SPELLINGS {
            for cut in 0..text.len() {
                fuzz_endpoint(&text.as_bytes()[..cut]);
                fuzz_endpoint(&text.as_bytes()[cut..]);
                for byte in [0, b':', b',', b'%', b'/', b'?', b'&', b'[', b'0', 0xff] {
                    let mut bytes = text.as_bytes().to_vec();
                    bytes[cut] = byte;
                    fuzz_endpoint(&bytes);
                    bytes.insert(cut, b':');
                    fuzz_endpoint(&bytes);
                }
            }
        }
        for text in [
            "serial:////dev//x:1,2:300",
            "serial:////dev/x:y:300",
            "//:50",
            "/,50",
            "/:,50",
            "/x:,",
            "/x:0:50,60",
            "/x,50:60",
            "serial:AUTO,50",
            "udpin:[::ffff:1.2.3.4]:0",
            "udpout:x.?name=%C3%A4%E3%80%80",
            "udpout:x?name=?name=%26%25",
            "udpout:x?bind=[::1%25]",
            "mcast:[ff02::1%1]",
            "?",
            ":",
            "//",
            "udpin:%",
            "[",
            "udpin:[",
            "udpin:]",
            "udpin:[]:",
            "udpout:ä:1",
            "/ä/ä:50",
        ] {
            fuzz_endpoint(text.as_bytes());
        }
    }
}
