//! What can be wrong with an endpoint's text, in words that tell the user what to do.
//!
//! These messages are user interface: a test holds each of them to the letter.

use std::net::Ipv6Addr;

use thiserror::Error;

/// An endpoint's text that cannot be read.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("endpoint `{text}`: {problem}")]
pub struct AddressError {
    /// The text, with control characters replaced, so that it may be printed anywhere.
    pub text: String,
    /// What is wrong with it.
    pub problem: AddressProblem,
}

impl AddressError {
    pub(super) fn new(text: &str, problem: AddressProblem) -> Self {
        let text = printable(text);
        Self { text, problem }
    }
}

/// `text` with control characters replaced: a message may go to a terminal or a log.
pub(super) fn printable(text: &str) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

/// What is wrong with an endpoint's text. What each variant carries is what its message names.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum AddressProblem {
    /// No file to play back.
    #[error("no file: write it like tlog:/var/lib/mavswitch/flight.tlog")]
    NoFile,
    /// There is no text.
    #[error("it is empty: write for example udpin:0.0.0.0:14550 or /dev/ttyACM0:57600")]
    Empty,
    /// It could not be printed in a log.
    #[error("it has a control character: take it out")]
    ControlCharacter,
    /// A host and a port, but nothing that says what to do with them.
    #[error("no scheme: write udpin:{0} to listen there or udpout:{0} to send there")]
    NoScheme(String),
    /// A scheme nobody knows, and what to write instead.
    #[error("unknown scheme `{0}`: {1}")]
    UnknownScheme(String, String),
    /// Nowhere to send to: scheme and port.
    #[error("no host: write {0}:HOST:{1}")]
    NoHost(&'static str, u16),
    /// Neither an IPv4 address nor a name.
    #[error("bad host `{0}`: write a name, an address like 10.0.0.2, or IPv6 in brackets")]
    BadHost(String),
    /// IPv6 without brackets; carries how to write it.
    #[error("write IPv6 in brackets: {0}")]
    UnbracketedIpv6(String),
    /// Something else than an IPv6 address in brackets.
    #[error("bad IPv6 address `{0}`: write it like [2001:db8::1]:14550")]
    BadIpv6(String),
    /// Not the name of an interface, or an address that has no need of one.
    #[error(
        "bad zone `{0}`: write the interface of a link-local address, like [fe80::1%wlan0]:14550"
    )]
    BadZone(String),
    /// A link-local address without its interface.
    #[error("link-local address without interface: write it like [{0}%wlan0], or add dev=wlan0")]
    NoZone(Ipv6Addr),
    /// A colon and nothing behind it.
    #[error("no port after the last colon: write a number, or leave out the colon")]
    NoPort,
    /// A port that is no number.
    #[error("bad port `{0}`: write a number of 1 to 65535")]
    BadPort(String),
    /// A port above 65535.
    #[error("port {0} is too large: write a number of 1 to 65535")]
    PortTooLarge(String),
    /// Port 0 where nobody listens.
    #[error("port 0 cannot be sent to: write a number of 1 to 65535")]
    PortZero,
    /// Multicast to something that is no group.
    #[error(
        "`{0}` is no multicast group: write one of 224.0.0.0 to 239.255.255.255, or IPv6 from [ff00::]"
    )]
    NotMulticast(String),
    /// Broadcast to an IPv6 address.
    #[error("IPv6 has no broadcast: write an IPv4 address, or use mcast")]
    Ipv6Broadcast,
    /// A serial endpoint without a device.
    #[error("no device: write for example serial:/dev/ttyACM0:57600 or serial:auto")]
    NoDevice,
    /// A device that does not begin with a slash, and what was probably meant.
    #[error("device `{0}` is no absolute path: write for example serial:{1}")]
    RelativeDevice(String, String),
    /// A baud rate that is none.
    #[error("bad baud rate `{0}`: write a number of 50 to 20000000, several with commas between")]
    BadBaud(String),
    /// Something behind the colon of `sim:`.
    #[error("`{0}` means nothing to sim: write sim: alone, or options behind it, as sim:?count=3")]
    SimHasNoPlace(String),
    /// More vehicles than there are system ids from the first on: the first, and how many.
    #[error("{1} vehicles from system {0} on end beyond 255: choose a lower system or count")]
    TooManySystems(u8, u8),
    /// An option nobody knows, and what to write instead.
    #[error("unknown option `{0}`: {1}")]
    UnknownOption(String, String),
    /// An option without `=`; carries the syntax of its value.
    #[error("option `{0}` has no value: write {0}={1}")]
    NoValue(&'static str, &'static str),
    /// The value, the option, and what it takes.
    #[error("bad value `{0}` for option `{1}`: expected {2}")]
    BadValue(String, &'static str, &'static str),
    /// A percent sign that is not followed by the two hexadecimal digits of a UTF-8 byte.
    #[error("bad % in option `{0}`: write a percent sign as %25")]
    BadEscape(&'static str),
    /// The same option again.
    #[error("option `{0}` is there twice: keep one")]
    DuplicateOption(&'static str),
    /// An option that means nothing here: option, scheme, and the schemes that take it.
    #[error("option `{0}` does not apply to {1}, only to {2}")]
    NotApplicable(&'static str, &'static str, String),
    /// An option that means nothing without another one: the option, and the other.
    #[error("option `{0}` needs `{1}`: add {1}, or leave out {0}")]
    NeedsOption(&'static str, &'static str),
}

#[cfg(test)]
mod tests {
    use crate::config::EndpointConfig;

    /// Each problem, once or more: what is typed, and what is answered behind the typed text.
    const MESSAGES: &[(&str, &str)] = &[
        ("", "it is empty: write for example udpin:0.0.0.0:14550 or /dev/ttyACM0:57600"),
        (
            "127.0.0.1:14550",
            "no scheme: write udpin:127.0.0.1:14550 to listen there or udpout:127.0.0.1:14550 to send there",
        ),
        ("[::1]", "no scheme: write udpin:[::1] to listen there or udpout:[::1] to send there"),
        (
            "localhost:14550",
            "no scheme: write udpin:localhost:14550 to listen there or udpout:localhost:14550 to send there",
        ),
        ("upd:127.0.0.1:14550", "unknown scheme `upd`: did you mean `udp`?"),
        ("UDPINN://127.0.0.1:14550", "unknown scheme `UDPINN`: did you mean `udpin`?"),
        ("ttyACM0:57600", "unknown scheme `ttyACM0`: write /dev/ttyACM0:57600"),
        ("dev/ttyACM0", "unknown scheme `dev/ttyACM0`: write /dev/ttyACM0"),
        ("a/b.tlog", "unknown scheme `a/b.tlog`: write tlog:a/b.tlog to play it back"),
        (
            "http://10.0.0.2:80",
            "unknown scheme `http`: write udpin, udpout, udpbcast, mcast, tcpin, tcpout, serial, tlog or sim",
        ),
        ("udpout:14551", "no host: write udpout:HOST:14551"),
        ("udpbcast:", "no host: write udpbcast:HOST:14550"),
        ("tcp:", "no host: write tcpout:HOST:5760"),
        (
            "udpin:10.0.0:14550",
            "bad host `10.0.0`: write a name, an address like 10.0.0.2, or IPv6 in brackets",
        ),
        (
            "udpout:a:b:14550",
            "bad host `a:b`: write a name, an address like 10.0.0.2, or IPv6 in brackets",
        ),
        ("udpin:::1:14550", "write IPv6 in brackets: udpin:[::1]:14550"),
        ("udps:fe80::1%wlan0", "write IPv6 in brackets: udpin:[fe80::1%wlan0]"),
        (
            "tcpin:[10.0.0.1]:5760",
            "bad IPv6 address `[10.0.0.1]:5760`: write it like [2001:db8::1]:14550",
        ),
        ("tcpin:[::1:5760", "bad IPv6 address `[::1:5760`: write it like [2001:db8::1]:14550"),
        ("tcpin:[::1]5760", "bad IPv6 address `[::1]5760`: write it like [2001:db8::1]:14550"),
        (
            "udpout:[fe80::1%]:14550",
            "bad zone ``: write the interface of a link-local address, like [fe80::1%wlan0]:14550",
        ),
        (
            "udpout:[2001:db8::1%wlan0]:14550",
            "bad zone `wlan0`: write the interface of a link-local address, like [fe80::1%wlan0]:14550",
        ),
        (
            "udpout:[fe80::1]:14550",
            "link-local address without interface: write it like [fe80::1%wlan0], or add dev=wlan0",
        ),
        ("udpin:0.0.0.0:", "no port after the last colon: write a number, or leave out the colon"),
        ("udpin:0.0.0.0:+1", "bad port `+1`: write a number of 1 to 65535"),
        ("tcpin:127.0.0.1:5760/", "bad port `5760/`: write a number of 1 to 65535"),
        ("udpin:65536", "port 65536 is too large: write a number of 1 to 65535"),
        ("tcpout:[::1]:99999999999", "port 99999999999 is too large: write a number of 1 to 65535"),
        ("udpout:10.0.0.2:0", "port 0 cannot be sent to: write a number of 1 to 65535"),
        ("mcast:0", "port 0 cannot be sent to: write a number of 1 to 65535"),
        (
            "mcast:10.0.0.2",
            "`10.0.0.2` is no multicast group: write one of 224.0.0.0 to 239.255.255.255, or IPv6 from [ff00::]",
        ),
        (
            "mcast:swarm.local:14550",
            "`swarm.local` is no multicast group: write one of 224.0.0.0 to 239.255.255.255, or IPv6 from [ff00::]",
        ),
        ("udpbcast:[ff02::1]:14550", "IPv6 has no broadcast: write an IPv4 address, or use mcast"),
        ("serial:", "no device: write for example serial:/dev/ttyACM0:57600 or serial:auto"),
        ("serial::57600", "no device: write for example serial:/dev/ttyACM0:57600 or serial:auto"),
        (
            "serial:ttyACM0:57600",
            "device `ttyACM0` is no absolute path: write for example serial:/dev/ttyACM0",
        ),
        (
            "serial://dev/ttyACM0",
            "device `dev/ttyACM0` is no absolute path: write for example serial:/dev/ttyACM0",
        ),
        (
            "/dev/ttyACM0:57k6",
            "bad baud rate `57k6`: write a number of 50 to 20000000, several with commas between",
        ),
        (
            "/dev/ttyACM0,57600,",
            "bad baud rate ``: write a number of 50 to 20000000, several with commas between",
        ),
        (
            "serial:auto:5",
            "bad baud rate `5`: write a number of 50 to 20000000, several with commas between",
        ),
        ("udpout:10.0.0.2?bnd=:1", "unknown option `bnd`: did you mean `bind`?"),
        (
            "serial:auto?colour=red",
            "unknown option `colour`: serial takes name, enabled, baudrate, flow, bandwidth, queue_time, rate, allow_messages_in, block_messages_in, allow_systems_in, block_systems_in, allow_components_in, block_components_in, allow_messages_out, block_messages_out, allow_systems_out, block_systems_out, allow_components_out, block_components_out, sniffer, forward_setup_signing, record, group, path, prefer, dedup, readonly, max_rate, remap, version, version_strict, heartbeats, sign, v1, verify, allow_unsigned, strip, own_component, request_streams and block_stream_requests",
        ),
        ("udpin:14550?name", "option `name` has no value: write name=NAME"),
        (
            "udpin:14550?name=",
            "bad value `` for option `name`: expected 1 to 64 printable characters",
        ),
        (
            "udpout:10.0.0.2?bind=::1:14551",
            "bad value `::1:14551` for option `bind`: expected a local IP:PORT, IP or :PORT, IPv6 in brackets",
        ),
        ("udpin:14550?name=50%", "bad % in option `name`: write a percent sign as %25"),
        ("udpin:14550?name=a&name=b", "option `name` is there twice: keep one"),
        (
            "tcpin:5760?bind=:1",
            "option `bind` does not apply to tcpin, only to udpout, udpbcast, mcast and tcpout",
        ),
        (
            "serial:auto?pack=true",
            "option `pack` does not apply to serial, only to udpin, udpout, udpbcast and mcast",
        ),
        ("mcast:?ttl=256", "bad value `256` for option `ttl`: expected a whole number of 0 to 255"),
        (
            "serial:/dev/ttyS1:57600?baudrate=115200",
            "bad value `115200` for option `baudrate`: expected numbers of 50 to 20000000 with commas between, and none in the address",
        ),
        (
            "udpin:14550?rate=ATTITUDE",
            "bad value `ATTITUDE` for option `rate`: expected MESSAGE:HZ with commas between, each message once, 0.001 to 1000 Hz; for sim also 1 to 100",
        ),
        (
            "sim:2",
            "`2` means nothing to sim: write sim: alone, or options behind it, as sim:?count=3",
        ),
        (
            "sim:?count=7&system=250",
            "7 vehicles from system 250 on end beyond 255: choose a lower system or count",
        ),
        (
            "sim:?rate=0",
            "bad value `0` for option `rate`: expected MESSAGE:HZ with commas between, each message once, 0.001 to 1000 Hz; for sim also 1 to 100",
        ),
        ("serial:auto?baud=57600", "unknown option `baud`: did you mean `baudrate`?"),
        ("udpin:14550?pack", "option `pack` has no value: write pack=true|false"),
        ("tcpin:5760?path=best", "option `path` needs `group`: add group, or leave out path"),
    ];

    #[test]
    fn each_problem_is_told_in_plain_words() {
        for (text, message) in MESSAGES {
            let error = text.parse::<EndpointConfig>().unwrap_err();
            assert_eq!(error.to_string(), format!("endpoint `{text}`: {message}"));
        }
    }

    #[test]
    fn control_characters_are_not_printed() {
        let error = "udpin:\u{1b}[2J".parse::<EndpointConfig>().unwrap_err();
        let message = "endpoint `udpin:\u{fffd}[2J`: it has a control character: take it out";
        assert_eq!(error.to_string(), message);
    }
}
