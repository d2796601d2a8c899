//! Looking at frames as they pass: which of them are wanted, how they are told of, and how they look.
//!
//! The daemon picks and tells, from copies that its router keeps; whoever listens reads the payloads,
//! so that none of that costs the daemon anything.

mod filter;
mod frames;
mod show;

pub use filter::{FilterError, Selection, Wanted};
pub use frames::{Frames, SeenFrame, from_hex, to_hex};
pub use show::{Reader, Widths};
