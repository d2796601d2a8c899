//! The router: a frame from one link goes into the queues of others.

use std::collections::VecDeque;
use std::time::Duration;

use super::counters::{DropReason, LinkCounters};
use super::link_set::{LinkId, LinkSet, MAX_LINKS};
use super::options::{LOOP_WINDOW, Learn, LinkOptions, RouterEvent, RouterOptions};
use super::queue::{Precedence, Queue};
use super::route_table::{Heard, RouteTable};
use super::sequence::Sequence;
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, MessageId};

/// The router's side of a link.
struct Port {
    options: LinkOptions,
    queue: Queue,
    counters: LinkCounters,
}

/// Frames in, frames out; see the module.
pub struct Router {
    options: RouterOptions,
    /// By number. Invariant: occupied exactly for the members of `links`.
    ports: Vec<Option<Port>>,
    links: LinkSet,
    table: RouteTable,
    /// Links that got something since they were last asked for.
    dirty: LinkSet,
    /// Links whose queues are filling.
    filling: LinkSet,
    has_filling: bool,
    events: VecDeque<RouterEvent>,
    /// When routes may be too old.
    next_aging: Option<Time>,
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
            table: RouteTable::new(),
            dirty: LinkSet::EMPTY,
            filling: LinkSet::EMPTY,
            has_filling: false,
            events: VecDeque::with_capacity(MAX_EVENTS),
            next_aging: None,
        }
    }

    /// Adds a link; `None` if there are [`MAX_LINKS`] already.
    pub fn add_link(&mut self, options: LinkOptions) -> Option<LinkId> {
        let link = self.links.first_absent()?;
        let queue = Queue::new(options.queue);
        let port = Port {
            options,
            queue,
            counters: LinkCounters::default(),
        };
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
        self.dirty.remove(link);
        self.filling.remove(link);
        self.ports[link.index()] = None;
        let events = &mut self.events;
        self.table.forget(
            |heard| heard.link == link,
            |component| push_event(events, RouterEvent::ComponentLost(component)),
        );
    }

    /// Takes a frame that arrived on `link` and queues it wherever it belongs.
    ///
    /// Does nothing if there is no such link.
    #[inline]
    pub fn handle(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else {
            return;
        };
        port.counters.frames_in += 1;
        port.counters.bytes_in += frame.bytes.len() as u64;
        self.learn(link, frame, now);
        let mut destinations = self.destinations(link, frame, now);
        if destinations.is_empty() {
            if frame.is_directed() {
                self.count_drop(link, DropReason::NoRoute);
            }
            return;
        }
        if frame.header.id == MessageId::SETUP_SIGNING {
            destinations = self.permit_setup_signing(link, destinations);
        }
        self.deliver(frame, destinations);
    }

    /// Where a frame from `link` goes, whether or not there is room (rules 33-39 and 49).
    fn destinations(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> LinkSet {
        let candidates = if frame.is_directed() {
            self.routes_to(frame.target, now)
        } else {
            self.links
        };
        let mut destinations = candidates - LinkSet::of(link);
        let Some(source) = self.table.find(frame.header.source) else {
            return destinations;
        };
        for heard in &source.heard {
            let is_recent = now.since(heard.last) < LOOP_WINDOW;
            if is_recent && destinations.contains(heard.link) {
                destinations.remove(heard.link);
                count_drop(&mut self.ports, heard.link, DropReason::Loop);
            }
        }
        destinations
    }

    /// The links that lead to a target (rules 36-38); the target's system is not 0.
    fn routes_to(&self, target: Component, now: Time) -> LinkSet {
        let oldest = self.options.route_age.map_or(Time::ZERO, |age| now - age);
        if target.component != 0 {
            let exact = self.table.find(target).map(|known| known.routes(oldest));
            match exact {
                Some(routes) if !routes.is_empty() => return routes,
                _ if self.options.strict => return LinkSet::EMPTY,
                _ => {}
            }
        }
        let of_system = self.table.system(target.system);
        of_system.fold(LinkSet::EMPTY, |all, known| all | known.routes(oldest))
    }

    /// Learns where the source of a frame is, and counts its losses (rules 8, 24, 35 and 51).
    fn learn(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) {
        let source = frame.header.source;
        if !source.is_valid_source() {
            self.count(link, |counters| &mut counters.invalid_sources);
            return;
        }
        let is_heartbeat = frame.header.id == MessageId::HEARTBEAT;
        let teaches = frame.verified && (self.options.learn == Learn::All || is_heartbeat);
        if let Some(known) = self.table.find_mut(source) {
            if let Some(heard) = known.on_mut(link) {
                heard.sequence.handle(frame.header.seq);
                if frame.verified {
                    heard.last = now;
                    heard.is_route |= teaches;
                    self.check_restart(link, frame);
                }
            } else if frame.verified {
                known.heard.push(first_heard(link, frame, teaches, now));
                self.check_restart(link, frame);
            }
        } else if frame.verified {
            self.learn_new(link, frame, teaches, now);
        }
    }

    fn learn_new(&mut self, link: LinkId, frame: &CheckedFrame<'_>, teaches: bool, now: Time) {
        let heard = first_heard(link, frame, teaches, now);
        let source = frame.header.source;
        let events = &mut self.events;
        let lost = |component| push_event(events, RouterEvent::ComponentLost(component));
        if self.table.add(source, heard, lost).is_err() {
            self.count(link, |counters| &mut counters.unlearned);
            return;
        }
        push_event(&mut self.events, RouterEvent::ComponentSeen(source, link));
        self.check_restart(link, frame);
        if let Some(age) = self.options.route_age {
            self.next_aging.get_or_insert(now + age);
        }
    }

    /// Rule 44: when time since boot runs backwards, the source started again, and its routes over
    /// other links are forgotten.
    fn check_restart(&mut self, link: LinkId, frame: &CheckedFrame<'_>) {
        if frame.header.id != MessageId::SYSTEM_TIME {
            return;
        }
        let boot_ms = u32::from_le_bytes([8, 9, 10, 11].map(|at| frame.payload_byte(at)));
        let source = frame.header.source;
        let Some(known) = self.table.find_mut(source) else {
            return;
        };
        let Some(heard) = known.on_mut(link) else {
            return;
        };
        let restarted = heard.boot_ms.is_some_and(|before| boot_ms < before);
        heard.boot_ms = Some(boot_ms);
        if restarted {
            for other in known.heard.iter_mut().filter(|heard| heard.link != link) {
                other.is_route = false;
                other.boot_ms = None;
            }
            push_event(
                &mut self.events,
                RouterEvent::ComponentRestarted(source, link),
            );
        }
    }

    /// Rule 47: SETUP_SIGNING passes only between links that both allow it.
    fn permit_setup_signing(&mut self, link: LinkId, destinations: LinkSet) -> LinkSet {
        let allows = |link: LinkId| {
            self.ports[link.index()]
                .as_ref()
                .is_some_and(|p| p.options.forward_setup_signing)
        };
        let permitted = if allows(link) {
            destinations.iter().filter(|link| allows(*link)).collect()
        } else {
            LinkSet::EMPTY
        };
        if permitted != destinations {
            self.count_drop(link, DropReason::SetupSigning);
        }
        permitted
    }

    fn deliver(&mut self, frame: &CheckedFrame<'_>, destinations: LinkSet) {
        let precedence = precedence(frame);
        for link in destinations.iter() {
            let Some(Some(port)) = self.ports.get_mut(link.index()) else {
                continue;
            };
            if port.queue.push(frame.bytes, precedence).is_err() {
                port.counters[DropReason::QueueFull] += 1;
                continue;
            }
            port.counters.frames_out += 1;
            port.counters.bytes_out += frame.bytes.len() as u64;
            self.dirty.insert(link);
            if port.queue.is_filling() {
                self.filling.insert(link);
                self.has_filling = true;
            }
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

    /// A link's queue, to be sent from.
    #[inline]
    pub fn queue_mut(&mut self, link: LinkId) -> Option<&mut Queue> {
        self.ports
            .get_mut(link.index())?
            .as_mut()
            .map(|port| &mut port.queue)
    }

    /// What happened on a link.
    pub fn counters(&self, link: LinkId) -> Option<&LinkCounters> {
        self.ports
            .get(link.index())?
            .as_ref()
            .map(|port| &port.counters)
    }

    /// All links.
    pub fn links(&self) -> LinkSet {
        self.links
    }

    /// What is known of components.
    pub fn table(&self) -> &RouteTable {
        &self.table
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
        let heard = self
            .table
            .components()
            .iter()
            .flat_map(|known| &known.heard);
        // Not more often than once a second, however the ages are spread.
        let earliest = now + Duration::from_secs(1);
        let oldest = heard.map(|heard| heard.last).min();
        self.next_aging = oldest.map(|oldest| (oldest + age).max(earliest));
    }

    fn count(&mut self, link: LinkId, counter: impl Fn(&mut LinkCounters) -> &mut u64) {
        if let Some(Some(port)) = self.ports.get_mut(link.index()) {
            *counter(&mut port.counters) += 1;
        }
    }

    fn count_drop(&mut self, link: LinkId, reason: DropReason) {
        count_drop(&mut self.ports, link, reason);
    }
}

fn count_drop(ports: &mut [Option<Port>], link: LinkId, reason: DropReason) {
    if let Some(Some(port)) = ports.get_mut(link.index()) {
        port.counters[reason] += 1;
    }
}

fn push_event(events: &mut VecDeque<RouterEvent>, event: RouterEvent) {
    if events.len() < MAX_EVENTS {
        events.push_back(event);
    }
}

fn first_heard(link: LinkId, frame: &CheckedFrame<'_>, is_route: bool, now: Time) -> Heard {
    let mut sequence = Sequence::default();
    sequence.handle(frame.header.seq);
    Heard {
        link,
        last: now,
        is_route,
        sequence,
        boot_ms: None,
    }
}

/// What somebody waits for, and what the next frame replaces.
#[inline]
fn precedence(frame: &CheckedFrame<'_>) -> Precedence {
    let is_awaited = matches!(
        frame.header.id,
        MessageId::HEARTBEAT | MessageId::COMMAND_ACK
    );
    if frame.is_directed() || is_awaited {
        Precedence::Immediate
    } else {
        Precedence::Routine
    }
}

// The number of a link indexes a table of at most this length.
const _: () = assert!(MAX_LINKS <= u16::MAX as usize);
