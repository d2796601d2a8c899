//! A daemon for tests, which turn its loop themselves.

use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::{Events, Poll, Token};

use super::event_loop::{Daemon, DaemonConfig};
use super::reload::Host;
use super::signals::Signals;
use crate::config::{EndpointConfig, General, LogLevel};
use crate::mavlink::Dialect;

/// A host that has no configuration to load.
struct Nobody;

impl Host for Nobody {
    fn load(&self) -> Result<DaemonConfig, Vec<String>> {
        Err(Vec::new())
    }

    fn set_log_level(&self, _level: LogLevel) {}
}

/// A daemon with these endpoints, none of which is open yet.
pub(super) fn daemon(general: General, endpoints: Vec<EndpointConfig>) -> Daemon {
    let dialect = Dialect::builtin();
    daemon_of(Arc::new(Nobody), DaemonConfig { general, endpoints, dialect })
}

/// The same, with a host of the test's own.
pub(super) fn daemon_of(host: Arc<dyn Host>, config: DaemonConfig) -> Daemon {
    let poll = Poll::new().unwrap();
    let signals = Signals::deaf(poll.registry(), Token(0)).unwrap();
    Daemon::new(config, host, poll, signals).unwrap()
}

/// Lets the loop work until something has become true.
pub(super) fn until(daemon: &mut Daemon, what: &str, is_true: impl Fn(&Daemon) -> bool) {
    let give_up = Instant::now() + Duration::from_secs(60);
    let mut events = Events::with_capacity(8);
    let patience = Duration::from_millis(10);
    while !is_true(daemon) {
        assert!(Instant::now() < give_up, "{what}");
        let timeout = daemon.timeout().map_or(patience, |timeout| timeout.min(patience));
        daemon.turn(&mut events, Some(timeout)).unwrap();
        while daemon.serve_control() {}
    }
}
