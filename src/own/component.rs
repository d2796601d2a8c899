//! The component: what it says, and to whom it listens.

use std::collections::VecDeque;

use super::Place;
use super::round_trip::{Answer, Question, RoundTrip, RoundTrips};
use super::stream_requests::{self, StreamRequests, Vehicle};
use crate::mavlink::{Component, Frame, Layout, MessageId, Payload, Timing};
use crate::routing::{Heartbeat, LinkId, LocalPeer, Time};

/// How many answers may wait; what comes on top gets none, as on a link that is too slow.
const MAX_REPLIES: usize = 32;

const EVERYBODY: Component = Component::new(0, 0);

/// The program's own component; see the room.
///
/// Whoever runs it calls [`begin_second`](Self::begin_second) once a second, tells it whom there is to
/// measure and to ask, and then [`end_second`](Self::end_second).
#[derive(Debug)]
pub struct OwnComponent {
    /// `None`: it is nobody, and only asks vehicles for their telemetry.
    id: Option<Component>,
    seq: u8,
    /// For whoever they are directed at, or for all.
    replies: VecDeque<Payload>,
    /// For one link each, whatever other ways there are.
    singles: VecDeque<Single>,
    trips: RoundTrips,
    streams: StreamRequests,
}

/// A message for one link.
#[derive(Debug)]
struct Single {
    link: LinkId,
    source: Component,
    target: Component,
    payload: Payload,
}

impl OwnComponent {
    /// The messages that it listens to.
    pub const HEARS: [MessageId; 2] = Timing::IDS;

    /// A component with this id; with none, it says nothing of itself and answers nobody.
    pub fn new(id: Option<Component>) -> Self {
        Self {
            id,
            seq: 0,
            replies: VecDeque::new(),
            singles: VecDeque::new(),
            trips: RoundTrips::default(),
            streams: StreamRequests::default(),
        }
    }

    /// Another second begins: it says that it is there.
    pub fn begin_second(&mut self) {
        if self.id.is_some() {
            self.reply(heartbeat());
        }
        self.streams.begin_second();
    }

    /// Measures how far whoever is on a link is, if it is time; `partner` is one who may answer.
    pub fn measure(&mut self, place: Place, partner: Component, now: Time) {
        let Some(source) = self.id else { return };
        let Some(question) = self.trips.ask(place, now) else { return };
        let (target, payload) = match question {
            Question::Timesync { ts1 } => (partner, Timing::timesync(0, ts1, partner)),
            Question::Ping { seq } => (EVERYBODY, Timing::ping(now.as_micros(), seq, EVERYBODY)),
        };
        self.singles.push_back(Single { link: place.link, source, target, payload });
    }

    /// A vehicle is there: asks it for its telemetry, `rate` times a second, if it is time; says
    /// whether it does.
    pub fn ask_for_streams(&mut self, vehicle: &Vehicle, rate: u8, now: Time) -> bool {
        if !self.streams.is_due(vehicle, rate, now) {
            return false;
        }
        let target = vehicle.component;
        // Who is nobody speaks as a part of the vehicle itself.
        let source =
            self.id.unwrap_or_else(|| Component::new(target.system, Component::ONBOARD_COMPUTER));
        let link = vehicle.place.link;
        self.singles.extend(stream_requests::requests(target, rate).map(|payload| Single {
            link,
            source,
            target,
            payload,
        }));
        true
    }

    /// The second's questions are put: forgets links and vehicles that are not there any more.
    pub fn end_second(&mut self, is_there: impl Fn(Place) -> bool) {
        self.trips.retain(is_there);
        self.streams.end_second();
    }

    /// Appends the next frame that is for one link alone, a whole one; says for which, and whom on it.
    pub fn poll_single(&mut self, out: &mut Vec<u8>) -> Option<(LinkId, Component)> {
        let Single { link, source, target, payload } = self.singles.pop_front()?;
        self.say(&payload, source, out);
        Some((link, target))
    }

    /// How far whoever is on a link is, if somebody answers there.
    pub fn round_trip(&self, place: Place) -> Option<RoundTrip> {
        self.trips.get(place)
    }

    fn say(&mut self, payload: &Payload, source: Component, out: &mut Vec<u8>) {
        payload.encode(source, self.seq, out);
        self.seq = self.seq.wrapping_add(1);
    }

    fn reply(&mut self, payload: Payload) {
        if self.replies.len() < MAX_REPLIES {
            self.replies.push_back(payload);
        }
    }

    fn handle_timing(&mut self, id: Component, from: Component, timing: Timing, now: Time) {
        if let Some(answer) = timing.answer(from, now.as_nanos()) {
            if is_for(id, timing.target()) {
                self.reply(answer);
            }
            return;
        }
        match timing {
            // Old senders answer everybody (rule 29).
            Timing::Timesync { ts1, target, .. } if target == id || target.system == 0 => {
                self.trips.handle(Answer::Timesync { ts1 }, now);
            }
            Timing::Ping { seq, target, .. } if target == id => {
                self.trips.handle(Answer::Ping { seq }, now);
            }
            Timing::Timesync { .. } | Timing::Ping { .. } => {}
        }
    }
}

impl LocalPeer for OwnComponent {
    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time) {
        let Some(id) = self.id else { return };
        let from = frame.header().source;
        // Nobody is system 0.
        if from == id || from.system == 0 {
            return;
        }
        if let Some(timing) = Timing::read(frame) {
            self.handle_timing(id, from, timing, now);
        }
    }

    fn poll_transmit(&mut self, _now: Time, out: &mut Vec<u8>) -> bool {
        let Some(id) = self.id else { return false };
        let Some(payload) = self.replies.pop_front() else { return false };
        self.say(&payload, id, out);
        true
    }

    /// It is told when a second is over.
    fn poll_timeout(&self) -> Option<Time> {
        None
    }
}

/// Whether a question for `target` is for `id` too (rule 36).
fn is_for(id: Component, target: Component) -> bool {
    [0, id.system].contains(&target.system) && [0, id.component].contains(&target.component)
}

/// HEARTBEAT of MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE (rule 68).
fn heartbeat() -> Payload {
    const ONBOARD_CONTROLLER: u8 = 18;
    Payload::new(Layout::new(0, 50), 9)
        .with(4, [ONBOARD_CONTROLLER, Heartbeat::NO_AUTOPILOT, 0, 4, 3])
}

#[cfg(test)]
mod tests;
