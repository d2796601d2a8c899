//! What the logs of all vehicles have in common, whatever flight stack makes them: they are asked
//! for, come, and are asked to end.

use std::fmt;

use super::message::{Heard, Said};
use super::sink::Sink;
use crate::routing::Time;

/// One moment of a session: when it is, where the log goes, and what is to be said.
pub(super) struct Turn<'a> {
    pub(super) now: Time,
    pub(super) sink: &'a mut dyn Sink,
    pub(super) out: &'a mut Vec<Said>,
}

/// How far the log of a vehicle is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Phase {
    /// No log is wanted.
    Idle,
    /// The vehicle was asked for its log, and has not begun to send it.
    Asking,
    /// It comes.
    Running,
    /// It is not wanted any more, and may still come.
    Stopping,
}

/// The log of one vehicle: a machine without a clock or a file.
pub(super) trait Session: fmt::Debug {
    /// How far it is.
    fn phase(&self) -> Phase;

    /// How many bytes of the present log have been written, and how many pieces of it are missing.
    fn progress(&self) -> (u64, u64);

    /// How many bytes it holds for the log that are not written yet.
    fn held(&self) -> usize;

    /// Asks the vehicle to begin.
    fn start(&mut self, turn: &mut Turn<'_>);

    /// Asks the vehicle to end; what still comes is taken for a while.
    fn stop(&mut self, turn: &mut Turn<'_>);

    /// The log ends with what there is.
    fn finish(&mut self, turn: &mut Turn<'_>);

    /// Nothing is wanted, and nothing is to be done.
    fn rest(&mut self);

    /// Takes what the vehicle says.
    fn handle(&mut self, heard: Heard, turn: &mut Turn<'_>);

    /// Does what has its time.
    fn handle_timeout(&mut self, turn: &mut Turn<'_>);

    /// When that is.
    fn poll_timeout(&self) -> Option<Time>;

    /// A log is wanted from now on, or is not.
    fn set_wanted(&mut self, is_wanted: bool, turn: &mut Turn<'_>) {
        match (is_wanted, self.phase()) {
            (true, Phase::Idle) => self.start(turn),
            (true, Phase::Stopping) => {
                // What comes from now on is another log.
                self.finish(turn);
                self.stop(turn);
                self.start(turn);
            }
            (false, Phase::Asking | Phase::Running) => self.stop(turn),
            _ => {}
        }
    }

    /// The vehicle has started again: its log has ended, and another may begin.
    fn handle_reboot(&mut self, turn: &mut Turn<'_>) {
        self.finish(turn);
        match self.phase() {
            Phase::Asking | Phase::Running => self.start(turn),
            Phase::Idle | Phase::Stopping => self.rest(),
        }
    }

    /// The file of the log is lost: without its beginning the rest is of no use.
    fn handle_broken(&mut self, turn: &mut Turn<'_>) {
        self.finish(turn);
        if matches!(self.phase(), Phase::Asking | Phase::Running) {
            self.stop(turn);
            self.start(turn);
        }
    }

    /// Nobody will take anything any more: the vehicle shall not go on sending.
    fn leave(&mut self, turn: &mut Turn<'_>) {
        if self.phase() != Phase::Idle {
            self.stop(turn);
        }
        self.finish(turn);
        self.rest();
    }
}
