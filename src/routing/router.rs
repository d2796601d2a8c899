//! The router: a frame from one link goes into the queues of others.

use std::collections::VecDeque;
use std::time::Duration;

use super::counters::{DropReason, LinkCounters};
use super::decision::{Decision, Witness};
use super::dedup::Dedup;
use super::group::Group;
use super::link_set::{LinkId, LinkSet, MAX_LINKS};
use super::loops::Arrival;
use super::options::{LinkOptions, RouterEvent, RouterOptions};
use super::port::Port;
use super::queue::Precedence;
use super::route_table::RouteTable;
use super::signing::Signing;
use super::tallies::{Tallies, Tally};
use super::tap::Tap;
use super::time::Time;
use crate::mavlink::{CheckedFrame, MessageId};

/// Frames in, frames out; see the module.
pub struct Router {
    pub(super) options: RouterOptions,
    /// By number. Invariant: occupied exactly for the members of `links`.
    pub(super) ports: Vec<Option<Port>>,
    pub(super) links: LinkSet,
    /// How many links there have been, in its lowest bits.
    lives: u8,
    pub(super) table: RouteTable,
    pub(super) tallies: Tallies,
    pub(super) groups: Vec<Group>,
    /// Links that are sent everything by an option of their own.
    pub(super) sniffers: LinkSet,
    pub(super) has_sniffers: bool,
    pub(super) dedup: Dedup,
    /// Copies for those who look on.
    pub(super) tap: Tap,
    /// Links that got something since they were last asked for.
    pub(super) dirty: LinkSet,
    /// Links whose queues are filling.
    filling: LinkSet,
    has_filling: bool,
    pub(super) events: VecDeque<RouterEvent>,
    /// When routes may be too old.
    pub(super) next_aging: Option<Time>,
    pub(super) signing: Signing,
}

/// How many events wait to be fetched; what comes on top is not told.
const MAX_EVENTS: usize = 64;

impl Router {
    /// A router without links.
    pub fn new(options: RouterOptions) -> Self {
        Self {
            options,
            ports: Vec::new(),
            links: LinkSet::EMPTY,
            lives: 0,
            table: RouteTable::new(),
            tallies: Tallies::new(),
            groups: Vec::new(),
            sniffers: LinkSet::EMPTY,
            has_sniffers: options.sniffer.is_some(),
            dedup: Dedup::new(),
            tap: Tap::default(),
            dirty: LinkSet::EMPTY,
            filling: LinkSet::EMPTY,
            has_filling: false,
            events: VecDeque::with_capacity(MAX_EVENTS),
            next_aging: None,
            signing: Signing::default(),
        }
    }

    /// Adds a link; `None` if there are [`MAX_LINKS`] already.
    pub fn add_link(&mut self, options: LinkOptions, now: Time) -> Option<LinkId> {
        let link = self.links.first_absent()?;
        if let Some(membership) = options.membership {
            self.join_group(link, membership);
        }
        if options.is_sniffer {
            self.sniffers.insert(link);
            self.has_sniffers = true;
        }
        self.lives = self.lives.wrapping_add(1);
        let mut port = Port::new(options, self.lives, now);
        port.set_gate(link, &mut self.signing, now);
        if link.index() == self.ports.len() {
            self.ports.push(Some(port));
        } else {
            self.ports[link.index()] = Some(port);
        }
        self.links.insert(link);
        Some(link)
    }

    /// Forgets a link, what waits for it, and every route that leads there (rule 44).
    pub fn remove_link(&mut self, link: LinkId) {
        if !self.links.contains(link) {
            return;
        }
        self.links.remove(link);
        self.sniffers.remove(link);
        self.dirty.remove(link);
        self.filling.remove(link);
        self.ports[link.index()] = None;
        self.leave_groups(link);
        let events = &mut self.events;
        self.table.forget(
            |heard| heard.link == link,
            |component| push_event(events, RouterEvent::ComponentLost(component)),
        );
    }

    /// Takes a frame that arrived on `link` and queues it wherever it belongs.
    ///
    /// Says whether it was taken: not kept out by gate or filter, nor the copy of another. Does
    /// nothing if there is no such link.
    #[inline]
    pub fn handle(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> bool {
        if self.tap.is_open() {
            return self.handle_watched(link, frame, now);
        }
        self.handle_unwatched(link, frame, now)
    }

    /// The same when nobody looks on.
    #[inline]
    pub(super) fn handle_unwatched(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> bool {
        let Some(port) = self.count_in(link, frame) else { return false };
        if port.has_gate() {
            return self.handle_gated(link, frame, now);
        }
        self.admit(link, frame, now)
    }

    /// A frame came on a link, if there is such a link.
    #[inline]
    pub(super) fn count_in(&mut self, link: LinkId, frame: &CheckedFrame<'_>) -> Option<&Port> {
        let port = self.ports.get_mut(link.index())?.as_mut()?;
        port.counters.frames_in += 1;
        port.counters.bytes_in += frame.bytes.len() as u64;
        Some(port)
    }

    /// Takes a frame that has passed the gate of its link, if there is one.
    #[inline]
    pub(super) fn admit(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> bool {
        self.tallies.count(frame);
        let Some(Some(port)) = self.ports.get_mut(link.index()) else {
            return false;
        };
        if !port.takes(frame) {
            port.counters[DropReason::FilteredIn] += 1;
            self.handle_filtered(link, frame, now);
            return false;
        }
        let arrival = self.arrival(link, frame, now);
        self.learn(link, frame, arrival, now);
        if arrival == Arrival::Copy {
            self.count_drop(link, DropReason::Duplicate);
            return false;
        }
        let destinations = self.destinations(link, frame, now);
        if !destinations.is_empty() {
            self.deliver(frame, destinations, now);
        }
        true
    }

    /// Where a frame from `link` goes, whether or not there is room.
    #[inline]
    fn destinations(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> LinkSet {
        let witness = Counting { ports: &mut self.ports, events: &mut self.events };
        let mut decision = Decision {
            options: self.options,
            links: &self.links,
            table: &self.table,
            sniffers: &self.sniffers,
            has_sniffers: self.has_sniffers,
            groups: &mut self.groups,
            witness,
        };
        decision.destinations(link, frame, now)
    }

    #[inline]
    pub(super) fn deliver(&mut self, frame: &CheckedFrame<'_>, destinations: LinkSet, now: Time) {
        if self.tap.is_open() {
            return self.deliver_watched(frame, destinations, now);
        }
        let precedence = precedence(frame);
        for link in destinations.iter() {
            self.deliver_to(link, frame, precedence, now);
        }
    }

    #[inline]
    pub(super) fn deliver_to(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        precedence: Precedence,
        now: Time,
    ) {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else { return };
        if port.leaves_by_gate() {
            port.offer_gated(frame, precedence, &mut self.signing, now);
        } else {
            port.offer(frame, precedence, now);
        }
        self.dirty.insert(link);
        if port.is_filling() {
            self.filling.insert(link);
            self.has_filling = true;
        }
    }

    /// The links that got something since the last call.
    pub fn take_dirty(&mut self) -> LinkSet {
        std::mem::take(&mut self.dirty)
    }

    /// Whether a queue is filling: time to send before the turn is over.
    #[inline]
    pub fn has_filling(&self) -> bool {
        self.has_filling
    }

    /// The links whose queues were found filling since the last call.
    pub fn take_filling(&mut self) -> LinkSet {
        self.has_filling = false;
        std::mem::take(&mut self.filling)
    }

    /// A link's port, to be sent from.
    #[inline]
    pub fn port_mut(&mut self, link: LinkId) -> Option<&mut Port> {
        self.ports.get_mut(link.index())?.as_mut()
    }

    /// A link's port.
    pub fn port(&self, link: LinkId) -> Option<&Port> {
        self.ports.get(link.index())?.as_ref()
    }

    /// What happened on a link.
    pub fn counters(&self, link: LinkId) -> Option<&LinkCounters> {
        self.port(link).map(Port::counters)
    }

    /// All links.
    pub fn links(&self) -> LinkSet {
        self.links
    }

    /// What is known of components.
    pub fn table(&self) -> &RouteTable {
        &self.table
    }

    /// What came of each message from each component, in no order; at most
    /// [`MAX_TALLIES`](super::MAX_TALLIES), and what was heard first.
    pub fn tallies(&self) -> impl Iterator<Item = Tally> {
        self.tallies.iter()
    }

    /// The next event that nobody has fetched yet.
    pub fn poll_event(&mut self) -> Option<RouterEvent> {
        self.events.pop_front()
    }

    /// When [`Router::handle_timeout`] wants to be called. Changes with that call, and when the
    /// first component is heard.
    pub fn poll_timeout(&self) -> Option<Time> {
        self.next_aging
    }

    /// Forgets routes that are too old. Harmless if called early.
    pub fn handle_timeout(&mut self, now: Time) {
        let Some(age) = self.options.route_age else {
            return;
        };
        let events = &mut self.events;
        self.table.forget(
            |heard| now.since(heard.last) > age,
            |component| push_event(events, RouterEvent::ComponentLost(component)),
        );
        let heard = self.table.components().iter().flat_map(|known| &known.heard);
        // Not more often than once a second, however the ages are spread.
        let earliest = now + Duration::from_secs(1);
        let oldest = heard.map(|heard| heard.last).min();
        self.next_aging = oldest.map(|oldest| (oldest + age).max(earliest));
    }

    pub(super) fn count(&mut self, link: LinkId, counter: impl Fn(&mut LinkCounters) -> &mut u64) {
        if let Some(Some(port)) = self.ports.get_mut(link.index()) {
            *counter(&mut port.counters) += 1;
        }
    }

    fn count_drop(&mut self, link: LinkId, reason: DropReason) {
        count_drop(&mut self.ports, link, reason);
    }
}

/// Counts what is decided.
struct Counting<'a> {
    ports: &'a mut [Option<Port>],
    events: &'a mut VecDeque<RouterEvent>,
}

impl Witness for Counting<'_> {
    #[inline]
    fn ports(&self) -> &[Option<Port>] {
        self.ports
    }

    #[inline]
    fn count(&mut self, link: LinkId, reason: DropReason) {
        count_drop(self.ports, link, reason);
    }

    #[inline]
    fn tell(&mut self, event: RouterEvent) {
        push_event(self.events, event);
    }
}

fn count_drop(ports: &mut [Option<Port>], link: LinkId, reason: DropReason) {
    if let Some(Some(port)) = ports.get_mut(link.index()) {
        port.counters[reason] += 1;
    }
}

pub(super) fn push_event(events: &mut VecDeque<RouterEvent>, event: RouterEvent) {
    if events.len() < MAX_EVENTS {
        events.push_back(event);
    }
}

/// What somebody waits for, and what the next frame replaces.
#[inline]
pub(super) fn precedence(frame: &CheckedFrame<'_>) -> Precedence {
    match frame.header.id {
        MessageId::HEARTBEAT | MessageId::COMMAND_ACK | MessageId::MISSION_ACK => Precedence::Flash,
        id if frame.is_directed() || ANSWERS.contains(&id) => Precedence::Immediate,
        _ => Precedence::Routine,
    }
}

/// Answers that may come without a target: PARAM_VALUE, PARAM_EXT_VALUE, PARAM_EXT_ACK.
const ANSWERS: [MessageId; 3] = [MessageId(22), MessageId(322), MessageId(324)];

// The number of a link indexes a table of at most this length.
const _: () = assert!(MAX_LINKS <= u16::MAX as usize);
