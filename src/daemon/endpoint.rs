//! Endpoints as the loop sees them: what of them is open, and what happens next.

use std::collections::HashMap;
use std::io;
use std::mem::discriminant;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use mio::net::{TcpListener, TcpStream, UdpSocket};

use crate::config::{Address, EndpointConfig, EndpointOptions};
use crate::link::Backoff;
use crate::mavlink::SplitterStats;
use crate::routing::{FilterLists, GateOptions, LinkCounters, LinkId, Membership, RateCap, Time};

use super::log_limit::Log;
use super::settings::Settings;
use super::strangers::PeerRefusals;

/// What the user configured, and what came of it.
#[derive(Debug)]
pub(super) struct Endpoint {
    /// What it is called: no other endpoint is. It may have a number behind the name of its
    /// configuration.
    pub(super) name: String,
    pub(super) config: EndpointConfig,
    pub(super) state: State,
    /// Since when it is in this state.
    pub(super) since: Time,
    /// How often it was open.
    pub(super) openings: u64,
    /// What its links counted that are gone.
    pub(super) past: Past,
    /// Why it could not be opened the last time.
    pub(super) failure: Option<Failure>,
    pub(super) backoff: Backoff,
    /// When [`super::timers::Timer::Endpoint`] has something to do.
    pub(super) deadline: Option<Time>,
    /// What its options mean for the router.
    pub(super) filter_in: FilterLists,
    pub(super) filter_out: FilterLists,
    pub(super) caps: Vec<RateCap>,
    pub(super) gate: GateOptions,
    /// Its place in its group, once it is in the table.
    pub(super) membership: Option<Membership>,
    /// The device that its serial port really is, as the opener found it behind a name.
    pub(super) real_device: Option<PathBuf>,
    /// Which of several baud rates is in use, and whether frames were heard at it.
    pub(super) baud: usize,
    pub(super) baud_is_proven: bool,
    /// Since when it is in use, if another one was before: what was heard until then proves nothing.
    pub(super) baud_since: Time,
    /// Whether it was told that no frame comes.
    pub(super) silence_is_told: bool,
    /// Where it was opened, and what its sockets depend on.
    pub(super) address: Option<SocketAddr>,
    pub(super) bound: Bound,
    /// What its host means, and which of these addresses comes next.
    pub(super) addresses: Vec<SocketAddr>,
    pub(super) next_address: usize,
    /// Whether a helper owes an answer, the resolver or the opener: one question at a time.
    pub(super) is_asking: bool,
    pub(super) log: Log,
    /// The failure that was last told, so that it is told once and not at every try.
    pub(super) told: Option<(String, io::ErrorKind)>,
    /// Whether it was told that the other side is gone and is waited for.
    pub(super) is_missed: bool,
    /// Who was refused as a peer.
    pub(super) refusals: PeerRefusals,
    /// Whether it was told that connections cannot be accepted.
    pub(super) is_refusing: bool,
    /// Why the last datagram could not be sent, and where to.
    pub(super) unsendable: Option<(SocketAddr, io::Error)>,
    /// Whether that was told.
    pub(super) unsendable_is_told: bool,
}

/// What links counted that are gone.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Past {
    pub(super) router: LinkCounters,
    pub(super) splitter: SplitterStats,
}

/// Why an endpoint is not open.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    /// What could not be done, why, and what to do about it.
    pub(super) text: String,
    /// Whether waiting may help.
    pub(super) may_pass: bool,
}

/// What the sockets of an endpoint are bound to besides their addresses, and can go away.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) struct Bound {
    /// The number of the network interface; one that comes back has another.
    pub(super) interface: Option<u32>,
    /// Our own address there, by which what we send to everybody is known when it comes back.
    pub(super) source: Option<SocketAddr>,
}

/// How far an endpoint is.
#[derive(Debug)]
pub(super) enum State {
    /// Nothing is open; it is tried again at the deadline.
    Waiting,
    /// The host name was asked for.
    Resolving,
    /// A serial port is being opened; if it still is at the deadline, that is told.
    Opening,
    /// A TCP connection is being made; given up at the deadline.
    Connecting(TcpStream, SocketAddr),
    /// Waits for TCP connections, and has so many.
    Listening(TcpListener, usize),
    /// A UDP socket.
    Datagrams(DatagramPort),
    /// Its one link is up.
    Up(LinkId),
}

/// The UDP socket of an endpoint.
#[derive(Debug)]
pub(super) struct DatagramPort {
    /// Sends, and receives.
    pub(super) socket: UdpSocket,
    /// Receives what is sent to a multicast group.
    pub(super) group_socket: Option<UdpSocket>,
    /// Whether the system takes datagrams, or has not been asked.
    pub(super) writable: bool,
    pub(super) role: Role,
}

/// Who is at the other end of a UDP socket.
#[derive(Debug)]
pub(super) enum Role {
    /// Whoever sends: each remote address is a link of its own.
    Server(Peers),
    /// One remote address.
    Sender { link: LinkId, remote: SocketAddr },
    /// Everybody on a network, by broadcast or multicast: one link for all.
    Shared { link: LinkId, everybody: SocketAddr, own: SocketAddr, answerer: Answerer },
}

/// The peers of a UDP server.
#[derive(Default, Debug)]
pub(super) struct Peers {
    pub(super) links: HashMap<SocketAddr, LinkId>,
    /// The one that was looked up last: mostly it is the next one too.
    last: Option<(SocketAddr, LinkId)>,
    /// When [`super::timers::Timer::Peers`] has something to do.
    pub(super) deadline: Option<Time>,
}

impl Peers {
    /// The link of a remote address.
    pub(super) fn find(&mut self, address: SocketAddr) -> Option<LinkId> {
        match self.last {
            Some((last, link)) if last == address => Some(link),
            _ => {
                let link = *self.links.get(&address)?;
                self.last = Some((address, link));
                Some(link)
            }
        }
    }

    pub(super) fn insert(&mut self, address: SocketAddr, link: LinkId) {
        self.links.insert(address, link);
    }

    pub(super) fn remove(&mut self, link: LinkId) {
        self.links.retain(|_, other| *other != link);
        self.last = None;
    }
}

/// The one who answered a broadcast, and gets unicast from then on.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Answerer {
    /// Who, and when it was last heard.
    heard: Option<(SocketAddr, Time)>,
    /// Who sent last, of all: a torn frame is not joined with somebody else's.
    pub(super) last_source: Option<SocketAddr>,
}

/// How long an answerer may be silent before everybody is sent to again.
const ANSWERER_TIMEOUT: Duration = Duration::from_secs(5);

impl Answerer {
    /// A frame came from `source`. Whoever answered first stays until it falls silent.
    pub(super) fn handle(&mut self, source: SocketAddr, now: Time) {
        match self.current(now) {
            Some(current) if current != source => {}
            _ => self.heard = Some((source, now)),
        }
    }

    fn current(&self, now: Time) -> Option<SocketAddr> {
        let is_fresh = |heard: &(SocketAddr, Time)| now.since(heard.1) < ANSWERER_TIMEOUT;
        self.heard.filter(is_fresh).map(|(address, _)| address)
    }
}

impl DatagramPort {
    /// Where what is meant for `peer` is sent now.
    pub(super) fn destination(&self, peer: SocketAddr, now: Time) -> SocketAddr {
        match &self.role {
            Role::Server(_) | Role::Sender { .. } => peer,
            Role::Shared { everybody, answerer, .. } => answerer.current(now).unwrap_or(*everybody),
        }
    }

    /// The links of this socket.
    pub(super) fn links(&self) -> Vec<LinkId> {
        match &self.role {
            Role::Server(peers) => peers.links.values().copied().collect(),
            Role::Sender { link, .. } | Role::Shared { link, .. } => vec![*link],
        }
    }
}

impl Endpoint {
    pub(super) fn new(settings: Settings, now: Time) -> Self {
        let Settings { config, filter_in, filter_out, caps, gate } = settings;
        Self {
            name: config.name(),
            backoff: Backoff::up_to(config.options.retry),
            config,
            state: State::Waiting,
            since: now,
            openings: 0,
            past: Past::default(),
            failure: None,
            deadline: None,
            filter_in,
            filter_out,
            caps,
            gate,
            membership: None,
            baud: 0,
            real_device: None,
            baud_is_proven: false,
            baud_since: Time::ZERO,
            silence_is_told: false,
            address: None,
            bound: Bound::default(),
            addresses: Vec::new(),
            next_address: 0,
            is_asking: false,
            log: Log::new(now),
            told: None,
            is_missed: false,
            refusals: PeerRefusals::default(),
            is_refusing: false,
            unsendable: None,
            unsendable_is_told: false,
        }
    }

    /// Goes into another state.
    pub(super) fn set_state(&mut self, state: State, now: Time) {
        if discriminant(&self.state) != discriminant(&state) {
            self.since = now;
        }
        self.state = state;
    }

    /// Whether it has as many links as there are peers, and stays open when one goes.
    pub(super) fn is_server(&self) -> bool {
        self.config.address.kind().is_server()
    }

    /// What its host means is asked anew the next time.
    pub(super) fn forget_addresses(&mut self) {
        self.addresses.clear();
        self.next_address = 0;
    }

    /// Takes other settings; says whether they are others at all.
    pub(super) fn set(&mut self, settings: Settings) -> bool {
        let Settings { config, filter_in, filter_out, caps, gate } = settings;
        let is_same = (&self.config, &self.filter_in, &self.filter_out, &self.caps, &self.gate)
            == (&config, &filter_in, &filter_out, &caps, &gate);
        if self.config.name() != config.name() {
            self.name = config.name();
        }
        self.config = config;
        (self.filter_in, self.filter_out, self.caps, self.gate) =
            (filter_in, filter_out, caps, gate);
        !is_same
    }

    /// The baud rate that a serial port has or would be opened at.
    pub(super) fn baud_in_use(&self) -> Option<u32> {
        let Address::Serial { bauds, .. } = &self.config.address else { return None };
        bauds.get(self.baud).copied()
    }

    /// Whether it is a UDP socket that takes datagrams.
    pub(super) fn has_room(&self) -> bool {
        matches!(&self.state, State::Datagrams(datagrams) if datagrams.writable)
    }

    pub(super) fn options(&self) -> &EndpointOptions {
        &self.config.options
    }

    /// Whether it is not open, and not tried again: it has failed for good, or come to its end.
    pub(super) fn is_given_up(&self) -> bool {
        let has_ended = self.failure.as_ref().is_some_and(|failure| !failure.may_pass);
        matches!(self.state, State::Waiting)
            && self.deadline.is_none()
            && (self.tries_once() || has_ended)
    }

    /// Whether it is given up when it fails.
    pub(super) fn tries_once(&self) -> bool {
        self.config.options.retry.is_zero()
    }
}
