//! How recording is getting on, as a part of the picture.

use serde::{Deserialize, Serialize};

/// How recording is getting on. Counts from its start.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct RecordStatus {
    /// What it does.
    pub state: RecordState,
    /// Why no telemetry is written although nothing fails, in words.
    #[serde(default)]
    pub reason: Option<String>,
    /// The telemetry log that is being written.
    pub file: Option<String>,
    /// How many bytes it has so far.
    #[serde(default)]
    pub file_bytes: u64,
    /// The flight-stack logs that are being written.
    pub flight_files: Vec<String>,
    /// Frames written to telemetry logs.
    pub frames: u64,
    /// Bytes written, to files of all kinds.
    pub bytes: u64,
    /// Files begun, of all kinds.
    pub files: u64,
    /// Frames of telemetry that could not be written.
    pub lost: u64,
    /// Why nothing can be written, in words.
    pub error: Option<String>,
    /// The logs that vehicles make themselves, one for each vehicle that was heard.
    #[serde(default)]
    pub flight_logs: Vec<FlightLogStatus>,
}

/// How the log of one vehicle is getting on.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct FlightLogStatus {
    /// The system id of the vehicle.
    pub system: u8,
    /// How far its log is.
    pub state: FlightLogState,
    /// The file that it is written to.
    pub file: Option<String>,
    /// Bytes of the present log so far.
    pub bytes: u64,
    /// Pieces of it that are missing: given up, or asked for again.
    pub missing: u64,
}

/// How far the log of a vehicle is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FlightLogState {
    /// None is wanted: the vehicle is not armed.
    #[default]
    Idle,
    /// The vehicle was asked for it, and has not begun to send it.
    Asking,
    /// It comes.
    Running,
    /// The vehicle was asked to stop, and what is on its way is still taken.
    Stopping,
}

/// What recording does.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordState {
    /// It waits for a frame, or for a vehicle to be armed.
    #[default]
    Waiting,
    /// It writes.
    Recording,
    /// It cannot write, and tries again.
    Failing,
    /// Telemetry is not recorded: so it is configured, or somebody has stopped it.
    Stopped,
}
