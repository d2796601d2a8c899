//! The pure layers against the protocol: published frames, every message ever defined, streams
//! with damage, and routing by the rules. No sockets, no processes.

#![allow(clippy::unwrap_used)]

mod best_path;
mod changes;
mod copies;
mod every_message;
mod filters;
mod frames;
mod groups;
mod late;
mod loops;
mod network;
mod onlookers;
mod properties;
mod regressions;
mod remade;
mod replayed;
mod routing;
mod signed;
mod signing;
mod streams;
mod vectors;
