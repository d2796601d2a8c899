//! The table of options: everything that reads, prints or explains an option goes through it.

use super::address::Address;
use super::address::AddressKind::{
    self, Multicast, Serial, TcpIn, TcpOut, UdpBroadcast, UdpIn, UdpOut,
};
use super::device;
use super::host_port;
use super::option_spec::OnChange::{InPlace, Reopen};
use super::option_spec::OptionSpec;
use super::shape::Shape;
use super::value::{self, QUEUE_TIME, TIMEOUT, WINDOW};

const ANY: &[AddressKind] = AddressKind::ALL;
const UDP: &[AddressKind] = &[UdpIn, UdpOut, UdpBroadcast, Multicast];
const NETWORK: &[AddressKind] = &[UdpIn, UdpOut, UdpBroadcast, Multicast, TcpIn, TcpOut];
const SENDERS: &[AddressKind] = &[UdpOut, UdpBroadcast, Multicast, TcpOut];

/// A row for a list of messages that are allowed or blocked in one direction.
macro_rules! message_filter {
    ($name:literal, $help:literal, $direction:ident, $list:ident) => {
        OptionSpec {
            name: $name,
            value: "MESSAGE[,MESSAGE...]",
            shape: Shape::List,
            expects: "messages by name or number with commas between",
            help: $help,
            default: None,
            applies_to: ANY,
            needs: None,
            on_change: InPlace,
            set: |to, text| put(&mut to.options.$direction.$list, value::messages(text)),
            show: |options| value::show_list(&options.$direction.$list),
        }
    };
}

/// A row for a list of system or component ids that are allowed or blocked in one direction.
macro_rules! id_filter {
    ($name:literal, $help:literal, $direction:ident, $list:ident) => {
        OptionSpec {
            name: $name,
            value: "ID[,ID...]",
            shape: Shape::List,
            expects: "ids of 0 to 255 with commas between",
            help: $help,
            default: None,
            applies_to: ANY,
            needs: None,
            on_change: InPlace,
            set: |to, text| put(&mut to.options.$direction.$list, value::ids(text)),
            show: |options| value::show_list(&options.$direction.$list),
        }
    };
}

/// A row for an option that is there or not.
macro_rules! flag {
    ($name:literal, $default:literal, $help:literal, $kinds:expr, $field:ident) => {
        OptionSpec {
            name: $name,
            value: "true|false",
            shape: Shape::Flag,
            expects: "true or false",
            help: $help,
            default: Some($default),
            applies_to: $kinds,
            needs: None,
            on_change: InPlace,
            set: |to, text| put(&mut to.options.$field, value::flag(text)),
            show: |options| Some(options.$field.to_string()),
        }
    };
}

/// All options, in the order in which they are printed and explained.
pub const OPTIONS: &[OptionSpec] = &[
    OptionSpec {
        name: "name",
        value: "NAME",
        shape: Shape::Text,
        expects: "1 to 64 printable characters",
        help: "what the endpoint is called in log and status",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.name, value::name(text).map(Some)),
        show: |options| options.name.clone(),
    },
    flag!("enabled", "true", "open it; if not, it waits for `mavswitch endpoint enable`", ANY, enabled),
    OptionSpec {
        name: "bind",
        value: "IP:PORT",
        shape: Shape::Text,
        expects: "a local IP:PORT, IP or :PORT, IPv6 in brackets",
        help: "send from this local address and port",
        default: None,
        applies_to: SENDERS,
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.bind, host_port::parse_local(text).map(Some)),
        show: |options| options.bind.as_ref().map(ToString::to_string),
    },
    OptionSpec {
        name: "dev",
        value: "INTERFACE",
        shape: Shape::Text,
        expects: "the name of a network interface, such as wlan0",
        help: "send and receive on this network interface only",
        default: None,
        applies_to: NETWORK,
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.dev, value::interface(text).map(Some)),
        show: |options| options.dev.clone(),
    },
    OptionSpec {
        name: "baudrate",
        value: "BAUD[,BAUD...]",
        shape: Shape::List,
        expects: "numbers of 50 to 20000000 with commas between, and none in the address",
        help: "the same as baud rates in the address",
        default: None,
        applies_to: &[Serial],
        needs: None,
        on_change: InPlace,
        set: |to, text| match &mut to.address {
            Address::Serial { bauds, .. } if bauds.is_empty() => {
                put(bauds, device::parse_bauds(text).ok())
            }
            _ => None,
        },
        // It is in the address.
        show: |_| None,
    },
    OptionSpec {
        name: "flow",
        value: "none|rtscts",
        shape: Shape::Text,
        expects: "none or rtscts",
        help: "hardware flow control of a serial port",
        default: Some("none"),
        applies_to: &[Serial],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.flow, value::flow(text)),
        show: |options| Some(options.flow.to_string()),
    },
    OptionSpec {
        name: "bandwidth",
        value: "BYTES_PER_S",
        shape: Shape::Number,
        expects: "a whole number of bytes a second, 10 to 1000000000",
        help: "pace what is sent at this rate; serial ports are paced at their line rate",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| {
            let rate = value::number(text, 10..=1_000_000_000);
            put(&mut to.options.bandwidth, rate.map(Some))
        },
        show: |options| options.bandwidth.as_ref().map(ToString::to_string),
    },
    OptionSpec {
        name: "queue_time",
        value: "TIME",
        shape: Shape::Time,
        expects: "a time of 10ms to 60s",
        help: "how long a frame may wait for a paced link",
        default: Some("250ms"),
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.queue_time, value::seconds(text, QUEUE_TIME)),
        show: |options| Some(value::show_time(options.queue_time)),
    },
    OptionSpec {
        name: "rate",
        value: "MESSAGE:HZ[,MESSAGE:HZ...]",
        shape: Shape::Rates,
        expects: "MESSAGE:HZ with commas between, each message once, 0.001 to 1000 Hz",
        help: "send these messages, by name or number, at most so often",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.rate, value::rates(text)),
        show: |options| value::show_rates(&options.rate),
    },
    OptionSpec {
        name: "max_peers",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 1 to 1000",
        help: "how many peers may be there at the same time",
        default: Some("64"),
        applies_to: &[UdpIn, TcpIn],
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.max_peers, value::number(text, 1..=1000)),
        show: |options| Some(options.max_peers.to_string()),
    },
    OptionSpec {
        name: "peer_timeout",
        value: "TIME",
        shape: Shape::Time,
        expects: "a time of 100ms to 60m",
        help: "forget a peer that was silent for so long",
        default: Some("60s"),
        applies_to: &[UdpIn],
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.peer_timeout, value::seconds(text, TIMEOUT)),
        show: |options| Some(value::show_time(options.peer_timeout)),
    },
    OptionSpec {
        name: "stall_timeout",
        value: "TIME",
        shape: Shape::Time,
        expects: "a time of 100ms to 60m",
        help: "close a connection that took nothing for so long",
        default: Some("30s"),
        applies_to: &[TcpIn, TcpOut],
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.stall_timeout, value::seconds(text, TIMEOUT)),
        show: |options| Some(value::show_time(options.stall_timeout)),
    },
    OptionSpec {
        name: "retry",
        value: "TIME",
        shape: Shape::Time,
        expects: "a time of 100ms to 60m, or 0 to connect only once",
        help: "wait at most so long before the next try to connect; 0: connect only once",
        default: Some("2s"),
        applies_to: &[TcpOut],
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.retry, value::seconds_or_zero(text, TIMEOUT)),
        show: |options| Some(value::show_time(options.retry)),
    },
    flag!(
        "sticky",
        "true",
        "send to whoever answers alone, until it is silent",
        &[UdpBroadcast, Multicast],
        sticky
    ),
    flag!("pack", "false", "put frames that leave together into one datagram", UDP, pack),
    OptionSpec {
        name: "mtu",
        value: "BYTES",
        shape: Shape::Number,
        expects: "a whole number of bytes, 280 to 65507",
        help: "the longest datagram, without its headers",
        default: Some("1400"),
        applies_to: UDP,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.mtu, value::number(text, 280..=65507)),
        show: |options| Some(options.mtu.to_string()),
    },
    OptionSpec {
        name: "ttl",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 0 to 255",
        help: "how far multicast goes: 0 this computer, 1 this network",
        default: Some("1"),
        applies_to: &[Multicast],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.ttl, value::number(text, 0..=255)),
        show: |options| Some(options.ttl.to_string()),
    },
    message_filter!("allow_messages_in", "take only these messages", filter_in, allow_messages),
    message_filter!("block_messages_in", "do not take these messages", filter_in, block_messages),
    id_filter!("allow_systems_in", "take only what these systems sent", filter_in, allow_systems),
    id_filter!("block_systems_in", "do not take what these systems sent", filter_in, block_systems),
    id_filter!(
        "allow_components_in",
        "take only what components with these ids sent",
        filter_in,
        allow_components
    ),
    id_filter!(
        "block_components_in",
        "do not take what components with these ids sent",
        filter_in,
        block_components
    ),
    message_filter!("allow_messages_out", "send only these messages", filter_out, allow_messages),
    message_filter!("block_messages_out", "do not send these messages", filter_out, block_messages),
    id_filter!("allow_systems_out", "send only what these systems sent", filter_out, allow_systems),
    id_filter!(
        "block_systems_out",
        "do not send what these systems sent",
        filter_out,
        block_systems
    ),
    id_filter!(
        "allow_components_out",
        "send only what components with these ids sent",
        filter_out,
        allow_components
    ),
    id_filter!(
        "block_components_out",
        "do not send what components with these ids sent",
        filter_out,
        block_components
    ),
    flag!("sniffer", "false", "send everything here, whoever it is for", ANY, sniffer),
    flag!(
        "forward_setup_signing",
        "false",
        "let SETUP_SIGNING, which carries a secret key, pass to others that allow it too",
        ANY,
        forward_setup_signing
    ),
    OptionSpec {
        name: "group",
        value: "NAME",
        shape: Shape::Text,
        expects: "1 to 64 printable characters",
        help: "endpoints of one group are one path: nothing is forwarded between them",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.group, value::name(text).map(Some)),
        show: |options| options.group.clone(),
    },
    OptionSpec {
        name: "path",
        value: "all|best",
        shape: Shape::Text,
        expects: "all or best",
        help: "send over every link of the group, or over the best",
        default: Some("all"),
        applies_to: ANY,
        needs: Some("group"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.path, value::path(text)),
        show: |options| Some(options.path.to_string()),
    },
    OptionSpec {
        name: "prefer",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 0 to 255",
        help: "the rank within the group: the highest is preferred",
        default: Some("0"),
        applies_to: ANY,
        needs: Some("group"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.prefer, value::number(text, 0..=255)),
        show: |options| Some(options.prefer.to_string()),
    },
    OptionSpec {
        name: "dedup",
        value: "MS",
        shape: Shape::Time,
        expects: "a time of 1 to 1000 milliseconds",
        help: "drop the second copy of a frame within this time",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.dedup, value::millis(text, WINDOW).map(Some)),
        show: |options| options.dedup.map(value::show_time),
    },
];

/// Stores a value that could be read.
fn put<T>(field: &mut T, value: Option<T>) -> Option<()> {
    *field = value?;
    Some(())
}

#[cfg(test)]
mod tests;
