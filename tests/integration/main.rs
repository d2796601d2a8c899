//! The program as its users meet it: the real binary, spoken to through real sockets and terminals.
//!
//! Each scenario is told as the field talks: who sends what, and who must hear it.
//! `cargo test --test integration` runs them; see [`harness`] for what they are made of.

// A harness that cannot go on fails the test that it serves, and a panic is how.
#![allow(clippy::unwrap_used)]

mod abuse;
mod access;
mod addresses;
mod architecture;
mod blackhole;
mod configuration;
mod connections;
mod control;
mod corruption;
mod datagrams;
mod faults;
mod flight_logs;
mod forwarding;
mod guarded;
mod harness;
mod high_latency;
mod idle;
mod learning;
mod mavlink_router;
mod mavlink_router_logs;
mod metrics;
mod options;
mod overload;
mod overloaded_line;
mod own;
mod own_rules;
mod program;
mod record;
mod reload;
mod replay;
mod resync;
mod ring;
mod routing;
mod serial;
mod shutdown;
mod sim;
mod stalled;
mod top;
mod watch;
