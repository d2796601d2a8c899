//! Rows of the table of options: what datagrams look like.

use super::row::flag;
use super::{UDP, put};
use crate::config::address::AddressKind::Multicast;
use crate::config::option_spec::OnChange::{InPlace, Reopen};
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;

pub(super) const DATAGRAMS: &[OptionSpec] = &[
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
];
