//! Where a frame goes: the steps in their order, one place for them all.
//!
//! The router takes them for every frame, and [`super::explain`] for a frame that is only asked
//! about. A [`Witness`] is told of each step, so that the one counts and the other explains, and
//! neither decides anything by itself. Whether there is room is the business of [`super::port`].

use super::counters::DropReason;
use super::group::{Group, GroupId, Quality};
use super::link_set::{LinkId, LinkSet};
use super::options::{LOOP_WINDOW, RouterEvent, RouterOptions};
use super::port::Port;
use super::route_table::{Heard, RouteTable};
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, MessageId};

/// What is decided by.
pub(super) struct Decision<'a, W> {
    pub(super) options: RouterOptions,
    pub(super) links: &'a LinkSet,
    pub(super) table: &'a RouteTable,
    /// Links that are sent everything by an option of their own.
    pub(super) sniffers: &'a LinkSet,
    /// Whether anybody is sent everything.
    pub(super) has_sniffers: bool,
    /// Changed only in what they remember of their own judgement.
    pub(super) groups: &'a mut [Group],
    pub(super) witness: W,
}

/// Who sees how a decision is made.
pub(super) trait Witness {
    /// All links, by number.
    fn ports(&self) -> &[Option<Port>];

    /// Links on which a component is heard by the frame itself, unless that was learned already.
    #[inline]
    fn taught(&self, _component: Component) -> LinkSet {
        LinkSet::EMPTY
    }

    /// What is left after a step.
    #[inline]
    fn note(&mut self, _step: Step, _left: &LinkSet) {}

    /// A frame is dropped, and it counts on this link.
    #[inline]
    fn count(&mut self, _link: LinkId, _reason: DropReason) {}

    /// Something happened that a person wants to be told.
    #[inline]
    fn tell(&mut self, _event: RouterEvent) {}
}

/// The steps, in their order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// Everybody, or the links that lead to the target (rules 33-38).
    Routes,
    /// Without the link it came from, and those that lead the same way (rules 34 and 39).
    OwnPath,
    /// With those that are sent everything.
    Sniffers,
    /// Each group has chosen its paths.
    Paths,
    /// Without those that lead to where this link just brought the like from (rule 49).
    Loop(LinkId),
    /// Without those that a secret key must not go to (rule 47).
    SetupSigning,
}

impl<W: Witness> Decision<'_, W> {
    /// Where a frame from `link` goes, whether or not there is room (rules 33-39, 47 and 49).
    #[inline]
    pub(super) fn destinations(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> LinkSet {
        let mut left =
            if frame.is_directed() { self.routes_to(frame.target, now) } else { *self.links };
        self.witness.note(Step::Routes, &left);
        self.leave_out_own_path(link, &mut left);
        self.witness.note(Step::OwnPath, &left);
        if left.is_empty() && frame.is_directed() {
            self.witness.count(link, DropReason::NoRoute);
            self.witness.tell(RouterEvent::NoRoute(frame.header.source, frame.target));
        }
        if self.has_sniffers {
            left = left | self.sniffers(now);
            self.leave_out_own_path(link, &mut left);
            self.witness.note(Step::Sniffers, &left);
        }
        if !self.groups.is_empty() {
            left = self.choose_paths(left, frame.header.id == MessageId::HEARTBEAT, now);
            self.witness.note(Step::Paths, &left);
        }
        if !frame.is_directed() {
            self.apply_loop_rule(link, frame.header.source, &mut left, now);
        }
        if frame.header.id == MessageId::SETUP_SIGNING {
            left = self.permit_setup_signing(link, left);
            self.witness.note(Step::SetupSigning, &left);
        }
        left
    }

    fn port(&self, link: LinkId) -> Option<&Port> {
        self.witness.ports().get(link.index())?.as_ref()
    }

    /// A frame from `link` never goes there, nor to the links that lead the same way.
    fn leave_out_own_path(&self, link: LinkId, destinations: &mut LinkSet) {
        match self.group_of(link) {
            Some(group) => *destinations = *destinations - group.links(),
            None => destinations.remove(link),
        }
    }

    fn group_of(&self, link: LinkId) -> Option<&Group> {
        let group = self.port(link).and_then(Port::group)?;
        self.groups.get(usize::from(group.0))
    }

    /// Lets each group choose its paths.
    fn choose_paths(&mut self, candidates: LinkSet, is_heartbeat: bool, now: Time) -> LinkSet {
        let mut chosen = candidates;
        for (number, group) in self.groups.iter_mut().enumerate() {
            let through = candidates & group.links();
            chosen = chosen - group.links();
            if !through.is_empty() {
                let ports = self.witness.ports();
                let quality = |link: LinkId| {
                    ports[link.index()].as_ref().map_or_else(Quality::default, Port::quality)
                };
                chosen = chosen | group.expand(through, is_heartbeat, now, quality);
                if let Some(member) = group.take_change() {
                    // At most 256, as there are no more group numbers.
                    let group = GroupId(number as u8);
                    self.witness.tell(RouterEvent::PathChosen(group, member));
                }
            }
        }
        chosen
    }

    /// The links that are sent everything.
    fn sniffers(&self, now: Time) -> LinkSet {
        match self.options.sniffer {
            Some(system) => *self.sniffers | self.routes_to(Component::new(system, 0), now),
            None => *self.sniffers,
        }
    }

    /// The links that lead to a target (rules 36-38); the target's system is not 0.
    fn routes_to(&self, target: Component, now: Time) -> LinkSet {
        let oldest = self.options.oldest_route(now);
        let mut routes = LinkSet::EMPTY;
        if target.component != 0 {
            routes = self.witness.taught(target);
            if let Some(known) = self.table.find(target) {
                routes.extend(known.routes(oldest));
            }
            if !routes.is_empty() || self.options.strict {
                return routes;
            }
        }
        let of_system = self.table.system(target.system);
        routes.extend(of_system.flat_map(|known| known.routes(oldest)));
        routes
    }

    /// Rule 49: takes out the links that just brought a broadcast of the source, and those that lead
    /// the same way. Not one whose last frame was a copy: whoever sent it may have it from here, and
    /// depend on that. And none for directed frames: their target may be on a way by which the source
    /// is heard.
    fn apply_loop_rule(
        &mut self,
        link: LinkId,
        source: Component,
        destinations: &mut LinkSet,
        now: Time,
    ) {
        let Some(source) = self.table.find(source) else { return };
        for heard in &source.heard {
            if heard.link == link || !just_brought_a_broadcast(heard, now) {
                continue;
            }
            let same_way = self.group_of(heard.link);
            let muted = same_way.map_or_else(|| LinkSet::of(heard.link), Group::links);
            if !(*destinations & muted).is_empty() {
                *destinations = *destinations - muted;
                self.witness.count(heard.link, DropReason::Loop);
                self.witness.note(Step::Loop(heard.link), destinations);
            }
        }
    }

    /// Rule 47: SETUP_SIGNING passes only between links that both allow it.
    fn permit_setup_signing(&mut self, link: LinkId, destinations: LinkSet) -> LinkSet {
        let allows =
            |link: LinkId| self.port(link).is_some_and(|port| port.options.forward_setup_signing);
        let permitted = if allows(link) {
            destinations.iter().filter(|link| allows(*link)).collect()
        } else {
            LinkSet::EMPTY
        };
        if permitted != destinations {
            self.witness.count(link, DropReason::SetupSigning);
        }
        permitted
    }
}

/// And nothing since that came elsewhere before.
fn just_brought_a_broadcast(heard: &Heard, now: Time) -> bool {
    heard.first.is_some_and(|first| now.since(first) < LOOP_WINDOW)
}
