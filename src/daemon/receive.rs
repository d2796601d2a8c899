//! From what is readable to the router: streams and datagrams, a bounded amount a turn.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use super::endpoint::{Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Ready};
use super::links::{Output, StreamOutput};
use super::peers::Admission;
use super::timers::Timer;
use crate::link::{Arrived, Stream};
use crate::mavlink::{CheckedFrame, FrameBuffer, Input, Splitter};
use crate::record::Recorder;
use crate::routing::{LinkId, Router};

/// How many batches a UDP socket may read in one turn. A stream reads once, up to 64 KiB: long
/// enough to be worth the turn, short enough that a flood keeps nobody waiting.
const BATCHES: usize = 2;

/// When receiving is tried again that has only failed.
const RECEIVE_AGAIN: Duration = Duration::from_millis(500);

/// How long a link may stop in the middle of a frame before complete frames are looked for behind
/// the start of it (rule 18).
const PAUSE: Duration = Duration::from_millis(50);

/// The same over TCP. That loses nothing, so its pauses tell of nothing but its own repetitions,
/// the first of which takes 200 ms or little more. Only a serial line behind the other side may
/// have lost something.
const TCP_PAUSE: Duration = Duration::from_millis(500);

impl Daemon {
    /// Goes on where the last turn left off.
    pub(super) fn receive_more(&mut self, source: Ready) {
        match source {
            Ready::Link(link) => match self.io.links.get(link).map(|link| &link.output) {
                Some(Output::Local(_)) => self.receive_local(link),
                _ => self.receive_stream(link),
            },
            Ready::Endpoint(index) => match self.io.endpoints.get(index).map(|it| &it.state) {
                Some(State::Listening(..)) => self.accepting.push(index),
                Some(State::Datagrams(_)) => self.receive_datagrams(index),
                _ => {}
            },
        }
    }

    /// Reads a stream and routes what it says.
    pub(super) fn receive_stream(&mut self, id: LinkId) {
        let Some(link) = self.io.links.get_mut(id) else { return };
        let Output::Stream(output) = &mut link.output else { return };
        let buffer = self.inbox.stream_buffer();
        match output.stream.read(buffer) {
            Ok(0) => self.handle_end(id),
            Ok(received) => {
                // A short read says that there was no more, unless the end is near; what comes later
                // is told of. A terminal, too, hands out all that it has.
                let drained = received < buffer.len() && !output.read_closed;
                self.route(id, 0, received, Input::Flowing);
                if !drained {
                    self.ready.push(Ready::Link(id));
                }
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {
                self.ready.push(Ready::Link(id));
            }
            // What a driver says of a plug that was pulled is no help to anybody.
            Err(_) if matches!(output.stream, Stream::Serial(_)) => self.handle_end(id),
            Err(error) => self.close_later(id, &error.to_string()),
        }
    }

    /// The stream has come to its end: what stands behind an unfinished frame is routed yet.
    fn handle_end(&mut self, id: LinkId) {
        self.route(id, 0, 0, Input::Paused);
        let Some(link) = self.io.links.get(id) else { return };
        let reason = match &link.output {
            Output::Stream(StreamOutput { stream: Stream::Serial(_), .. }) => "the device is gone",
            _ => "closed by the other side",
        };
        self.close_later(id, reason);
    }

    /// Reads a UDP socket and routes what it says.
    pub(super) fn receive_datagrams(&mut self, index: EndpointId) {
        let mut drained = self.receive_batches(index, false);
        drained &= self.receive_batches(index, true);
        if !drained {
            self.ready.push(Ready::Endpoint(index));
        }
    }

    /// Reads one of the two sockets that an endpoint may have; says whether it is empty now.
    fn receive_batches(&mut self, index: EndpointId, group: bool) -> bool {
        let mut failures = 0;
        for _ in 0..BATCHES {
            let State::Datagrams(port) = &self.io.endpoints[index].state else {
                return true;
            };
            let result = match (group, &port.group_socket) {
                (false, _) => self.inbox.receive(&port.socket),
                (true, Some(socket)) => self.inbox.receive(socket),
                (true, None) => return true,
            };
            match result {
                Ok(Arrived { count, drained }) => {
                    (0..count).for_each(|slot| self.handle_datagram(index, slot, group));
                    if drained {
                        return true;
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return true,
                Err(error) if is_of_datagram(&error) => failures += 1,
                Err(error) => {
                    self.warn(index, &format!("cannot receive: {error}; trying again"));
                    failures = BATCHES;
                    break;
                }
            }
        }
        // Nothing but errors may go on for ever: then there is time for others in between.
        if failures == BATCHES {
            self.set_deadline(index, RECEIVE_AGAIN);
        }
        failures == BATCHES
    }

    /// `to_group`: it was sent to the multicast group, and not to us alone.
    fn handle_datagram(&mut self, index: EndpointId, slot: usize, to_group: bool) {
        let (len, Some(source)) = self.inbox.received(slot) else { return };
        let State::Datagrams(port) = &mut self.io.endpoints[index].state else { return };
        match &mut port.role {
            Role::Server(peers) => match peers.find(source) {
                Some(link) => {
                    self.route(link, slot, len, Input::Paused);
                }
                None => self.handle_stranger(index, slot, len, source),
            },
            // Its port may change, as when the program at the other end starts again.
            Role::Sender { link, remote } if remote.ip() == source.ip() => {
                let link = *link;
                self.route(link, slot, len, Input::Paused);
            }
            // What we send to everybody comes back to us as well.
            Role::Shared { own, .. } if (source.ip(), source.port()) == (own.ip(), own.port()) => {}
            Role::Shared { .. } => self.handle_shared(index, slot, source, to_group),
            Role::Sender { remote, .. } => {
                let reason = format!("it hears {} alone, to whom it sends", remote.ip());
                self.refuse(index, source, &reason);
            }
        }
    }

    /// A datagram of one of many who share a link. Who answers us alone is sent to alone.
    fn handle_shared(
        &mut self,
        index: EndpointId,
        slot: usize,
        source: SocketAddr,
        to_group: bool,
    ) {
        let State::Datagrams(port) = &mut self.io.endpoints[index].state else { return };
        let Role::Shared { link, answerer, .. } = &mut port.role else { return };
        let link = *link;
        if answerer.last_source.replace(source) != Some(source)
            && let Some(link) = self.io.links.get_mut(link)
        {
            link.splitter.forget();
        }
        let (len, _) = self.inbox.received(slot);
        let verified = self.route(link, slot, len, Input::Paused);
        let endpoint = &mut self.io.endpoints[index];
        let is_answer = verified && !to_group && endpoint.options().sticky;
        if let State::Datagrams(port) = &mut endpoint.state
            && let Role::Shared { answerer, .. } = &mut port.role
            && is_answer
        {
            answerer.handle(source, self.now);
        }
    }

    /// A datagram of somebody new: a verified frame makes it a peer.
    fn handle_stranger(&mut self, index: EndpointId, slot: usize, len: usize, source: SocketAddr) {
        if self.sends_away(index, source) {
            return;
        }
        // Out of the inbox, so that a link can be made while the frames are being looked at.
        let mut bytes = std::mem::take(&mut self.stranger);
        bytes.clear();
        bytes.extend_from_slice(&self.inbox.slot(slot)[..Splitter::CARRY + len]);
        let mut splitter = Splitter::new();
        let mut admission = Admission::Unproven;
        let mut cutter = splitter.cut(&mut bytes, len, Input::Paused);
        while let Some(frame) = cutter.next(&mut self.checker) {
            // A radio's report without a signature may stand before what is signed.
            let is_open = matches!(admission, Admission::Unproven | Admission::Unbelieved(_));
            if frame.verified && is_open {
                admission = self.admit_by(index, source, &frame);
            }
            if let Admission::Peer(link) = admission {
                let is_taken = self.router.handle(link, &frame, self.now);
                if is_taken
                    && let Some(recorder) = &mut self.recorder
                    && self.io.endpoints[index].options().record
                {
                    record_taken(recorder, &self.router, link, &frame);
                }
            }
        }
        self.stranger = bytes;
        match admission {
            Admission::Peer(link) => {
                if let Some(link) = self.io.links.get_mut(link) {
                    link.splitter = splitter;
                }
            }
            Admission::Unbelieved(why) => self.refuse_unbelieved(index, source, why),
            Admission::Unproven | Admission::Refused => {}
        }
    }

    /// Cuts what stands in a slot into frames and routes them; says whether any was verified.
    pub(super) fn route(&mut self, id: LinkId, slot: usize, received: usize, input: Input) -> bool {
        let Some(link) = self.io.links.get_mut(id) else {
            return false;
        };
        link.last_read = self.now;
        // What is recorded is decided once for all that is at hand.
        let mut recorder =
            self.recorder.as_mut().filter(|_| self.io.endpoints[link.endpoint].options().record);
        let mut splitter = std::mem::take(&mut link.splitter);
        let is_gated = self.router.is_gated(id);
        let mut verified = false;
        let mut cutter = splitter.cut(self.inbox.slot(slot), received, input);
        while let Some(frame) = cutter.next(&mut self.checker) {
            verified |= frame.verified;
            let is_taken = self.router.handle(id, &frame, self.now);
            if is_taken && let Some(recorder) = &mut recorder {
                match is_gated {
                    true => record_taken(recorder, &self.router, id, &frame),
                    false => recorder.record(&frame),
                }
            }
            if self.router.has_filling() {
                self.io.flush_filling(&mut self.router, self.now);
            }
        }
        let is_waiting = splitter.is_waiting();
        if let Some(link) = self.io.links.get_mut(id) {
            link.splitter = splitter;
        }
        if is_waiting && input == Input::Flowing {
            self.watch_unfinished(id);
        }
        verified
    }

    fn watch_unfinished(&mut self, id: LinkId) {
        let Some(link) = self.io.links.get(id) else { return };
        self.unfinished.insert(id);
        let at = link.last_read + pause(&link.output);
        if self.pause_timer.is_none_or(|set| set > at) {
            self.pause_timer = Some(at);
            self.timers.set(at, Timer::Pause);
        }
    }

    /// Rule 18: looks behind the unfinished frames of links that have paused.
    pub(super) fn handle_pause(&mut self) {
        if self.pause_timer.is_some_and(|set| set > self.now) {
            return;
        }
        self.pause_timer = None;
        let unfinished = std::mem::take(&mut self.unfinished);
        for id in unfinished.iter() {
            let Some(link) = self.io.links.get(id) else {
                continue;
            };
            if self.now.since(link.last_read) >= pause(&link.output) {
                self.route(id, 0, 0, Input::Paused);
            } else if link.splitter.is_waiting() {
                self.watch_unfinished(id);
            }
        }
    }
}

/// Records a frame as the gate of its link let it in: it is known by that everywhere else.
#[inline(never)]
fn record_taken(recorder: &mut Recorder, router: &Router, link: LinkId, frame: &CheckedFrame<'_>) {
    let mut buffers = <[FrameBuffer; 2]>::default();
    recorder.record(&router.as_taken(link, frame, &mut buffers));
}

/// How long a link may stop in the middle of a frame.
fn pause(output: &Output) -> Duration {
    match output {
        Output::Stream(StreamOutput { stream: Stream::Tcp(_), .. }) => TCP_PAUSE,
        _ => PAUSE,
    }
}

/// Whether receiving failed for what an earlier datagram brought about, or for a signal: the next
/// call finds the next datagram.
fn is_of_datagram(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, HostUnreachable, Interrupted, NetworkUnreachable};
    matches!(error.kind(), ConnectionRefused | HostUnreachable | Interrupted | NetworkUnreachable)
}
