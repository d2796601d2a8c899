//! How recording is getting on, as text: tables for a terminal, and a line for the live view.

use super::columns::Columns;
use super::units::{bytes, number};
use super::{FlightLogState, FlightLogStatus, RecordState, RecordStatus};
use crate::printable::printable;

const RECORD: &[&str] = &["RECORD", " FRAMES", " LOST", " FILES", " SIZE", "FILE"];
const FLIGHT_LOGS: &[&str] = &["FLIGHT LOG OF", "STATE", " SIZE", " MISSING", "FILE"];

/// Tables of what is recorded; `colour`: for a terminal.
pub(super) fn tables(record: &RecordStatus, colour: bool) -> Vec<String> {
    let mut table = Columns::new(RECORD, colour);
    table.push(vec![
        state(record.state).to_owned(),
        record.frames.to_string(),
        record.lost.to_string(),
        record.files.to_string(),
        size(record.file.as_deref(), record.file_bytes),
        record.file.clone().unwrap_or_else(|| "-".to_owned()),
    ]);
    let mut text = table.to_string();
    if let Some(why) = why(record) {
        text.push_str(&format!("{}: {}\n", state(record.state), printable(&why)));
    }
    let mut tables = vec![text];
    if !record.flight_logs.is_empty() {
        tables.push(flight_logs(&record.flight_logs, colour));
    }
    tables
}

fn flight_logs(logs: &[FlightLogStatus], colour: bool) -> String {
    let mut table = Columns::new(FLIGHT_LOGS, colour);
    for log in logs {
        table.push(vec![
            format!("system {}", log.system),
            flight_log_state(log.state).to_owned(),
            size(log.file.as_deref(), log.bytes),
            log.missing.to_string(),
            log.file.clone().unwrap_or_else(|| "-".to_owned()),
        ]);
    }
    table.to_string()
}

/// All of it in a line: what matters first, for what has no room is cut off.
pub(crate) fn line(record: &RecordStatus) -> String {
    let mut parts = vec![state(record.state).to_owned()];
    parts.extend(record.file.as_deref().map(|file| printable(name(file))));
    if record.file.is_some() {
        parts.push(bytes(record.file_bytes as f64));
    }
    parts.push(format!("{} frames", number(record.frames as f64)));
    if record.lost > 0 {
        parts.push(format!("{} lost", number(record.lost as f64)));
    }
    parts.extend(why(record).map(|why| printable(&why)));
    for log in &record.flight_logs {
        parts.push(flight_log(log));
    }
    parts.join("  ")
}

fn flight_log(log: &FlightLogStatus) -> String {
    let mut text = format!("log of {}: {}", log.system, flight_log_state(log.state));
    if log.state != FlightLogState::Idle && log.bytes > 0 {
        text.push_str(&format!(" {}", bytes(log.bytes as f64)));
    }
    if log.missing > 0 {
        text.push_str(&format!(", {} missing", log.missing));
    }
    text
}

/// Why nothing is written.
fn why(record: &RecordStatus) -> Option<String> {
    let failing = record.error.as_ref().map(|error| format!("{error}; tried again each second"));
    failing.or_else(|| record.reason.clone())
}

fn size(file: Option<&str>, so_far: u64) -> String {
    file.map_or_else(|| "-".to_owned(), |_| bytes(so_far as f64))
}

/// The last part of a path.
fn name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn state(state: RecordState) -> &'static str {
    match state {
        RecordState::Waiting => "waiting",
        RecordState::Recording => "recording",
        RecordState::Failing => "failing",
        RecordState::Stopped => "stopped",
    }
}

fn flight_log_state(state: FlightLogState) -> &'static str {
    match state {
        FlightLogState::Idle => "not wanted",
        FlightLogState::Asking => "asked for",
        FlightLogState::Running => "running",
        FlightLogState::Stopping => "ending",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> RecordStatus {
        RecordStatus {
            state: RecordState::Recording,
            file: Some("/var/lib/mavswitch/00017-2026-11-22_10-30-00.tlog".into()),
            file_bytes: 7_040,
            frames: 152,
            files: 2,
            ..RecordStatus::default()
        }
    }

    #[test]
    fn the_file_its_size_and_what_was_lost_are_told() {
        let record = RecordStatus { lost: 12, ..recording() };
        let expected = "\
RECORD     FRAMES  LOST  FILES    SIZE  FILE
recording     152    12      2  7.0 kB  /var/lib/mavswitch/00017-2026-11-22_10-30-00.tlog
";
        assert_eq!(tables(&record, false), [expected]);
        let expected = "recording  00017-2026-11-22_10-30-00.tlog  7.0 kB  152 frames  12 lost";
        assert_eq!(line(&record), expected);
    }

    #[test]
    fn why_nothing_is_written_is_told_and_commands_no_terminal() {
        let odd = RecordStatus {
            state: RecordState::Failing,
            error: Some("No space\u{1b}[2J".into()),
            ..RecordStatus::default()
        };
        let expected = "failing: No space?[2J; tried again each second\n";
        assert!(tables(&odd, false)[0].ends_with(expected), "{:?}", tables(&odd, false));
        let waits =
            RecordStatus { reason: Some("no vehicle is armed".into()), ..Default::default() };
        assert!(tables(&waits, false)[0].ends_with("waiting: no vehicle is armed\n"));
        assert_eq!(line(&waits), "waiting  0 frames  no vehicle is armed");
    }

    #[test]
    fn the_log_of_each_vehicle_has_a_row() {
        let log = |system, state, bytes, missing| {
            let file = (bytes > 0).then(|| format!("r/{system}.bin"));
            FlightLogStatus { system, state, file, bytes, missing }
        };
        let flight_logs =
            vec![log(1, FlightLogState::Running, 200_000, 3), log(2, FlightLogState::Asking, 0, 0)];
        let record = RecordStatus { flight_logs, ..recording() };
        let expected = "\
FLIGHT LOG OF  STATE          SIZE  MISSING  FILE
system 1       running    200.0 kB        3  r/1.bin
system 2       asked for         -        0  -
";
        assert_eq!(tables(&record, false)[1], expected);
        let end = "log of 1: running 200.0 kB, 3 missing  log of 2: asked for";
        assert!(line(&record).ends_with(end), "{}", line(&record));
    }
}
