//! The keys of endpoints: which sections have them, what each one takes, and what it is with us.

use std::time::Duration;

use super::value;
use crate::config::host_port::Host;
use crate::config::options::{EndpointOptions, FlowControl};
use crate::config::place::Place;
use crate::config::value::{TIMEOUT, name};

/// The kinds of section that configure an endpoint.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SectionKind {
    /// `[UartEndpoint NAME]`
    Uart,
    /// `[UdpEndpoint NAME]`
    Udp,
    /// `[TcpEndpoint NAME]`
    Tcp,
}

use SectionKind::{Tcp, Uart, Udp};

impl SectionKind {
    /// Every kind.
    pub const ALL: &[Self] = &[Uart, Udp, Tcp];

    /// As mavlink-router spells it.
    pub fn word(self) -> &'static str {
        match self {
            Uart => "UartEndpoint",
            Udp => "UdpEndpoint",
            Tcp => "TcpEndpoint",
        }
    }
}

/// What a section says, or an endpoint of the command line.
#[derive(Clone, Debug)]
pub(super) struct EndpointDraft {
    pub(super) kind: SectionKind,
    /// What the user calls it; one of the command line has no name.
    pub(super) name: Option<String>,
    /// Where the section begins.
    pub(super) place: Option<Place>,
    pub(super) mode: Mode,
    pub(super) host: Option<Host>,
    pub(super) port: Option<u16>,
    pub(super) device: Option<String>,
    /// None if none are written.
    pub(super) bauds: Vec<u32>,
    pub(super) options: EndpointOptions,
}

impl EndpointDraft {
    /// An endpoint of which nothing is known yet.
    pub(super) fn new(kind: SectionKind) -> Self {
        Self {
            kind,
            name: None,
            place: None,
            mode: Mode::Normal,
            host: None,
            port: None,
            device: None,
            bauds: Vec::new(),
            options: EndpointOptions::default(),
        }
    }
}

/// What a UDP endpoint does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    /// Sends to an address.
    Normal,
    /// Listens at an address.
    Server,
}

/// One key of an endpoint.
#[derive(Clone, Copy, Debug)]
pub struct EndpointKey {
    /// The key, as mavlink-router spells it: `AllowMsgIdOut`.
    pub name: &'static str,
    /// Which sections may have it.
    pub sections: &'static [SectionKind],
    /// Which sections must have it.
    pub required_in: &'static [SectionKind],
    /// What the value has to be, for errors: "expected " goes before it.
    pub expects: &'static str,
    /// Reads a value; `None` if it is not right.
    pub(super) set: fn(&mut EndpointDraft, &str) -> Option<()>,
    /// What there is to say of a value that is right.
    pub(super) note: fn(&str) -> Option<&'static str>,
}

/// A row for a list of messages, systems or components that are allowed or blocked.
macro_rules! filter {
    ($name:literal, $read:ident, $expects:ident, $direction:ident, $list:ident) => {
        filter!($name, SectionKind::ALL, $read, $expects, $direction, $list)
    };
    ($name:literal, $in:expr, $read:ident, $expects:ident, $direction:ident, $list:ident) => {
        EndpointKey {
            name: $name,
            sections: $in,
            required_in: &[],
            expects: $expects,
            set: |to, text| {
                to.options.$direction.$list.extend(value::$read(text)?);
                Some(())
            },
            note: |_| None,
        }
    };
}

const MESSAGES: &str = "messages by number or name with commas between";
const IDS: &str = "ids of 0 to 255 with commas between";
const HOST: &str =
    "an address without port, as 10.0.0.2, [2001:db8::1], [fe80::1%wlan0] or gcs.local";

/// All keys of endpoints.
pub const ENDPOINT_KEYS: &[EndpointKey] = &[
    EndpointKey {
        name: "Device",
        sections: &[Uart],
        required_in: &[Uart],
        expects: "a path, as /dev/ttyS0",
        set: |to, text| put(&mut to.device, text.starts_with('/').then(|| Some(text.to_owned()))),
        note: |_| None,
    },
    EndpointKey {
        name: "Baud",
        sections: &[Uart],
        required_in: &[],
        expects: "numbers of 50 to 20000000 with commas between",
        set: |to, text| put(&mut to.bauds, value::bauds(text)),
        note: |_| None,
    },
    EndpointKey {
        name: "FlowControl",
        sections: &[Uart],
        required_in: &[],
        expects: "true or false",
        set: |to, text| {
            let flow = |on: bool| if on { FlowControl::RtsCts } else { FlowControl::None };
            put(&mut to.options.flow, value::flag(text).map(flow))
        },
        note: |_| None,
    },
    EndpointKey {
        name: "Mode",
        sections: &[Udp],
        required_in: &[Udp],
        expects: "normal or server",
        set: |to, text| {
            const MODES: [Mode; 3] = [Mode::Normal, Mode::Server, Mode::Server];
            let mode = value::word(text, &["normal", "server", "eavesdropping"])?;
            put(&mut to.mode, MODES.get(mode).copied())
        },
        note: |text| {
            let is_old = text.eq_ignore_ascii_case("eavesdropping");
            is_old.then_some("an old name of server: it is taken for that")
        },
    },
    EndpointKey {
        name: "Address",
        sections: &[Udp, Tcp],
        required_in: &[Udp, Tcp],
        expects: HOST,
        set: |to, text| put(&mut to.host, value::host(text).map(Some)),
        note: |_| None,
    },
    EndpointKey {
        name: "Port",
        sections: &[Udp, Tcp],
        required_in: &[Tcp],
        expects: "a whole number of 1 to 65535",
        set: |to, text| put(&mut to.port, value::port(text).map(Some)),
        note: |_| None,
    },
    EndpointKey {
        name: "RetryTimeout",
        sections: &[Tcp],
        required_in: &[],
        expects: "a whole number of seconds, or 0 to try only once",
        set: |to, text| put(&mut to.options.retry, retry(text)),
        note: |text| {
            let longest = TIMEOUT.end().as_secs();
            let is_long = value::number(text, longest + 1..=u64::MAX).is_some();
            is_long.then_some("3600 s are the most")
        },
    },
    filter!("Filter", &[Udp], messages, MESSAGES, filter_out, allow_messages),
    filter!("AllowMsgIdOut", messages, MESSAGES, filter_out, allow_messages),
    filter!("BlockMsgIdOut", messages, MESSAGES, filter_out, block_messages),
    filter!("AllowSrcCompOut", ids, IDS, filter_out, allow_components),
    filter!("BlockSrcCompOut", ids, IDS, filter_out, block_components),
    filter!("AllowSrcSysOut", ids, IDS, filter_out, allow_systems),
    filter!("BlockSrcSysOut", ids, IDS, filter_out, block_systems),
    filter!("AllowMsgIdIn", messages, MESSAGES, filter_in, allow_messages),
    filter!("BlockMsgIdIn", messages, MESSAGES, filter_in, block_messages),
    filter!("AllowSrcCompIn", ids, IDS, filter_in, allow_components),
    filter!("BlockSrcCompIn", ids, IDS, filter_in, block_components),
    filter!("AllowSrcSysIn", ids, IDS, filter_in, allow_systems),
    filter!("BlockSrcSysIn", ids, IDS, filter_in, block_systems),
    EndpointKey {
        name: "Group",
        sections: SectionKind::ALL,
        required_in: &[],
        expects: "1 to 64 printable characters",
        set: |to, text| put(&mut to.options.group, name(text).map(Some)),
        note: |_| None,
    },
];

/// The longest wait between two tries to connect: 0 and less than that is for "only once".
fn retry(text: &str) -> Option<Duration> {
    let seconds = match text.strip_prefix('-') {
        Some(rest) => value::number(rest, 0..=u64::MAX).map(|_| 0),
        None => value::number(text, 0..=u64::MAX),
    };
    seconds.map(|seconds| Duration::from_secs(seconds).min(*TIMEOUT.end()))
}

/// Stores a value that could be read.
fn put<T>(field: &mut T, value: Option<T>) -> Option<()> {
    *field = value?;
    Some(())
}
