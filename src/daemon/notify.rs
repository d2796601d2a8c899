//! Speaks to the service manager: the notification protocol of systemd, sd_notify(3).
//!
//! Datagrams of `NAME=value` lines to the socket that `NOTIFY_SOCKET` names; without that variable
//! nothing is opened and nothing is sent. Nothing here waits, and nothing here can fail the
//! program: a message that does not get through is sent again where that matters, or is left out.
//! What to say, and when, is for `service`.

use std::ffi::OsString;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

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
    /// The message that says that the program is ready, if it did not get through yet.
    owed: Option<String>,
    /// When there is something to send, whatever happens until then.
    deadline: Option<Time>,
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

    /// Everything that is configured has been opened. From now on the watchdog is fed.
    pub(super) fn handle_ready(&mut self, status: String, now: Time) {
        self.owed = Some(format!("READY=1\nSTATUS={status}"));
        self.status = status;
        self.looked = Some(now);
        self.handle_timeout(now);
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

    /// When [`Self::handle_timeout`] has something to send.
    pub(super) fn poll_timeout(&self) -> Option<Time> {
        self.deadline
    }

    /// Feeds the watchdog, and says again what did not get through.
    pub(super) fn handle_timeout(&mut self, now: Time) {
        let message = self.owed.take();
        let is_ready = message.is_none();
        match self.send(message.as_deref().unwrap_or("WATCHDOG=1")) {
            Outcome::Busy => {
                self.owed = message;
                let delay = self.period.filter(|_| is_ready).map_or(RETRY, |it| it.min(RETRY));
                self.deadline = Some(now + delay);
            }
            Outcome::Done => self.deadline = self.period.map(|period| now + period),
        }
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
