//! The ULog of one PX4: asked for, taken, acknowledged, and asked for again when it does not come.

use std::time::Duration;

use super::assembler::Assembler;
use super::message::{Heard, START, STOP, Said, UlogPiece};
use super::session::{Phase, Session, Turn};
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

    fn handle_piece(&mut self, piece: UlogPiece, turn: &mut Turn<'_>) {
        let ack = piece.wants_ack.then(|| Said::logging_ack(self.system, piece.sequence));
        if self.log.as_ref().is_some_and(|log| log.is_another(&piece)) {
            if !turn.sink.has_room(piece.data.len()) {
                return;
            }
            self.end_before_another(turn);
        }
        let is_safe = match (&mut self.log, self.state) {
            (Some(log), _) => log.handle(piece, turn.now, turn.sink),
            (None, State::Starting) => return self.begin(&piece, ack, turn),
            // Nobody wants it: the vehicle shall not send it again and again.
            (None, _) => true,
        };
        if self.state == State::Running {
            self.timer = Some(turn.now + SILENCE);
        }
        turn.out.extend(ack.filter(|_| is_safe));
    }

    /// Somebody else has had the vehicle begin another log.
    fn end_before_another(&mut self, turn: &mut Turn<'_>) {
        self.finish(turn);
        if self.state == State::Running {
            (self.state, self.timer) = (State::Starting, Some(turn.now + AGAIN));
        }
    }

    /// The first piece of a log has come, or a later one of a log that somebody else has begun.
    fn begin(&mut self, piece: &UlogPiece, ack: Option<Said>, turn: &mut Turn<'_>) {
        self.log = Assembler::begin(piece, turn.now, turn.sink);
        if self.log.is_some() {
            (self.state, self.timer) = (State::Running, Some(turn.now + SILENCE));
            self.failures = 0;
            turn.out.extend(ack);
        } else if self.failures < STOPS {
            // Without its beginning a log is of no use: that vehicle has to begin anew.
            self.failures += 1;
            turn.out.push(Said::command(self.system, STOP));
            turn.out.push(Said::command(self.system, START));
        }
    }

    fn ask_to_stop(&mut self, count: u8, turn: &mut Turn<'_>) {
        turn.out.push(Said::command(self.system, STOP));
        (self.state, self.timer) = (State::Stopping(count), Some(turn.now + AGAIN));
    }
}

impl Session for Ulog {
    fn phase(&self) -> Phase {
        match self.state {
            State::Idle => Phase::Idle,
            State::Starting => Phase::Asking,
            State::Running => Phase::Running,
            State::Stopping(_) => Phase::Stopping,
        }
    }

    fn progress(&self) -> (u64, u64) {
        self.log.as_ref().map_or((0, 0), |log| (log.written(), log.gaps))
    }

    fn held(&self) -> usize {
        self.log.as_ref().map_or(0, Assembler::held)
    }

    fn start(&mut self, turn: &mut Turn<'_>) {
        turn.out.push(Said::command(self.system, START));
        (self.state, self.timer, self.failures) = (State::Starting, Some(turn.now + AGAIN), 0);
    }

    fn stop(&mut self, turn: &mut Turn<'_>) {
        self.ask_to_stop(1, turn);
    }

    fn finish(&mut self, turn: &mut Turn<'_>) {
        if let Some(mut log) = self.log.take() {
            log.finish(turn.now, turn.sink);
            turn.sink.close();
        }
    }

    fn rest(&mut self) {
        (self.state, self.timer) = (State::Idle, None);
    }

    fn handle(&mut self, heard: Heard, turn: &mut Turn<'_>) {
        match heard {
            Heard::Answer(START, result) if self.state == State::Starting => match result {
                ACCEPTED | LATER | IN_PROGRESS => {}
                _ => self.timer = Some(turn.now + MUCH_LATER),
            },
            Heard::Answer(STOP, _) if matches!(self.state, State::Stopping(_)) => {
                self.finish(turn);
                self.rest();
            }
            Heard::Ulog(piece) => self.handle_piece(piece, turn),
            _ => {}
        }
    }

    fn handle_timeout(&mut self, turn: &mut Turn<'_>) {
        if let Some(log) = &mut self.log {
            log.handle_timeout(turn.now, turn.sink);
        }
        if self.timer.is_none_or(|at| at > turn.now) {
            return;
        }
        match self.state {
            State::Idle => self.timer = None,
            State::Starting => self.start(turn),
            State::Running => {
                self.finish(turn);
                self.start(turn);
            }
            State::Stopping(count) if count >= STOPS => {
                self.finish(turn);
                self.rest();
            }
            State::Stopping(count) => self.ask_to_stop(count + 1, turn),
        }
    }

    fn poll_timeout(&self) -> Option<Time> {
        let gap = self.log.as_ref().and_then(Assembler::poll_timeout);
        self.timer.into_iter().chain(gap).min()
    }
}

#[cfg(test)]
mod tests;
