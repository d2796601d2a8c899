//! Several routers and the ways between them: redundant paths that are cut, and rings.
//!
//! The paths are pairs of virtual Ethernet devices between network namespaces, which takes root and
//! the programs `ip` and `tc`; without them those tests say that they were skipped. The rings take
//! nothing: their cables are relays on the loopback network.
//!
//! `cargo test --test namespaces -- --nocapture` runs them and shows what they measured.

// A harness that cannot go on fails the test that it serves, and a panic is how.
#![allow(clippy::unwrap_used)]

mod best;
mod flight;
// Made for another test binary, which needs more of it.
#[allow(dead_code, unused_imports)]
#[path = "../integration/harness/mod.rs"]
mod harness;
mod loops;
mod net;
mod paths;
mod redundant;
mod relay;
mod report;
