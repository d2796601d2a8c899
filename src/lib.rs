//! A learning switch for MAVLink: frames go from link to link by their target.
//!
//! The library is a stack of layers; each may use only those before it:
//!
//! - [`mavlink`]: bytes to frames. Pure: no I/O, no clock, no allocation per frame.
//! - [`config`]: text to endpoints. Pure: no I/O, no names resolved.

pub mod config;
pub mod mavlink;
