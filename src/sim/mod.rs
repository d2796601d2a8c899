//! A synthetic vehicle, or a swarm of them: something to see without hardware, and a load.
//!
//! Each vehicle flies a circle and tells of it, and answers what a ground station asks of an
//! autopilot at the start: parameters, commands, missions, its version. It is no flight simulator:
//! nothing here is steered.
//!
//! This room is pure, as `mavlink` and `routing` are: frames come in and go out by
//! [`crate::routing::LocalPeer`], and time is an argument.

mod commands;
mod flight;
mod fuzz;
mod messages;
mod mission;
mod parameters;
mod requests;
mod streams;
mod swarm;
mod vehicle;

pub use flight::VehicleKind;
pub use fuzz::fuzz_sim;
pub use swarm::{MAX_RATE, MAX_VEHICLES, Swarm, SwarmOptions};
