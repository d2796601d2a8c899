//! Finds the vehicles that make logs, and has a session with each of them.
//!
//! It is one of the vehicle's own components to each vehicle, the logger 155, on a link inside the
//! program. It says nothing until a vehicle is heard whose log is wanted.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use super::dataflash::Dataflash;
use super::message::{
    AUTOPILOT, Heard, LOGGING_DATA, LOGGING_DATA_ACKED, REMOTE_LOG_DATA_BLOCK, Said,
};
use super::session::{Phase, Session, Turn};
use super::sink::FlightFeed;
use super::ulog::Ulog;
use crate::config::{FlightLog, RecordOptions, RecordWhen};
use crate::mavlink::{Frame, MessageId};
use crate::routing::{Heartbeat, LocalPeer, Time};

/// How many vehicles it has sessions with; those that come later make no log here.
pub const VEHICLES: usize = 32;

/// How much may wait to be said; what goes beyond is said again when it is asked for again.
const OUTBOX: usize = 4_096;

/// MAV_AUTOPILOT_PX4.
const PX4: u8 = 12;

/// How much less the time since boot has to be for a restart, in milliseconds: frames may overtake
/// each other.
const RESTART: u32 = 3_000;

/// Takes the logs that vehicles make; see the module. A clone is the same collector.
#[derive(Clone, Debug)]
pub struct Collector(Rc<RefCell<Sessions>>);

/// How the log of one vehicle is getting on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FlightProgress {
    /// The system id of the vehicle.
    pub system: u8,
    /// The slot that its log has with the writer.
    pub slot: u8,
    /// How far it is.
    pub phase: Phase,
    /// Bytes of the present log so far.
    pub bytes: u64,
    /// Pieces of it that are missing: those that were given up, and those that are asked for.
    pub missing: u64,
}

#[derive(Debug)]
struct Sessions {
    which: FlightLog,
    when: RecordWhen,
    system: Option<u8>,
    feed: FlightFeed,
    vehicles: Vec<Vehicle>,
    outbox: VecDeque<(u8, Said)>,
    /// Whether it has taken leave: then it begins nothing any more.
    is_leaving: bool,
}

#[derive(Debug)]
struct Vehicle {
    system: u8,
    session: Box<dyn Session>,
    /// The number of our next frame in its system.
    seq: u8,
    /// Its time since boot, in milliseconds.
    since_boot: u32,
}

impl Collector {
    /// The messages that it wants to hear.
    pub const HEARS: [MessageId; 6] = [
        MessageId::HEARTBEAT,
        MessageId::SYSTEM_TIME,
        MessageId::COMMAND_ACK,
        REMOTE_LOG_DATA_BLOCK,
        LOGGING_DATA,
        LOGGING_DATA_ACKED,
    ];

    /// Takes the logs that `options` ask for, and hands them to the writer at the end of `feed`.
    pub fn new(options: &RecordOptions, feed: FlightFeed) -> Self {
        Self(Rc::new(RefCell::new(Sessions {
            which: options.flight_log,
            when: options.when,
            system: options.flight_log_system,
            feed,
            vehicles: Vec::new(),
            outbox: VecDeque::new(),
            is_leaving: false,
        })))
    }

    /// It is about to end: logs end with what there is, and what it says from now on asks the
    /// vehicles to stop, so that none sends on to nobody.
    pub fn leave(&self, now: Time) {
        let mut sessions = self.0.borrow_mut();
        sessions.is_leaving = true;
        for at in 0..sessions.vehicles.len() {
            sessions.with(at, now, |session, turn| session.leave(turn));
        }
    }

    /// How the log of each vehicle is getting on.
    pub fn progress(&self) -> Vec<FlightProgress> {
        let progress = |(vehicle, slot): (&Vehicle, u8)| {
            let (bytes, missing) = vehicle.session.progress();
            let phase = vehicle.session.phase();
            FlightProgress { system: vehicle.system, slot, phase, bytes, missing }
        };
        self.0.borrow().vehicles.iter().zip(0..).map(progress).collect()
    }
}

impl Sessions {
    fn handle_heartbeat(&mut self, frame: &Frame<'_>, now: Time) {
        let system = frame.header().source.system;
        let Some(at) = self.find_or_add(system, frame.payload_byte(5)) else { return };
        let is_armed = frame.payload_byte(6) & Heartbeat::ARMED != 0;
        let is_wanted = self.when == RecordWhen::Always || is_armed;
        self.with(at, now, |session, turn| session.set_wanted(is_wanted, turn));
    }

    fn find_or_add(&mut self, system: u8, autopilot: u8) -> Option<usize> {
        let found = self.vehicles.iter().position(|vehicle| vehicle.system == system);
        if found.is_some() || self.vehicles.len() == VEHICLES {
            return found;
        }
        if self.system.is_some_and(|wanted| wanted != system) {
            return None;
        }
        let session: Box<dyn Session> = match (self.which, autopilot) {
            (FlightLog::Off, _) | (_, Heartbeat::NO_AUTOPILOT) => return None,
            (FlightLog::Ulog, _) | (FlightLog::Auto, PX4) => Box::new(Ulog::new(system)),
            (FlightLog::Dataflash, _) | (FlightLog::Auto, Heartbeat::ARDUPILOT) => {
                Box::new(Dataflash::new(system))
            }
            (FlightLog::Auto, _) => return None,
        };
        self.vehicles.push(Vehicle { system, session, seq: 0, since_boot: 0 });
        Some(self.vehicles.len() - 1)
    }

    fn handle_system_time(&mut self, at: usize, frame: &Frame<'_>, now: Time) {
        let bytes = [8, 9, 10, 11].map(|offset| frame.payload_byte(offset));
        let since_boot = u32::from_le_bytes(bytes);
        let before = std::mem::replace(&mut self.vehicles[at].since_boot, since_boot);
        if since_boot.saturating_add(RESTART) < before {
            self.with(at, now, |session, turn| session.handle_reboot(turn));
        }
    }

    /// Does something with the session of a vehicle; what it has to say goes to the outbox.
    fn with(&mut self, at: usize, now: Time, act: impl FnOnce(&mut dyn Session, &mut Turn<'_>)) {
        let Some(vehicle) = self.vehicles.get_mut(at) else { return };
        let mut out = Vec::new();
        // At most `VEHICLES`.
        let mut sink = self.feed.sink(at as u8);
        act(&mut *vehicle.session, &mut Turn { now, sink: &mut sink, out: &mut out });
        let system = vehicle.system;
        let room = OUTBOX - self.outbox.len();
        self.outbox.extend(out.into_iter().take(room).map(|said| (system, said)));
    }

    fn handle_timeouts(&mut self, now: Time) {
        for at in 0..self.vehicles.len() {
            if self.vehicles[at].session.poll_timeout().is_some_and(|due| due <= now) {
                self.with(at, now, |session, turn| session.handle_timeout(turn));
            }
        }
    }

    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time) {
        let header = frame.header();
        if header.source.component != AUTOPILOT || self.is_leaving {
            return;
        }
        if header.id == MessageId::HEARTBEAT {
            return self.handle_heartbeat(frame, now);
        }
        let system = header.source.system;
        let Some(at) = self.vehicles.iter().position(|it| it.system == system) else { return };
        if header.id == MessageId::SYSTEM_TIME {
            self.handle_system_time(at, frame, now);
        } else if let Some(heard) = Heard::read(frame) {
            // At most `VEHICLES`.
            if self.feed.take_broken(at as u8) {
                return self.with(at, now, |session, turn| session.handle_broken(turn));
            }
            self.with(at, now, |session, turn| session.handle(heard, turn));
        }
    }

    fn say_next(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        self.handle_timeouts(now);
        let Some((system, said)) = self.outbox.pop_front() else { return false };
        let vehicle = self.vehicles.iter_mut().find(|vehicle| vehicle.system == system);
        let seq = vehicle.map_or(0, |vehicle| {
            vehicle.seq = vehicle.seq.wrapping_add(1);
            vehicle.seq
        });
        said.encode(system, seq, out);
        true
    }
}

impl LocalPeer for Collector {
    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time) {
        self.0.borrow_mut().handle_frame(frame, now);
    }

    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        self.0.borrow_mut().say_next(now, out)
    }

    fn poll_timeout(&self) -> Option<Time> {
        let sessions = self.0.borrow();
        sessions.vehicles.iter().filter_map(|vehicle| vehicle.session.poll_timeout()).min()
    }
}

#[cfg(test)]
mod tests;
