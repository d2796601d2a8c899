//! The keys of `[General]`: what each one takes, and what it is with us.

use std::time::Duration;

use super::value;
use crate::config::general::{General, LogLevel};
use crate::config::record::{FlightLog, RecordOptions, RecordWhen};
use crate::config::value::WINDOW;

/// What `[General]` says.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    /// What our own general keys say.
    pub(super) general: General,
    /// The port of the TCP server; `None`: there is none.
    pub(super) tcp_port: Option<u16>,
    /// For how long copies of a frame are dropped, 1 to 1000 ms.
    pub(super) dedup: Option<Duration>,
}

/// Where the TCP server listens unless told otherwise.
const TCP_PORT: u16 = 5760;

impl Default for Draft {
    fn default() -> Self {
        // What holds once a directory is named: logs of the vehicles, and nothing is deleted.
        let record = RecordOptions {
            telemetry: false,
            min_free: 0,
            flight_log: FlightLog::Auto,
            ..RecordOptions::default()
        };
        let general = General { record, ..General::default() };
        Self { general, tcp_port: Some(TCP_PORT), dedup: None }
    }
}

/// One key of `[General]`.
#[derive(Clone, Copy, Debug)]
pub struct GeneralKey {
    /// The key, as mavlink-router spells it: `TcpServerPort`.
    pub name: &'static str,
    /// What the value has to be, for errors: "expected " goes before it.
    pub expects: &'static str,
    /// The value that holds where nothing is written, if there is one.
    pub default: Option<&'static str>,
    /// Reads a value; `None` if it is not right.
    pub(super) set: fn(&mut Draft, &str) -> Option<()>,
    /// What there is to say of a value that is right.
    pub(super) note: fn(&str) -> Option<&'static str>,
}

const NUMBER: &str = "a whole number";
const FLAG: &str = "true or false";

/// All keys of `[General]`.
pub const GENERAL_KEYS: &[GeneralKey] = &[
    GeneralKey {
        name: "TcpServerPort",
        expects: "a port of 1 to 65535, or 0 for none",
        default: Some("5760"),
        set: |to, text| {
            let port = value::number(text, 0..=65_535)? as u16;
            to.tcp_port = (port != 0).then_some(port);
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "ReportStats",
        expects: FLAG,
        default: Some("false"),
        set: |_, text| value::flag(text).map(drop),
        note: |text| unless_off(text, "no statistics are printed yet"),
    },
    GeneralKey {
        name: "DebugLogLevel",
        expects: "error, warning, info, debug or trace",
        default: Some("info"),
        set: |to, text| {
            to.general.log_level = log_level(text)?;
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "DeduplicationPeriod",
        expects: "a whole number of milliseconds, or 0 for none",
        default: Some("0"),
        set: |to, text| {
            let period = Duration::from_millis(value::number(text, 0..=u64::MAX)?);
            to.dedup = (!period.is_zero()).then_some(period.min(*WINDOW.end()));
            Some(())
        },
        note: |text| {
            let is_long = value::number(text, 1_001..=u64::MAX).is_some();
            is_long.then_some(
                "1000 ms are used: within longer times frames are alike that are no copies",
            )
        },
    },
    GeneralKey {
        name: "SnifferSysid",
        expects: "a system id of 1 to 255, or 0 for none",
        default: Some("0"),
        set: |to, text| {
            let system = value::number(text, 0..=255)? as u8;
            to.general.router.sniffer = (system != 0).then_some(system);
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "MavlinkDialect",
        expects: "auto, common or ardupilotmega",
        default: Some("auto"),
        set: |to, text| {
            const LOGS: [FlightLog; 3] = [FlightLog::Auto, FlightLog::Ulog, FlightLog::Dataflash];
            let dialect = value::word(text, &["auto", "common", "ardupilotmega"])?;
            to.general.record.flight_log = *LOGS.get(dialect)?;
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "Log",
        expects: "a directory",
        default: None,
        set: |to, text| {
            to.general.record.dir = (!text.is_empty()).then(|| text.into());
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "LogMode",
        expects: "always or while-armed",
        default: Some("always"),
        set: |to, text| {
            const MODES: [RecordWhen; 2] = [RecordWhen::Always, RecordWhen::Armed];
            let mode = value::word(text, &["always", "while-armed"])?;
            to.general.record.when = *MODES.get(mode)?;
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "LogSystemId",
        expects: "a system id of 1 to 255",
        default: None,
        set: |to, text| {
            to.general.record.flight_log_system = Some(value::system(text)?);
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "MinFreeSpace",
        expects: NUMBER,
        default: Some("0"),
        set: |to, text| {
            to.general.record.min_free = value::number(text, 0..=u64::MAX)?;
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "MaxLogFiles",
        expects: NUMBER,
        default: Some("0"),
        set: |to, text| {
            let files = value::number(text, 0..=u64::MAX)?;
            to.general.record.max_files = usize::try_from(files).unwrap_or(usize::MAX);
            Some(())
        },
        note: |_| None,
    },
    GeneralKey {
        name: "LogTelemetry",
        expects: FLAG,
        default: Some("false"),
        set: |to, text| {
            to.general.record.telemetry = value::flag(text)?;
            Some(())
        },
        note: |_| None,
    },
];

/// What there is to say of a flag or a number that is not off.
fn unless_off(text: &str, note: &'static str) -> Option<&'static str> {
    (value::flag(text) == Some(true)).then_some(note)
}

fn log_level(text: &str) -> Option<LogLevel> {
    const LEVELS: [LogLevel; 5] =
        [LogLevel::Error, LogLevel::Warn, LogLevel::Info, LogLevel::Debug, LogLevel::Trace];
    let level = value::word(text, &["error", "warning", "info", "debug", "trace"])?;
    LEVELS.get(level).copied()
}
