//! The component that the program itself may be: it says that it is there, answers TIMESYNC and PING
//! (rule 40), measures how far the others are, and asks ArduPilot for its telemetry.
//!
//! This room is pure, as `mavlink` and `routing` are: frames come in and go out by
//! [`crate::routing::LocalPeer`], and time is an argument.

mod component;
mod fuzz;
mod round_trip;
mod stream_requests;

pub use component::OwnComponent;
pub use fuzz::fuzz_own;
pub use round_trip::RoundTrip;
pub use stream_requests::Vehicle;

use crate::routing::{LinkId, Time};

/// A link, told from those that had its number before.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Place {
    /// Its number.
    pub link: LinkId,
    /// When it came up.
    pub since: Time,
}
