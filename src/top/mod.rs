//! `mavswitch top`: what is going on in a running daemon, live on a terminal.
//!
//! A thread asks the daemon and hands over snapshots; what is shown is a pure function of those and of
//! the keys that were pressed. Whatever ends the view, the terminal is left as it was.

mod app;
mod draw;
mod follow;
mod table;
mod terminal;
mod trace;

pub use terminal::{TopError, top};
