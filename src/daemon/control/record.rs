//! Requests about recording.

use tracing::info;

use super::super::event_loop::Daemon;
use crate::control::Answer;

impl Daemon {
    /// Begins or stops to record telemetry.
    pub(super) fn request_record(&mut self, enabled: bool) -> Answer {
        let Some(recorder) = &mut self.recorder else {
            let text = "nothing can be recorded: no directory is configured (start with --record \
                        DIR, or set `record` in the file and reload)";
            return Answer::Error(text.to_owned());
        };
        if recorder.set_running(enabled) {
            info!("recording {}, by request", if enabled { "started" } else { "stopped" });
        }
        let text = if enabled { "recording" } else { "not recording telemetry" };
        Answer::Done(format!("{text}, until the next start, or a reload with other options"))
    }
}
