//! The program's own component in the loop: a link inside the program, and a timer once a second,
//! while there is somebody to be or a vehicle to be asked. Otherwise there is neither.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use tracing::warn;

use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::links::Link;
use super::plan::is_internal;
use super::timers::Timer;
use crate::config::{Address, EndpointOptions};
use crate::mavlink::{CheckedFrame, Component, Frame, Header, MessageId};
use crate::own::{OwnComponent, Place, RoundTrip, Vehicle};
use crate::routing::{Heard, KnownComponent, LinkId, LinkOptions, LocalPeer, Time};

/// A second: that of the heartbeat (rule 68).
const SECOND: Duration = Duration::from_secs(1);

/// What its endpoint is called.
const NAME: &str = "own-component";

/// Who was not heard on a link for so long may not answer there.
const PARTNER_SILENCE: Duration = Duration::from_secs(10);

/// The program's own component, if there is one.
#[derive(Default, Debug)]
pub(super) struct Own {
    role: Role,
    at_work: Option<AtWork>,
    /// When [`Timer::Own`] has something to do.
    deadline: Option<Time>,
}

/// What it is there for.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
enum Role {
    /// Nothing.
    #[default]
    Absent,
    /// It asks vehicles for their telemetry, and is nobody.
    Requests,
    /// It is somebody, and does so too.
    Component(Component),
}

impl Role {
    fn id(self) -> Option<Component> {
        match self {
            Self::Component(id) => Some(id),
            Self::Absent | Self::Requests => None,
        }
    }
}

#[derive(Debug)]
struct AtWork {
    endpoint: EndpointId,
    link: LinkId,
    component: Shared,
}

/// The component, whom its link and the timer speak to. Neither does so while the other one does.
#[derive(Clone, Debug)]
struct Shared(Rc<RefCell<OwnComponent>>);

impl LocalPeer for Shared {
    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time) {
        self.0.borrow_mut().handle_frame(frame, now);
    }

    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        self.0.borrow_mut().poll_transmit(now, out)
    }

    fn poll_timeout(&self) -> Option<Time> {
        self.0.borrow().poll_timeout()
    }
}

impl Daemon {
    /// Brings the component, or takes it away, as the configuration has it now.
    pub(super) fn refresh_own(&mut self) {
        let asks = self.io.endpoints.iter().any(|it| it.options().request_streams.is_some());
        let role = match self.general.own.id() {
            Some(id) => Role::Component(id),
            None if asks => Role::Requests,
            None => Role::Absent,
        };
        let before = std::mem::replace(&mut self.own.role, role);
        if role == before {
            return;
        }
        if let Some(old) = self.own.at_work.take() {
            self.remove_endpoint(old.endpoint, "the configuration has changed");
        }
        if role != Role::Absent {
            self.start_own(role);
        }
        if role.id() != before.id() {
            self.keep_own_away();
        }
    }

    fn start_own(&mut self, role: Role) {
        let component = Shared(Rc::new(RefCell::new(OwnComponent::new(role.id()))));
        let (options, peer) = (EndpointOptions::default(), Box::new(component.clone()));
        let added = self.add_internal(NAME, options, &OwnComponent::HEARS, peer);
        let Some((endpoint, link)) = added else {
            return warn!("cannot be a component: there are too many links or endpoints");
        };
        self.own.at_work = Some(AtWork { endpoint, link, component });
        self.own.deadline = Some(self.now);
        self.timers.set(self.now, Timer::Own);
    }

    /// Whose heartbeat is to be kept away from some endpoints is another now.
    fn keep_own_away(&mut self) {
        for index in self.io.endpoints.ids() {
            if !self.io.endpoints[index].options().own_component {
                self.change_links(index);
            }
        }
    }

    /// What the router must know of a link of an endpoint.
    pub(super) fn link_options(&self, index: EndpointId) -> LinkOptions {
        let endpoint = &self.io.endpoints[index];
        let mut options = endpoint.link_options();
        // It has no key: what is signed is for it only where a key was at hand.
        options.gate.needs_belief = endpoint.config.address == Address::Internal(NAME);
        if !endpoint.options().own_component {
            let own = self.own.role.id();
            options.filter_out.block_single = own.map(|id| (MessageId::HEARTBEAT, id));
        }
        options
    }

    /// A second is over.
    pub(super) fn handle_own_deadline(&mut self) {
        let Some(at) = self.own.deadline.filter(|at| *at <= self.now) else { return };
        let Some(AtWork { link, component, .. }) = &self.own.at_work else {
            return self.own.deadline = None;
        };
        let (link, component) = (*link, component.clone());
        // From second to second, but not all at once that were slept through.
        let next = if self.now.since(at) < SECOND { at + SECOND } else { self.now + SECOND };
        self.own.deadline = Some(next);
        self.timers.set(next, Timer::Own);
        self.live_a_second(&mut component.0.borrow_mut());
        let mut frame = Vec::new();
        loop {
            let single = component.0.borrow_mut().poll_single(&mut frame);
            let Some((to, target)) = single else { break };
            self.say_single(link, to, target, &frame);
            frame.clear();
        }
        self.receive_local(link);
    }

    fn live_a_second(&self, own: &mut OwnComponent) {
        own.begin_second();
        if let Some(id) = self.own.role.id() {
            for (place, partner) in self.partners(id) {
                own.measure(place, partner, self.now);
            }
        }
        for known in self.router.table().components() {
            self.ask_for_streams(known, own);
        }
        own.end_second(|place| self.place(place.link) == Some(place));
    }

    /// Asks a vehicle for its telemetry wherever that is wanted.
    fn ask_for_streams(&self, known: &KnownComponent, own: &mut OwnComponent) {
        if !known.heartbeat.as_ref().is_some_and(Vehicle::has_to_be_asked) {
            return;
        }
        let is_there = |heard: &&Heard| self.now.since(heard.last) < Vehicle::SILENCE;
        for heard in known.heard.iter().filter(is_there) {
            if let Some(place) = self.place(heard.link)
                && let Some(rate) = self.options_of(heard.link).and_then(|it| it.request_streams)
            {
                let component = known.component;
                own.ask_for_streams(
                    &Vehicle { place, component, boot_ms: heard.boot_ms },
                    rate,
                    self.now,
                );
            }
        }
    }

    /// The links that are measured, and on each somebody who may answer: a vehicle if there is one.
    fn partners(&self, own: Component) -> impl Iterator<Item = (Place, Component)> {
        let mut best: BTreeMap<Place, (u8, Component)> = BTreeMap::new();
        for known in self.router.table().components() {
            let rank = known.heartbeat.map_or(0, |it| 1 + u8::from(it.has_autopilot()));
            let is_there = |heard: &&Heard| self.now.since(heard.last) < PARTNER_SILENCE;
            for heard in known.heard.iter().filter(is_there) {
                let is_wanted = self.options_of(heard.link).is_some_and(|it| it.own_component);
                let Some(place) = self.place(heard.link) else { continue };
                let is_better = best.get(&place).is_none_or(|(other, _)| rank > *other);
                if is_wanted && is_better && known.component != own {
                    best.insert(place, (rank, known.component));
                }
            }
        }
        best.into_iter().map(|(place, (_, partner))| (place, partner))
    }

    /// The options of the endpoint of a link that leads out of the program.
    fn options_of(&self, link: LinkId) -> Option<&EndpointOptions> {
        let endpoint = self.io.endpoints.get(self.io.links.get(link)?.endpoint)?;
        (!is_internal(&endpoint.config)).then(|| endpoint.options())
    }

    fn place(&self, link: LinkId) -> Option<Place> {
        let since = self.io.links.get(link)?.since;
        Some(Place { link, since })
    }

    /// Sends what the component has to say to one link.
    fn say_single(&mut self, link: LinkId, to: LinkId, target: Component, bytes: &[u8]) {
        let Ok(header) = Header::parse(bytes) else { return };
        let frame = CheckedFrame { bytes, header, target, verified: true };
        let is_taken = self.router.handle_single(link, to, &frame, self.now);
        if is_taken && let Some(recorder) = &mut self.recorder {
            recorder.record(&frame);
        }
    }

    /// How far whoever is on a link is, if that is measured and somebody answers.
    pub(super) fn round_trip(&self, id: LinkId, link: &Link) -> Option<RoundTrip> {
        let own = self.own.at_work.as_ref()?.component.0.borrow();
        own.round_trip(Place { link: id, since: link.since })
    }
}

#[cfg(test)]
mod tests;
