//! The options of the command line about records.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::config::{self, FlightLog, RecordOptions, RecordWhen};

/// What to record.
#[derive(Args, Debug)]
pub struct RecordArgs {
    /// Record all traffic to this directory, as telemetry logs (.tlog)
    #[arg(long, value_name = "DIR")]
    pub record: Option<PathBuf>,

    /// Record all traffic, if there is a directory for it [default: true]
    #[arg(long, value_name = "YES", num_args = 0..=1, require_equals = true,
          default_missing_value = "true", hide_possible_values = true)]
    pub record_telemetry: Option<bool>,

    /// When to record [default: always]
    #[arg(long, value_name = "WHEN")]
    pub record_when: Option<RecordWhen>,

    /// Begin another telemetry log after so many bytes, as 100M; 0: never [default: 0]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub record_max_size: Option<u64>,

    /// Begin another telemetry log after so long, as 30m; 0: never [default: 0]
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub record_max_time: Option<Duration>,

    /// Delete the oldest records so that so much of the disk is free; 0: never [default: 100M]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub record_min_free: Option<u64>,

    /// Delete the oldest records so that there are no more; 0: never [default: 0]
    #[arg(long, value_name = "NUMBER")]
    pub record_max_files: Option<usize>,

    /// Ask vehicles for the logs that they make, and record these as well [default: off]
    #[arg(long, value_name = "WHICH")]
    pub flight_log: Option<FlightLog>,

    /// Ask only the vehicle with this system id for its logs
    #[arg(long, value_name = "SYSTEM", value_parser = clap::value_parser!(u8).range(1..))]
    pub flight_log_system: Option<u8>,
}

impl RecordArgs {
    /// Overrides what the files say.
    pub(super) fn apply_to(&self, options: &mut RecordOptions) {
        let RecordOptions { dir, flight_log_system, .. } = options;
        *dir = self.record.clone().or_else(|| dir.take());
        *flight_log_system = self.flight_log_system.or(*flight_log_system);
        options.telemetry = self.record_telemetry.unwrap_or(options.telemetry);
        options.when = self.record_when.unwrap_or(options.when);
        options.max_size = self.record_max_size.unwrap_or(options.max_size);
        options.max_time = self.record_max_time.unwrap_or(options.max_time);
        options.min_free = self.record_min_free.unwrap_or(options.min_free);
        options.max_files = self.record_max_files.unwrap_or(options.max_files);
        options.flight_log = self.flight_log.unwrap_or(options.flight_log);
    }
}

fn size(text: &str) -> Result<u64, String> {
    config::size(text).ok_or_else(|| "write a number of bytes, as 500k, 100M or 2G".to_owned())
}

fn time(text: &str) -> Result<Duration, String> {
    config::any_time(text).ok_or_else(|| "write a time, as 90s or 30m".to_owned())
}
