//! What the log tells of routing: components that come and go, and what a link carried.

use tracing::{Level, debug, info, warn};

use super::endpoint::Endpoint;
use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::links::Link;
use super::log_limit::{LeftOut, Topic};
use super::timers::Timer;
use crate::routing::{DropReason, GroupId, LinkId, RouterEvent};

impl Daemon {
    /// Tells what happened in the router since the last turn.
    pub(super) fn report_events(&mut self) {
        while let Some(event) = self.router.poll_event() {
            let limit = match event {
                RouterEvent::NoRoute(..) => &mut self.unrouted_log,
                RouterEvent::Refused(..) => &mut self.refusal_log,
                _ => &mut self.component_log,
            };
            if let Some(left_out) = limit.permit(self.now) {
                self.report_event(event, &LeftOut(left_out));
            }
        }
    }

    fn report_event(&self, event: RouterEvent, left_out: &LeftOut) {
        match event {
            RouterEvent::ComponentSeen(component, link) => {
                info!("component {component} seen on {}{left_out}", self.describe(link));
            }
            RouterEvent::ComponentLost(component) => {
                info!("component {component} lost{left_out}");
            }
            RouterEvent::ComponentRestarted(component, link) => {
                info!("component {component} restarted on {}{left_out}", self.describe(link));
            }
            RouterEvent::InvalidSource(component, link) => {
                let name = self.describe(link);
                warn!(
                    "frames from {component} on {name}: 0 is nobody, so answers cannot find it \
                     (set its system and component id, as source_component in pymavlink){left_out}"
                );
            }
            RouterEvent::NoRoute(source, target) => {
                debug!("no route to {target}, asked by {source}{left_out}");
            }
            RouterEvent::Refused(source, link, reason) => {
                let (name, why) = (self.describe(link), refusal(reason));
                warn!("frames from {source} on {name} are refused: {why}{left_out}");
            }
            RouterEvent::PathChosen(group, member) => self.report_path(group, member, left_out),
        }
    }

    fn report_path(&self, group: GroupId, member: Option<u16>, left_out: &LeftOut) {
        let mut endpoints = self.io.endpoints.iter();
        let is_its = |endpoint: &&Endpoint| endpoint.membership.is_some_and(|m| m.group == group);
        let group = endpoints.find(is_its).and_then(|endpoint| endpoint.options().group.clone());
        let group = group.unwrap_or_default();
        match member.and_then(|member| self.io.endpoints.id_at(member)) {
            Some(index) => {
                let name = &self.io.endpoints[index].name;
                info!("group {group}: sending over {name} now{left_out}");
            }
            None => info!("group {group}: no path is good; sending over all{left_out}"),
        }
    }

    fn describe(&self, id: LinkId) -> String {
        let link = self.io.links.get(id);
        let name = link.map_or("?", |link| &self.io.endpoints[link.endpoint].name);
        format!("{name} ({id})")
    }

    /// Tells what each link carried.
    pub(super) fn report_links(&self) {
        for id in self.router.links().iter() {
            if let Some(link) = self.io.links.get(id) {
                self.report_link(id, link);
            }
        }
    }

    /// Tells what a link carried.
    pub(super) fn report_link(&self, id: LinkId, link: &Link) {
        let Some(counters) = self.router.counters(id) else {
            return;
        };
        let stats = link.splitter.stats();
        let name = &self.io.endpoints[link.endpoint].name;
        debug!(
            "{name}: link {id} ({}) carried {} frames in ({} B; {} damaged, {} B of garbage) \
             and {} out ({} B; {} refused); {} found no route",
            link.peer,
            counters.frames_in,
            counters.bytes_in,
            stats.damaged + stats.incompatible,
            stats.skipped_bytes,
            counters.frames_out,
            counters.bytes_out,
            counters[DropReason::QueueFull],
            counters[DropReason::NoRoute],
        );
    }

    /// Tells how an endpoint is getting on.
    pub(super) fn tell(&mut self, index: EndpointId, text: &str) {
        self.say(index, Level::INFO, Topic::State, text);
    }

    /// Warns of something about an endpoint.
    pub(super) fn warn(&mut self, index: EndpointId, text: &str) {
        self.say(index, Level::WARN, Topic::State, text);
    }

    /// Writes a line about an endpoint, or leaves it out, for the time being or for good.
    pub(super) fn say(&mut self, index: EndpointId, level: Level, topic: Topic, text: &str) {
        let Endpoint { log, name, .. } = &mut self.io.endpoints[index];
        let limit = log.of(topic);
        if let Some(left_out) = limit.permit(self.now) {
            write(level, name, text, left_out);
            // The later word stands.
            if topic == Topic::State {
                log.unsaid = None;
            }
        } else if topic == Topic::State {
            let at = limit.next();
            if log.unsaid.replace((level, text.to_owned())).is_none() {
                self.timers.set(at, Timer::Log(index));
            }
        }
    }

    /// Says what had to wait, if nothing was said since.
    pub(super) fn say_last_word(&mut self, index: EndpointId) {
        let Some(endpoint) = self.io.endpoints.get_mut(index) else { return };
        let Endpoint { log, name, .. } = endpoint;
        let Some((level, text)) = log.unsaid.take() else { return };
        match log.of(Topic::State).permit(self.now) {
            // It has been counted as left out itself.
            Some(left_out) => write(level, name, &text, left_out.saturating_sub(1)),
            None => {
                let at = log.of(Topic::State).next();
                log.unsaid = Some((level, text));
                self.timers.set(at, Timer::Log(index));
            }
        }
    }
}

/// Why frames are refused, and what to do about it.
fn refusal(reason: DropReason) -> &'static str {
    match reason {
        DropReason::Unsigned => {
            "not signed (switch signing on there, or name them in allow_unsigned)"
        }
        DropReason::WrongSignature => "signed with another key than that of `verify`",
        DropReason::Replayed => {
            "not newer than what came before: sent again, or by two with one link id"
        }
        DropReason::TooOld => "signed more than 60 s ago (set the clock there)",
        DropReason::TooManyStreams => "more signing streams than are remembered",
        _ => "",
    }
}

fn write(level: Level, name: &str, text: &str, left_out: u64) {
    let left_out = LeftOut(left_out);
    if level == Level::WARN {
        warn!("{name}: {text}{left_out}");
    } else {
        info!("{name}: {text}{left_out}");
    }
}
