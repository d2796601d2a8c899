//! What is going on, as a value: one [`Snapshot`], and everything that is shown is made of it.
//!
//! The loop fills a snapshot when somebody asks; text, JSON, metrics and the live view are made
//! from it here. Nothing in this room reads a clock, a socket or the router.

mod columns;
mod diagnosis;
mod names;
mod page;
mod prometheus;
mod rates;
mod record;
mod record_text;
mod snapshot;
mod text;
pub(crate) mod units;
mod why;
mod why_text;

pub use diagnosis::{Finding, diagnose};
pub use page::PAGE;
pub use prometheus::{MAX_COMPONENT_SERIES, Metrics, MetricsFormat};
pub use rates::{Rate, Rates};
pub use record::{FlightLogState, FlightLogStatus, RecordState, RecordStatus};
pub(crate) use record_text::line as record_line;
pub use snapshot::{
    ArmedState, ComponentStatus, Counters, EndpointState, EndpointStatus, FORMAT, HeardStatus,
    LinkStatus, MessageStatus, Program, QueueStatus, Snapshot, Vehicle,
};
pub use text::to_text;
pub use why::{FrameFate, LinkFate, Why};
pub use why_text::diagnosis_text;
