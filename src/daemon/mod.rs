//! The poll loop: everything that was ready is read and routed, then every link that got
//! something is flushed once.
//!
//! One thread does all of it and waits in one place only. What a turn does, in order: poll, read
//! (a bounded amount of each link), timers, flush, close what broke, log.

mod alarm;
mod change;
mod control;
mod deadlines;
mod endpoint;
mod endpoint_table;
mod error;
mod event_loop;
mod groups;
mod http;
mod lifecycle;
mod links;
mod local;
mod log_limit;
mod notify;
mod open;
mod own;
mod peers;
mod plan;
mod proof;
mod receive;
mod record;
mod reload;
mod report;
mod serial;
mod service;
mod settings;
mod signals;
mod signing_time;
mod snapshot;
#[cfg(test)]
mod stage;
mod strangers;
mod timers;
mod token;
mod transmit;
mod upkeep;

pub use control::{LISTEN_ROOM, MAX_CLIENTS as MAX_CONTROL_CLIENTS};
pub use error::StartError;
pub use event_loop::{DaemonConfig, run};
pub use http::{MAX_HTTP_CLIENTS, fuzz_http_request};
pub use reload::Host;
