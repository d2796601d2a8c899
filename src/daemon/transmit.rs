//! From the queues to the wires: each link once a turn, as far as the system takes it.

use std::io;
use std::net::SocketAddr;

use mio::event::Source;
use mio::{Interest, Registry, Token};

use super::endpoint::{Endpoint, State};
use super::endpoint_table::EndpointTable;
use super::event_loop::Meaning;
use super::links::{LinkTable, Output, StreamOutput};
use crate::link::{BATCH, send_datagrams, take_refusals};
use crate::routing::{LinkId, LinkSet, Packed, Port, Router, Time};

/// Everything that bytes leave by.
pub(super) struct Io {
    registry: Registry,
    pub(super) endpoints: EndpointTable,
    pub(super) links: LinkTable,
    /// Links to be closed at the end of the turn, and why. Not at once: whoever notices is in the
    /// middle of using them, and events of this turn may still name them.
    pub(super) closing: Vec<(LinkId, String)>,
    /// Links that found no room in the system's buffer in this turn.
    pub(super) blocked: LinkSet,
    /// Links to which datagrams could not be sent in this turn.
    pub(super) unsent: LinkSet,
    /// Links that wait for their pace to let them send, since this turn.
    pub(super) paced: LinkSet,
    /// Links inside the program whose other side was told something in this turn.
    pub(super) addressed: LinkSet,
}

impl Io {
    pub(super) fn new(registry: Registry) -> Self {
        Self {
            registry,
            endpoints: EndpointTable::default(),
            links: LinkTable::new(),
            closing: Vec::new(),
            blocked: LinkSet::EMPTY,
            unsent: LinkSet::EMPTY,
            paced: LinkSet::EMPTY,
            addressed: LinkSet::EMPTY,
        }
    }

    /// Sends what waits for these links.
    pub(super) fn flush_all(&mut self, router: &mut Router, links: LinkSet, now: Time) {
        links.iter().for_each(|link| self.flush(router, link, now));
    }

    /// Sends where a queue is filling, before the turn is over.
    pub(super) fn flush_filling(&mut self, router: &mut Router, now: Time) {
        let filling = router.take_filling();
        self.flush_all(router, filling, now);
    }

    /// Sends what waits for a link, and may be sent now.
    pub(super) fn flush(&mut self, router: &mut Router, id: LinkId, now: Time) {
        let (Some(link), Some(port)) = (self.links.get_mut(id), router.port_mut(id)) else {
            return;
        };
        let is_writable = match &mut link.output {
            Output::Stream(output) => {
                let had_room = output.writable;
                let mut result = flush_stream(output, port, now);
                if result.is_ok() && had_room && !output.writable {
                    let token = Meaning::Link(id).token();
                    result = tell_of_room(&self.registry, &mut output.stream, token, true);
                }
                if let Err(error) = result {
                    self.closing.push((id, error.to_string()));
                }
                if let Some(since) = output.blocked_since
                    && since == now
                {
                    self.blocked.insert(id);
                }
                output.writable
            }
            Output::Datagrams(peer) => {
                let endpoint = &mut self.endpoints[link.endpoint];
                let had_room = endpoint.has_room();
                if !flush_datagrams(*peer, port, endpoint, now) {
                    self.unsent.insert(id);
                }
                if had_room
                    && let State::Datagrams(datagrams) = &mut endpoint.state
                    && !datagrams.writable
                {
                    let token = Meaning::Endpoint(link.endpoint.slot()).token();
                    // If even that fails, the next datagram finds out whether there is room.
                    let asked = tell_of_room(&self.registry, &mut datagrams.socket, token, true);
                    datagrams.writable = asked.is_err();
                }
                endpoint.has_room()
            }
            Output::Local(local) => {
                if local.hand_over(port, now) {
                    self.addressed.insert(id);
                }
                true
            }
        };
        // A blocked link waits for room, not for its pace: the system says when.
        if is_writable && port.ready_at(now).is_some() {
            self.paced.insert(id);
        }
    }
}

fn flush_stream(output: &mut StreamOutput, port: &mut Port, now: Time) -> io::Result<()> {
    loop {
        let sendable = port.sendable(now);
        if !output.writable || sendable == 0 {
            return Ok(());
        }
        match output.stream.write(port.head(sendable)) {
            Ok(written) => {
                port.consume(written);
                let blocked_since = output.blocked_since.take();
                output.slowness.handle_progress(&output.stream, blocked_since, now);
                // A short write means that there is no more room: the system will say when.
                if written < sendable {
                    output.block(now);
                }
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => output.block(now),
            Err(error) => {
                // Nothing more goes this way until the link is closed.
                output.writable = false;
                return Err(error);
            }
        }
    }
}

/// Says whether the system is to tell when there is room to send. It is asked only by who has found
/// none: of UDP sockets and serial ports it would else tell after every single write.
pub(super) fn tell_of_room(
    registry: &Registry,
    source: &mut impl Source,
    token: Token,
    is_wanted: bool,
) -> io::Result<()> {
    let interest = if is_wanted { UNLESS_FULL | Interest::WRITABLE } else { UNLESS_FULL };
    registry.reregister(source, token, interest)
}

/// What the system is to tell of a socket or port that has room to send.
pub(super) const UNLESS_FULL: Interest = Interest::READABLE;

/// Says whether the system took all that it was given.
fn flush_datagrams(peer: SocketAddr, port: &mut Port, endpoint: &mut Endpoint, now: Time) -> bool {
    let State::Datagrams(datagrams) = &mut endpoint.state else { return true };
    let destination = datagrams.destination(peer, now);
    let longest = if endpoint.config.options.pack { endpoint.config.options.mtu } else { 0 };
    let (mut failure, mut refused) = (None, false);
    while datagrams.writable {
        let sendable = port.sendable(now);
        if sendable == 0 {
            break;
        }
        let socket = &datagrams.socket;
        let waiting = port.frames().packed(usize::from(longest));
        let sent = send_datagrams(socket, destination, within(waiting, sendable));
        refused |= sent.refused;
        let bytes: usize =
            port.frames().packed(usize::from(longest)).take(sent.count).map(len).sum();
        port.consume(bytes);
        match sent.error {
            None => {}
            Some(error) if error.kind() == io::ErrorKind::WouldBlock => datagrams.writable = false,
            // Too long, no route, no buffers: this datagram is lost, the link is not.
            Some(error) => {
                let lost = port.frames().packed(usize::from(longest)).next().map_or(0, len);
                port.lose(lost);
                failure = Some((destination, error));
            }
        }
    }
    if refused {
        take_refusals(&datagrams.socket, BATCH);
    }
    let is_sent = failure.is_none() && !refused;
    // Told once, until it works again or another reason is found.
    let kind = |failure: &Option<(SocketAddr, io::Error)>| failure.as_ref().map(|it| it.1.kind());
    endpoint.unsendable_is_told &= kind(&failure) == kind(&endpoint.unsendable);
    endpoint.unsendable = failure;
    is_sent
}

/// The datagrams that begin within the first `sendable` bytes, as many as one call moves.
fn within<'a>(
    datagrams: Packed<'a>,
    sendable: usize,
) -> impl Iterator<Item = (&'a [u8], &'a [u8])> {
    let mut begun = 0;
    let is_within = move |datagram: &(&[u8], &[u8])| {
        let begins = begun;
        begun += len(*datagram);
        begins < sendable
    };
    datagrams.take(BATCH).take_while(is_within)
}

fn len((first, second): (&[u8], &[u8])) -> usize {
    first.len() + second.len()
}
