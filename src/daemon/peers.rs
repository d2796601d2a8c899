//! Links come and go: admitted, accepted, expired, closed.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use super::endpoint::{Endpoint, Peers, Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Meaning, Ready};
use super::links::{Link, Output, StreamOutput};
use super::log_limit::Topic;
use super::timers::Timer;
use super::transmit::UNLESS_FULL;
use crate::link::{Stream, tune};
use crate::mavlink::{CheckedFrame, Refusal};
use crate::routing::{LinkId, MAX_LINKS};
use mio::event::Source;
use mio::net::TcpStream;
use tracing::Level;

/// What became of a stranger.
#[derive(Clone, Copy, Debug)]
pub(super) enum Admission {
    /// It has sent no verified frame yet.
    Unproven,
    /// Nothing that it has sent so far was signed as it must be; why the last was not believed.
    Unbelieved(Refusal),
    /// It has a link now.
    Peer(LinkId),
    /// There is no room for it.
    Refused,
}

/// A peer that is silent for so long may make room for a new one.
const REPLACEABLE_AFTER: Duration = Duration::from_secs(10);

/// How many connections are accepted in one turn.
const ACCEPTS: usize = 64;

/// When accepting is tried again after the system had no descriptors left.
pub(super) const ACCEPT_AGAIN: Duration = Duration::from_millis(500);

impl Daemon {
    /// Makes a link and tells of it; gives `output` back if there are too many.
    pub(super) fn add_link(
        &mut self,
        endpoint: EndpointId,
        peer: String,
        output: Output,
    ) -> Result<LinkId, Output> {
        let options = self.link_options(endpoint);
        let Some(id) = self.router.add_link(options, self.now) else { return Err(output) };
        self.say(endpoint, Level::INFO, self.topic(endpoint), &format!("link {id} up: {peer}"));
        let link = Link::new(endpoint, peer, output, self.now);
        self.io.links.insert(id, link);
        // Its endpoint counts it for as long as it is there, however it ends.
        if let State::Listening(_, count) = &mut self.io.endpoints[endpoint].state {
            *count += 1;
        }
        Ok(id)
    }

    /// Makes a link of a stream that is open.
    ///
    /// # Errors
    ///
    /// If the system refuses to watch it, or if there are too many links.
    pub(super) fn add_stream(
        &mut self,
        endpoint: EndpointId,
        peer: String,
        stream: Stream,
    ) -> io::Result<LinkId> {
        let output = Output::Stream(StreamOutput::new(stream));
        let id = self.add_link(endpoint, peer, output).map_err(|output| {
            self.discard(output);
            io::Error::other("too many links")
        })?;
        if let Some(Link { output: Output::Stream(output), .. }) = self.io.links.get_mut(id) {
            let token = Meaning::Link(id).token();
            if let Err(error) = output.stream.register(self.poll.registry(), token, UNLESS_FULL) {
                self.close_link(id, &error.to_string());
                return Err(error);
            }
        }
        Ok(id)
    }

    /// Makes a peer of somebody who sent such a frame to a UDP server, if the server is to believe it.
    pub(super) fn admit_by(
        &mut self,
        index: EndpointId,
        source: SocketAddr,
        frame: &CheckedFrame<'_>,
    ) -> Admission {
        let Endpoint { gate, membership, .. } = &self.io.endpoints[index];
        if let Err(why) = self.router.would_let_in(gate, *membership, frame, self.now) {
            return Admission::Unbelieved(why);
        }
        self.admit_peer(index, source)
    }

    /// Makes a peer of somebody who sent a verified frame to a UDP server.
    pub(super) fn admit_peer(&mut self, index: EndpointId, source: SocketAddr) -> Admission {
        if !self.has_room_for_peer(index) {
            self.refuse_surplus(index, source);
            return Admission::Refused;
        }
        let output = Output::Datagrams(source);
        let Ok(link) = self.add_link(index, plain(source).to_string(), output) else {
            let reason = format!("there are {MAX_LINKS} links already");
            self.refuse(index, source, &reason);
            return Admission::Refused;
        };
        let endpoint = &mut self.io.endpoints[index];
        let timeout = endpoint.options().peer_timeout;
        if let State::Datagrams(port) = &mut endpoint.state
            && let Role::Server(peers) = &mut port.role
        {
            peers.insert(source, link);
            if peers.deadline.is_none() {
                peers.deadline = Some(self.now + timeout);
                self.timers.set(self.now + timeout, Timer::Peers(index));
            }
        }
        Admission::Peer(link)
    }

    /// Whether a UDP server takes one more, if need be in place of one that has fallen silent.
    fn has_room_for_peer(&mut self, index: EndpointId) -> bool {
        let endpoint = &self.io.endpoints[index];
        let max_peers = usize::from(endpoint.options().max_peers);
        let State::Datagrams(port) = &endpoint.state else {
            return false;
        };
        let Role::Server(peers) = &port.role else {
            return false;
        };
        if peers.links.len() < max_peers {
            return true;
        }
        let Some((silent_for, oldest)) = self.most_silent(peers) else {
            return false;
        };
        if silent_for >= REPLACEABLE_AFTER {
            self.close_link(oldest, "silent, and another one needs its place");
            return true;
        }
        false
    }

    fn most_silent(&self, peers: &Peers) -> Option<(Duration, LinkId)> {
        let silence = |id: &LinkId| {
            let link = self.io.links.get(*id)?;
            Some((self.now.since(link.last_read), *id))
        };
        peers.links.values().filter_map(silence).max()
    }

    /// What it is about when a link of an endpoint comes or goes.
    fn topic(&self, endpoint: EndpointId) -> Topic {
        if self.io.endpoints[endpoint].is_server() { Topic::Peer } else { Topic::State }
    }

    /// Closes the peers of a UDP server that were silent for too long.
    pub(super) fn expire_peers(&mut self, index: EndpointId) {
        let Some(endpoint) = self.io.endpoints.get(index) else { return };
        let timeout = endpoint.options().peer_timeout;
        let State::Datagrams(port) = &endpoint.state else { return };
        let Role::Server(peers) = &port.role else { return };
        if peers.deadline.is_none_or(|deadline| deadline > self.now) {
            return;
        }
        let last_read = |id: &LinkId| Some((*id, self.io.links.get(*id)?.last_read));
        let (expired, alive): (Vec<_>, Vec<_>) = port
            .links()
            .iter()
            .filter_map(last_read)
            .partition(|(_, last_read)| self.now.since(*last_read) >= timeout);
        let next = alive.iter().map(|(_, last_read)| *last_read + timeout).min();
        for (link, _) in expired {
            self.close_link(link, &format!("silent for {} s", timeout.as_secs_f32()));
        }
        if let State::Datagrams(port) = &mut self.io.endpoints[index].state
            && let Role::Server(peers) = &mut port.role
        {
            peers.deadline = next;
        }
        if let Some(next) = next {
            self.timers.set(next, Timer::Peers(index));
        }
    }

    /// Takes the connections that wait at TCP servers.
    pub(super) fn accept_all(&mut self) {
        for index in std::mem::take(&mut self.accepting) {
            if self.io.endpoints.get(index).is_some() {
                self.accept(index);
            }
        }
    }

    fn accept(&mut self, index: EndpointId) {
        for _ in 0..ACCEPTS {
            if self.will_have_room(index) {
                break;
            }
            let State::Listening(listener, _) = &self.io.endpoints[index].state else {
                return;
            };
            match next_caller(|| listener.accept()) {
                Ok(Some((stream, peer))) => self.handle_connection(index, stream, plain(peer)),
                Ok(None) => return,
                Err(error) => return self.accept_later(index, &error),
            }
        }
        self.ready.push(Ready::Endpoint(index));
    }

    /// Whether a TCP server is full, and a client that has hung up is still being read: whoever
    /// waits may be the same one, who calls again.
    fn will_have_room(&self, index: EndpointId) -> bool {
        let endpoint = &self.io.endpoints[index];
        let State::Listening(_, count) = &endpoint.state else { return false };
        let is_ending = |ready: &Ready| {
            let Ready::Link(id) = ready else { return false };
            let link = self.io.links.get(*id).filter(|link| link.endpoint == index);
            link.is_some_and(|link| match &link.output {
                Output::Stream(output) => output.read_closed,
                Output::Datagrams(_) | Output::Local(_) => false,
            })
        };
        *count >= usize::from(endpoint.options().max_peers) && self.ready.iter().any(is_ending)
    }

    fn handle_connection(&mut self, index: EndpointId, stream: TcpStream, peer: SocketAddr) {
        if self.sends_away(index, peer) {
            // Dropped, and so closed.
            return;
        }
        let options = self.io.endpoints[index].options();
        let (max_peers, patience) = (usize::from(options.max_peers), options.stall_timeout);
        let State::Listening(_, count) = &self.io.endpoints[index].state else {
            return;
        };
        if *count >= max_peers && !self.replace_unproven(index) {
            return self.refuse_surplus(index, peer);
        }
        let added = tune(&stream, patience)
            .and_then(|()| self.add_stream(index, peer.to_string(), Stream::Tcp(stream)));
        match added {
            Ok(link) => {
                self.io.endpoints[index].is_refusing = false;
                self.ask_for_proof(link);
            }
            Err(error) => self.refuse(index, peer, &error.to_string()),
        }
    }

    /// No descriptors, no memory: connections wait until there are some again.
    fn accept_later(&mut self, index: EndpointId, error: &io::Error) {
        if !std::mem::replace(&mut self.io.endpoints[index].is_refusing, true) {
            self.warn(index, &format!("cannot accept a connection: {error}; trying again"));
        }
        self.set_deadline(index, ACCEPT_AGAIN);
    }

    /// Marks a link as broken; it is closed at the end of the turn.
    pub(super) fn close_later(&mut self, id: LinkId, reason: &str) {
        self.io.closing.push((id, reason.to_owned()));
    }

    /// Closes what broke in this turn.
    pub(super) fn close_broken(&mut self) {
        // In the order in which it was noticed: the first reason is what broke it.
        for (link, reason) in std::mem::take(&mut self.io.closing) {
            self.close_link(link, &reason);
        }
    }

    /// Closes a link, tells of it, and sees to it that its endpoint goes on.
    pub(super) fn close_link(&mut self, id: LinkId, reason: &str) {
        let Some(mut link) = self.io.links.remove(id) else {
            return;
        };
        let log = &mut self.io.endpoints[link.endpoint].log;
        if tracing::enabled!(Level::DEBUG) && log.of(Topic::Detail).permit(self.now).is_some() {
            self.report_link(id, &link);
        }
        let heard = self.keep_counts(id, &link);
        self.router.remove_link(id);
        // Who gets its number next has nothing to do with what broke it.
        self.io.closing.retain(|(closing, _)| *closing != id);
        self.unfinished.remove(id);
        self.held_back.remove(id);
        self.ready.retain(|ready| *ready != Ready::Link(id));
        if let Output::Stream(output) = &mut link.output {
            // Closing it would do; this keeps the system from telling of it once more.
            let _ = output.stream.deregister(self.poll.registry());
        }
        self.discard(link.output);
        self.tell_closed(link.endpoint, id, reason);
        self.handle_closed(link.endpoint, id, heard);
    }

    /// What a link counted stays with its endpoint; says whether it brought any frame.
    fn keep_counts(&mut self, id: LinkId, link: &Link) -> bool {
        let Some(counters) = self.router.counters(id) else { return false };
        let past = &mut self.io.endpoints[link.endpoint].past;
        past.router += counters;
        past.splitter += link.splitter.stats();
        counters.frames_in > 0
    }

    /// Tells that a link is gone, and of one that will come again also that.
    fn tell_closed(&mut self, index: EndpointId, id: LinkId, reason: &str) {
        let endpoint = &mut self.io.endpoints[index];
        let text = match endpoint.state {
            State::Up(link) if link == id => {
                endpoint.is_missed = true;
                format!("link {id} down: {reason}; waiting for it")
            }
            _ => format!("link {id} down: {reason}"),
        };
        self.say(index, Level::INFO, self.topic(index), &text);
    }
}

/// The same address as IPv4, where it is that in the clothes of IPv6.
pub(super) fn plain(address: SocketAddr) -> SocketAddr {
    match address {
        SocketAddr::V6(v6) => match v6.ip().to_canonical() {
            IpAddr::V4(ip) => SocketAddr::new(ip.into(), v6.port()),
            IpAddr::V6(_) => address,
        },
        SocketAddr::V4(_) => address,
    }
}

/// The next of those who wait to be accepted; `None` if nobody does.
///
/// # Errors
///
/// If there are no descriptors or no memory for it: nothing tells when there are some again.
pub(super) fn next_caller<T>(mut accept: impl FnMut() -> io::Result<T>) -> io::Result<Option<T>> {
    loop {
        match accept() {
            Ok(caller) => return Ok(Some(caller)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            Err(error) if is_of_connection(&error) => {}
            Err(error) => return Err(error),
        }
    }
}

/// Whether accepting failed for a reason of that one connection.
fn is_of_connection(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionReset, Interrupted};
    matches!(error.kind(), ConnectionAborted | ConnectionReset | Interrupted)
}
