//! The I/O under the links: serial ports, TCP and UDP sockets, opened and set up without waiting.
//!
//! Nothing here knows of routes or of the poll loop. All `unsafe` of the program is in this room,
//! in the one module that speaks to the system by hand.

mod backoff;
mod batch;
mod opener;
mod ports;
mod resolver;
mod serial;
mod stream;
mod sys;
mod tcp;
mod udp;

pub use backoff::Backoff;
pub use batch::{Arrived, BATCH, Inbox, Sent, send_datagrams};
pub use opener::{Opener, SerialAnswer, SerialOutcome};
pub use ports::{Port, find_flight_controller, list_ports};
pub use resolver::{Resolved, Resolver};
pub use serial::SerialSettings;
pub use stream::{Slowness, Stream};
pub use sys::{interface_index, take_refusals};
pub use tcp::{connect, listen, tune};
pub use udp::{UdpSettings, join_multicast, open_udp};
