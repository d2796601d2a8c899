//! The loop itself: what a turn is, and which event means what.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::event::Event;
use mio::{Events, Poll, Registry, Waker};
use tracing::info;

use super::alarm::Alarm;
use super::control::Control;
use super::endpoint::State;
use super::endpoint_table::EndpointId;
use super::error::StartError;
use super::http::Http;
use super::links::Output;
use super::log_limit::LogLimit;
use super::notify::Notifier;
use super::own::Own;
use super::record::Collecting;
use super::reload::{Host, Reloader};
use super::settings::settle;
use super::signals::Signals;
use super::signing_time::SigningTime;
use super::timers::Timers;
pub(super) use super::token::Meaning;
use super::transmit::{Io, tell_of_room};
use crate::config::{EndpointConfig, General};
use crate::link::{Inbox, Opener, Resolver};
use crate::mavlink::{Checker, Dialect};
use crate::record::Recorder;
use crate::routing::{LinkId, LinkSet, Router, Time};

/// What the daemon is to do.
#[derive(Clone, Debug)]
pub struct DaemonConfig {
    /// What is configured for the program as a whole. Its definition files have been read already.
    pub general: General,
    /// What to join.
    pub endpoints: Vec<EndpointConfig>,
    /// The messages to know.
    pub dialect: Dialect,
}

/// The daemon at work.
pub(super) struct Daemon {
    pub(super) poll: Poll,
    pub(super) signals: Signals,
    pub(super) resolver: Resolver<EndpointId>,
    pub(super) opener: Opener<EndpointId>,
    pub(super) reloader: Reloader,
    pub(super) control: Control,
    pub(super) http: Http,
    /// What is configured now, and what was at the start: some of it cannot change.
    pub(super) general: General,
    pub(super) started_with: General,
    pub(super) start: Instant,
    /// The time of this turn: the clock is read once a turn.
    pub(super) now: Time,
    pub(super) router: Router,
    pub(super) checker: Checker,
    pub(super) inbox: Inbox,
    pub(super) io: Io,
    pub(super) timers: Timers,
    pub(super) alarm: Alarm,
    /// When [`super::timers::Timer::Router`] was last set for.
    pub(super) router_deadline: Option<Time>,
    /// Sources that may have more to read than a turn allows.
    pub(super) ready: Vec<Ready>,
    /// TCP servers at which connections may wait: accepted once room was made for them.
    pub(super) accepting: Vec<EndpointId>,
    /// Links that stopped in the middle of a frame.
    pub(super) unfinished: LinkSet,
    /// When [`super::timers::Timer::Pause`] has something to do.
    pub(super) pause_timer: Option<Time>,
    /// Links inside the program whose other side waits for room in the queues of others.
    pub(super) held_back: LinkSet,
    /// Where what such a link says stands until it is routed.
    pub(super) spoken: Vec<u8>,
    /// Where a datagram of somebody unknown stands while it is looked at.
    pub(super) stranger: Vec<u8>,
    pub(super) component_log: LogLimit,
    pub(super) notifier: Notifier,
    pub(super) unrouted_log: LogLimit,
    pub(super) refusal_log: LogLimit,
    pub(super) signing_time: SigningTime,
    /// Copies what is received to files, if it is to.
    pub(super) recorder: Option<Recorder>,
    /// The part of the program that takes flight-stack logs, if they are wanted.
    pub(super) collector: Option<Collecting>,
    pub(super) own: Own,
}

/// Something that has more to read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Ready {
    Link(LinkId),
    /// A UDP socket or a listener.
    Endpoint(EndpointId),
}

/// How long queues may take to drain at the end.
const LINGER: Duration = Duration::from_millis(500);

/// How many events one poll brings at most; the others come with the next.
const EVENTS: usize = 256;

/// Opens all endpoints, and moves frames between them until SIGINT or SIGTERM comes, or the terminal
/// is closed. SIGHUP makes it ask `host` for a new configuration.
///
/// # Errors
///
/// If an endpoint cannot be opened and waiting would not help; then nothing has been routed. Or if
/// the system refuses what the loop itself needs.
pub fn run(config: DaemonConfig, host: Arc<dyn Host>) -> Result<(), StartError> {
    let poll = Poll::new().map_err(StartError::System)?;
    let signals =
        Signals::register(poll.registry(), Meaning::Signal.token()).map_err(StartError::System)?;
    let mut daemon = Daemon::new(config, host, poll, signals)?;
    daemon.open_all()?;
    daemon.open_control();
    daemon.open_http();
    daemon.start_recorder();
    daemon.refresh_own();
    info!("ready");
    daemon.tell_ready();
    daemon.work().map_err(StartError::System)?;
    daemon.stop_recorder();
    daemon.close_serial_ports();
    Ok(())
}

impl Daemon {
    /// A daemon that has its endpoints, and has opened none of them.
    pub(super) fn new(
        config: DaemonConfig,
        host: Arc<dyn Host>,
        poll: Poll,
        signals: Signals,
    ) -> Result<Self, StartError> {
        let DaemonConfig { general, endpoints, dialect } = config;
        let settled = settle(endpoints, &dialect)?;
        let mut daemon = Self::empty(general, dialect, host, poll, signals)?;
        for settings in settled {
            // There are not too many: that was looked at when they were settled.
            daemon.insert_endpoint(settings);
        }
        Ok(daemon)
    }

    fn empty(
        general: General,
        dialect: Dialect,
        host: Arc<dyn Host>,
        poll: Poll,
        signals: Signals,
    ) -> Result<Self, StartError> {
        let waker = Arc::new(
            Waker::new(poll.registry(), Meaning::Wake.token()).map_err(StartError::System)?,
        );
        let alarm =
            Alarm::new(poll.registry(), Meaning::Alarm.token()).map_err(StartError::System)?;
        let registry = poll.registry().try_clone().map_err(StartError::System)?;
        let now = Time::ZERO;
        Ok(Self {
            poll,
            signals,
            resolver: Resolver::new(Arc::clone(&waker)),
            opener: Opener::new(Arc::clone(&waker)),
            reloader: Reloader::new(host, waker),
            control: Control::closed(),
            http: Http::closed(),
            start: Instant::now(),
            now,
            router: Router::new(general.router),
            started_with: General { keys: Vec::new(), ..general.clone() },
            general,
            checker: Checker::new(dialect),
            inbox: Inbox::new(),
            io: Io::new(registry),
            timers: Timers::default(),
            alarm,
            router_deadline: None,
            ready: Vec::new(),
            accepting: Vec::new(),
            unfinished: LinkSet::EMPTY,
            pause_timer: None,
            held_back: LinkSet::EMPTY,
            spoken: Vec::new(),
            stranger: Vec::new(),
            component_log: LogLimit::new(now),
            notifier: Notifier::from_environment(),
            unrouted_log: LogLimit::new(now),
            refusal_log: LogLimit::new(now),
            signing_time: SigningTime::default(),
            recorder: None,
            collector: None,
            own: Own::default(),
        })
    }

    pub(super) fn registry(&self) -> &Registry {
        self.poll.registry()
    }

    pub(super) fn clock(&self) -> Time {
        clock(self.start)
    }

    fn work(&mut self) -> io::Result<()> {
        let mut events = Events::with_capacity(EVENTS);
        let mut stopping = false;
        while !stopping {
            // What has changed is to be sent and told in a turn that does not wait.
            let has_changed = self.take_over() | self.serve_control() | self.serve_http();
            let timeout = if has_changed { Some(Duration::ZERO) } else { self.timeout() };
            stopping = self.turn(&mut events, timeout)?;
        }
        info!("stopping");
        self.notifier.handle_stopping();
        self.leave_vehicles();
        self.drain(&mut events)?;
        self.report_links();
        self.end_signing_time();
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

    /// One turn; says whether a signal asks to stop.
    pub(super) fn turn(
        &mut self,
        events: &mut Events,
        timeout: Option<Duration>,
    ) -> io::Result<bool> {
        match self.poll.poll(events, timeout) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => return Err(error),
            _ => {}
        }
        let wall = self.wall_clock();
        self.now = self.clock();
        self.begin_record_turn(wall);
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
        self.accept_all();
        self.handle_unsent();
        self.report_events();
        self.tell_status();
        self.keep_signing_time();
        self.tell_listeners();
        if let Some(recorder) = &mut self.recorder {
            recorder.end_turn();
        }
        self.set_timers();
        Ok(stop)
    }

    fn handle_event(&mut self, event: &Event) -> bool {
        match Meaning::of(event.token()) {
            Some(Meaning::Signal) => return self.handle_signals(),
            Some(Meaning::Alarm) => self.alarm.handle_event(),
            Some(Meaning::Wake) => {
                self.handle_answers();
                self.handle_serial_answers();
                self.handle_reloaded();
            }
            Some(Meaning::Endpoint(slot)) => {
                if let Some(index) = self.io.endpoints.id_at(slot) {
                    self.handle_endpoint_event(index, event);
                }
            }
            Some(Meaning::Link(link)) => self.handle_link_event(link, event),
            Some(Meaning::Control(number)) => self.control.handle_event(number, event),
            Some(Meaning::Http(number)) => self.http.handle_event(number, event),
            None => {}
        }
        false
    }

    /// Says whether the program is to end.
    fn handle_signals(&mut self) -> bool {
        let asked = self.signals.take();
        if asked.reload {
            self.ask_reload();
        }
        asked.stop
    }

    fn handle_endpoint_event(&mut self, index: EndpointId, event: &Event) {
        let Some(endpoint) = self.io.endpoints.get_mut(index) else {
            return;
        };
        match &mut endpoint.state {
            State::Listening(..) => self.accepting.push(index),
            State::Connecting(..) => self.check_connected(index),
            State::Datagrams(port) => {
                if event.is_writable() && !port.writable {
                    port.writable = true;
                    let registry = self.poll.registry();
                    // If it fails there are wake-ups for nothing, and no harm.
                    let _ = tell_of_room(registry, &mut port.socket, event.token(), false);
                    let links = port.links();
                    links.iter().for_each(|link| self.io.flush(&mut self.router, *link, self.now));
                }
                if event.is_error() {
                    self.handle_refusals(index);
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
            // As above.
            let _ = tell_of_room(self.poll.registry(), &mut output.stream, event.token(), false);
            self.io.flush(&mut self.router, id, self.now);
        }
        if event.is_readable() || event.is_read_closed() || event.is_error() {
            self.receive_stream(id);
        }
    }

    /// Whether anything still waits to be sent where it can be.
    fn has_backlog(&self) -> bool {
        let links = self.router.links();
        links.iter().any(|link| self.router.port(link).is_some_and(|port| port.backlog() > 0))
    }
}

/// What the daemon's clock shows, `start` being its zero.
pub(super) fn clock(start: Instant) -> Time {
    // Wraps after 584,000 years.
    Time::from_micros(start.elapsed().as_micros() as u64)
}
