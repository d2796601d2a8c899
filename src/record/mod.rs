//! Records: what went over the links, in files of the format that every ground station reads.
//!
//! A telemetry log, `.tlog`, is a row of records, each of a time and a frame; [`TlogReader`] and
//! [`write_record`] are the format. [`tools`] works on such files, whatever their length, in constant
//! memory.

mod select;
mod tlog;
pub mod tools;

pub use select::{BadMoment, Moment, Selection};
pub use tlog::{ReaderStats, Record, TIMESTAMP, TlogReader, fuzz_tlog, write_record};
