//! Logs that the flight stacks make themselves, and send over MAVLink to whoever asks: ULog of PX4,
//! DataFlash blocks of ArduPilot.
//!
//! [`Collector`] finds the vehicles and has a session with each; a session is a machine without a
//! clock or a file, which asks for the log, acknowledges what arrives and asks again for what does
//! not.

mod assembler;
mod collector;
mod dataflash;
mod fuzz;
mod message;
mod session;
mod sink;
#[cfg(test)]
mod stage;
mod ulog;

pub use collector::{Collector, FlightProgress, VEHICLES as MAX_FLIGHT_VEHICLES};
pub use fuzz::fuzz_flight;
pub use session::Phase;
pub use sink::FlightFeed;
