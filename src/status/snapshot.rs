//! The picture of one moment: every figure counts from the start of what it belongs to, so that
//! rates are the difference of two pictures, whoever wants them at whichever distance.
//!
//! Its JSON is an interface: a field may be added, none may change its meaning while [`FORMAT`]
//! stays the same. Times are in milliseconds where their name ends in `_ms`, counted back from the
//! moment of the picture where it ends in `_ago_ms`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::record::RecordStatus;

/// The version of the JSON that a [`Snapshot`] is written as.
pub const FORMAT: u32 = 1;

/// What is going on at one moment.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Snapshot {
    /// [`FORMAT`].
    pub format: u32,
    /// When: microseconds since the program started, by a clock that never jumps.
    pub time_us: u64,
    /// Who says so.
    pub program: Program,
    /// The endpoints, in the order in which they are configured; what joined later comes last.
    pub endpoints: Vec<EndpointStatus>,
    /// The components that were heard, by system and component id.
    pub components: Vec<ComponentStatus>,
    /// What they sent, by message: the most frequent first. Bounded; the rest is in no entry.
    pub messages: Vec<MessageStatus>,
    /// What is recorded, if a directory for that is configured.
    #[serde(default)]
    pub record: Option<RecordStatus>,
}

/// The program that runs.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Program {
    /// Its version: `0.1.0`.
    pub version: String,
    /// Its process id.
    pub pid: u32,
}

/// An endpoint: what the user configured, and what came of it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct EndpointStatus {
    /// Its name, by which requests and logs speak of it; unique.
    pub name: String,
    /// Its address, without options: `udpin:0.0.0.0:14550`.
    pub address: String,
    /// The group of redundant paths that it belongs to.
    pub group: Option<String>,
    /// How far it is.
    pub state: EndpointState,
    /// How long it has been in this state.
    pub since_ago_ms: u64,
    /// Why it is not up: the last failure, in words.
    pub reason: Option<String>,
    /// How often a link of it, or its socket, had to be opened again.
    pub reconnects: u64,
    /// How often somebody was refused as a peer, each connection and each datagram, by reason:
    /// `outside` of `allow_from`, `unbelieved` by `verify`, `full` by `max_peers`.
    #[serde(default)]
    pub refused_peers: BTreeMap<String, u64>,
    /// Its live links.
    pub links: Vec<LinkStatus>,
    /// What links of it counted that are gone. With those of `links`, its totals never fall.
    pub past: Counters,
    /// Whether it belongs to the program itself, and no configuration names it.
    #[serde(default)]
    pub is_internal: bool,
}

/// How far an endpoint is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndpointState {
    /// Nothing is open; it is tried again by itself.
    #[default]
    Waiting,
    /// Its host name was asked for.
    Resolving,
    /// Its port is being opened, or its connection made.
    Connecting,
    /// It is open and serves whoever comes; it may have no link yet.
    Listening,
    /// Its link is up.
    Up,
    /// It has failed (`retry=0`) or come to its end, as a log that is played back does, and is not
    /// tried again.
    GivenUp,
    /// Somebody switched it off.
    Disabled,
}

/// A link: one live peer of an endpoint.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct LinkStatus {
    /// Its number; another link may have had it before.
    pub id: u16,
    /// Who is at the other end: an address, or a device with its line rate.
    pub peer: String,
    /// How long it has been up.
    pub up_ago_ms: u64,
    /// How long ago something was last received.
    pub heard_ago_ms: Option<u64>,
    /// What it counted.
    pub counters: Counters,
    /// What waits to be sent.
    pub queue: QueueStatus,
    /// The pace at which it is sent to, in bytes a second, if it has one.
    pub pace: Option<u64>,
    /// The loss from the other side, in per cent of late, where it can be told (rule 51).
    pub loss_percent: Option<f64>,
    /// How long a question to whoever is there takes with its answer, of late, in milliseconds; if
    /// that is measured (`system`), and somebody answers.
    #[serde(default)]
    pub round_trip_ms: Option<f64>,
    /// The same for the last one.
    #[serde(default)]
    pub last_round_trip_ms: Option<f64>,
}

/// Counts of a link, or of several together.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Frames that arrived whole.
    pub frames_in: u64,
    /// Their bytes.
    pub bytes_in: u64,
    /// Frames that were queued for sending, but for those that could not be sent then.
    pub frames_out: u64,
    /// Their bytes.
    pub bytes_out: u64,
    /// Bytes received that belong to no frame.
    pub garbage_bytes: u64,
    /// What looked like a frame and had a wrong checksum.
    pub bad_crc: u64,
    /// Frames with an incompatibility flag that nobody knows (rule 12).
    pub unknown_flags: u64,
    /// Frames that were refused, by reason: `queue_full`, `filtered_in`, `no_route`.
    pub refused: BTreeMap<String, u64>,
}

/// What waits on a link to be sent.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct QueueStatus {
    /// Bytes that wait.
    pub bytes: u64,
    /// Bytes that may wait at most.
    pub limit: u64,
    /// How long the oldest of them has waited.
    pub age_ms: u64,
}

/// A component that was heard.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ComponentStatus {
    /// Its system id, 1..=255.
    pub system: u8,
    /// Its component id, 1..=255.
    pub component: u8,
    /// What it says of itself, if it sends heartbeats.
    pub vehicle: Option<Vehicle>,
    /// Where it was heard.
    pub heard: Vec<HeardStatus>,
}

/// What a HEARTBEAT says.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Vehicle {
    /// MAV_TYPE, in words: `quadrotor`.
    pub kind: String,
    /// MAV_AUTOPILOT, in words: `ArduPilot`.
    pub autopilot: String,
    /// Whether it is armed.
    pub armed: ArmedState,
    /// MAV_STATE, in words: `standby`.
    pub state: String,
}

/// Whether a vehicle is armed.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArmedState {
    /// Motors are off.
    #[default]
    Disarmed,
    /// Motors may turn.
    Armed,
    /// It is nothing that could be armed: a camera, a ground station.
    None,
}

/// A component on a link.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct HeardStatus {
    /// The name of the link's endpoint.
    pub endpoint: String,
    /// The link's number.
    pub link: u16,
    /// How long ago it was last heard there.
    pub heard_ago_ms: u64,
    /// Whether frames for it are sent there.
    pub is_route: bool,
    /// Frames of it that came there.
    pub frames: u64,
    /// Frames that were lost on the way there, by its sequence numbers (rule 51).
    pub lost: u64,
}

/// A message of a component.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct MessageStatus {
    /// Its source's system id.
    pub system: u8,
    /// Its source's component id.
    pub component: u8,
    /// Its number.
    pub id: u32,
    /// Its name, if it is known: `HEARTBEAT`.
    pub name: Option<String>,
    /// How many came; copies count as well.
    pub frames: u64,
    /// Their bytes.
    pub bytes: u64,
}
