//! Frames that come back: by parallel links, and round rings of routers (rule 49).
//!
//! Invariant, as long as a frame is remembered: **a router passes it on only when it comes over the
//! link that brought it first.** That link leads to a router that had the frame earlier, so these
//! links form a tree with the sender at its root. Each time the frame is sent it runs down the tree
//! once, and ends wherever it comes in by another way. So nothing goes round, however routers are
//! joined and whatever is lost; and a sender that says the same thing again and again, sequence
//! number included, is heard each time, as it does so over the same link.
//!
//! Four things are let through besides, each so that it cannot go on for ever:
//! - links of one group are one way: what one of them brought is a copy on the others, but only for
//!   so long as their ways differ in length, and for what the source has gone on from since;
//! - when the link that was first is gone, as with a program that connects anew, or the frame came
//!   over it too long ago to have gone round fast, another link **takes its place**, but on
//!   probation: the next time it comes, over whichever link, it counts as having gone round;
//! - a link behind which nobody passes anything on, as a log that is played back, says its own;
//! - what is forgotten, as there were too many others or it was too long ago.
//!
//! Probation is what ends a frame that a cable held back. Taking it for news adds an edge to the
//! tree, and a lap needs such an edge: at its end the frame meets its own probation. It is over
//! for a source that goes on counting over that link, and for one that counts nothing.
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

/// For so long a link may hold a frame back that came over another one, as modems do where there is
/// no coverage.
pub const HELD_BACK: Duration = Duration::from_secs(30);

/// So much longer one link of a group may take than another, where the user does not say. All that is
/// lost by it is a frame of who counts nothing, if it is sent twice within this time and each of the
/// two arrives over another link only.
pub const GROUP_WINDOW: Duration = Duration::from_millis(500);

/// A link that was heard within this time says where its sources are in their counting.
const COUNTING: Duration = Duration::from_secs(2);

/// So many frames one link may be ahead of another, or have lost, for a frame to be new that has the
/// same bytes as an old one.
const AHEAD: u8 = 16;

/// Whether a frame came before.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Arrival {
    /// It did not, or the same link says it again.
    New,
    /// It did, over another link, which is gone, or so long ago that it is taken for new.
    Again,
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
        self.is_echo = arrival != Arrival::New;
        if self.is_echo {
            self.first = None;
        } else if !frame.is_directed() {
            self.first = Some(now);
        }
    }

    /// Whether a frame is the next of this link's own, after one that came nowhere else before:
    /// each channel of a source counts for itself, and may say again what another one said.
    fn continues_with(&self, seq: u8) -> bool {
        let ahead = seq.wrapping_sub(self.sequence.latest());
        !self.is_echo && (1..=AHEAD).contains(&ahead)
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
    #[inline]
    fn judge(&self, seen: &mut Seen) -> Arrival {
        if self.from == seen.first() && !seen.is_on_probation() {
            seen.renew(self.from, self.now);
            return Arrival::New;
        }
        self.judge_other(seen)
    }

    /// It comes over another link than the one that was first, or that one is on probation.
    #[inline(never)]
    fn judge_other(&self, seen: &mut Seen) -> Arrival {
        if self.says_its_own(seen.first()) {
            seen.renew(self.from, self.now);
            return Arrival::New;
        }
        let (first, age) = (seen.first(), seen.age(self.now));
        let is_beside = self.from != first && !self.is_gone(first) && self.is_beside(first.link);
        let is_within_dedup =
            || self.from != first && self.dedup().is_some_and(|window| age < window);
        let arrival = if is_within_dedup() {
            Arrival::Copy
        } else if is_beside && !seen.is_on_probation() {
            self.judge_beside(age)
        } else if seen.is_on_probation() {
            self.judge_on_probation(seen, age)
        } else {
            self.judge_late(first, age)
        };
        match arrival {
            Arrival::New => seen.renew(self.from, self.now),
            Arrival::Again => seen.take_over(self.from, self.now),
            Arrival::Copy if seen.is_on_probation() => seen.note(),
            Arrival::Copy => {}
        }
        arrival
    }

    /// Whether this link repeats nobody, not even the one that was first: the same log is played back
    /// again, perhaps. Only with `dedup` two that are there at the same time bring it once.
    fn says_its_own(&self, first: Origin) -> bool {
        let is_rival = || self.from != first && !self.is_gone(first) && self.dedup().is_some();
        let repeats_nobody = |port: &Port| port.options.repeats_nobody;
        self.port(self.from.link).is_some_and(repeats_nobody) && !is_rival()
    }

    /// Another link was first, and of no group with this one.
    fn judge_late(&self, first: Origin, age: Duration) -> Arrival {
        if age < RING_WINDOW {
            return if self.is_gone(first) { Arrival::Again } else { Arrival::Copy };
        }
        if age >= HELD_BACK {
            return Arrival::New;
        }
        if !self.may_be_news(age) && self.is_late_copy() { Arrival::Copy } else { Arrival::Again }
    }

    /// A link has taken the place of the first one: what comes now may have gone round.
    fn judge_on_probation(&self, seen: &Seen, age: Duration) -> Arrival {
        if age < RING_WINDOW {
            return if self.is_gone(seen.first()) { Arrival::Again } else { Arrival::Copy };
        }
        if age >= HELD_BACK || seen.was_noted() && self.counts_nothing() {
            return Arrival::New;
        }
        if self.may_be_news(age) { Arrival::Again } else { Arrival::Copy }
    }

    /// Whether this link may well say for itself what another one said: it was opened since, as by a
    /// program that was started again, or it goes on with its own counting.
    fn may_be_news(&self, age: Duration) -> bool {
        let is_younger = |port: &Port| self.now.since(port.opened) < age;
        self.port(self.from.link).is_some_and(is_younger)
            || self.heard().is_some_and(|heard| heard.continues_with(self.frame.header.seq))
    }

    /// Whether a broadcast that does not continue what this link says is behind what another one
    /// says. What is meant for somebody is better told twice than never.
    fn is_late_copy(&self) -> bool {
        !self.frame.is_directed() && self.is_behind(|_| true)
    }

    /// Whether the source has never said any other number. That its last one here was the same proves
    /// nothing: it may be this very frame, on its lap before.
    fn counts_nothing(&self) -> bool {
        let Some(known) = self.table.find(self.frame.header.source) else { return false };
        let is_same = |heard: &Heard| heard.sequence.latest() == self.frame.header.seq;
        known.heard.iter().all(|heard| is_same(heard) && !heard.sequence.counts())
    }

    /// What was heard of the source on this link.
    fn heard(&self) -> Option<&Heard> {
        self.table.find(self.frame.header.source)?.on(self.from.link)
    }

    /// Another link of the same group was first.
    fn judge_beside(&self, age: Duration) -> Arrival {
        let is_longer_way = age < self.dedup().unwrap_or(GROUP_WINDOW);
        let is_late = || age < HELD_BACK && self.is_behind(|link| self.is_beside(link));
        if is_longer_way || is_late() { Arrival::Copy } else { Arrival::New }
    }

    /// Whether the source has said this over another link, of those that are meant, and gone on
    /// counting since, or nothing more.
    ///
    /// A source that counts nothing never has, and neither has one whose frames come over this link
    /// alone: what they say again is new.
    fn is_behind(&self, is_meant: impl Fn(LinkId) -> bool) -> bool {
        let Some(known) = self.table.find(self.frame.header.source) else { return false };
        let is_counting = |heard: &&Heard| {
            let is_other = heard.link != self.from.link && is_meant(heard.link);
            is_other && self.now.since(heard.last) < COUNTING
        };
        let newest = known.heard.iter().filter(is_counting).max_by_key(|heard| heard.last);
        let ahead = |heard: &Heard| self.frame.header.seq.wrapping_sub(heard.sequence.latest());
        newest.is_some_and(|newest| match ahead(newest) {
            // The last word of who counts is this very frame.
            0 => newest.sequence.counts(),
            ahead => ahead > AHEAD,
        })
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

    fn is_gone(&self, origin: Origin) -> bool {
        self.port(origin.link).is_none_or(|port| port.life != origin.life)
    }

    fn dedup(&self) -> Option<Duration> {
        self.port(self.from.link).and_then(|port| port.options.dedup)
    }

    fn port(&self, link: LinkId) -> Option<&Port> {
        self.ports.get(link.index())?.as_ref()
    }
}
