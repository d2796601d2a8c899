//! The picture of one moment, made when somebody asks for it.

use std::cmp::Reverse;
use std::time::Duration;

use super::endpoint::{Endpoint, Past, Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::links::Link;
use super::plan::is_internal;
use crate::mavlink::SplitterStats;
use crate::routing::{DropReason, Heard, KnownComponent, LinkCounters, LinkId, Port, Time};
use crate::status::{
    ComponentStatus, Counters, EndpointState, EndpointStatus, FORMAT, HeardStatus, LinkStatus,
    MessageStatus, Program, QueueStatus, Snapshot,
};

impl Daemon {
    /// What is going on.
    pub(super) fn snapshot(&self) -> Snapshot {
        let ids = self.io.endpoints.ids();
        let endpoints = ids.into_iter().map(|index| self.endpoint_status(index));
        let mut components: Vec<ComponentStatus> =
            self.router.table().components().iter().map(|it| self.component_status(it)).collect();
        components.sort_by_key(|component| (component.system, component.component));
        Snapshot {
            format: FORMAT,
            time_us: self.now.since(Time::ZERO).as_micros() as u64,
            program: Program {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                pid: std::process::id(),
            },
            endpoints: endpoints.collect(),
            components,
            messages: self.message_status(),
            record: self.record_status(),
        }
    }

    fn endpoint_status(&self, index: EndpointId) -> EndpointStatus {
        let endpoint = &self.io.endpoints[index];
        let links = self.links_of(index).into_iter();
        EndpointStatus {
            name: endpoint.name.clone(),
            address: endpoint.config.address.to_string(),
            group: endpoint.options().group.clone(),
            state: endpoint.status(),
            since_ago_ms: self.ago_ms(endpoint.since),
            reason: endpoint.failure.as_ref().map(|failure| failure.text.clone()),
            reconnects: endpoint.openings.saturating_sub(1),
            refused_peers: endpoint.refusals.by_name(),
            links: links.filter_map(|id| self.link_status(id)).collect(),
            past: endpoint.past.counters(),
            is_internal: is_internal(&endpoint.config),
        }
    }

    fn link_status(&self, id: LinkId) -> Option<LinkStatus> {
        let (link, port) = (self.io.links.get(id)?, self.router.port(id)?);
        let has_heard = port.counters().frames_in > 0;
        let round_trip = self.round_trip(id, link);
        let millis = |time: Duration| time.as_secs_f64() * 1e3;
        Some(LinkStatus {
            id: u16::try_from(id.index()).ok()?,
            peer: link.peer.clone(),
            up_ago_ms: self.ago_ms(link.since),
            heard_ago_ms: has_heard.then(|| self.ago_ms(link.last_read)),
            counters: counters(port.counters(), link.splitter.stats()),
            queue: QueueStatus {
                bytes: port.backlog() as u64,
                limit: port.queue_limit() as u64,
                age_ms: port.queue_age(self.now).as_millis() as u64,
            },
            pace: port.rate().map(u64::from),
            loss_percent: loss_percent(port),
            round_trip_ms: round_trip.map(|it| millis(it.smoothed)),
            last_round_trip_ms: round_trip.map(|it| millis(it.last)),
        })
    }

    fn component_status(&self, known: &KnownComponent) -> ComponentStatus {
        ComponentStatus {
            system: known.component.system,
            component: known.component.component,
            vehicle: known.heartbeat.map(Into::into),
            heard: known.heard.iter().filter_map(|heard| self.heard_status(heard)).collect(),
        }
    }

    fn heard_status(&self, heard: &Heard) -> Option<HeardStatus> {
        let Link { endpoint, .. } = self.io.links.get(heard.link)?;
        let age = self.general.router.route_age;
        let is_fresh = age.is_none_or(|age| self.now.since(heard.last) <= age);
        Some(HeardStatus {
            endpoint: self.io.endpoints[*endpoint].name.clone(),
            link: u16::try_from(heard.link.index()).ok()?,
            heard_ago_ms: self.ago_ms(heard.last),
            is_route: heard.is_route && is_fresh,
            frames: heard.sequence.received,
            lost: heard.sequence.lost,
        })
    }

    /// The most frequent first.
    fn message_status(&self) -> Vec<MessageStatus> {
        let name = |id| self.checker.dialect().by_id(id).map(|it| it.name.to_string());
        let tallies = self.router.tallies().map(|tally| MessageStatus {
            system: tally.source.system,
            component: tally.source.component,
            id: tally.id.0,
            name: name(tally.id),
            frames: tally.frames,
            bytes: tally.bytes,
        });
        let mut messages: Vec<MessageStatus> = tallies.collect();
        messages.sort_by_key(|it| (Reverse(it.frames), it.system, it.component, it.id));
        messages
    }

    fn ago_ms(&self, at: Time) -> u64 {
        self.now.since(at).as_millis() as u64
    }
}

impl Endpoint {
    /// How far it is, for those who look on.
    fn status(&self) -> EndpointState {
        match &self.state {
            _ if !self.options().enabled => EndpointState::Disabled,
            State::Waiting if self.is_given_up() => EndpointState::GivenUp,
            State::Waiting => EndpointState::Waiting,
            State::Resolving => EndpointState::Resolving,
            State::Opening | State::Connecting(..) => EndpointState::Connecting,
            State::Listening(..) => EndpointState::Listening,
            State::Datagrams(port) => match port.role {
                Role::Server(_) => EndpointState::Listening,
                Role::Sender { .. } | Role::Shared { .. } => EndpointState::Up,
            },
            State::Up(_) => EndpointState::Up,
        }
    }
}

impl Past {
    fn counters(&self) -> Counters {
        counters(&self.router, self.splitter)
    }
}

fn counters(router: &LinkCounters, splitter: SplitterStats) -> Counters {
    let refused = DropReason::ALL.into_iter().filter(|reason| router[*reason] > 0);
    Counters {
        frames_in: router.frames_in,
        bytes_in: router.bytes_in,
        frames_out: router.frames_out,
        bytes_out: router.bytes_out,
        garbage_bytes: splitter.skipped_bytes,
        bad_crc: splitter.damaged,
        unknown_flags: splitter.incompatible,
        refused: refused.map(|reason| (reason.name().to_owned(), router[reason])).collect(),
    }
}

fn loss_percent(port: &Port) -> Option<f64> {
    let quality = port.quality();
    quality.last_carried.map(|_| f64::from(quality.loss) * 100.0 / 1_024.0)
}
