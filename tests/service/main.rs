//! The program as a service: what it tells its manager and the journal, and the unit that runs it.
//!
//! The manager is a stand-in: a datagram socket that the test reads. `cargo test --test service`
//! runs these; the unit itself is judged by `systemd-analyze` where that is installed.

// A harness that cannot go on fails the test that it serves, and a panic is how.
#![allow(clippy::unwrap_used)]

#[allow(dead_code, unused_imports, reason = "it serves the integration tests as well")]
#[path = "../integration/harness/mod.rs"]
mod harness;
mod journal;
mod manager;
mod notify;
mod reload;
mod unit;
