//! The pure layers against the protocol: published frames, every message ever defined, streams
//! with damage, and routing by the rules. No sockets, no processes.

mod every_message;
mod frames;
mod streams;
mod vectors;
