//! What is recorded, where and for how long: the values, and the general keys that say them.

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum;

use super::general::{GeneralSpec, choice, put, show_choice};
use super::shape::Shape;
use super::value::{self, FOREVER};

/// What is recorded, where and for how long.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RecordOptions {
    /// The directory of records; without it, nothing is recorded.
    pub dir: Option<PathBuf>,
    /// Whether all traffic goes to telemetry logs.
    pub telemetry: bool,
    /// When telemetry is recorded.
    pub when: RecordWhen,
    /// A telemetry log of so many bytes is followed by another; 0: of any size.
    pub max_size: u64,
    /// The same after so long a time; zero: after any.
    pub max_time: Duration,
    /// The oldest records are deleted until so many bytes are free; 0: none is.
    pub min_free: u64,
    /// The oldest records are deleted until there are so many; 0: any number.
    pub max_files: usize,
    /// Which flight-stack logs are asked for.
    pub flight_log: FlightLog,
    /// Whose; without it, those of every vehicle.
    pub flight_log_system: Option<u8>,
}

impl Default for RecordOptions {
    fn default() -> Self {
        Self {
            dir: None,
            telemetry: true,
            when: RecordWhen::Always,
            max_size: 0,
            max_time: Duration::ZERO,
            min_free: 100_000_000,
            max_files: 0,
            flight_log: FlightLog::Off,
            flight_log_system: None,
        }
    }
}

/// When something is recorded.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum RecordWhen {
    /// As long as the program runs
    #[default]
    Always,
    /// While a vehicle is armed
    Armed,
}

/// Which logs are asked for that the flight stack itself makes.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FlightLog {
    /// None
    #[default]
    Off,
    /// What each vehicle makes: ULog of PX4, DataFlash blocks of ArduPilot
    Auto,
    /// ULog, whatever the vehicle
    Ulog,
    /// DataFlash blocks, whatever the vehicle
    Dataflash,
}

pub(super) const RECORD: GeneralSpec = GeneralSpec {
    name: "record",
    shape: Shape::Path,
    expects: "the name of a directory",
    help: "record to this directory; it is made if it is not there; relative to this file",
    default: None,
    is_reloaded: true,
    set: |to, words| put(&mut to.record.dir, words.first().map(|word| Some(PathBuf::from(word)))),
    show: |general| general.record.dir.iter().map(|dir| dir.display().to_string()).collect(),
};

pub(super) const TELEMETRY: GeneralSpec = GeneralSpec {
    name: "record_telemetry",
    shape: Shape::Flag,
    expects: "true or false",
    help: "record all traffic to telemetry logs (.tlog)",
    default: Some("true"),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.telemetry, words.first().and_then(|it| value::flag(it))),
    show: |general| vec![general.record.telemetry.to_string()],
};

pub(super) const WHEN: GeneralSpec = GeneralSpec {
    name: "record_when",
    shape: Shape::Text,
    expects: "always or armed",
    help: "when to record: always, or while a vehicle is armed",
    default: Some("\"always\""),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.when, words.first().and_then(|word| choice(word))),
    show: |general| show_choice(&general.record.when),
};

pub(super) const MAX_SIZE: GeneralSpec = GeneralSpec {
    name: "record_max_size",
    shape: Shape::Time,
    expects: "a number of bytes, or with a unit, as 500k, 100M or 2G; 0 for any size",
    help: "begin another telemetry log after so many bytes; 0: never",
    default: Some("\"0\""),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.max_size, words.first().and_then(|word| size(word))),
    show: |general| vec![show_size(general.record.max_size)],
};

pub(super) const MAX_TIME: GeneralSpec = GeneralSpec {
    name: "record_max_time",
    shape: Shape::Time,
    expects: "a time, as 90s or 30m; 0 for any time",
    help: "begin another telemetry log after so long; 0: never",
    default: Some("\"0s\""),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.max_time, words.first().and_then(|word| any_time(word))),
    show: |general| vec![value::show_time(general.record.max_time)],
};

pub(super) const MIN_FREE: GeneralSpec = GeneralSpec {
    name: "record_min_free",
    shape: Shape::Time,
    expects: "a number of bytes, or with a unit, as 500k, 100M or 2G; 0 for none",
    help: "delete the oldest records so that so much of the disk is free; 0: never",
    default: Some("\"100M\""),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.min_free, words.first().and_then(|word| size(word))),
    show: |general| vec![show_size(general.record.min_free)],
};

pub(super) const MAX_FILES: GeneralSpec = GeneralSpec {
    name: "record_max_files",
    shape: Shape::Number,
    expects: "a whole number, or 0 for any",
    help: "delete the oldest records so that there are no more; 0: never",
    default: Some("0"),
    is_reloaded: true,
    set: |to, words| {
        let number = words.first().and_then(|word| value::number(word, 0..=usize::MAX));
        put(&mut to.record.max_files, number)
    },
    show: |general| vec![general.record.max_files.to_string()],
};

pub(super) const FLIGHT_LOG: GeneralSpec = GeneralSpec {
    name: "flight_log",
    shape: Shape::Text,
    expects: "off, auto, ulog or dataflash",
    help: "ask vehicles for the logs they make: off, auto, ulog (PX4) or dataflash (ArduPilot); auto: what each one makes",
    default: Some("\"off\""),
    is_reloaded: true,
    set: |to, words| put(&mut to.record.flight_log, words.first().and_then(|word| choice(word))),
    show: |general| show_choice(&general.record.flight_log),
};

pub(super) const FLIGHT_LOG_SYSTEM: GeneralSpec = GeneralSpec {
    name: "flight_log_system",
    shape: Shape::Number,
    expects: "a system id of 1 to 255",
    help: "ask only the vehicle with this system id for its logs",
    default: None,
    is_reloaded: true,
    set: |to, words| {
        let system = words.first().and_then(|word| value::number(word, 1..=255));
        put(&mut to.record.flight_log_system, system.map(Some))
    },
    show: |general| general.record.flight_log_system.iter().map(ToString::to_string).collect(),
};

/// A number of bytes: `4096`, `500k`, `100M`, `2G`.
pub fn size(text: &str) -> Option<u64> {
    let (digits, unit) = UNITS
        .iter()
        .find_map(|(letter, unit)| Some((text.strip_suffix(*letter)?, *unit)))
        .unwrap_or((text, 1));
    value::number::<u64>(digits, 0..=u64::MAX)?.checked_mul(unit)
}

const UNITS: [(char, u64); 3] = [('G', 1_000_000_000), ('M', 1_000_000), ('k', 1_000)];

fn show_size(bytes: u64) -> String {
    let whole = UNITS.iter().find(|(_, unit)| bytes != 0 && bytes.is_multiple_of(*unit));
    whole.map_or_else(|| bytes.to_string(), |(letter, unit)| format!("{}{letter}", bytes / unit))
}

/// Any time: `90s`, `30m`.
pub fn any_time(text: &str) -> Option<Duration> {
    value::seconds(text, Duration::ZERO..=FOREVER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units_or_none() {
        for (text, bytes) in [("0", 0), ("4096", 4_096), ("500k", 500_000), ("2G", 2_000_000_000)] {
            assert_eq!(size(text), Some(bytes));
            assert_eq!(show_size(bytes), text);
        }
        assert_eq!(show_size(1_500_000), "1500k");
        for text in ["", "k", "-1", "1.5M", "1 M", "1m", "99999999999999G"] {
            assert_eq!(size(text), None, "{text}");
        }
    }
}
