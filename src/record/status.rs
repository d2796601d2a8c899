//! How the recorder is getting on: what the loop and the writer both tell, and others show.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// How the recorder is getting on. Counts from the start of the recorder.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct RecordStatus {
    /// What it does.
    pub state: RecordState,
    /// The telemetry log that is being written.
    pub file: Option<PathBuf>,
    /// How many bytes it has so far.
    pub file_bytes: u64,
    /// The flight-stack logs that are being written, with their slots.
    pub flight_files: Vec<(u8, PathBuf)>,
    /// Frames written to telemetry logs.
    pub frames: u64,
    /// Bytes written, to files of all kinds.
    pub bytes: u64,
    /// Files begun, of all kinds.
    pub files: u64,
    /// Frames of telemetry that could not be written.
    pub lost: u64,
    /// Why nothing can be written.
    pub error: Option<String>,
}

/// What a recorder does.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum RecordState {
    /// It waits for a frame, or for a vehicle to be armed.
    #[default]
    Waiting,
    /// It writes.
    Recording,
    /// It cannot write, and tries again each second.
    Failing,
}

/// What the loop and the writer share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// Frames that found no room on their way to the writer.
    pub(super) overflowed: AtomicU64,
    /// Whether the writer sleeps until somebody wakes it.
    pub(super) is_asleep: AtomicBool,
    /// Whether the writer is to end once it has written what waits.
    pub(super) is_ending: AtomicBool,
    /// Whether the writer cannot write.
    pub(super) is_failing: AtomicBool,
    /// The slots of the flight-stack logs that broke off, as bits, until their sessions know.
    pub(super) broken: AtomicU32,
    /// Held for copying alone, never while a file is touched.
    status: Mutex<RecordStatus>,
}

impl Shared {
    /// How it is getting on.
    pub(super) fn status(&self) -> RecordStatus {
        let mut status = self.status.lock().unwrap_or_else(PoisonError::into_inner).clone();
        status.lost += self.overflowed.load(Ordering::Relaxed);
        status
    }

    /// The writer tells.
    pub(super) fn set_status(&self, status: RecordStatus) {
        *self.status.lock().unwrap_or_else(PoisonError::into_inner) = status;
    }
}
