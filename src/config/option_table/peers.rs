//! Rows of the table of options: who may be there, and for how long.

use super::put;
use super::row::flag;
use crate::config::address::AddressKind::{self, Multicast, TcpIn, TcpOut, UdpBroadcast, UdpIn};
use crate::config::network;
use crate::config::option_spec::OnChange::InPlace;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value::{self, TIMEOUT};

pub(super) const PEERS: &[OptionSpec] = &[
    OptionSpec {
        name: "max_peers",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 1 to 1000",
        help: "how many peers may be there at the same time",
        default: Some("64"),
        applies_to: AddressKind::SERVERS,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.max_peers, value::number(text, 1..=1000)),
        show: |options| Some(options.max_peers.to_string()),
    },
    OptionSpec {
        name: "allow_from",
        value: "NETWORK[,NETWORK...]",
        shape: Shape::List,
        expects: "networks such as 192.168.0.0/16, without bits behind the prefix, or addresses with \
                  commas between",
        help: "who may be a peer: only these networks and addresses",
        default: None,
        applies_to: AddressKind::SERVERS,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.allow_from, network::networks(text)),
        show: |options| value::show_list(&options.allow_from),
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
];
