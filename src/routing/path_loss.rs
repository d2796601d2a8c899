//! How much a path loses, by what was heard on it and on the other paths of its group.
//!
//! A gap in a source's numbers says little by itself: a far end that sends over its best path alone
//! leaves everything out of the others but heartbeats (rule 52). So heartbeats are compared, which go
//! over every path: one that another link of the group brought and this one did not was lost here.
//! Gaps count only while the far end sends more than heartbeats over this link.

use std::time::Duration;

use super::group::SILENT;
use super::link_set::LinkId;
use super::loops::Arrival;
use super::port::Port;
use super::route_table::Heard;
use super::router::Router;
use super::time::Time;
use crate::mavlink::{Component, MessageId};

/// Lost frames of late, in parts of 1,024.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct PathLoss(u32);

/// How many frames the measure looks back, more or less.
const MEMORY: u32 = 64;

/// And how many heartbeats, of which there are fewer.
const HEARTBEATS: u32 = 32;

/// A longer gap says no more.
const LONGEST_GAP: u8 = 16;

/// After a longer pause of a source a gap says nothing: meanwhile it may have gone another way.
const PAUSE: Duration = SILENT;

impl PathLoss {
    /// The loss, in parts of 1,024.
    pub(super) fn get(self) -> u32 {
        self.0
    }

    /// A frame came, after so many that did not come.
    #[inline]
    pub(super) fn hear(&mut self, id: MessageId, lost: u8) {
        for _ in 0..lost.min(LONGEST_GAP) {
            self.0 += (1_024 - self.0) / MEMORY;
        }
        let memory = if id == MessageId::HEARTBEAT { HEARTBEATS } else { MEMORY };
        self.0 -= self.0.div_ceil(memory);
    }

    /// A heartbeat did not come.
    pub(super) fn miss_heartbeat(&mut self) {
        self.0 += (1_024 - self.0) / HEARTBEATS;
    }
}

/// What a source says over a link, as far as it tells of loss.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub(super) struct Speech {
    /// How many heartbeats may come until it says nothing else here.
    in_use: u8,
    /// Heartbeats that another link of the group has brought, and this one not yet.
    due: u8,
}

impl Heard {
    /// A frame came over this link, with a gap before it: how much of that was lost here.
    #[inline]
    pub(super) fn lost_here(&mut self, id: MessageId, gap: u8, now: Time) -> u8 {
        let speech = &mut self.speech;
        if id == MessageId::HEARTBEAT {
            speech.in_use = speech.in_use.saturating_sub(1);
            return 0;
        }
        let is_in_use = speech.in_use > 0 && now.since(self.last) < PAUSE;
        speech.in_use = 2;
        if is_in_use { gap } else { 0 }
    }

    /// A heartbeat came over this link; says how many did not come before it.
    fn take_heartbeat(&mut self, arrival: Arrival) -> u8 {
        if arrival == Arrival::New {
            return std::mem::take(&mut self.speech.due);
        }
        self.speech.due = self.speech.due.saturating_sub(1);
        0
    }

    /// A heartbeat came over another link first; says how many are now too late here.
    fn await_heartbeat(&mut self) -> u8 {
        let late = self.speech.due;
        self.speech.due = 1;
        late
    }
}

impl Router {
    /// A heartbeat came: links of the same group that did not bring the one before have lost it.
    pub(super) fn compare_heartbeats(
        &mut self,
        link: LinkId,
        source: Component,
        arrival: Arrival,
        now: Time,
    ) {
        let Some(group) = self.port(link).and_then(Port::group) else { return };
        let Some(known) = self.table.find_mut(source) else { return };
        for heard in &mut known.heard {
            let Some(Some(port)) = self.ports.get_mut(heard.link.index()) else { continue };
            if port.group() != Some(group) {
                continue;
            }
            let missed = match arrival {
                _ if heard.link == link => heard.take_heartbeat(arrival),
                Arrival::New => heard.await_heartbeat(),
                Arrival::Again | Arrival::Copy => 0,
            };
            (0..missed).for_each(|_| port.handle_missed_heartbeat(now));
        }
    }
}
