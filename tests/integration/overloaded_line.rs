//! The far side of an overloaded radio: what comes out of a slow serial line when a vehicle offers
//! twice what it carries, and how old it is then. For any router; see also `tests/bench`.
//!
//! The test takes bytes out of a pseudo terminal as fast as a line of that baud rate sends them and
//! no faster, and a byte that is not there in time is a byte that the line did not carry.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use mavswitch::mavlink::Crc;

use crate::harness::*;

/// Broadcast telemetry, as the streams of an autopilot mix it; each begins with its number.
const TELEMETRY: [Message; 4] = [
    ATTITUDE,
    Message { id: 33, extra: 104, len: 28 }, // GLOBAL_POSITION_INT
    Message { id: 1, extra: 124, len: 31 },  // SYS_STATUS
    Message { id: 65, extra: 118, len: 42 }, // RC_CHANNELS
];

/// How often the vehicle sends what has become due, as the main loop of an autopilot does.
const VEHICLE_TURN: Duration = Duration::from_millis(20);
/// How often bytes are taken out of the line.
const LINE_TURN: Duration = Duration::from_millis(2);
/// How often somebody is sent an acknowledgement.
const DIRECTED_EVERY: Duration = Duration::from_millis(100);
/// What is sent before the line is full for sure counts for nothing in its use.
const WARM_UP: Duration = Duration::from_secs(1);
/// After so long a silence nothing more comes out of the line.
const SILENCE: Duration = Duration::from_millis(1_500);

/// What became of the frames of one kind.
#[derive(Default)]
pub(crate) struct Journey {
    pub(crate) sent: usize,
    /// The age of each that arrived.
    pub(crate) ages: Vec<Duration>,
}

impl Journey {
    pub(crate) fn lost(&self) -> usize {
        self.sent.saturating_sub(self.ages.len())
    }

    pub(crate) fn age(&self, part: f64) -> Duration {
        quantile(&self.ages, part)
    }
}

/// What came out.
pub(crate) struct Outcome {
    /// Bytes that belong to no whole frame.
    pub(crate) torn: usize,
    /// Frames that came before one that was sent earlier, or twice.
    pub(crate) disordered: usize,
    pub(crate) directed: Journey,
    pub(crate) heartbeats: Journey,
    pub(crate) telemetry: Journey,
    /// The part of the line's time in which it carried something.
    pub(crate) line_use: f64,
    /// How late the vehicle and the line were by themselves.
    pub(crate) lateness: Lateness,
}

impl Outcome {
    /// What the columns of [`Self::row`] are.
    pub(crate) const HEAD: &str = "\
| router | torn bytes | directed lost | directed age p50 / p99 | heartbeats lost \
| telemetry delivered | telemetry age p50 / p99 | line use | test's own lateness p99 |
|---|---|---|---|---|---|---|---|---|";

    /// The outcome as the row of a table.
    pub(crate) fn row(&self, router: &str) -> String {
        let ages = |journey: &Journey| {
            format!("{:.0} / {:.0} ms", millis(journey.age(0.5)), millis(journey.age(0.99)))
        };
        let lost = |journey: &Journey| format!("{} of {}", journey.lost(), journey.sent);
        let (directed, telemetry) = (&self.directed, &self.telemetry);
        format!(
            "| {router} | {} | {} ({:.0} %) | {} | {} | {:.0} % | {} | {:.1} % | {:.1} ms |",
            self.torn,
            lost(directed),
            per(directed.lost(), directed.sent) * 100.0,
            ages(directed),
            lost(&self.heartbeats),
            per(telemetry.ages.len(), telemetry.sent) * 100.0,
            ages(telemetry),
            self.line_use * 100.0,
            millis(self.lateness.p99()),
        )
    }
}

/// Offers a router more than the line of `pty` carries, through its TCP server at `router`.
///
/// # Panics
///
/// If nothing gets through at all.
pub(crate) fn overload(pty: PtyWire, router: SocketAddr, baud: u32, time: Duration) -> Outcome {
    let rate = baud / 10;
    let (over, met) = (AtomicBool::new(false), AtomicBool::new(false));
    thread::scope(|scope| {
        let line = scope.spawn(|| Line::new(pty, rate).carry(&met, &over));
        let mut vehicle = Vehicle { peer: Peer::new(TcpWire::to(router), VEHICLE), sent: vec![] };
        vehicle.meet_ground_station();
        met.store(true, Ordering::Release);
        let start = Instant::now();
        let mut lateness = vehicle.offer(2 * rate, time);
        let end = Instant::now();
        over.store(true, Ordering::Release);
        let line = line.join().expect("the line");
        lateness = lateness.and(line.lateness);
        let arrived = line.arrived.iter().filter(|(at, _)| (start + WARM_UP..end).contains(at));
        let carried: usize = arrived.map(|(_, bytes)| bytes.len()).sum();
        let line_use = per(carried, rate as usize) / (end - start - WARM_UP).as_secs_f64();
        judge(&vehicle.sent, &line.arrived, line_use, lateness)
    })
}

fn per(count: usize, of: usize) -> f64 {
    let exact = |number: usize| f64::from(u32::try_from(number).expect("a small number"));
    exact(count) / exact(of)
}

/// What a frame was sent for.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Telemetry,
    Heartbeat,
    Directed,
}

/// The vehicle, who remembers what it sent; the number of a frame is its place.
struct Vehicle {
    peer: Peer<TcpWire>,
    sent: Vec<(Kind, Instant)>,
}

impl Vehicle {
    /// Speaks and listens until it has heard the ground station: then there is a route to it.
    fn meet_ground_station(&mut self) {
        let give_up = Instant::now() + PATIENCE;
        while Instant::now() < give_up {
            self.peer.send(numbered(u32::MAX, HEARTBEAT));
            let heard = self.peer.try_receive(Duration::from_millis(200));
            if heard.is_some_and(|frame| source_of(&frame) == GCS) {
                return;
            }
        }
        panic!("the ground station is never heard");
    }

    /// Sends telemetry at this rate, a heartbeat each second, and acknowledgements.
    fn offer(&mut self, rate: u32, time: Duration) -> Lateness {
        let start = Instant::now();
        let mut turns = Schedule::every(VEHICLE_TURN);
        let (mut bytes, mut directed, mut heartbeats) = (0, 0, 0);
        while start.elapsed() < time {
            let elapsed = start.elapsed();
            if elapsed >= DIRECTED_EVERY * directed {
                self.send(Kind::Directed);
                directed += 1;
            }
            if elapsed >= Duration::from_secs(1) * heartbeats {
                self.send(Kind::Heartbeat);
                heartbeats += 1;
            }
            while f64::from(bytes) < elapsed.as_secs_f64() * f64::from(rate) {
                bytes += self.send(Kind::Telemetry);
            }
            turns.wait();
        }
        turns.lateness
    }

    fn send(&mut self, kind: Kind) -> u32 {
        let number = u32::try_from(self.sent.len()).expect("a small number");
        let frame = match kind {
            Kind::Telemetry => {
                let message = TELEMETRY[self.sent.len() % TELEMETRY.len()];
                numbered(number, message)
            }
            Kind::Heartbeat => numbered(number, HEARTBEAT),
            Kind::Directed => numbered_ack(number),
        };
        self.sent.push((kind, Instant::now()));
        self.peer.send(&frame);
        u32::try_from(frame.len()).expect("a short frame")
    }
}

/// A frame that begins with its number and is not shortened by trimming.
fn numbered(number: u32, message: Message) -> Vec<u8> {
    let mut payload = number.to_le_bytes().to_vec();
    payload.resize(message.len, 3);
    Draft::new(VEHICLE, message, payload).seq(number.to_le_bytes()[0]).build()
}

/// COMMAND_ACK for the ground station, its number where the second result is.
fn numbered_ack(number: u32) -> Vec<u8> {
    let [a, b, c, d] = number.to_le_bytes();
    let payload = [0x90, 1, 0, 0, a, b, c, d, GCS.system, GCS.component];
    Draft::new(VEHICLE, COMMAND_ACK, payload).seq(a).build()
}

/// A serial line with a ground station at its far end.
struct Line {
    pty: PtyWire,
    /// Bytes a second.
    rate: f64,
    /// What the line may yet carry in the time that has passed.
    credit: f64,
    arrived: Vec<(Instant, Vec<u8>)>,
    lateness: Lateness,
}

impl Line {
    fn new(pty: PtyWire, rate: u32) -> Self {
        let (arrived, lateness) = (Vec::new(), Lateness::default());
        Self { pty, rate: f64::from(rate), credit: 0.0, arrived, lateness }
    }

    /// Carries bytes until the vehicle is done and nothing more comes. What came before the two
    /// have met is forgotten.
    fn carry(mut self, met: &AtomicBool, over: &AtomicBool) -> Self {
        let mut turns = Schedule::every(LINE_TURN);
        let (mut counted, mut spoken) = (Instant::now(), None::<Instant>);
        let mut last = counted;
        while !(over.load(Ordering::Acquire) && last.elapsed() > SILENCE) {
            if spoken.is_none_or(|at| at.elapsed() > Duration::from_secs(1)) {
                spoken = Some(Instant::now());
                self.pty.send(&heartbeat(GCS));
            }
            let now = Instant::now();
            self.credit += (now - counted).as_secs_f64() * self.rate;
            counted = now;
            if let Some(bytes) = self.take() {
                last = now;
                self.arrived.push((now, bytes));
            }
            if !met.load(Ordering::Acquire) {
                self.arrived.clear();
            }
            turns.wait();
        }
        self.lateness = turns.lateness;
        self
    }

    /// Takes out what the line has carried since the last time.
    fn take(&mut self) -> Option<Vec<u8>> {
        let mut buffer = [0; 4096];
        // Not negative, and cut off where it is too much.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let due = (self.credit as usize).min(buffer.len());
        let count = if due == 0 { 0 } else { self.pty.take(&mut buffer[..due]) };
        if count < due {
            // The line had nothing to carry; that time is gone.
            self.credit = 0.0;
        } else {
            self.credit -= per(count, 1);
        }
        (count > 0).then(|| buffer[..count].to_vec())
    }
}

/// Finds the frames in what came out, and says what became of those that were sent.
fn judge(
    sent: &[(Kind, Instant)],
    arrived: &[(Instant, Vec<u8>)],
    line_use: f64,
    lateness: Lateness,
) -> Outcome {
    let bytes: Vec<u8> = arrived.iter().flat_map(|(_, bytes)| bytes).copied().collect();
    let times: Vec<Instant> =
        arrived.iter().flat_map(|(at, bytes)| bytes.iter().map(|_| *at)).collect();
    let journey = |kind| {
        let sent = sent.iter().filter(|(other, _)| *other == kind).count();
        Journey { sent, ages: Vec::new() }
    };
    let mut outcome = Outcome {
        torn: 0,
        disordered: 0,
        directed: journey(Kind::Directed),
        heartbeats: journey(Kind::Heartbeat),
        telemetry: journey(Kind::Telemetry),
        line_use,
        lateness,
    };
    let (mut at, mut expected) = (first_whole(&bytes), 0);
    while at < bytes.len() {
        let Some(len) = whole_frame(&bytes[at..]) else {
            outcome.torn += 1;
            at += 1;
            continue;
        };
        let frame = &bytes[at..at + len];
        at += len;
        // Said by the router itself, or before the two had met.
        let Some((kind, sent_at)) = number(frame).and_then(|n| sent.get(n)) else { continue };
        let n = number(frame).unwrap_or_default();
        outcome.disordered += usize::from(n < expected);
        expected = n + 1;
        let ages = match kind {
            Kind::Directed => &mut outcome.directed.ages,
            Kind::Heartbeat => &mut outcome.heartbeats.ages,
            Kind::Telemetry => &mut outcome.telemetry.ages,
        };
        ages.push(times[at - 1].saturating_duration_since(*sent_at));
    }
    outcome
}

/// Where the first frame begins: what is remembered may begin within one.
fn first_whole(bytes: &[u8]) -> usize {
    (0..bytes.len()).find(|at| whole_frame(&bytes[*at..]).is_some()).unwrap_or(bytes.len())
}

/// The length of the frame that `bytes` begin with, if it is one and undamaged.
fn whole_frame(bytes: &[u8]) -> Option<usize> {
    let &[0xfd, len, 0, _, _, _, _, a, b, c, ..] = bytes else { return None };
    let id = u32::from_le_bytes([a, b, c, 0]);
    let known = [HEARTBEAT, COMMAND_ACK].into_iter().chain(TELEMETRY);
    let extra = known.into_iter().find(|message| message.id == id)?.extra;
    let end = 10 + usize::from(len);
    let checksum = bytes.get(end..end + 2)?;
    let valid = Crc::step(Crc::of(&bytes[1..end]), extra).to_le_bytes() == checksum;
    valid.then_some(end + 2)
}

/// The number of a frame of the vehicle.
fn number(frame: &[u8]) -> Option<usize> {
    let at = if frame[7] == COMMAND_ACK.id.to_le_bytes()[0] { 14 } else { 10 };
    let bytes = frame.get(at..at + 4)?.try_into().ok()?;
    (source_of(frame) == VEHICLE).then_some(u32::from_le_bytes(bytes) as usize)
}
