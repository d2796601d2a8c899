//! The options of an endpoint as values, and their defaults.

use std::fmt;
use std::net::IpAddr;
use std::time::Duration;

use super::host_port::HostPort;
use super::key_files::KeyRef;
use super::network::Network;
use crate::routing::OldFrames;
use crate::sim::SwarmOptions;

/// The options of an endpoint; the default is what holds where nothing is written.
///
/// An option that has no meaning for a kind of address is never set there.
#[derive(Clone, PartialEq, Debug)]
pub struct EndpointOptions {
    /// What the user calls the endpoint: 1 to 64 characters. Without it, its address is its name.
    pub name: Option<String>,
    /// Whether it is to be opened at all.
    pub enabled: bool,
    /// The local address and port of a sender; port 0 is any free one. Without it, the system
    /// chooses both.
    pub bind: Option<HostPort>,
    /// The network interface to send and receive on, 1 to 15 bytes. A zone in an address says the
    /// same for that address.
    pub dev: Option<String>,
    /// Who says when a serial port may send.
    pub flow: FlowControl,
    /// The rate to pace a link at, in bytes a second, 10..=1,000,000,000. Without it, the line
    /// rate of a serial port holds, and other links are not paced.
    pub bandwidth: Option<u32>,
    /// How long a frame may wait in the queue of a paced link, 10 ms to 60 s.
    pub queue_time: Duration,
    /// How often a message of one source may be sent here at most, in frames a second,
    /// 0.001..=1000; each message stands here once. What is not named is not limited.
    pub rate: Vec<(MessageRef, f32)>,
    /// How many peers a listener takes at the same time, 1..=1000.
    pub max_peers: u16,
    /// Whose addresses may be peers of a listener; if there are none here, all.
    pub allow_from: Vec<Network>,
    /// How long a peer of a UDP listener may be silent before it is forgotten, 100 ms to 60 min.
    pub peer_timeout: Duration,
    /// How long a TCP peer may take nothing from a full queue before it is closed, 100 ms to
    /// 60 min.
    pub stall_timeout: Duration,
    /// How long to wait at most before the next try to connect, 100 ms to 60 min; zero: connect only
    /// once.
    pub retry: Duration,
    /// Whether broadcast and multicast turn into unicast to whoever answers.
    pub sticky: bool,
    /// Whether frames that leave together share datagrams.
    pub pack: bool,
    /// The longest datagram to send, in bytes of payload, 280..=65507.
    pub mtu: u16,
    /// How many routers a multicast datagram may pass, plus one; 0 stays on this computer.
    pub ttl: u8,
    /// What is taken from this endpoint.
    pub filter_in: FilterOptions,
    /// What is sent to this endpoint.
    pub filter_out: FilterOptions,
    /// Whether everything is sent here, whoever it is for.
    pub sniffer: bool,
    /// Whether SETUP_SIGNING, which carries a secret key, may pass between this endpoint and others
    /// that allow it.
    pub forward_setup_signing: bool,
    /// How many times as fast as it was recorded a log is played back, 0..=1000; 0: as fast as the
    /// others take it.
    pub speed: f32,
    /// Whether a log begins anew when it has ended.
    pub looped: bool,
    /// Whether what comes from this endpoint is recorded, if anything is.
    pub record: bool,
    /// The name of the path that this endpoint shares with others, 1 to 64 characters. Nothing is
    /// forwarded within a group.
    pub group: Option<String>,
    /// Which endpoints of the group send.
    pub path: PathChoice,
    /// The rank of this endpoint in its group: with [`PathChoice::Best`], the highest is preferred.
    pub prefer: u8,
    /// The time within which the second copy of a frame is dropped, 1 to 1000 ms; `None`: 500 ms in a
    /// group.
    pub dedup: Option<Duration>,
    /// Whether nothing is taken that comes from here.
    pub readonly: bool,
    /// How many frames are taken of each peer in a second at most, 1..=1,000,000.
    pub max_rate: Option<u32>,
    /// System ids that change places between here and there; no id is there twice, or 0.
    pub remap: Vec<(u8, u8)>,
    /// The version of MAVLink to send, 1 or 2; without it, frames leave as they came.
    pub version: Option<u8>,
    /// Whether what cannot be had in that version is dropped.
    pub version_strict: bool,
    /// Whether HEARTBEAT is sent here.
    pub heartbeats: bool,
    /// Whether the component that the program itself is may be heard here.
    pub own_component: bool,
    /// How often ArduPilot vehicles that are heard here are asked to send their telemetry, in messages
    /// a second, 1..=50.
    pub request_streams: Option<u8>,
    /// Whether REQUEST_DATA_STREAM is not taken from here.
    pub block_stream_requests: bool,
    /// What is signed with that is sent here and has no signature.
    pub sign: Option<KeyRef>,
    /// What becomes of MAVLink 1 where frames are signed.
    pub v1: OldFrames,
    /// What everything must be signed with that comes from here.
    pub verify: Option<KeyRef>,
    /// Messages that may come unsigned all the same.
    pub allow_unsigned: Vec<MessageRef>,
    /// Whether frames go on without the signature that was checked.
    pub strip: bool,
    /// Which vehicles are simulated.
    pub sim: SwarmOptions,
}

impl Default for EndpointOptions {
    fn default() -> Self {
        Self {
            name: None,
            enabled: true,
            bind: None,
            dev: None,
            flow: FlowControl::None,
            bandwidth: None,
            queue_time: Duration::from_millis(250),
            rate: Vec::new(),
            max_peers: 64,
            allow_from: Vec::new(),
            peer_timeout: Duration::from_secs(60),
            stall_timeout: Duration::from_secs(30),
            retry: Duration::from_secs(2),
            sticky: true,
            pack: false,
            mtu: 1400,
            ttl: 1,
            filter_in: FilterOptions::default(),
            filter_out: FilterOptions::default(),
            sniffer: false,
            forward_setup_signing: false,
            speed: 1.0,
            looped: false,
            record: true,
            group: None,
            path: PathChoice::All,
            prefer: 0,
            dedup: None,
            readonly: false,
            max_rate: None,
            remap: Vec::new(),
            version: None,
            version_strict: true,
            heartbeats: true,
            own_component: true,
            request_streams: None,
            block_stream_requests: false,
            sign: None,
            v1: OldFrames::Pass,
            verify: None,
            allow_unsigned: ["RADIO_STATUS", "RADIO"].map(|it| MessageRef::Name(it.into())).into(),
            strip: false,
            sim: SwarmOptions::default(),
        }
    }
}

impl EndpointOptions {
    /// Whether somebody at this address may be a peer.
    pub fn admits(&self, ip: IpAddr) -> bool {
        self.allow_from.is_empty() || self.allow_from.iter().any(|network| network.contains(ip))
    }
}

/// Which frames pass in one direction. A frame passes if every list allows it and none blocks it;
/// an empty list of what is allowed allows everything.
#[derive(Clone, Default, PartialEq, Eq, Hash, Debug)]
pub struct FilterOptions {
    /// Only these messages.
    pub allow_messages: Vec<MessageRef>,
    /// Not these messages.
    pub block_messages: Vec<MessageRef>,
    /// Only what these systems send.
    pub allow_systems: Vec<u8>,
    /// Not what these systems send.
    pub block_systems: Vec<u8>,
    /// Only what components with these ids send.
    pub allow_components: Vec<u8>,
    /// Not what components with these ids send.
    pub block_components: Vec<u8>,
}

/// Who says when a serial port may send.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum FlowControl {
    /// Nobody.
    None,
    /// The wires RTS and CTS.
    RtsCts,
}

impl fmt::Display for FlowControl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::RtsCts => "rtscts",
        })
    }
}

/// Which endpoints of a group send.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum PathChoice {
    /// Every one.
    All,
    /// The one with the best measured quality.
    Best,
}

impl fmt::Display for PathChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::All => "all",
            Self::Best => "best",
        })
    }
}

/// A message as the user named it; which id a name has is found out where the dialect is known.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum MessageRef {
    /// By name, in capitals: `RAW_IMU`.
    Name(String),
    /// By id, 0..=16,777,215.
    Id(u32),
}

impl fmt::Display for MessageRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Id(id) => id.fmt(f),
        }
    }
}
