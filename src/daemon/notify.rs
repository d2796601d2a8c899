//! Speaks to the service manager: the notification protocol of systemd, sd_notify(3).
//!
//! Datagrams of `NAME=value` lines to the socket that `NOTIFY_SOCKET` names; without that variable
//! nothing is opened and nothing is sent. Nothing here waits, and nothing here can fail the
//! program: a message that does not get through is sent again where that matters, or is left out.
//! What to say, and when, is for `service`.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use tracing::{trace, warn};

use crate::routing::Time;

/// When a message that did not get through is sent again.
const RETRY: Duration = Duration::from_millis(100);

/// How often the status may be told.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);

/// The watchdog is not fed more often than this, whatever period it is said to have.
const LEAST_PERIOD: Duration = Duration::from_millis(1);

/// The service manager's ear, if it has one.
#[derive(Default, Debug)]
pub(super) struct Notifier {
    target: Option<Target>,
    /// Half the time after which the manager takes the program for stuck.
    period: Option<Duration>,
    /// Messages that must get through and did not yet, in their order: a reload at most, and its
    /// end.
    owed: VecDeque<String>,
    /// When there is something to send, whatever happens until then.
    deadline: Option<Time>,
    /// The deadline that [`Self::take_timeout`] gave last.
    taken: Option<Time>,
    /// The status that was told last, and when one was last looked for.
    status: String,
    looked: Option<Time>,
}

/// Where messages go.
#[derive(Debug)]
struct Target {
    socket: UnixDatagram,
    address: SocketAddr,
    /// Whether a failure has been logged: one line is enough.
    is_failing: bool,
}

/// What became of a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Outcome {
    /// It is sent, or never will be.
    Done,
    /// The manager is busy: later it may get through.
    Busy,
}

impl Notifier {
    /// What the environment asks for; that may be nothing.
    pub(super) fn from_environment() -> Self {
        Self::from_variables(|name| std::env::var_os(name))
    }

    fn from_variables(variable: impl Fn(&str) -> Option<OsString>) -> Self {
        let Some(path) = variable("NOTIFY_SOCKET") else { return Self::default() };
        match Target::open(path.as_bytes()) {
            Ok(target) => {
                let period = watchdog_period(variable);
                Self { target: Some(target), period, ..Self::default() }
            }
            Err(error) => {
                warn!("NOTIFY_SOCKET={}: {error}", path.display());
                Self::default()
            }
        }
    }

    /// Everything that is configured has been opened, at the start or after a reload. From now on
    /// the watchdog is fed.
    pub(super) fn handle_ready(&mut self, status: String, now: Time) {
        self.owed.push_back(format!("READY=1\nSTATUS={status}"));
        self.status = status;
        self.looked = Some(now);
        self.send_owed(now);
    }

    /// The configuration is about to be read anew. Whatever comes of it, [`Self::handle_ready`]
    /// has to follow: until then `systemctl reload` waits.
    pub(super) fn handle_reloading(&mut self, now: Time) {
        // `Type=notify-reload` takes only a message from after its signal, and knows it by this.
        let clock = clock_gettime(ClockId::Monotonic);
        let micros = clock.tv_sec * 1_000_000 + clock.tv_nsec / 1_000;
        // What an earlier reload still has to say is of no interest any more.
        self.owed.clear();
        self.owed.push_back(format!("RELOADING=1\nMONOTONIC_USEC={micros}"));
        self.send_owed(now);
    }

    /// The program is about to end.
    pub(super) fn handle_stopping(&mut self) {
        self.send("STOPPING=1");
    }

    /// Whether a new status would be sent now. Asking counts as looking: it is worth no more than
    /// one look in [`STATUS_INTERVAL`].
    pub(super) fn wants_status(&mut self, now: Time) -> bool {
        let is_due = |last: Time| now.since(last) >= STATUS_INTERVAL;
        if self.target.is_none() || !self.looked.is_some_and(is_due) {
            return false;
        }
        self.looked = Some(now);
        true
    }

    /// Tells how the program is getting on, if that has changed.
    pub(super) fn handle_status(&mut self, status: String) {
        // One that does not get through counts as not told, and the next look tries again.
        if status != self.status && self.send(&format!("STATUS={status}")) == Outcome::Done {
            self.status = status;
        }
    }

    /// When [`Self::handle_timeout`] has something to send, if that was not given before: one
    /// timer for each deadline is enough.
    pub(super) fn take_timeout(&mut self) -> Option<Time> {
        let deadline = self.deadline.filter(|_| self.deadline != self.taken);
        self.taken = deadline.or(self.taken);
        deadline
    }

    /// Feeds the watchdog, and says again what did not get through. Before the deadline it does
    /// nothing.
    pub(super) fn handle_timeout(&mut self, now: Time) {
        if self.deadline.is_none_or(|deadline| now < deadline) {
            return;
        }
        self.deadline = None;
        if !self.owed.is_empty() {
            self.send_owed(now);
        } else if self.send("WATCHDOG=1") == Outcome::Done {
            self.deadline = self.period.map(|period| now + period);
        } else {
            self.deadline = self.period.map(|period| now + period.min(RETRY));
        }
    }

    fn send_owed(&mut self, now: Time) {
        // The next meal of the watchdog is not put off.
        let meal = self.deadline.filter(|deadline| *deadline > now);
        while let Some(message) = self.owed.pop_front() {
            if self.send(&message) == Outcome::Busy {
                self.owed.push_front(message);
                let retry = now + RETRY;
                self.deadline = Some(meal.map_or(retry, |meal| meal.min(retry)));
                return;
            }
        }
        self.deadline = meal.or_else(|| self.period.map(|period| now + period));
    }

    fn send(&mut self, message: &str) -> Outcome {
        self.target.as_mut().map_or(Outcome::Done, |target| target.send(message))
    }
}

impl Target {
    /// A socket for messages to `path`, which is absolute, or abstract after an `@`.
    fn open(path: &[u8]) -> io::Result<Self> {
        let address = match path {
            [b'@', name @ ..] => SocketAddr::from_abstract_name(name)?,
            [b'/', ..] => SocketAddr::from_pathname(std::ffi::OsStr::from_bytes(path))?,
            _ => return Err(io::Error::other("neither an absolute path nor an abstract socket")),
        };
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, address, is_failing: false })
    }

    fn send(&mut self, message: &str) -> Outcome {
        trace!("to the service manager: {}", message.replace('\n', ", "));
        match self.socket.send_to_addr(message.as_bytes(), &self.address) {
            Ok(_) => self.is_failing = false,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Outcome::Busy,
            Err(error) => {
                if !self.is_failing {
                    warn!("cannot speak to the service manager: {error}");
                }
                self.is_failing = true;
            }
        }
        Outcome::Done
    }
}

/// How often to feed the watchdog, if there is one and it is meant for this process.
fn watchdog_period(variable: impl Fn(&str) -> Option<OsString>) -> Option<Duration> {
    let number = |name| variable(name)?.to_str()?.parse::<u64>().ok();
    let is_ours = variable("WATCHDOG_PID").is_none()
        || number("WATCHDOG_PID") == Some(u64::from(std::process::id()));
    let timeout = number("WATCHDOG_USEC").filter(|timeout| is_ours && *timeout > 0)?;
    Some((Duration::from_micros(timeout) / 2).max(LEAST_PERIOD))
}

#[cfg(test)]
mod tests;
