//! Rows of the table of options: what the endpoint is called, and where it is.

use super::row::flag;
use super::{ANY, NETWORK, SENDERS, put};
use crate::config::address::Address;
use crate::config::address::AddressKind::Serial;
use crate::config::device;
use crate::config::host_port;
use crate::config::option_spec::OnChange::{InPlace, Reopen};
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;

pub(super) const ADDRESS: &[OptionSpec] = &[
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
    flag!(
        "enabled",
        "true",
        "open it; without, it waits for `mavswitch endpoint enable`",
        ANY,
        enabled
    ),
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
];
