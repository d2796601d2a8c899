//! Frames that come back: by parallel links, and round rings of routers (rule 49).
//!
//! Invariant, as long as a frame is remembered: **a router passes it on only when it comes over the
//! link that brought it first.** That link leads to a router that had the frame earlier, so these
//! links form a tree with the sender at its root. Each time the frame is sent it runs down the tree
//! once, and ends wherever it comes in by another way. So nothing goes round, however routers are
//! joined and whatever is lost; and a sender that says the same thing again and again, sequence
//! number included, is heard each time, as it does so over the same link.
//!
//! Three things are let through besides, each so that it cannot go on for ever:
//! - between links of one group without `dedup`, each brings it once more for each time that the
//!   first one does: the user wants both;
//! - when the link that was first is gone, as with a program that connects anew, another takes its
//!   place, but only once within the time, for the frame may also have gone round;
//! - what is forgotten, as there were too many others or it was too long ago.
//!
//! The loop rule, that a broadcast is not sent to a link on which a broadcast of its source was just
//! heard, saves some of the copies from being sent at all.

use std::time::Duration;

use super::dedup::{Origin, Seen};
use super::link_set::LinkId;
use super::port::Port;
use super::route_table::{Heard, RouteTable};
use super::router::Router;
use super::time::Time;
use crate::mavlink::CheckedFrame;

/// A frame that goes round comes again within this time.
pub const RING_WINDOW: Duration = Duration::from_secs(2);

/// For so long a path of a group may hold a frame back that came over another one, as modems do
/// where there is no coverage.
pub const HELD_BACK: Duration = Duration::from_secs(30);

/// A path of a group that was heard within this time says where its sources are in their counting.
const COUNTING: Duration = Duration::from_secs(2);

/// So many frames one path of a group may be ahead of another, or have lost, for a frame to be new
/// that has the same bytes as an old one.
const AHEAD: u8 = 16;

/// Whether a frame came before.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Arrival {
    /// It did not, or the same link says it again.
    New,
    /// It did, over another link of the same group, and the user wants both.
    Parallel,
    /// It did, over another link.
    Copy,
}

impl Router {
    /// Whether a frame has come already, by another way or round a ring (rule 49).
    #[inline]
    pub(super) fn arrival(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> Arrival {
        let Some(port) = self.port(link) else { return Arrival::New };
        let from = Origin { link, life: port.life };
        match self.dedup.recall(frame.bytes, from, now) {
            None => Arrival::New,
            Some(seen) => {
                let known = Known { ports: &self.ports, table: &self.table, from, frame, now };
                known.judge(seen)
            }
        }
    }
}

impl Heard {
    /// A frame came over this link; notes whether it came over another one before.
    ///
    /// That a directed frame did not proves nothing: it goes where its target is, perhaps the long
    /// way round, past somebody who depends on this router for the broadcasts.
    #[inline]
    pub(super) fn note_first(&mut self, frame: &CheckedFrame<'_>, arrival: Arrival, now: Time) {
        if arrival != Arrival::New {
            self.first = None;
        } else if !frame.is_directed() {
            self.first = Some(now);
        }
    }
}

/// A frame that is remembered, and has come again.
struct Known<'a> {
    ports: &'a [Option<Port>],
    table: &'a RouteTable,
    /// Over which link it has come now.
    from: Origin,
    frame: &'a CheckedFrame<'a>,
    now: Time,
}

impl Known<'_> {
    fn judge(&self, seen: &mut Seen) -> Arrival {
        let (first, age) = (seen.first(), seen.age(self.now));
        let is_recent = age < RING_WINDOW;
        let is_first_gone = self.port(first.link).is_none_or(|port| port.life != first.life);
        let arrival = if self.from == first {
            if seen.is_inherited() && is_recent { Arrival::Copy } else { Arrival::New }
        } else if self.dedup().is_some_and(|window| age < window) {
            Arrival::Copy
        } else if self.is_beside(first.link) {
            self.judge_parallel(seen, age)
        } else if is_recent && !is_first_gone {
            Arrival::Copy
        } else {
            Arrival::New
        };
        match arrival {
            Arrival::New if is_first_gone && is_recent => seen.inherit(self.from, self.now),
            Arrival::New => seen.renew(self.from, self.now),
            Arrival::Parallel | Arrival::Copy => {}
        }
        arrival
    }

    /// The frame came over another link of the same group before, but not within `dedup`.
    fn judge_parallel(&self, seen: &mut Seen, age: Duration) -> Arrival {
        if self.dedup().is_some() {
            let is_copy = age < HELD_BACK && self.is_behind();
            return if is_copy { Arrival::Copy } else { Arrival::New };
        }
        match age < RING_WINDOW {
            true if seen.note(self.from.link) => Arrival::Parallel,
            true => Arrival::Copy,
            false => Arrival::New,
        }
    }

    /// Whether the source has gone on counting over another link of the group since.
    ///
    /// A source that counts nothing never has, and neither has one whose frames come over this link
    /// alone: what they say again is new.
    fn is_behind(&self) -> bool {
        let Some(known) = self.table.find(self.frame.header.source) else { return false };
        let is_counting = |heard: &&Heard| {
            let is_other = heard.link != self.from.link && self.is_beside(heard.link);
            is_other && self.now.since(heard.last) < COUNTING
        };
        let newest = known.heard.iter().filter(is_counting).max_by_key(|heard| heard.last);
        let ahead = |heard: &Heard| self.frame.header.seq.wrapping_sub(heard.sequence.latest());
        newest.is_some_and(|newest| ahead(newest) > AHEAD)
    }

    /// Whether another link belongs to the same group.
    fn is_beside(&self, other: LinkId) -> bool {
        let group = |link| {
            let membership = self.port(link).and_then(|port| port.options.membership);
            membership.map(|membership| membership.group)
        };
        let own = group(self.from.link);
        own.is_some() && own == group(other)
    }

    fn dedup(&self) -> Option<Duration> {
        self.port(self.from.link).and_then(|port| port.options.dedup)
    }

    fn port(&self, link: LinkId) -> Option<&Port> {
        self.ports.get(link.index())?.as_ref()
    }
}
