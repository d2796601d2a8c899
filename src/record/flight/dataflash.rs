//! The DataFlash log of one ArduPilot: blocks with numbers, each acknowledged, and those that are
//! missing asked for.

use std::collections::BTreeMap;
use std::time::Duration;

use super::message::{BLOCK, Heard, Said};
use super::session::{Phase, Session, Turn};
use crate::routing::Time;

/// Numbers that are none: MAV_REMOTE_LOG_DATA_BLOCK_STOP and MAV_REMOTE_LOG_DATA_BLOCK_START.
pub(super) const STOP: u32 = 2_147_483_645;
pub(super) const START: u32 = 2_147_483_646;

/// How long a block is waited for before the vehicle is asked again to begin, or to stop.
const AGAIN: Duration = Duration::from_secs(1);

/// Blocks below this one may be the first to arrive of a log: those before them come later.
const BEGINNING: u32 = 100;

/// How often it is asked for blocks that are missing.
const NACK_AGAIN: Duration = Duration::from_millis(300);

/// For how many at once: they go before commands, and many a line is slow.
const NACKS_AT_ONCE: usize = 16;

/// How often for each of them: a vehicle forgets blocks that are long gone.
const NACKS: u8 = 20;

/// How many blocks may be missing at once: no vehicle holds more for us.
const MISSING: usize = 1_024;

/// A block so far ahead of the others belongs to no log: nobody shall make a file of any size.
const AHEAD: u32 = 100_000;

/// For how long the last blocks are waited for after the log has ended.
const LATE: Duration = Duration::from_secs(2);

/// When nothing has come for so long, the vehicle is asked to begin, in case that it has started
/// again. One that has not takes no notice.
const SILENCE: Duration = Duration::from_secs(5);

/// How far the log of one vehicle is.
#[derive(Debug)]
pub(super) struct Dataflash {
    system: u8,
    state: State,
    /// When something is to be done.
    timer: Option<Time>,
    log: Option<Log>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// No log is wanted.
    Idle,
    /// It was asked for, and has not begun.
    Starting,
    /// It comes.
    Running,
    /// Nothing came for a while: it was asked for once more.
    Silent,
    /// It is not wanted any more; what is on its way or missing is still taken, until then.
    Stopping(Time),
}

/// The file in the making.
#[derive(Debug)]
struct Log {
    /// The number after the highest that came.
    next: u32,
    /// The blocks before it that did not come, and how often each was asked for.
    missing: BTreeMap<u32, u8>,
    /// When they are asked for again.
    ask_at: Option<Time>,
    /// How many blocks were given up.
    given_up: u64,
}

impl Dataflash {
    pub(super) fn new(system: u8) -> Self {
        Self { system, state: State::Idle, timer: None, log: None }
    }

    /// Takes a block, if there is room for it: not acknowledged, it comes again.
    fn take(&mut self, number: u32, bytes: &[u8; BLOCK], turn: &mut Turn<'_>) {
        if !turn.sink.has_room(BLOCK) {
            return;
        }
        if let Some(log) = &mut self.log
            && number < log.next.saturating_add(AHEAD)
            && turn.sink.write(u64::from(number) * BLOCK as u64, bytes)
        {
            log.handle(number, turn.now);
            turn.out.push(self.status(number, true));
        }
        if !matches!(self.state, State::Stopping(_)) {
            (self.state, self.timer) = (State::Running, Some(turn.now + SILENCE));
        }
        self.ask(turn);
    }

    /// Whether a block after a long silence is of another log: its numbers begin anew.
    fn is_another(&self, number: u32) -> bool {
        let next = self.log.as_ref().map_or(0, |log| log.next);
        number == 0 || (number < BEGINNING && next > 2 * BEGINNING)
    }

    /// Has the vehicle begin anew; what is on its way may still be of the log before.
    fn begin_anew(&mut self, turn: &mut Turn<'_>) {
        if self.timer.is_none_or(|at| at <= turn.now + AGAIN / 2) {
            self.say(STOP, turn);
            self.start(turn);
        }
    }

    fn begin(&mut self, turn: &mut Turn<'_>) {
        self.finish(turn);
        turn.sink.open("bin");
        self.log = Some(Log { next: 0, missing: BTreeMap::new(), ask_at: None, given_up: 0 });
    }

    /// Asks for the blocks that are missing, if it is time to.
    fn ask(&mut self, turn: &mut Turn<'_>) {
        let system = self.system;
        let Some(log) = &mut self.log else { return };
        if log.ask_at.is_some_and(|at| at <= turn.now) {
            for number in log.next_asked() {
                log.missing.entry(number).and_modify(|asked| *asked += 1);
                turn.out.push(Said::block_status(system, number, false));
            }
            log.give_up();
            log.ask_at = (!log.missing.is_empty()).then(|| turn.now + NACK_AGAIN);
        }
    }

    fn say(&self, number: u32, turn: &mut Turn<'_>) {
        turn.out.push(self.status(number, true));
    }

    fn status(&self, number: u32, has_arrived: bool) -> Said {
        Said::block_status(self.system, number, has_arrived)
    }
}

impl Session for Dataflash {
    fn phase(&self) -> Phase {
        match self.state {
            State::Idle => Phase::Idle,
            State::Starting => Phase::Asking,
            State::Running | State::Silent => Phase::Running,
            State::Stopping(_) => Phase::Stopping,
        }
    }

    fn progress(&self) -> (u64, u64) {
        self.log.as_ref().map_or((0, 0), Log::progress)
    }

    /// No bytes, but the numbers of blocks.
    fn held(&self) -> usize {
        self.log.as_ref().map_or(0, |log| log.missing.len() * size_of::<(u32, u8)>())
    }

    fn start(&mut self, turn: &mut Turn<'_>) {
        self.say(START, turn);
        (self.state, self.timer) = (State::Starting, Some(turn.now + AGAIN));
    }

    fn stop(&mut self, turn: &mut Turn<'_>) {
        self.say(STOP, turn);
        (self.state, self.timer) = (State::Stopping(turn.now + LATE), Some(turn.now + AGAIN));
    }

    fn finish(&mut self, turn: &mut Turn<'_>) {
        if self.log.take().is_some() {
            turn.sink.close();
        }
    }

    fn rest(&mut self) {
        (self.state, self.timer) = (State::Idle, None);
    }

    fn handle(&mut self, heard: Heard, turn: &mut Turn<'_>) {
        let Heard::Block(number, bytes) = heard else { return };
        if number >= STOP {
            return;
        }
        match self.state {
            // Nobody wants it: the vehicle shall stop.
            State::Idle => return self.say(STOP, turn),
            // Without room it comes again: it is not acknowledged.
            State::Starting if number < BEGINNING && !turn.sink.has_room(BLOCK) => return,
            State::Starting if number < BEGINNING => self.begin(turn),
            State::Silent if self.is_another(number) => self.begin(turn),
            // A log that was begun for somebody else: without its beginning it is of no use.
            State::Starting => return self.begin_anew(turn),
            _ => {}
        }
        self.take(number, &bytes, turn);
    }

    fn handle_timeout(&mut self, turn: &mut Turn<'_>) {
        self.ask(turn);
        if self.timer.is_none_or(|at| at > turn.now) {
            return;
        }
        match self.state {
            State::Idle => self.timer = None,
            State::Starting => self.start(turn),
            State::Running | State::Silent => {
                self.say(START, turn);
                (self.state, self.timer) = (State::Silent, Some(turn.now + SILENCE));
            }
            State::Stopping(until) if until <= turn.now => {
                self.finish(turn);
                self.rest();
            }
            State::Stopping(_) => {
                self.say(STOP, turn);
                self.timer = Some(turn.now + AGAIN);
            }
        }
    }

    fn poll_timeout(&self) -> Option<Time> {
        let ask_at = self.log.as_ref().and_then(|log| log.ask_at);
        self.timer.into_iter().chain(ask_at).min()
    }
}

impl Log {
    /// How many bytes there are, and how many blocks are missing.
    fn progress(&self) -> (u64, u64) {
        let missing = self.given_up + self.missing.len() as u64;
        ((u64::from(self.next) * BLOCK as u64), missing)
    }

    /// Asks no more for what was asked for often enough.
    fn give_up(&mut self) {
        let before = self.missing.len();
        self.missing.retain(|_, asked| *asked < NACKS);
        self.given_up += (before - self.missing.len()) as u64;
    }

    /// The blocks to ask for: those first that were asked for least.
    fn next_asked(&self) -> impl Iterator<Item = u32> + use<> {
        let mut missing: Vec<_> =
            self.missing.iter().map(|(number, asked)| (*asked, *number)).collect();
        missing.sort_unstable();
        missing.into_iter().take(NACKS_AT_ONCE).map(|(_, number)| number)
    }

    /// A block has come.
    fn handle(&mut self, number: u32, now: Time) {
        self.missing.remove(&number);
        if number >= self.next {
            // The latest are those that the vehicle may still have.
            let first = self.next.max(number.saturating_sub(MISSING as u32));
            self.given_up += u64::from(first - self.next);
            self.missing.extend((first..number).map(|missing| (missing, 0)));
            while self.missing.len() > MISSING {
                self.missing.pop_first();
                self.given_up += 1;
            }
            self.next = number + 1;
        }
        if self.missing.is_empty() {
            self.ask_at = None;
        } else {
            self.ask_at.get_or_insert(now);
        }
    }
}

#[cfg(test)]
mod tests;
