//! Who may not be a peer of a server: told, counted, and sent away.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};

use tracing::Level;

use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::links::{Link, Output};
use super::log_limit::Topic;
use super::peers::plain;
use crate::link::Stream;
use crate::mavlink::Refusal;
use crate::routing::Reminder;

/// Why somebody is no peer of a server.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum PeerRefusal {
    /// `allow_from` does not have its address.
    Outside,
    /// Nothing that it sends is signed as `verify` wants it, or it sends nothing at all.
    Unbelieved,
    /// There are as many peers as `max_peers` allows.
    Full,
}

impl PeerRefusal {
    const ALL: [Self; 3] = [Self::Outside, Self::Unbelieved, Self::Full];

    /// What it is called in status and metrics.
    fn name(self) -> &'static str {
        match self {
            Self::Outside => "outside",
            Self::Unbelieved => "unbelieved",
            Self::Full => "full",
        }
    }
}

/// How often a server has refused somebody: each connection counts, and each datagram.
#[derive(Debug, Default)]
pub(super) struct PeerRefusals {
    counts: [u64; PeerRefusal::ALL.len()],
    /// From where somebody came who was told of. Without the port: that is another one each time.
    told: Reminder<IpAddr>,
    /// Who was told of and not believed. With the port: of two programs on one computer, one may
    /// have the key.
    disbelieved: Reminder<SocketAddr>,
}

impl PeerRefusals {
    fn count(&mut self, reason: PeerRefusal) {
        self.counts[reason as usize] += 1;
    }

    /// The reasons that there were, and how often.
    pub(super) fn by_name(&self) -> BTreeMap<String, u64> {
        let counts = PeerRefusal::ALL.into_iter().zip(self.counts).filter(|(_, count)| *count > 0);
        counts.map(|(reason, count)| (reason.name().to_owned(), count)).collect()
    }
}

impl Daemon {
    /// Whether somebody new has to go because of its address; if so, that is counted, and told once
    /// a minute.
    pub(super) fn sends_away(&mut self, index: EndpointId, source: SocketAddr) -> bool {
        let endpoint = &mut self.io.endpoints[index];
        if endpoint.options().admits(source.ip()) {
            return false;
        }
        endpoint.refusals.count(PeerRefusal::Outside);
        if endpoint.refusals.told.is_due(source.ip().to_canonical(), self.now) {
            self.refuse(index, source, "its address is not in allow_from");
        }
        true
    }

    /// Counts and tells of somebody who sent nothing that is signed as it must be.
    pub(super) fn refuse_unbelieved(
        &mut self,
        index: EndpointId,
        source: SocketAddr,
        why: Refusal,
    ) {
        let refusals = &mut self.io.endpoints[index].refusals;
        refusals.count(PeerRefusal::Unbelieved);
        if refusals.disbelieved.is_due(source, self.now) {
            self.refuse(index, source, disbelief(why));
        }
    }

    /// Counts somebody who was connected and has not shown the key.
    pub(super) fn count_unproven(&mut self, index: EndpointId) {
        self.io.endpoints[index].refusals.count(PeerRefusal::Unbelieved);
    }

    /// Counts and tells of somebody for whom there is no room.
    pub(super) fn refuse_surplus(&mut self, index: EndpointId, peer: SocketAddr) {
        let endpoint = &mut self.io.endpoints[index];
        endpoint.refusals.count(PeerRefusal::Full);
        let max = endpoint.options().max_peers;
        self.refuse(index, peer, &format!("it has {max} peers already (raise max_peers)"));
    }

    /// Tells that somebody is not listened to.
    pub(super) fn refuse(&mut self, index: EndpointId, peer: SocketAddr, reason: &str) {
        let text = format!("{} refused: {reason}", plain(peer));
        self.say(index, Level::WARN, Topic::Refusal, &text);
    }

    /// Closes the peers of a server that its `allow_from` of now does not have.
    pub(super) fn close_outsiders(&mut self, index: EndpointId) {
        let options = self.io.endpoints[index].options();
        let links = self.links_of(index).into_iter();
        // Whoever has no address any more is about to be closed in any case.
        let is_outside = |id: &_| {
            let address = self.io.links.get(*id).and_then(address);
            address.is_none_or(|address| !options.admits(address.ip()))
        };
        let outsiders: Vec<_> = links.filter(is_outside).collect();
        for link in outsiders {
            self.close_link(link, "its address is not in allow_from any more");
        }
    }
}

/// Why what somebody sends is not believed, in words.
fn disbelief(why: Refusal) -> &'static str {
    match why {
        Refusal::Unsigned | Refusal::WrongSignature => {
            "what it sends is not signed with the key of `verify`"
        }
        Refusal::Replayed => "what it sends came before",
        Refusal::TooOld => {
            "the time that it signs with is more than a minute behind ours (set its clock, or ours \
             if that is ahead)"
        }
        Refusal::TooManyStreams => "too many others sign with the key of `verify`",
    }
}

/// From where the peer of a server sends.
fn address(link: &Link) -> Option<SocketAddr> {
    match &link.output {
        Output::Datagrams(source) => Some(*source),
        Output::Stream(output) => match &output.stream {
            Stream::Tcp(stream) => stream.peer_addr().ok(),
            Stream::Serial(_) => None,
        },
        Output::Local(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ground_station_with_an_old_clock_is_told_from_one_without_the_key() {
        assert!(disbelief(Refusal::TooOld).contains("is more than a minute behind ours"));
        assert!(!disbelief(Refusal::TooOld).contains("key"));
        for why in [Refusal::Unsigned, Refusal::WrongSignature] {
            assert!(disbelief(why).contains("not signed with the key of `verify`"));
        }
    }
}
