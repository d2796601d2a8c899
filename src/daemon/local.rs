//! Links inside the program: their frames are handed over instead of sent, and what the other side
//! has to say is asked for instead of read. [`LocalPeer`] is the contract.
//!
//! Such a link belongs to an endpoint like any other: to one that the user configured, or to one
//! that the program adds for itself and no reload touches.

use std::time::Duration;

use super::endpoint::{Failure, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Ready};
use super::links::{Link, Output};
use super::open::OpenError;
use super::settings::Settings;
use super::timers::Timer;
use crate::config::{Address, EndpointConfig, EndpointOptions};
use crate::mavlink::{Frame, Input, MAX_FRAME, MessageId};
use crate::routing::{FilterLists, GateOptions, LinkId, LocalPeer, Port, Precedence, Time};
use crate::sim::Swarm;

/// How much a peer may say in one turn, in bytes; what goes beyond is said in the next.
const TURN: usize = 32 * 1_024;

/// How much is said at once, before it is routed.
const BREATH: usize = 4 * 1_024;

/// How long a connection that takes nothing is waited for by who can wait.
const PATIENCE: Duration = Duration::from_secs(1);

/// The side of a link that stays inside.
#[derive(Debug)]
pub(super) struct LocalOutput {
    peer: Box<dyn LocalPeer>,
    /// When [`Timer::Local`] has something to do.
    deadline: Option<Time>,
}

impl LocalOutput {
    /// A link to this peer, who has said nothing yet.
    pub(super) fn new(peer: Box<dyn LocalPeer>) -> Self {
        Self { peer, deadline: None }
    }

    /// Hands over what waits and may leave now; says whether that was anything.
    pub(super) fn hand_over(&mut self, port: &mut Port, now: Time) -> bool {
        let mut joined = [0; MAX_FRAME];
        let mut has_heard = false;
        while port.sendable(now) > 0
            && let Some((first, second)) = port.frames().next()
        {
            let len = first.len() + second.len();
            joined[..first.len()].copy_from_slice(first);
            joined[first.len()..len].copy_from_slice(second);
            port.consume(len);
            if let Ok(frame) = Frame::parse(&joined[..len]) {
                self.peer.handle_frame(&frame, now);
                has_heard = true;
            }
        }
        has_heard
    }
}

/// How a peer stopped talking.
enum Pause {
    /// It has said all that it has to say for now.
    Silence,
    /// It could go on, but its turn is over.
    TurnOver,
    /// It waits for room in the queues of others.
    NoRoom,
}

impl Daemon {
    /// Opens the link of an endpoint whose other side is inside.
    ///
    /// # Errors
    ///
    /// If there are too many links.
    pub(super) fn open_local(
        &mut self,
        index: EndpointId,
        description: &str,
        peer: Box<dyn LocalPeer>,
    ) -> Result<LinkId, OpenError> {
        let action = || format!("add {description}");
        let output = Output::Local(LocalOutput::new(peer));
        let Ok(link) = self.add_link(index, description.to_owned(), output) else {
            let error = std::io::Error::other("too many links");
            return Err(OpenError { action: action(), error });
        };
        self.set_open(index, State::Up(link));
        self.ready.push(Ready::Link(link));
        Ok(link)
    }

    /// Lets the vehicles of an endpoint start.
    pub(super) fn open_sim(&mut self, index: EndpointId) -> Result<(), OpenError> {
        let options = self.io.endpoints[index].options().sim;
        let swarm = Box::new(Swarm::new(options, self.now));
        self.open_local(index, &options.to_string(), swarm).map(drop)
    }

    /// Adds a part of the program itself, with an endpoint that no configuration names, and its link; `None` if
    /// there are too many links or endpoints.
    ///
    /// It stays until [`Daemon::remove_endpoint`].
    pub(super) fn add_internal(
        &mut self,
        name: &'static str,
        options: EndpointOptions,
        hears: &[MessageId],
        peer: Box<dyn LocalPeer>,
    ) -> Option<(EndpointId, LinkId)> {
        let settings = Settings {
            config: EndpointConfig { address: Address::Internal(name), options },
            filter_in: FilterLists::default(),
            filter_out: FilterLists { allow_messages: hears.to_vec(), ..FilterLists::default() },
            caps: Vec::new(),
            gate: GateOptions::default(),
        };
        let index = self.insert_endpoint(settings)?;
        let Ok(link) = self.open_local(index, name, peer) else {
            self.remove_endpoint(index, "there are too many links");
            return None;
        };
        Some((index, link))
    }

    /// Routes what the other side of a link inside the program has to say.
    pub(super) fn receive_local(&mut self, id: LinkId) {
        self.held_back.remove(id);
        let pause = self.listen_to_local(id);
        let now = self.now;
        let Some((local, endpoint)) = self.local(id) else { return };
        let timeout = local.peer.poll_timeout();
        let timeout = match pause {
            Pause::Silence => {
                if let Some(reason) = local.peer.ended() {
                    let (reason, has_failed) = (reason.to_owned(), local.peer.has_failed());
                    return self.end_local(id, endpoint, &reason, has_failed);
                }
                timeout
            }
            Pause::TurnOver => return self.ask_next_turn(id),
            Pause::NoRoom => {
                self.held_back.insert(id);
                let at = now + PATIENCE;
                Some(timeout.map_or(at, |timeout| timeout.min(at)))
            }
        };
        self.set_local_deadline(id, timeout);
    }

    /// Lets a peer say as much as it may in one turn.
    fn listen_to_local(&mut self, id: LinkId) -> Pause {
        let mut out = std::mem::take(&mut self.spoken);
        let mut said = 0;
        let pause = loop {
            out.clear();
            if let Some(pause) = self.ask_local(id, &mut out) {
                break pause;
            }
            self.inbox.stream_buffer()[..out.len()].copy_from_slice(&out);
            self.route(id, 0, out.len(), Input::Paused);
            said += out.len();
            if said >= TURN {
                break Pause::TurnOver;
            }
        };
        self.spoken = out;
        pause
    }

    /// Has a peer say what has its time, or else one frame that can wait; if it says nothing, tells
    /// why.
    fn ask_local(&mut self, id: LinkId, out: &mut Vec<u8>) -> Option<Pause> {
        let now = self.now;
        let Some((local, _)) = self.local(id) else { return Some(Pause::Silence) };
        while out.len() < BREATH && local.peer.poll_transmit(now, out) {}
        if !out.is_empty() {
            return None;
        }
        let Some(wanted) = local.peer.bulk(now) else { return Some(Pause::Silence) };
        if !self.has_room_beside(id, wanted) {
            return Some(Pause::NoRoom);
        }
        let (local, _) = self.local(id)?;
        let has_said = local.peer.poll_bulk(now, out);
        (!has_said).then_some(Pause::Silence)
    }

    /// Whether all other links would take a frame of any length now, but for those that take
    /// nothing at all.
    fn has_room_beside(&self, speaker: LinkId, precedence: Precedence) -> bool {
        let is_stuck = |id: LinkId| match self.io.links.get(id).map(|link| &link.output) {
            Some(Output::Stream(output)) => {
                output.blocked_since.is_some_and(|since| self.now.since(since) >= PATIENCE)
            }
            _ => false,
        };
        let has_room =
            |id: LinkId| self.router.port(id).is_none_or(|port| port.has_room(precedence));
        let links = self.router.links();
        links.iter().all(|id| id == speaker || has_room(id) || is_stuck(id))
    }

    fn local(&mut self, id: LinkId) -> Option<(&mut LocalOutput, EndpointId)> {
        let link = self.io.links.get_mut(id)?;
        let Link { output: Output::Local(local), endpoint, .. } = link else { return None };
        Some((local, *endpoint))
    }

    fn set_local_deadline(&mut self, id: LinkId, timeout: Option<Time>) {
        let Some((local, _)) = self.local(id) else { return };
        if let Some(at) = timeout
            && local.deadline.is_none_or(|set| set > at)
        {
            local.deadline = Some(at);
            self.timers.set(at, Timer::Local(id));
        }
    }

    /// The time of a peer has come.
    pub(super) fn handle_local_deadline(&mut self, id: LinkId) {
        let now = self.now;
        let Some((local, _)) = self.local(id) else { return };
        if local.deadline.is_some_and(|deadline| deadline <= now) {
            local.deadline = None;
            self.receive_local(id);
        }
    }

    /// At the end of a turn: whoever was told something, or has room now, is asked in the next.
    pub(super) fn ask_local_peers(&mut self) {
        let mut asked = std::mem::take(&mut self.io.addressed);
        let (held_back, now) = (self.held_back, self.now);
        for id in held_back.iter() {
            let wanted = self.local(id).and_then(|(local, _)| local.peer.bulk(now));
            if wanted.is_none_or(|wanted| self.has_room_beside(id, wanted)) {
                asked.insert(id);
            }
        }
        asked.iter().for_each(|id| self.ask_next_turn(id));
    }

    fn ask_next_turn(&mut self, id: LinkId) {
        if !self.ready.contains(&Ready::Link(id)) {
            self.ready.push(Ready::Link(id));
        }
    }

    /// A peer has come to its end, and is not opened again.
    fn end_local(&mut self, id: LinkId, endpoint: EndpointId, reason: &str, has_failed: bool) {
        let now = self.now;
        if has_failed {
            self.warn(endpoint, reason);
        }
        let ended = &mut self.io.endpoints[endpoint];
        ended.set_state(State::Waiting, now);
        ended.deadline = None;
        ended.failure = Some(Failure { text: reason.to_owned(), may_pass: false });
        self.close_later(id, reason);
    }
}

// What is said at once stands in the buffer of a stream, which is somewhat below 64 KiB.
const _: () = assert!(BREATH + MAX_FRAME < 60 * 1_024);

#[cfg(test)]
mod tests;
