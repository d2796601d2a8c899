//! Records: what went over the links, in files of the format that every ground station reads.
//!
//! A telemetry log, `.tlog`, is a row of records, each of a time and a frame; [`TlogReader`] and
//! [`write_record`] are the format. [`Recorder`] makes such files of what the loop hands it, by a
//! thread of its own: a slow card delays no frame. [`Collector`] takes the logs that vehicles make
//! themselves. [`tools`] works on them, whatever their length, in
//! constant memory.

mod arming;
mod bars;
mod feed;
mod flight;
mod flight_files;
mod output;
mod recorder;
mod replay;
mod select;
mod status;
mod store;
mod tlog;
pub mod tools;
mod writer;

pub use bars::{beside_bars, hide_bars, show_bars};
pub use feed::CAPACITY as RECORD_BUFFER;
pub use flight::{Collector, FlightFeed, FlightProgress, MAX_FLIGHT_VEHICLES, Phase, fuzz_flight};
pub use recorder::Recorder;
pub use replay::{Replay, ReplayOptions, look_at_log};
pub use select::{BadMoment, Moment, Selection};
pub use status::{RecordState, RecordStatus};
pub use tlog::{ReaderStats, Record, TIMESTAMP, TlogReader, fuzz_tlog, write_record};
