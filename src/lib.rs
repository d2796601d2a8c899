//! A learning switch for MAVLink: frames go from link to link by their target.
//!
//! The library is a stack of layers; each may use only those before it:
//!
//! - [`mavlink`]: bytes to frames. Pure: no I/O, no clock, no allocation per frame.
//! - [`routing`]: which link gets which frame, and the queues in between. Pure as well; the time
//!   is an argument.
//! - [`sim`]: vehicles that are not there, as pure as the two before.
//! - [`own`]: the component that the program itself may be, as pure as these.
//! - [`link`]: the sockets and serial ports that carry the bytes; the only room with `unsafe`.
//! - [`status`]: what is going on, as a value that can be shown.
//! - [`listen`]: frames as they pass, and how they look.
//! - [`control`]: how a running daemon is asked, and told what to do.
//! - [`config`]: what the user writes; [`cli`]: the command line itself.
//! - [`record`]: telemetry logs: what is recorded, and what can be done with it.
//! - [`check`]: what can be said of a configuration before it is used.
//! - [`daemon`]: the poll loop that joins it all.
//! - [`top`]: a live view of it, for a terminal.

pub mod check;
pub mod cli;
pub mod config;
pub mod control;
pub mod daemon;
pub mod link;
pub mod listen;
pub mod mavlink;
pub mod own;
mod printable;
pub mod record;
pub mod routing;
pub mod sim;
pub mod status;
#[cfg(test)]
mod test_chance;
#[cfg(test)]
mod test_dir;
pub mod top;
