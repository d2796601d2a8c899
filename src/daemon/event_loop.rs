//! The loop itself: what a turn is, and which event means what.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::event::Event;
use mio::{Events, Poll, Registry, Token, Waker};
use tracing::info;

use super::endpoint::State;
use super::error::StartError;
use super::links::Output;
use super::log_limit::LogLimit;
use super::notify::Notifier;
use super::settings::settle;
use super::signals::Signals;
use super::timers::{Timer, Timers};
use super::transmit::Io;
use crate::config::EndpointConfig;
use crate::link::{Inbox, Opener, Resolver, Stream};
use crate::mavlink::{Checker, Dialect};
use crate::routing::{LinkId, LinkSet, Router, RouterOptions, Time};

/// What the daemon is to do.
#[derive(Debug)]
pub struct DaemonConfig {
    /// What to join.
    pub endpoints: Vec<EndpointConfig>,
    /// How to route.
    pub router: RouterOptions,
    /// The messages to know.
    pub dialect: Dialect,
}

/// The daemon at work.
pub(super) struct Daemon {
    pub(super) poll: Poll,
    pub(super) signals: Signals,
    pub(super) resolver: Resolver,
    pub(super) opener: Opener,
    start: Instant,
    /// The time of this turn: the clock is read once a turn.
    pub(super) now: Time,
    pub(super) router: Router,
    pub(super) checker: Checker,
    pub(super) inbox: Inbox,
    pub(super) io: Io,
    pub(super) timers: Timers,
    /// When [`Timer::Router`] was last set for.
    router_deadline: Option<Time>,
    /// Sources that may have more to read than a turn allows.
    pub(super) ready: Vec<Ready>,
    /// Links that stopped in the middle of a frame.
    pub(super) unfinished: LinkSet,
    /// Links whose [`Timer::Pace`] is set.
    pub(super) pace_timers: LinkSet,
    /// Links whose [`Timer::Stall`] is set.
    pub(super) stall_timers: LinkSet,
    /// Where a datagram of somebody unknown stands while it is looked at.
    pub(super) stranger: Vec<u8>,
    pub(super) component_log: LogLimit,
    pub(super) notifier: Notifier,
    pub(super) unrouted_log: LogLimit,
}

/// Something that has more to read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Ready {
    Link(LinkId),
    /// A UDP socket or a listener.
    Endpoint(usize),
}

/// What a token of the poll means.
pub(super) enum Meaning {
    Signal,
    Wake,
    Endpoint(usize),
    Link(LinkId),
}

const SIGNAL: Token = Token(0);
const WAKE: Token = Token(1);

/// How long queues may take to drain at the end.
const LINGER: Duration = Duration::from_millis(500);

/// How many events one poll brings at most; the others come with the next.
const EVENTS: usize = 256;

impl Meaning {
    pub(super) fn token(&self) -> Token {
        match self {
            Self::Signal => SIGNAL,
            Self::Wake => WAKE,
            Self::Endpoint(index) => Token(2 + index * 2),
            Self::Link(link) => Token(3 + link.index() * 2),
        }
    }

    fn of(token: Token) -> Option<Self> {
        Some(match token {
            SIGNAL => Self::Signal,
            WAKE => Self::Wake,
            Token(number) if number % 2 == 0 => Self::Endpoint(number / 2 - 1),
            Token(number) => Self::Link(LinkId::new((number - 3) / 2)?),
        })
    }
}

/// Opens all endpoints, and moves frames between them until SIGINT, SIGTERM or SIGHUP comes.
///
/// # Errors
///
/// If an endpoint cannot be opened and waiting would not help; then nothing has been sent. Or if
/// the system refuses what the loop itself needs.
pub fn run(config: DaemonConfig) -> Result<(), StartError> {
    let mut daemon = Daemon::new(config)?;
    daemon.open_all()?;
    info!("ready");
    daemon.tell_ready();
    daemon.work().map_err(StartError::System)?;
    daemon.close_serial_ports();
    Ok(())
}

impl Daemon {
    fn new(config: DaemonConfig) -> Result<Self, StartError> {
        let poll = Poll::new().map_err(StartError::System)?;
        let signals = Signals::register(poll.registry(), SIGNAL).map_err(StartError::System)?;
        let waker = Waker::new(poll.registry(), WAKE).map_err(StartError::System)?;
        let waker = Arc::new(waker);
        let now = Time::ZERO;
        let endpoints = settle(config.endpoints, &config.dialect, now)?;
        Ok(Self {
            poll,
            signals,
            resolver: Resolver::new(Arc::clone(&waker)),
            opener: Opener::new(waker),
            start: Instant::now(),
            now,
            router: Router::new(config.router),
            checker: Checker::new(config.dialect),
            inbox: Inbox::new(),
            io: Io::new(endpoints),
            timers: Timers::default(),
            router_deadline: None,
            ready: Vec::new(),
            unfinished: LinkSet::EMPTY,
            pace_timers: LinkSet::EMPTY,
            stall_timers: LinkSet::EMPTY,
            stranger: Vec::new(),
            component_log: LogLimit::new(now),
            notifier: Notifier::from_environment(),
            unrouted_log: LogLimit::new(now),
        })
    }

    pub(super) fn registry(&self) -> &Registry {
        self.poll.registry()
    }

    pub(super) fn clock(&self) -> Time {
        // Wraps after 584,000 years.
        Time::from_micros(self.start.elapsed().as_micros() as u64)
    }

    fn work(&mut self) -> io::Result<()> {
        let mut events = Events::with_capacity(EVENTS);
        let mut stopping = false;
        while !stopping {
            let timeout = self.timeout();
            stopping = self.turn(&mut events, timeout)?;
        }
        info!("stopping");
        self.notifier.handle_stopping();
        self.drain(&mut events)?;
        self.report_links();
        Ok(())
    }

    /// What has arrived already is still routed, and the queues get some time to empty.
    fn drain(&mut self, events: &mut Events) -> io::Result<()> {
        let end = self.clock() + LINGER;
        self.turn(events, Some(Duration::ZERO))?;
        while self.clock() < end && self.has_backlog() {
            let left = end.since(self.clock());
            let wait = self.timeout().map_or(left, |due| due.min(left));
            self.turn(events, Some(wait))?;
        }
        Ok(())
    }

    /// How long the loop may wait.
    fn timeout(&self) -> Option<Duration> {
        if !self.ready.is_empty() {
            return Some(Duration::ZERO);
        }
        let deadline = self.timers.next_deadline()?;
        // A timer must not be found short of its deadline again and again: rounded up by poll.
        Some(deadline.since(self.clock()))
    }

    /// One turn; says whether a signal asks to stop.
    fn turn(&mut self, events: &mut Events, timeout: Option<Duration>) -> io::Result<bool> {
        match self.poll.poll(events, timeout) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => return Err(error),
            _ => {}
        }
        self.now = self.clock();
        let leftover = std::mem::take(&mut self.ready);
        let mut stop = false;
        for event in events.iter() {
            stop |= self.handle_event(event);
        }
        for source in leftover {
            // Whoever had an event as well has been read already, and shall not be read twice.
            if !self.ready.contains(&source) {
                self.receive_more(source);
            }
        }
        self.handle_timers();
        let dirty = self.router.take_dirty();
        self.io.flush_all(&mut self.router, dirty, self.now);
        self.close_broken();
        self.handle_unsent();
        self.report_events();
        self.tell_status();
        self.set_timers();
        Ok(stop)
    }

    fn handle_event(&mut self, event: &Event) -> bool {
        match Meaning::of(event.token()) {
            Some(Meaning::Signal) => return self.signals.take(),
            Some(Meaning::Wake) => {
                self.handle_answers();
                self.handle_serial_answers();
            }
            Some(Meaning::Endpoint(index)) => self.handle_endpoint_event(index, event),
            Some(Meaning::Link(link)) => self.handle_link_event(link, event),
            None => {}
        }
        false
    }

    fn handle_endpoint_event(&mut self, index: usize, event: &Event) {
        let Some(endpoint) = self.io.endpoints.get_mut(index) else {
            return;
        };
        match &mut endpoint.state {
            State::Listening(..) => self.accept(index),
            State::Connecting(..) => self.check_connected(index),
            State::Datagrams(port) => {
                if event.is_writable() && !port.writable {
                    port.writable = true;
                    let links = port.links();
                    links.iter().for_each(|link| self.io.flush(&mut self.router, *link, self.now));
                }
                if event.is_readable() || event.is_error() {
                    self.receive_datagrams(index);
                }
            }
            State::Waiting | State::Resolving | State::Opening | State::Up(_) => {}
        }
    }

    fn handle_link_event(&mut self, id: LinkId, event: &Event) {
        let Some(link) = self.io.links.get_mut(id) else {
            return;
        };
        let Output::Stream(output) = &mut link.output else {
            return;
        };
        output.read_closed |= event.is_read_closed() || event.is_error();
        if event.is_writable() && !output.writable {
            output.writable = true;
            self.io.flush(&mut self.router, id, self.now);
        }
        if event.is_readable() || event.is_read_closed() || event.is_error() {
            self.receive_stream(id);
        }
    }

    fn handle_timers(&mut self) {
        while let Some(timer) = self.timers.pop_due(self.now) {
            match timer {
                Timer::Endpoint(index) => self.handle_deadline(index),
                Timer::Peers(index) => self.expire_peers(index),
                Timer::Pause => self.handle_pause(),
                Timer::Pace(link) => {
                    self.pace_timers.remove(link);
                    self.io.flush(&mut self.router, link, self.now);
                }
                Timer::Stall(link) => {
                    self.stall_timers.remove(link);
                    self.check_stalled(link);
                }
                Timer::Notify => self.feed_watchdog(),
                Timer::Router => {
                    self.router_deadline = None;
                    self.router.handle_timeout(self.now);
                }
            }
        }
    }

    /// Sets the timers that this turn has made necessary, each once.
    fn set_timers(&mut self) {
        let deadline = self.router.poll_timeout();
        if let Some(at) = deadline
            && self.router_deadline.is_none_or(|set| set > at)
        {
            self.timers.set(at, Timer::Router);
            self.router_deadline = deadline;
        }
        for link in std::mem::take(&mut self.io.paced).iter() {
            let ready = self.router.port(link).and_then(|port| port.ready_at(self.now));
            if let Some(at) = ready
                && !self.pace_timers.contains(link)
            {
                self.pace_timers.insert(link);
                self.timers.set(at, Timer::Pace(link));
            }
        }
        for link in std::mem::take(&mut self.io.blocked).iter() {
            self.set_stall_timer(link);
        }
    }

    fn set_stall_timer(&mut self, id: LinkId) {
        let Some(at) = self.stalled_at(id) else { return };
        if !self.stall_timers.contains(id) {
            self.stall_timers.insert(id);
            self.timers.set(at, Timer::Stall(id));
        }
    }

    /// When a connection will have stalled, if it takes nothing until then. A serial port may
    /// wait for ever: whoever is behind it can be asked for nothing.
    fn stalled_at(&self, id: LinkId) -> Option<Time> {
        let link = self.io.links.get(id)?;
        let Output::Stream(output) = &link.output else { return None };
        let Stream::Tcp(_) = output.stream else { return None };
        let timeout = self.io.endpoints[link.endpoint].options().stall_timeout;
        Some(output.blocked_since? + timeout)
    }

    /// Closes a connection that has taken nothing for too long.
    fn check_stalled(&mut self, id: LinkId) {
        match self.stalled_at(id) {
            Some(at) if at <= self.now => self.close_link(id, "it takes nothing any more"),
            _ => self.set_stall_timer(id),
        }
    }

    /// Whether anything still waits to be sent where it can be.
    fn has_backlog(&self) -> bool {
        let links = self.router.links();
        links.iter().any(|link| self.router.port(link).is_some_and(|port| port.backlog() > 0))
    }
}
