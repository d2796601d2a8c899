//! From the queues to the wires: each link once a turn, as far as the system takes it.

use std::io;
use std::net::SocketAddr;

use tracing::warn;

use super::endpoint::{Endpoint, State};
use super::links::{LinkTable, Output, StreamOutput};
use crate::link::{BATCH, send_datagrams};
use crate::routing::{LinkId, LinkSet, Queue, Router, Time};

/// Everything that bytes leave by.
pub(super) struct Io {
    pub(super) endpoints: Vec<Endpoint>,
    pub(super) links: LinkTable,
    /// Links to be closed at the end of the turn, and why: never in the middle, where events of
    /// this turn may still name them.
    pub(super) closing: Vec<(LinkId, String)>,
}

impl Io {
    pub(super) fn new(endpoints: Vec<Endpoint>) -> Self {
        Self {
            endpoints,
            links: LinkTable::new(),
            closing: Vec::new(),
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

    /// Sends what waits for a link.
    pub(super) fn flush(&mut self, router: &mut Router, id: LinkId, now: Time) {
        let (Some(link), Some(queue)) = (self.links.get_mut(id), router.queue_mut(id)) else {
            return;
        };
        match &mut link.output {
            Output::Stream(output) => {
                if let Err(error) = flush_stream(output, queue) {
                    self.closing.push((id, error.to_string()));
                }
            }
            Output::Datagrams(peer) => {
                flush_datagrams(*peer, queue, &mut self.endpoints[link.endpoint], now);
            }
        }
    }
}

fn flush_stream(output: &mut StreamOutput, queue: &mut Queue) -> io::Result<()> {
    while output.writable && !queue.is_empty() {
        match output.stream.write(queue.as_slices()) {
            Ok(written) => {
                // A short write means that there is no more room: the system will say when.
                output.writable = written == queue.len();
                queue.consume(written);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => output.writable = false,
            Err(error) => {
                // Nothing more goes this way until the link is closed.
                output.writable = false;
                return Err(error);
            }
        }
    }
    Ok(())
}

fn flush_datagrams(peer: SocketAddr, queue: &mut Queue, endpoint: &mut Endpoint, now: Time) {
    let State::Datagrams(port) = &mut endpoint.state else {
        return;
    };
    let destination = port.destination(peer, now);
    let mut failure = None;
    while port.writable && !queue.is_empty() {
        let (sent, error) = send_datagrams(&port.socket, destination, queue.frames().take(BATCH));
        consume_frames(queue, sent);
        match error {
            None => {}
            Some(error) if error.kind() == io::ErrorKind::WouldBlock => port.writable = false,
            // Too long, no route, no buffers: this frame is lost, the link is not.
            Some(error) => {
                consume_frames(queue, 1);
                failure = Some(error);
            }
        }
    }
    if let Some(error) = failure
        && endpoint.log.permit(now).is_some()
    {
        warn!("{}: cannot send to {destination}: {error}", endpoint.name);
    }
}

fn consume_frames(queue: &mut Queue, count: usize) {
    let frames = queue.frames().take(count);
    let bytes = frames
        .map(|(first, second)| first.len() + second.len())
        .sum();
    queue.consume(bytes);
}
