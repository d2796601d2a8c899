//! What a frame teaches the router before it is forwarded: routes, losses, restarts.

use super::link_set::LinkId;
use super::loops::Arrival;
use super::options::{Learn, RouterEvent};
use super::path_loss::Speech;
use super::port::{Port, is_radio_report};
use super::route_table::{Heard, Heartbeat, TableFull};
use super::router::{Router, push_event};
use super::sequence::Sequence;
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, Header, MessageId};

/// Where SYSTEM_TIME has the milliseconds since boot: four bytes.
const BOOT_MS: [u8; 4] = [8, 9, 10, 11];

/// How much later a message may come over one link than over another, in milliseconds.
const LATE_MS: u32 = 10_000;

impl Router {
    /// Learns where the source of a frame is, and counts its losses (rules 8, 24, 35 and 51).
    ///
    /// Where the user wants no copies, one teaches no route (rule 50), unless within a group: there
    /// the route is known already, and shall outlive the link that was first. Where nothing is said
    /// of copies, the source can be reached by both links (rule 37). In either case it was received,
    /// and the sequence numbers of this link say so.
    #[inline]
    pub(super) fn learn(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        arrival: Arrival,
        now: Time,
    ) {
        let source = frame.header.source;
        if !source.is_valid_source() {
            return self.handle_invalid_source(link, source);
        }
        let is_news =
            arrival != Arrival::Copy || self.port(link).is_some_and(Port::learns_of_copies);
        let teaches = frame.verified && is_news && self.may_teach(frame.header.id);
        let known = self.table.find_mut(source).and_then(|known| known.on_mut(link));
        let Some(heard) = known else {
            if frame.verified {
                self.learn_new(link, frame, arrival, teaches, now);
            }
            return;
        };
        let gap = heard.sequence.handle(frame.header.seq);
        if frame.verified {
            let lost = heard.lost_here(frame.header.id, gap, now);
            heard.last = now;
            heard.note_first(frame, arrival, now);
            heard.is_route |= teaches;
            self.handle_verified(link, frame, arrival, lost, now);
        }
    }

    fn handle_invalid_source(&mut self, link: LinkId, source: Component) {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else { return };
        port.counters.invalid_sources += 1;
        if port.counters.invalid_sources == 1 {
            push_event(&mut self.events, RouterEvent::InvalidSource(source, link));
        }
    }

    /// A filter keeps a frame out: it teaches no route, but it was heard, and counts; and a radio that
    /// asks for less gets less, whoever else shall hear of it.
    pub(super) fn handle_filtered(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) {
        let known = self.table.find_mut(frame.header.source);
        let heard = known.and_then(|known| known.on_mut(link));
        let id = frame.header.id;
        let lost = heard.map_or(0, |heard| {
            let gap = heard.sequence.handle(frame.header.seq);
            heard.lost_here(id, gap, now)
        });
        if let Some(Some(port)) = self.ports.get_mut(link.index())
            && frame.verified
        {
            port.handle_heard(id, lost, now);
            if is_radio_report(id) {
                port.handle_radio_status(frame, now);
            }
        }
    }

    fn may_teach(&self, id: MessageId) -> bool {
        match self.options.learn {
            Learn::All => true,
            Learn::Heartbeat => id == MessageId::HEARTBEAT,
        }
    }

    fn learn_new(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        arrival: Arrival,
        teaches: bool,
        now: Time,
    ) {
        let mut heard = first_heard(link, frame, teaches, now);
        heard.note_first(frame, arrival, now);
        let source = frame.header.source;
        let events = &mut self.events;
        let lost = |component| push_event(events, RouterEvent::ComponentLost(component));
        match self.table.add(source, heard, lost) {
            Ok(true) => push_event(&mut self.events, RouterEvent::ComponentSeen(source, link)),
            Ok(false) => {}
            Err(TableFull) => return self.count(link, |counters| &mut counters.unlearned),
        }
        self.handle_verified(link, frame, arrival, 0, now);
        if let Some(age) = self.options.route_age {
            self.next_aging.get_or_insert(now + age);
        }
    }

    /// What some messages mean for the link that they came over.
    #[inline]
    fn handle_verified(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        arrival: Arrival,
        lost: u8,
        now: Time,
    ) {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else {
            return;
        };
        let Header { id, source, .. } = frame.header;
        port.handle_heard(id, lost, now);
        match id {
            MessageId::HEARTBEAT => {
                if let Some(known) = self.table.find_mut(source) {
                    known.heartbeat = Some(Heartbeat::read(frame));
                }
                self.compare_heartbeats(link, source, arrival, now);
            }
            MessageId::SYSTEM_TIME => self.check_restart(link, frame),
            id if is_radio_report(id) => port.handle_radio_status(frame, now),
            _ => {}
        }
    }

    /// Rule 44: when time since boot runs backwards, the source started again, and its routes over
    /// other links are forgotten.
    fn check_restart(&mut self, link: LinkId, frame: &CheckedFrame<'_>) {
        let boot_ms = u32::from_le_bytes(BOOT_MS.map(|at| frame.payload_byte(at)));
        let source = frame.header.source;
        let Some(known) = self.table.find_mut(source) else { return };
        let is_before = |heard: &Heard| {
            // Over another link, the message may just be late.
            let late = if heard.link == link { 0 } else { LATE_MS };
            heard.boot_ms.is_some_and(|before| boot_ms.saturating_add(late) < before)
        };
        let restarted = known.heard.iter().any(is_before);
        for heard in &mut known.heard {
            if heard.link == link {
                heard.boot_ms = Some(boot_ms);
            } else if restarted {
                (heard.is_route, heard.boot_ms) = (false, None);
            }
        }
        if restarted {
            push_event(&mut self.events, RouterEvent::ComponentRestarted(source, link));
        }
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
        first: None,
        is_echo: false,
        speech: Speech::default(),
    }
}
