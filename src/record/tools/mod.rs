//! What can be done with telemetry logs: told about, cut, merged, filtered.
//!
//! Everything is read once from beginning to end and written as it goes, in memory that does not
//! grow with the file.

mod copy;
mod error;
mod info;
mod progress;

pub use copy::{Copied, filter, merge};
pub use error::ToolError;
pub use info::{Gap, Info, info};
