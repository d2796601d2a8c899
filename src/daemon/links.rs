//! The links as the loop sees them: what they are read from and written to.

use std::net::SocketAddr;

use super::endpoint_table::EndpointId;
use super::local::LocalOutput;
use crate::link::{Slowness, Stream};
use crate::mavlink::Splitter;
use crate::routing::{LinkId, MAX_LINKS, Time};

/// One live peer of an endpoint.
#[derive(Debug)]
pub(super) struct Link {
    /// Whose link this is.
    pub(super) endpoint: EndpointId,
    /// Who is at the other end, for people.
    pub(super) peer: String,
    /// Cuts what it sends into frames.
    pub(super) splitter: Splitter,
    /// When it came up.
    pub(super) since: Time,
    /// When something was last read from it; at first, when it came up.
    pub(super) last_read: Time,
    pub(super) output: Output,
    /// When [`super::timers::Timer::Pace`] has something to do.
    pub(super) pace_deadline: Option<Time>,
    /// When [`super::timers::Timer::Stall`] has something to do.
    pub(super) stall_deadline: Option<Time>,
    /// When [`super::timers::Timer::Proof`] has something to do.
    pub(super) proof_deadline: Option<Time>,
}

impl Link {
    /// A link that came up just now.
    pub(super) fn new(endpoint: EndpointId, peer: String, output: Output, now: Time) -> Self {
        Self {
            endpoint,
            peer,
            splitter: Splitter::new(),
            since: now,
            last_read: now,
            output,
            pace_deadline: None,
            stall_deadline: None,
            proof_deadline: None,
        }
    }
}

/// Where a link's queue is sent.
#[derive(Debug)]
pub(super) enum Output {
    /// To a stream of its own.
    Stream(StreamOutput),
    /// Through the socket of the endpoint, to wherever that sends for this peer.
    Datagrams(SocketAddr),
    /// To a part of the program itself.
    Local(LocalOutput),
}

#[derive(Debug)]
pub(super) struct StreamOutput {
    pub(super) stream: Stream,
    /// Whether the last write was taken whole, or the system has since said that there is room.
    pub(super) writable: bool,
    /// Whether the other side said that it will send no more: what is left must be read to its end.
    pub(super) read_closed: bool,
    /// Since when the system has taken nothing, though something waits.
    pub(super) blocked_since: Option<Time>,
    pub(super) slowness: Slowness,
}

impl StreamOutput {
    pub(super) fn new(stream: Stream) -> Self {
        Self {
            stream,
            writable: true,
            read_closed: false,
            blocked_since: None,
            slowness: Slowness::default(),
        }
    }

    /// The system takes no more for now.
    pub(super) fn block(&mut self, now: Time) {
        self.writable = false;
        self.blocked_since.get_or_insert(now);
    }
}

/// All links, by number.
#[derive(Debug)]
pub(super) struct LinkTable(Vec<Option<Link>>);

impl LinkTable {
    pub(super) fn new() -> Self {
        let mut table = Vec::new();
        table.resize_with(MAX_LINKS, || None);
        Self(table)
    }

    pub(super) fn insert(&mut self, id: LinkId, link: Link) {
        self.0[id.index()] = Some(link);
    }

    pub(super) fn remove(&mut self, id: LinkId) -> Option<Link> {
        self.0[id.index()].take()
    }

    pub(super) fn get(&self, id: LinkId) -> Option<&Link> {
        self.0[id.index()].as_ref()
    }

    pub(super) fn get_mut(&mut self, id: LinkId) -> Option<&mut Link> {
        self.0[id.index()].as_mut()
    }
}
