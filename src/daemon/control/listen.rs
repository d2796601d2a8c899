//! The request `listen`: frames as they pass, for whoever asked to see them.
//!
//! The router keeps copies while somebody listens; at the end of a turn they are told to whom they
//! are wanted by, as far as there is room. Nobody waits for a listener: what it does not take is
//! counted, and that is told to it.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tracing::info;

use super::Daemon;
use super::client::{ControlClient, Mode};
use crate::control::{Answer, AnswerLine};
use crate::listen::{Frames, SeenFrame, Selection, to_hex};
use crate::mavlink::Header;
use crate::routing::{LinkId, Sighting, Time};

/// A listener's business.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Listening {
    id: u64,
    wanted: Selection,
    /// How many frames there was no room for: wanted ones, and those of all that found no room with
    /// the router.
    missed: u64,
}

/// How much may wait for a listener, in bytes.
pub const ROOM: usize = 256 * 1_024;

impl Daemon {
    /// From now on the client is told of frames; the first answer says so.
    pub(super) fn begin_listen(&mut self, slot: usize, id: u64, filter: &str) -> Answer {
        let names: Vec<&str> = self.io.endpoints.iter().map(|it| it.name.as_str()).collect();
        let wanted = match Selection::parse(filter, self.checker.dialect(), &names) {
            Ok(wanted) => wanted,
            Err(error) => return Answer::Error(error.to_string()),
        };
        self.set_mode(slot, Mode::Listening(Box::new(Listening { id, wanted, missed: 0 })));
        info!("somebody listens on the control socket");
        Answer::Frames(Frames::default())
    }

    /// Copies are kept only while somebody listens.
    pub(super) fn set_tap(&mut self) {
        let is_listening = |client: &ControlClient| matches!(client.mode, Mode::Listening(_));
        self.router.set_tap(self.control.clients.iter().flatten().any(is_listening));
    }

    /// Tells listeners what has passed in this turn.
    pub(in crate::daemon) fn tell_listeners(&mut self) {
        if self.router.tap().is_empty() {
            return;
        }
        for slot in 0..self.control.clients.len() {
            let Some(mut client) = self.control.clients[slot].take() else { continue };
            let is_there = self.tell_listener(&mut client);
            self.control.clients[slot] = Some(client);
            if !is_there {
                self.close_client(slot);
            }
        }
        self.router.clear_tap();
        self.set_control_timer();
    }

    /// Says whether the client is still there.
    fn tell_listener(&self, client: &mut ControlClient) -> bool {
        let room = ROOM.saturating_sub(client.waiting());
        let Mode::Listening(listening) = &mut client.mode else { return true };
        let tap = self.router.tap();
        let mut frames = Frames::default();
        let (mut used, mut missed) = (0, tap.missed());
        for (sighting, bytes) in tap.sightings() {
            let Ok(header) = Header::parse(bytes) else { continue };
            let endpoint = self.endpoint_name(sighting.link);
            if !listening.wanted.takes(&header, endpoint, sighting.dropped.is_some()) {
                continue;
            }
            used += self.told_len(sighting, bytes);
            if used > room {
                missed += 1;
            } else {
                frames.frames.push(self.seen(sighting, bytes));
            }
        }
        listening.missed += missed;
        if frames.frames.is_empty() {
            return true;
        }
        frames.missed = std::mem::take(&mut listening.missed);
        let line = AnswerLine::new(listening.id, Answer::Frames(frames));
        client.append(&line.to_line());
        client.flush(self.now)
    }

    /// About how long a frame is in a line, in bytes.
    fn told_len(&self, sighting: &Sighting, bytes: &[u8]) -> usize {
        let refused = sighting.refused.iter().flatten().map(|(link, _)| *link);
        // A name in its quotes, with a comma, and a reason at most; then the digits and the rest.
        let name = |link: LinkId| self.endpoint_name(link).len() + 3;
        let names: usize = sighting.sent.iter().map(name).sum();
        names + refused.map(|link| name(link) + 30).sum::<usize>() + bytes.len() * 2 + 300
    }

    fn seen(&self, sighting: &Sighting, bytes: &[u8]) -> SeenFrame {
        let name = |link: LinkId| self.endpoint_name(link).to_owned();
        let refused = sighting.refused.iter().flatten();
        SeenFrame {
            time_us: self.since_1970(sighting.at),
            endpoint: name(sighting.link),
            // Below the number of links that there may be.
            link: sighting.link.index() as u16,
            to: sighting.sent.iter().map(name).collect(),
            refused: refused.map(|(link, why)| (name(*link), why.name().to_owned())).collect(),
            dropped: sighting.dropped.map(|reason| reason.name().to_owned()),
            verified: sighting.verified,
            bytes: to_hex(bytes),
        }
    }

    /// A time of the loop as microseconds since 1970.
    fn since_1970(&self, at: Time) -> u64 {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let since = self.clock().since(at);
        u64::try_from(now.saturating_sub(since).as_micros()).unwrap_or(u64::MAX)
    }
}
