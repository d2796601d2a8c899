//! The control socket: how programs ask a running daemon, and tell it what to do.
//!
//! A connection carries lines of JSON, requests one way and answers the other. What they mean is
//! declared here, for both sides; [`Client`] is the asking one. The daemon answers from its loop.

mod client;
mod place;
mod protocol;

pub use client::{Client, ClientError};
pub use place::{default_place, places_to_ask};
pub use protocol::{
    Answer, AnswerLine, MAX_INTERVAL, MAX_REQUEST, MIN_INTERVAL, Request, RequestLine, VERSION,
    fuzz_request,
};
