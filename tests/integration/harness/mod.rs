//! What every test is made of: the real router, and peers that talk to it through real sockets.
//!
//! Nothing here sleeps where it can wait for an event, and nothing fails because a machine is slow:
//! [`PATIENCE`] is an upper bound for things that are to happen, never a measure.

mod again;
mod asking;
mod condition;
mod cutter;
mod dir;
mod frames;
mod log;
mod marks;
mod names;
mod network;
mod noise;
mod peer;
mod port;
mod process;
mod pty;
mod router;
mod scene;
mod schedule;
mod tcp;
mod terminal;
mod udp;

use std::time::Duration;

pub(crate) use again::{Actor, can_delay, in_own_namespaces, is_there, part, sh};
pub(crate) use condition::{Condition, assert_rests};
pub(crate) use dir::TempDir;
pub(crate) use frames::*;
pub(crate) use names::Names;
pub(crate) use network::{FAR, FarNetwork, NEAR};
pub(crate) use noise::Noise;
pub(crate) use peer::{Peer, Wire, source_of};
pub(crate) use port::FreePort;
pub(crate) use process::eventually;
pub(crate) use pty::{Pty, PtyWire};
pub(crate) use router::{PROGRAM, Router, run, run_command};
pub(crate) use scene::{Scene, endpoint, path, recording};
pub(crate) use schedule::{Lateness, Schedule, millis, quantile};
pub(crate) use tcp::{TcpServer, TcpWire, blackhole};
pub(crate) use terminal::{Terminal, quoted};
pub(crate) use udp::{UdpWire, roomy_udp_socket};

pub(crate) use mavswitch::mavlink::Component;

/// How long a test waits for what must come, before it calls it missing.
pub(crate) const PATIENCE: Duration = Duration::from_secs(40);

/// An autopilot.
pub(crate) const VEHICLE: Component = Component::new(1, 1);
/// A camera of the same vehicle.
pub(crate) const CAMERA: Component = Component::new(1, 100);
/// The autopilot of another vehicle.
pub(crate) const OTHER: Component = Component::new(2, 1);
/// A ground station.
pub(crate) const GCS: Component = Component::new(255, 190);
/// A second ground station.
pub(crate) const GCS_2: Component = Component::new(254, 190);
/// Somebody who only watches.
pub(crate) const WITNESS: Component = Component::new(77, 191);
