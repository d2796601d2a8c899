//! What the tests of the sessions share: a scripted flight stack on a line that loses, repeats and
//! reorders, and files in memory.

pub(super) mod ardupilot;
pub(super) mod px4;

use std::time::Duration;

use super::message::{
    AUTOPILOT, Heard, LOGGER, LOGGING_DATA, LOGGING_DATA_ACKED, REMOTE_LOG_DATA_BLOCK, Said,
};
use super::session::{Session, Turn};
use super::sink::Sink;
use crate::mavlink::{Component, FrameSpec, MessageId};
use crate::routing::Time;
use crate::test_chance::Chance;

/// A flight stack that has a log to send.
pub(super) trait FlightStack {
    /// Hears what we say; what it answers at once.
    fn hear(&mut self, said: &Said) -> Option<Heard>;

    /// What it has to say by itself, once a millisecond.
    fn speak(&mut self, now: Time, chance: &mut Chance) -> Option<Heard>;

    /// Whether everything is sent, and acknowledged where that is needed.
    fn is_done(&self) -> bool;
}

/// What a flight stack says on its way to us.
pub(super) struct Line {
    pub(super) chance: Chance,
    /// How many of a hundred are lost on the way to us, and on the way back; how many are repeated.
    pub(super) loss: (u64, u64),
    pub(super) repeats: u64,
    /// How many milliseconds behind others it may fall.
    pub(super) reorder: u64,
    on_its_way: Vec<(Time, Heard)>,
}

impl Line {
    /// A line on which nothing happens.
    pub(super) fn new(seed: u64) -> Self {
        let chance = Chance::new(seed);
        Self { chance, loss: (0, 0), repeats: 0, reorder: 0, on_its_way: Vec::new() }
    }

    fn send(&mut self, heard: &Heard, now: Time) {
        let copies = 1 + u64::from(self.chance.happens(self.repeats));
        for _ in 0..copies {
            if !self.chance.happens(self.loss.0) {
                let delay = Duration::from_millis(1 + self.chance.below(1 + self.reorder));
                self.on_its_way.push((now + delay, heard.clone()));
            }
        }
    }

    /// What is on its way is lost.
    pub(super) fn clear(&mut self) {
        self.on_its_way.clear();
    }

    fn arrived(&mut self, now: Time) -> Vec<Heard> {
        let (due, later): (Vec<_>, _) =
            std::mem::take(&mut self.on_its_way).into_iter().partition(|it| it.0 <= now);
        self.on_its_way = later;
        due.into_iter().map(|(_, heard)| heard).collect()
    }

    /// The flight stack says what it has to say; what arrives now.
    pub(super) fn pass(&mut self, vehicle: &mut dyn FlightStack, now: Time) -> Vec<Heard> {
        if let Some(heard) = vehicle.speak(now, &mut self.chance) {
            self.send(&heard, now);
        }
        self.arrived(now)
    }

    /// The flight stack hears what we say, if it is not lost.
    pub(super) fn tell(&mut self, vehicle: &mut dyn FlightStack, said: &Said, now: Time) {
        if !self.chance.happens(self.loss.1)
            && let Some(answer) = vehicle.hear(said)
        {
            self.send(&answer, now);
        }
    }
}

/// A flight stack, its line, and us.
pub(super) struct Stage<V, S> {
    pub(super) line: Line,
    pub(super) vehicle: V,
    pub(super) session: S,
    pub(super) files: Files,
    pub(super) now: Time,
}

impl<V: FlightStack, S: Session> Stage<V, S> {
    pub(super) fn new(seed: u64, vehicle: V, session: S) -> Self {
        Self { line: Line::new(seed), vehicle, session, files: Files::default(), now: Time::ZERO }
    }

    /// Has the session do something; what it says.
    pub(super) fn act(&mut self, act: impl FnOnce(&mut S, &mut Turn<'_>)) -> Vec<Said> {
        let mut out = Vec::new();
        let sink = &mut self.files;
        act(&mut self.session, &mut Turn { now: self.now, sink, out: &mut out });
        out
    }

    /// The session hears something that no flight stack has said; what it says.
    pub(super) fn handle(&mut self, heard: Heard) -> Vec<Said> {
        self.act(|session, turn| session.handle(heard, turn))
    }

    pub(super) fn want(&mut self, is_wanted: bool) {
        let out = self.act(|session, turn| session.set_wanted(is_wanted, turn));
        self.tell(&out);
    }

    pub(super) fn tell(&mut self, out: &[Said]) {
        out.iter().for_each(|said| self.line.tell(&mut self.vehicle, said, self.now));
    }

    /// So much time goes by, a millisecond at a time.
    pub(super) fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.now = self.now + Duration::from_millis(1);
            let mut out = Vec::new();
            for heard in self.line.pass(&mut self.vehicle, self.now) {
                out.extend(self.handle(heard));
            }
            if self.session.poll_timeout().is_some_and(|at| at <= self.now) {
                out.extend(self.act(Session::handle_timeout));
            }
            self.tell(&out);
        }
    }

    /// Runs until everything is sent and acknowledged.
    pub(super) fn run_to_end(&mut self) {
        for _ in 0..2_000 {
            if self.vehicle.is_done() {
                break;
            }
            self.run(50);
        }
        assert!(self.vehicle.is_done(), "it could not send everything");
    }
}

/// Files in memory.
#[derive(Default)]
pub(super) struct Files {
    pub(super) files: Vec<(&'static str, Vec<u8>)>,
    pub(super) is_open: bool,
    pub(super) is_full: bool,
}

impl Files {
    pub(super) fn contents(&self) -> Vec<&[u8]> {
        self.files.iter().map(|(_, bytes)| &bytes[..]).collect()
    }
}

impl Sink for Files {
    fn open(&mut self, extension: &'static str) {
        self.files.push((extension, Vec::new()));
        self.is_open = true;
    }

    fn has_room(&self, _: usize) -> bool {
        !self.is_full
    }

    fn write(&mut self, at: u64, bytes: &[u8]) -> bool {
        assert!(self.is_open, "written to a file that is closed");
        let (_, file) = self.files.last_mut().unwrap();
        let end = at as usize + bytes.len();
        file.resize(file.len().max(end), 0);
        file[at as usize..end].copy_from_slice(bytes);
        true
    }

    fn close(&mut self) {
        assert!(self.is_open);
        self.is_open = false;
    }
}

/// What the autopilot of a system says of its log, as a frame to its logger.
pub(super) fn frame(system: u8, heard: &Heard) -> Vec<u8> {
    let (id, crc_extra, payload) = match heard {
        Heard::Answer(command, result) => {
            let [low, high] = command.to_le_bytes();
            let payload = vec![low, high, *result, 0, 0, 0, 0, 0, system, LOGGER];
            (MessageId::COMMAND_ACK, 143, payload)
        }
        Heard::Ulog(piece) => {
            let mut payload = piece.sequence.to_le_bytes().to_vec();
            // 255: no message begins here.
            let first = piece.first.map_or(255, |first| first as u8);
            payload.extend([system, LOGGER, piece.data.len() as u8, first]);
            payload.extend(&piece.data);
            match piece.wants_ack {
                true => (LOGGING_DATA_ACKED, 35, payload),
                false => (LOGGING_DATA, 193, payload),
            }
        }
        Heard::Block(number, bytes) => {
            let mut payload = number.to_le_bytes().to_vec();
            payload.extend([system, LOGGER]);
            payload.extend(bytes);
            (REMOTE_LOG_DATA_BLOCK, 159, payload)
        }
    };
    from_autopilot(system, id, crc_extra, &payload)
}

/// A frame of the autopilot of a system.
pub(super) fn from_autopilot(system: u8, id: MessageId, crc_extra: u8, payload: &[u8]) -> Vec<u8> {
    FrameSpec::new(Component::new(system, AUTOPILOT), id, crc_extra, payload).to_frame()
}
