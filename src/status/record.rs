//! How recording is getting on, as a part of the picture.

use serde::{Deserialize, Serialize};

/// How recording is getting on. Counts from its start.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct RecordStatus {
    /// What it does.
    pub state: RecordState,
    /// The telemetry log that is being written.
    pub file: Option<String>,
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
