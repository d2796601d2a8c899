//! Faults of the field, with real terminals and sockets. After each of them traffic flows, the
//! router holds no more descriptors and memory than before, and it rests when there is nothing to
//! do.

mod connections;
mod descriptors;
mod interfaces;
mod names;
mod serial;
mod stopped;
mod stuck;
mod told;
