//! Endpoints come, go and change while the loop runs. Only between two turns: then no event names
//! anything that is to go.

use std::time::Duration;

use tracing::{info, warn};

use super::endpoint::{Answerer, Endpoint, Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Ready};
use super::links::Output;
use super::settings::Settings;
use super::timers::Timer;
use crate::config::{Difference, EndpointOptions, MAX_ENDPOINTS};
use crate::link::{Backoff, Stream, tune};
use crate::routing::LinkId;

impl Daemon {
    /// Takes an endpoint in, not yet open; `None` if there are [`MAX_ENDPOINTS`] already.
    pub(super) fn insert_endpoint(&mut self, settings: Settings) -> Option<EndpointId> {
        let index = self.io.endpoints.insert(Endpoint::new(settings, self.now))?;
        self.join_group(index);
        Some(index)
    }

    /// Takes endpoints in and opens them. One that cannot be opened is tried again later; one too
    /// many is told of and left out.
    pub(super) fn add_endpoints(&mut self, new: impl Iterator<Item = Settings>) {
        let mut added = Vec::new();
        for settings in new {
            let name = settings.config.name();
            match self.insert_endpoint(settings) {
                Some(index) => added.push(index),
                None => warn!("{name}: not added: there are {MAX_ENDPOINTS} endpoints already"),
            }
        }
        // Only when all are there: a server at [::] leaves IPv4 to who asks for it.
        for index in added {
            if let Err(failure) = self.open(index) {
                self.try_later(index, failure);
            }
        }
    }

    /// Closes an endpoint with all its links, and forgets it.
    pub(super) fn remove_endpoint(&mut self, index: EndpointId, reason: &str) {
        if self.io.endpoints.get(index).is_none() {
            return;
        }
        self.close_endpoint(index, reason);
        self.ready.retain(|ready| *ready != Ready::Endpoint(index));
        let gone = self.io.endpoints.remove(index);
        if gone.is_some_and(|endpoint| endpoint.membership.is_some()) {
            self.set_groups();
        }
    }

    /// Closes the sockets of an endpoint and then its links, so that none of them comes back.
    pub(super) fn close_endpoint(&mut self, index: EndpointId, reason: &str) {
        let links = self.links_of(index);
        let now = self.now;
        self.io.endpoints[index].set_state(State::Waiting, now);
        for link in links {
            self.close_link(link, reason);
        }
    }

    /// Gives an endpoint other settings, under its links. They must be such that it can become so
    /// while it is open; see [`crate::config::EndpointConfig::can_become`].
    ///
    /// Says whether they are others at all.
    pub(super) fn change_endpoint(&mut self, index: EndpointId, settings: Settings) -> bool {
        let Some(endpoint) = self.io.endpoints.get_mut(index) else { return false };
        let before = endpoint.config.clone();
        debug_assert!(before.can_become(&settings.config));
        let differences = before.differences(&settings.config);
        let baud = endpoint.baud_in_use();
        if !differences.is_empty() {
            info!("{}: changed: {}", before.name(), list(&differences));
        }
        if !endpoint.set(settings) {
            return false;
        }
        self.join_group(index);
        if differences.iter().any(|difference| difference.key == "baudrate") {
            self.change_bauds(index, baud);
        }
        self.change_links(index);
        if differences.iter().any(|difference| difference.key == "allow_from") {
            self.close_outsiders(index);
        }
        self.change_timeouts(index, &before.options);
        self.change_enabled(index, before.options.enabled);
        true
    }

    /// Opens an endpoint that is switched on, and closes one that is switched off.
    fn change_enabled(&mut self, index: EndpointId, before: bool) {
        let endpoint = &mut self.io.endpoints[index];
        match (before, endpoint.options().enabled) {
            (true, false) => {
                self.close_endpoint(index, "switched off");
                let endpoint = &mut self.io.endpoints[index];
                (endpoint.deadline, endpoint.failure) = (None, None);
                (endpoint.since, endpoint.is_missed) = (self.now, false);
                // Who switches it on again wants to hear once more why it does not open.
                endpoint.told = None;
                endpoint.forget_addresses();
            }
            (false, true) => {
                endpoint.since = self.now;
                if let Err(failure) = self.open(index) {
                    self.try_later(index, failure);
                }
            }
            _ => {}
        }
    }

    /// All links of an endpoint.
    pub(super) fn links_of(&self, index: EndpointId) -> Vec<LinkId> {
        let links = self.router.links();
        let is_its =
            |link: &LinkId| self.io.links.get(*link).is_some_and(|link| link.endpoint == index);
        links.iter().filter(is_its).collect()
    }

    /// Tells the router what the options of an endpoint mean for its links.
    pub(super) fn change_links(&mut self, index: EndpointId) {
        let endpoint = &mut self.io.endpoints[index];
        if let State::Datagrams(port) = &mut endpoint.state
            && let Role::Shared { answerer, .. } = &mut port.role
            && !endpoint.config.options.sticky
        {
            *answerer = Answerer::default();
        }
        let options = self.link_options(index);
        for id in self.links_of(index) {
            self.router.set_link_options(id, options.clone(), self.now);
            if let Some(link) = self.io.links.get_mut(id) {
                // At another pace, it is ready at another time; that is set after the next flush.
                link.pace_deadline = None;
            }
            self.ask_for_proof(id);
        }
    }

    /// Makes new timeouts hold for the links that are there.
    fn change_timeouts(&mut self, index: EndpointId, before: &EndpointOptions) {
        let endpoint = &mut self.io.endpoints[index];
        let options = &endpoint.config.options;
        let patience = options.stall_timeout;
        let begins_anew = options.enabled
            && options.retry != before.retry
            && matches!(endpoint.state, State::Waiting);
        if options.retry != before.retry {
            endpoint.backoff = Backoff::up_to(options.retry);
        }
        if options.peer_timeout != before.peer_timeout
            && let State::Datagrams(port) = &mut endpoint.state
            && let Role::Server(peers) = &mut port.role
            && peers.deadline.is_some()
        {
            peers.deadline = Some(self.now);
            self.timers.set(self.now, Timer::Peers(index));
        }
        if begins_anew {
            self.set_deadline(index, Duration::ZERO);
        }
        if patience != before.stall_timeout {
            for id in self.links_of(index) {
                let Some(link) = self.io.links.get_mut(id) else { continue };
                if let Output::Stream(output) = &link.output
                    && let Stream::Tcp(stream) = &output.stream
                {
                    // One that refuses is about to break.
                    let _ = tune(stream, patience);
                }
                link.stall_deadline = None;
                self.set_stall_timer(id);
            }
        }
    }

    /// Gives an endpoint its place in the group that it names now.
    fn join_group(&mut self, index: EndpointId) {
        let membership = self.io.endpoints.membership_of(index);
        let before = std::mem::replace(&mut self.io.endpoints[index].membership, membership);
        if membership != before {
            self.set_groups();
        }
    }

    /// Tells the router which groups there are.
    pub(super) fn set_groups(&mut self) {
        let groups = self.io.endpoints.groups();
        self.router.set_groups(&groups);
    }
}

/// The keys, with commas between.
pub(super) fn list(differences: &[Difference]) -> String {
    let keys: Vec<&str> = differences.iter().map(|difference| difference.key).collect();
    keys.join(", ")
}
