//! Copies of frames as they pass, for somebody who looks on: only while somebody does, and never
//! more than there is room for.
//!
//! What does not fit is counted, and the router goes on. Nothing is allocated for a frame: the room
//! is taken when the tap is opened, and given back when it is closed.

use super::counters::{DropReason, LinkCounters};
use super::link_set::{LinkId, LinkSet};
use super::router::{Router, precedence};
use super::time::Time;
use crate::mavlink::{CheckedFrame, MessageId};

/// A frame that passed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sighting {
    /// Where it came from.
    pub link: LinkId,
    /// When.
    pub at: Time,
    /// Whether its checksum was checked in full.
    pub verified: bool,
    /// Why it was not taken at all, if so.
    pub dropped: Option<DropReason>,
    /// Where it was queued.
    pub sent: LinkSet,
    /// Where it was to go and was not queued, and why; the first few.
    pub refused: [Option<(LinkId, DropReason)>; REFUSALS],
    /// Where its bytes end; they begin where those before it end.
    end: usize,
}

/// How many refusals are told of one frame.
const REFUSALS: usize = 4;

/// How many frames there is room for, and how many bytes of them: more than a turn mostly brings.
const FRAMES: usize = 1_024;
const BYTES: usize = 96 * 1_024;

/// Frames that passed since they were last asked for.
#[derive(Default)]
pub struct Tap {
    is_open: bool,
    sightings: Vec<Sighting>,
    bytes: Vec<u8>,
    missed: u64,
    /// What became of the frame that is being handled.
    sent: LinkSet,
    refused: [Option<(LinkId, DropReason)>; REFUSALS],
}

impl Tap {
    /// The frames, oldest first, and their bytes as they arrived.
    pub fn sightings(&self) -> impl Iterator<Item = (&Sighting, &[u8])> {
        let starts = std::iter::once(0).chain(self.sightings.iter().map(|it| it.end));
        let bytes = |start: usize, end: usize| self.bytes.get(start..end).unwrap_or_default();
        self.sightings.iter().zip(starts).map(move |(it, start)| (it, bytes(start, it.end)))
    }

    /// How many frames passed that there was no room for.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Whether nothing has passed.
    pub fn is_empty(&self) -> bool {
        self.sightings.is_empty() && self.missed == 0
    }

    /// Whether copies are kept.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    fn push(&mut self, sighting: Sighting, bytes: &[u8]) {
        let end = self.bytes.len() + bytes.len();
        if self.sightings.len() == FRAMES || end > BYTES {
            self.missed += 1;
            return;
        }
        self.bytes.extend_from_slice(bytes);
        self.sightings.push(Sighting { end, ..sighting });
    }

    fn clear(&mut self) {
        self.sightings.clear();
        self.bytes.clear();
        self.missed = 0;
    }
}

impl Router {
    /// From now on, copies of frames are kept until [`Router::clear_tap`]; or no longer.
    pub fn set_tap(&mut self, is_open: bool) {
        if is_open == self.tap.is_open {
            return;
        }
        self.tap = Tap::default();
        if is_open {
            self.tap.sightings.reserve_exact(FRAMES);
            self.tap.bytes.reserve_exact(BYTES);
            self.tap.is_open = true;
        }
    }

    /// What has passed since [`Router::clear_tap`].
    pub fn tap(&self) -> &Tap {
        &self.tap
    }

    /// Forgets what has passed.
    pub fn clear_tap(&mut self) {
        self.tap.clear();
    }

    /// Takes a frame as always, and keeps a copy of it.
    #[cold]
    #[inline(never)]
    pub(super) fn handle_watched(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> bool {
        self.watch(link, frame, now, |router| router.handle_unwatched(link, frame, now))
    }

    /// Lets `take` take a frame that arrived on `link`, and keeps a copy of it.
    pub(super) fn watch(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
        take: impl FnOnce(&mut Self) -> bool,
    ) -> bool {
        let before = self.counters(link).copied().unwrap_or_default();
        (self.tap.sent, self.tap.refused) = (LinkSet::EMPTY, [None; REFUSALS]);
        let is_taken = take(self);
        // It carries a secret key (rule 47), which is nobody's to see.
        if frame.header.id == MessageId::SETUP_SIGNING {
            return is_taken;
        }
        let Tap { sent, refused, .. } = self.tap;
        let has_gone = !sent.is_empty() || refused[0].is_some();
        let dropped = if has_gone { None } else { self.dropped_since(link, &before) };
        let verified = frame.verified;
        let sighting = Sighting { link, at: now, verified, dropped, sent, refused, end: 0 };
        self.tap.push(sighting, frame.bytes);
        is_taken
    }

    /// Delivers as always, and notes what came of it.
    #[cold]
    #[inline(never)]
    pub(super) fn deliver_watched(
        &mut self,
        frame: &CheckedFrame<'_>,
        destinations: LinkSet,
        now: Time,
    ) {
        let precedence = precedence(frame);
        for link in destinations.iter() {
            let before = self.counters(link).copied().unwrap_or_default();
            self.deliver_to(link, frame, precedence, now);
            match self.dropped_since(link, &before) {
                None => self.tap.sent.insert(link),
                Some(reason) => {
                    let free = self.tap.refused.iter_mut().find(|place| place.is_none());
                    free.into_iter().for_each(|place| *place = Some((link, reason)));
                }
            }
        }
    }

    /// For which reason a frame was dropped that counts on this link.
    fn dropped_since(&self, link: LinkId, before: &LinkCounters) -> Option<DropReason> {
        let after = self.counters(link)?;
        DropReason::ALL.into_iter().find(|reason| after[*reason] > before[*reason])
    }
}
