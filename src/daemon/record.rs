//! Recording as the loop sees it: one recorder or none, told when a turn begins and ends.

use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use tracing::{info, warn};

use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::open::OpenError;
use crate::config::{Address, EndpointOptions, FlightLog, RecordOptions};
use crate::record::{self, Collector, FlightProgress, Phase, Recorder, Replay, ReplayOptions};
use crate::routing::LinkId;
use crate::status::{FlightLogState, FlightLogStatus, RecordState, RecordStatus};

/// How long the writer may take at the end for what waits: a card that hangs keeps nobody.
const CLOSING: Duration = Duration::from_secs(2);

/// The part of the program that takes flight-stack logs, and the endpoint that it has.
#[derive(Debug)]
pub(super) struct Collecting {
    collector: Collector,
    endpoint: EndpointId,
    link: LinkId,
}

impl Daemon {
    /// Begins to record, if that is configured.
    pub(super) fn start_recorder(&mut self) {
        let options = &self.general.record;
        if options.dir.is_none() {
            return;
        }
        match Recorder::start(options, self.now) {
            Ok(recorder) => {
                self.start_collector(&recorder);
                self.recorder = Some(recorder);
            }
            Err(error) => warn!("cannot record: cannot start a thread for it: {error}"),
        }
    }

    /// Begins to take flight-stack logs, if they are wanted.
    fn start_collector(&mut self, recorder: &Recorder) {
        let options = &self.general.record;
        if options.flight_log == FlightLog::Off {
            return;
        }
        let collector = Collector::new(options, recorder.flight_feed());
        let endpoint = EndpointOptions::default();
        let peer = Box::new(collector.clone());
        match self.add_internal("flight-logs", endpoint, &Collector::HEARS, peer) {
            Some((endpoint, link)) => {
                self.collector = Some(Collecting { collector, endpoint, link });
            }
            None => warn!("cannot record flight-stack logs: there are too many links"),
        }
    }

    /// Has vehicles stop sending their logs: nobody will take them any more.
    pub(super) fn leave_vehicles(&mut self) {
        let Some(collecting) = &self.collector else { return };
        collecting.collector.leave(self.now);
        self.receive_local(collecting.link);
    }

    /// Ends recording; what waits is still written.
    pub(super) fn stop_recorder(&mut self) {
        self.end_recorder(CLOSING);
    }

    /// The same, but the writer is waited for no longer than that.
    fn end_recorder(&mut self, patience: Duration) {
        self.leave_vehicles();
        if let Some(Collecting { endpoint, .. }) = self.collector.take() {
            self.remove_endpoint(endpoint, "recording has ended");
        }
        if let Some(recorder) = self.recorder.take() {
            recorder.stop(patience);
        }
    }

    /// What is configured is another.
    pub(super) fn change_recorder(&mut self, before: &RecordOptions) {
        if self.general.record == *before {
            return;
        }
        // While frames flow nobody waits for a disk: the writer ends by itself.
        self.end_recorder(Duration::ZERO);
        self.start_recorder();
        info!("recording anew: its options have changed");
    }

    /// How recording is getting on, if there is any.
    pub(super) fn record_status(&self) -> Option<RecordStatus> {
        let recorder = self.recorder.as_ref()?;
        let status = recorder.status();
        let name = |path: &PathBuf| path.display().to_string();
        Some(RecordStatus {
            state: shown(status.state, recorder.is_running()),
            reason: recorder.reason().map(str::to_owned),
            file: status.file.as_ref().map(name),
            file_bytes: status.file_bytes,
            flight_files: status.flight_files.iter().map(|(_, path)| name(path)).collect(),
            frames: status.frames,
            bytes: status.bytes,
            files: status.files,
            lost: status.lost,
            flight_logs: self.flight_logs(&status.flight_files),
            error: status.error,
        })
    }

    /// How the log of each vehicle is getting on, of which the writer has these files open.
    fn flight_logs(&self, files: &[(u8, PathBuf)]) -> Vec<FlightLogStatus> {
        let Some(Collecting { collector, .. }) = &self.collector else { return Vec::new() };
        let file_of = |slot: u8| files.iter().find(|file| file.0 == slot);
        let status = |it: FlightProgress| FlightLogStatus {
            system: it.system,
            state: match it.phase {
                Phase::Idle => FlightLogState::Idle,
                Phase::Asking => FlightLogState::Asking,
                Phase::Running => FlightLogState::Running,
                Phase::Stopping => FlightLogState::Stopping,
            },
            file: file_of(it.slot).map(|(_, path)| path.display().to_string()),
            bytes: it.bytes,
            missing: it.missing,
        };
        collector.progress().into_iter().map(status).collect()
    }

    /// Begins to play back a log.
    pub(super) fn open_replay(&mut self, index: EndpointId) -> Result<(), OpenError> {
        let config = &self.io.endpoints[index].config;
        let Address::Tlog(file) = &config.address else { return Ok(()) };
        let options = ReplayOptions { speed: config.options.speed, is_loop: config.options.looped };
        let file = file.display().to_string();
        let replay = Replay::start(file.as_ref(), options)
            .map_err(|error| OpenError { action: format!("play back {file}"), error })?;
        self.open_local(index, &file, Box::new(replay)).map(drop)
    }

    /// A turn begins that was awake at `wall`.
    pub(super) fn begin_record_turn(&mut self, wall: Option<SystemTime>) {
        if let (Some(recorder), Some(wall)) = (&mut self.recorder, wall) {
            recorder.begin_turn(wall, self.now);
        }
    }

    /// The wall clock, for whoever needs it: only the recorder does.
    pub(super) fn wall_clock(&self) -> Option<SystemTime> {
        self.recorder.is_some().then(SystemTime::now)
    }
}

/// What recording does, whose telemetry is running or is not. That nothing can be written comes
/// first: that goes for flight-stack logs, too.
fn shown(state: record::RecordState, is_running: bool) -> RecordState {
    match state {
        record::RecordState::Failing => RecordState::Failing,
        _ if !is_running => RecordState::Stopped,
        record::RecordState::Waiting => RecordState::Waiting,
        record::RecordState::Recording => RecordState::Recording,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorder_that_fails_is_failing_although_telemetry_is_stopped() {
        assert_eq!(shown(record::RecordState::Failing, false), RecordState::Failing);
        assert_eq!(shown(record::RecordState::Waiting, false), RecordState::Stopped);
    }
}
