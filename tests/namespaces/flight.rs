//! Numbered streams between a vehicle and a ground station, and what became of them.

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::thread;
use std::time::{Duration, Instant};

use crate::harness::*;
use crate::report::Report;

/// What is sent: the streams of a test.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Stream {
    /// COMMAND_LONG from the ground station to the vehicle.
    Commands,
    /// COMMAND_ACK from the vehicle to the ground station.
    Acks,
    /// ATTITUDE from the vehicle, to everybody.
    Telemetry,
    /// HEARTBEAT once a second from both, as everybody sends it.
    Heartbeats,
}

/// How many frames of each stream are sent in a second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rates {
    pub(crate) directed: u32,
    pub(crate) telemetry: u32,
}

/// How far it is, for the test to wait for.
#[derive(Default, Debug)]
pub(crate) struct Progress {
    is_over: AtomicBool,
    commands: AtomicUsize,
    acks: AtomicUsize,
}

/// How long nothing must come before nothing more is waited for: longer than any delay on the way,
/// and than a busy machine lets a program wait.
const QUIET: Duration = Duration::from_secs(2);

/// So many frames come to nobody in any story that goes well.
const STORM: usize = 20_000;

impl Progress {
    /// Waits until so many more directed frames have arrived at both ends.
    pub(crate) fn wait_for(&self, count: usize) {
        let (commands, acks) = self.arrived();
        eventually(&format!("{count} more commands and acknowledgements arrive"), || {
            let now = self.arrived();
            now.0 >= commands + count && now.1 >= acks + count
        });
    }

    /// How many commands and how many acknowledgements have arrived.
    pub(crate) fn arrived(&self) -> (usize, usize) {
        (self.commands.load(Relaxed), self.acks.load(Relaxed))
    }

    fn count(&self, stream: Stream) {
        match stream {
            Stream::Commands => self.commands.fetch_add(1, Relaxed),
            Stream::Acks => self.acks.fetch_add(1, Relaxed),
            Stream::Telemetry | Stream::Heartbeats => 0,
        };
    }
}

/// Lets both sides speak while the story happens, and until all has arrived; tells what became of
/// commands, acknowledgements and telemetry.
pub(crate) fn fly<W: Wire + Send>(
    vehicle: &mut Peer<W>,
    station: &mut Peer<W>,
    rates: Rates,
    story: impl FnOnce(&Progress),
) -> [Report; 3] {
    let progress = &Progress::default();
    let heartbeats = (Stream::Heartbeats, 1);
    let down = [(Stream::Acks, rates.directed), (Stream::Telemetry, rates.telemetry), heartbeats];
    let up = [(Stream::Commands, rates.directed), heartbeats];
    let (vehicle, station) = thread::scope(|scope| {
        let vehicle = scope.spawn(|| Speaker::new(VEHICLE, vehicle, &down).speak(progress));
        let station = scope.spawn(|| Speaker::new(GCS, station, &up).speak(progress));
        // The streams end, however the story ends.
        let outcome = catch_unwind(AssertUnwindSafe(|| story(progress)));
        progress.is_over.store(true, Relaxed);
        let (vehicle, station) = (vehicle.join(), station.join());
        outcome.unwrap_or_else(|panic| resume_unwind(panic));
        (vehicle.expect("the vehicle"), station.expect("the station"))
    });
    [
        station.report(Stream::Commands, &vehicle),
        vehicle.report(Stream::Acks, &station),
        vehicle.report(Stream::Telemetry, &station),
    ]
}

/// Somebody who sends streams, and notes what comes.
struct Speaker<'a, W: Wire> {
    me: Component,
    peer: &'a mut Peer<W>,
    seq: u8,
    outgoing: Vec<Outgoing>,
    arrived: Vec<(Stream, u32, Instant)>,
    /// What arrived already: the progress counts no copies.
    known: HashSet<(Stream, u32)>,
}

struct Outgoing {
    stream: Stream,
    period: Duration,
    next: Instant,
    /// By number: when it was sent.
    sent: Vec<Instant>,
}

/// What somebody said and heard.
struct Spoken {
    sent: Vec<Outgoing>,
    arrived: Vec<(Stream, u32, Instant)>,
}

impl Spoken {
    /// What became of a stream of this side, at the other side.
    fn report(&self, stream: Stream, other: &Self) -> Report {
        let sent = self.sent.iter().find(|outgoing| outgoing.stream == stream);
        let sent = sent.map(|outgoing| outgoing.sent.clone()).unwrap_or_default();
        let arrived = other.arrived.iter().filter(|(of, _, _)| *of == stream);
        Report::new(stream, sent, arrived.map(|(_, number, at)| (*number, *at)).collect())
    }
}

impl<'a, W: Wire> Speaker<'a, W> {
    fn new(me: Component, peer: &'a mut Peer<W>, streams: &[(Stream, u32)]) -> Self {
        let next = Instant::now();
        let outgoing = streams.iter().filter(|(_, rate)| *rate > 0).map(|(stream, rate)| {
            let period = Duration::from_secs(1) / *rate;
            Outgoing { stream: *stream, period, next, sent: Vec::new() }
        });
        Self {
            me,
            peer,
            seq: 0,
            outgoing: outgoing.collect(),
            arrived: Vec::new(),
            known: HashSet::new(),
        }
    }

    fn speak(mut self, progress: &Progress) -> Spoken {
        while !progress.is_over.load(Relaxed) {
            let next = self.send_due();
            while let Some(left) = next.checked_duration_since(Instant::now()) {
                self.listen(left, progress);
            }
        }
        while self.listen(QUIET, progress) {}
        Spoken { sent: self.outgoing, arrived: self.arrived }
    }

    /// Sends what is due; says when there is more to send.
    fn send_due(&mut self) -> Instant {
        let now = Instant::now();
        for outgoing in &mut self.outgoing {
            if outgoing.next <= now {
                let number = u32::try_from(outgoing.sent.len()).expect("not so many");
                outgoing.sent.push(now);
                self.peer.send(numbered(outgoing.stream, self.me, number, self.seq));
                self.seq = self.seq.wrapping_add(1);
                // Never faster than that, even after a pause: a burst would be another test.
                outgoing.next = now + outgoing.period;
            }
        }
        let next = self.outgoing.iter().map(|outgoing| outgoing.next).min();
        next.expect("a stream")
    }

    /// Waits for a frame; says whether one came.
    fn listen(&mut self, timeout: Duration, progress: &Progress) -> bool {
        let Some(frame) = self.peer.try_receive(timeout) else { return false };
        if let Some((stream, number)) = number_of(&frame) {
            self.arrived.push((stream, number, Instant::now()));
            assert!(self.arrived.len() < STORM, "a storm: frames come without end");
            if self.known.insert((stream, number)) {
                progress.count(stream);
            }
        }
        true
    }
}

/// Frame number `number` of a stream; heartbeats are anybody's.
fn numbered(stream: Stream, me: Component, number: u32, seq: u8) -> Vec<u8> {
    let bytes = number.to_le_bytes();
    let draft = match stream {
        Stream::Commands => {
            let mut payload = [0; 33];
            payload[..4].copy_from_slice(&bytes);
            payload[28..].copy_from_slice(&[0x90, 1, VEHICLE.system, VEHICLE.component, 1]);
            Draft::new(GCS, COMMAND_LONG, payload)
        }
        Stream::Acks => {
            let mut payload = [0x90, 1, 0, 0, 0, 0, 0, 0, GCS.system, GCS.component];
            payload[4..8].copy_from_slice(&bytes);
            Draft::new(VEHICLE, COMMAND_ACK, payload)
        }
        Stream::Telemetry => {
            let mut payload = [0x3f; 28];
            payload[..4].copy_from_slice(&bytes);
            Draft::new(VEHICLE, ATTITUDE, payload)
        }
        Stream::Heartbeats => heartbeat_draft(me),
    };
    draft.seq(seq).build()
}

/// Of which stream a frame is, and which number it has there.
fn number_of(frame: &[u8]) -> Option<(Stream, u32)> {
    let (stream, at) = match frame[7..10] {
        [76, 0, 0] => (Stream::Commands, 10),
        [77, 0, 0] => (Stream::Acks, 14),
        [30, 0, 0] => (Stream::Telemetry, 10),
        _ => return None,
    };
    let number = frame[at..at + 4].try_into().expect("four bytes");
    Some((stream, u32::from_le_bytes(number)))
}
