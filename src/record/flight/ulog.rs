//! The ULog of one PX4: asked for, taken, acknowledged, and asked for again when it does not come.

use std::time::Duration;

use super::assembler::Assembler;
use super::message::{Heard, START, STOP, Said, UlogPiece};
use super::sink::Sink;
use crate::routing::Time;

/// How long an answer is waited for before the vehicle is asked again.
const AGAIN: Duration = Duration::from_secs(1);

/// The same after it has refused, or sends something that is no beginning of a log.
const MUCH_LATER: Duration = Duration::from_secs(30);

/// A log from which nothing comes for so long has ended: the vehicle has started again.
const SILENCE: Duration = Duration::from_secs(5);

/// How often it is asked to stop.
const STOPS: u8 = 5;

/// MAV_RESULT_ACCEPTED, MAV_RESULT_TEMPORARILY_REJECTED and MAV_RESULT_IN_PROGRESS.
const ACCEPTED: u8 = 0;
const LATER: u8 = 1;
const IN_PROGRESS: u8 = 5;

/// How far the log of one vehicle is.
#[derive(Debug)]
pub(super) struct Ulog {
    system: u8,
    state: State,
    /// When something is to be done.
    timer: Option<Time>,
    log: Option<Assembler>,
    /// How often a beginning was missing in a row.
    failures: u8,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// No log is wanted.
    Idle,
    /// It was asked for, and has not begun.
    Starting,
    /// It comes.
    Running,
    /// It is not wanted any more; so many times it was asked to stop.
    Stopping(u8),
}

impl Ulog {
    pub(super) fn new(system: u8) -> Self {
        Self { system, state: State::Idle, timer: None, log: None, failures: 0 }
    }

    /// A log is wanted from now on, or is not.
    pub(super) fn set_wanted(
        &mut self,
        is_wanted: bool,
        now: Time,
        sink: &mut impl Sink,
        out: &mut Vec<Said>,
    ) {
        match (is_wanted, self.state) {
            (true, State::Idle) => self.start(now, out),
            (true, State::Stopping(_)) => {
                // What comes from now on is another log.
                self.finish(now, sink);
                out.push(Said::command(self.system, STOP));
                self.start(now, out);
            }
            (false, State::Starting | State::Running) => {
                out.push(Said::command(self.system, STOP));
                (self.state, self.timer) = (State::Stopping(1), Some(now + AGAIN));
            }
            _ => {}
        }
    }

    /// The vehicle has started again: its log has ended, and another may begin.
    pub(super) fn handle_reboot(&mut self, now: Time, sink: &mut impl Sink, out: &mut Vec<Said>) {
        self.finish(now, sink);
        match self.state {
            State::Starting | State::Running => self.start(now, out),
            State::Idle | State::Stopping(_) => self.rest(),
        }
    }

    pub(super) fn handle(
        &mut self,
        heard: Heard,
        now: Time,
        sink: &mut impl Sink,
        out: &mut Vec<Said>,
    ) {
        match heard {
            Heard::Answer(START, result) if self.state == State::Starting => match result {
                ACCEPTED | LATER | IN_PROGRESS => {}
                _ => self.timer = Some(now + MUCH_LATER),
            },
            Heard::Answer(STOP, _) if matches!(self.state, State::Stopping(_)) => {
                self.finish(now, sink);
                self.rest();
            }
            Heard::Ulog(piece) => self.handle_piece(piece, now, sink, out),
            _ => {}
        }
    }

    fn handle_piece(
        &mut self,
        piece: UlogPiece,
        now: Time,
        sink: &mut impl Sink,
        out: &mut Vec<Said>,
    ) {
        let ack = piece.wants_ack.then(|| Said::logging_ack(self.system, piece.sequence));
        let is_safe = match (&mut self.log, self.state) {
            (Some(log), _) => log.handle(piece, now, sink),
            (None, State::Starting) => return self.begin(&piece, ack, now, sink, out),
            // Nobody wants it: the vehicle shall not send it again and again.
            (None, _) => true,
        };
        if self.state == State::Running {
            self.timer = Some(now + SILENCE);
        }
        out.extend(ack.filter(|_| is_safe));
    }

    /// The first piece of a log has come, or a later one of a log that somebody else has begun.
    fn begin(
        &mut self,
        piece: &UlogPiece,
        ack: Option<Said>,
        now: Time,
        sink: &mut impl Sink,
        out: &mut Vec<Said>,
    ) {
        self.log = Assembler::begin(piece, now, sink);
        if self.log.is_some() {
            (self.state, self.timer) = (State::Running, Some(now + SILENCE));
            self.failures = 0;
            out.extend(ack);
        } else if self.failures < STOPS {
            // Without its beginning a log is of no use: that vehicle has to begin anew.
            self.failures += 1;
            out.push(Said::command(self.system, STOP));
            out.push(Said::command(self.system, START));
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Time, sink: &mut impl Sink, out: &mut Vec<Said>) {
        if let Some(log) = &mut self.log {
            log.handle_timeout(now, sink);
        }
        if self.timer.is_none_or(|at| at > now) {
            return;
        }
        match self.state {
            State::Idle => self.timer = None,
            State::Starting => self.start(now, out),
            State::Running => {
                self.finish(now, sink);
                self.start(now, out);
            }
            State::Stopping(count) if count >= STOPS => {
                self.finish(now, sink);
                self.rest();
            }
            State::Stopping(count) => {
                out.push(Said::command(self.system, STOP));
                (self.state, self.timer) = (State::Stopping(count + 1), Some(now + AGAIN));
            }
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Time> {
        let gap = self.log.as_ref().and_then(Assembler::poll_timeout);
        self.timer.into_iter().chain(gap).min()
    }

    fn start(&mut self, now: Time, out: &mut Vec<Said>) {
        out.push(Said::command(self.system, START));
        (self.state, self.timer, self.failures) = (State::Starting, Some(now + AGAIN), 0);
    }

    fn rest(&mut self) {
        (self.state, self.timer) = (State::Idle, None);
    }

    /// The log ends with what there is.
    fn finish(&mut self, now: Time, sink: &mut impl Sink) {
        if let Some(mut log) = self.log.take() {
            log.finish(now, sink);
            sink.close();
        }
    }
}

#[cfg(test)]
mod tests;
