//! Opens, changes and closes serial ports by threads of their own: a driver that takes its time, or
//! never answers, holds up nobody else.

use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use mio::Waker;

use super::ports::find_flight_controller;
use super::serial::{self, SerialSettings, open_serial};

/// How long what was written to a port may take to leave when that is closed.
const CLOSING: Duration = Duration::from_millis(500);

/// What became of a port.
#[derive(Debug)]
pub struct SerialAnswer<A> {
    /// Who asked.
    pub asker: A,
    /// What was asked for.
    pub outcome: SerialOutcome,
}

/// What became of a port: what was asked for, and how it went.
#[derive(Debug)]
pub enum SerialOutcome {
    /// It was to be opened. Without a device, no flight controller was found.
    Opened {
        /// Its device node, or a name that leads to that.
        device: Option<PathBuf>,
        /// The device node itself, if it could be opened.
        real: Option<PathBuf>,
        /// How it was set up.
        settings: SerialSettings,
        /// The port, whose calls return instead of waiting.
        port: io::Result<File>,
    },
    /// Its baud rate was to be changed to this one.
    BaudSet(u32, io::Result<()>),
}

/// Whom to ask for serial ports. It wakes the poll loop when it has answered.
///
/// Each asker should have one question open at a time; that bounds the threads. `A` is what an asker
/// is known by.
pub struct Opener<A> {
    answers: (Sender<SerialAnswer<A>>, Receiver<SerialAnswer<A>>),
    waker: Arc<Waker>,
    emptying: Arc<Emptying>,
}

impl<A: Send + 'static> Opener<A> {
    /// One that wakes the loop of `waker`.
    pub fn new(waker: Arc<Waker>) -> Self {
        Self { answers: channel(), waker, emptying: Arc::default() }
    }

    /// Opens a port for this program alone; without a device, that of a flight controller. The
    /// answer comes from [`Opener::poll`].
    ///
    /// # Errors
    ///
    /// If the system refuses another thread.
    pub fn open(
        &self,
        asker: A,
        device: Option<PathBuf>,
        settings: SerialSettings,
    ) -> io::Result<()> {
        let emptying = Arc::clone(&self.emptying);
        self.ask(asker, move || {
            let none =
                || io::Error::new(io::ErrorKind::NotFound, "no flight controller is plugged in");
            let device = device.or_else(find_flight_controller);
            let port = match &device {
                Some(device) => {
                    emptying.wait_for(device);
                    open_serial(device, settings)
                }
                None => Err(none()),
            };
            let real =
                device.as_ref().filter(|_| port.is_ok()).and_then(|it| it.canonicalize().ok());
            SerialOutcome::Opened { device, real, settings, port }
        })
    }

    /// Changes the baud rate of a port; the answer comes from [`Opener::poll`].
    ///
    /// # Errors
    ///
    /// If the system refuses another thread or descriptor.
    pub fn set_baud(&self, asker: A, port: &File, baud: u32) -> io::Result<()> {
        let port = port.try_clone()?;
        self.ask(asker, move || SerialOutcome::BaudSet(baud, serial::set_baud(&port, baud)))
    }

    fn ask(
        &self,
        asker: A,
        work: impl FnOnce() -> SerialOutcome + Send + 'static,
    ) -> io::Result<()> {
        let (answers, waker) = (self.answers.0.clone(), Arc::clone(&self.waker));
        let answer = move || {
            // Fails only when the program ends and nobody wants to know.
            if answers.send(SerialAnswer { asker, outcome: work() }).is_ok() {
                let _ = waker.wake();
            }
        };
        thread::Builder::new().name("serial".into()).spawn(answer).map(drop)
    }

    /// The next answer.
    pub fn poll(&self) -> Option<SerialAnswer<A>> {
        self.answers.1.try_recv().ok()
    }

    /// The next answer, if it comes before `limit` is over. For the start, before the loop runs.
    pub fn wait(&self, limit: Duration) -> Option<SerialAnswer<A>> {
        self.answers.1.recv_timeout(limit).ok()
    }

    /// Closes a port. Other programs may open it from now on; who asks here waits until it is empty.
    pub fn close(&self, port: File) {
        serial::release(&port);
        let emptied = Emptying::begin(&self.emptying, &port);
        let close = move || {
            serial::empty(&port, CLOSING);
            drop(port);
            drop(emptied);
        };
        // Without a thread, the port is closed here and now.
        let _ = thread::Builder::new().name("serial".into()).spawn(close);
    }

    /// Waits until all ports are closed that were to be, at most until `limit` is over.
    pub fn wait_until_closed(self, limit: Duration) {
        self.emptying.wait_while(limit, |devices| !devices.is_empty());
    }
}

/// The devices whose ports are being emptied, by number. What is thrown away of a port goes for the
/// whole device: also what somebody has written who has opened it meanwhile.
#[derive(Default)]
struct Emptying {
    /// `None`: one that cannot be told.
    devices: Mutex<Vec<Option<u64>>>,
    is_one_less: Condvar,
}

impl Emptying {
    /// A port is being emptied and closed until the value that this gives is gone.
    fn begin(this: &Arc<Self>, port: &File) -> Emptied {
        let device = port.metadata().ok().map(|found| found.rdev());
        this.devices().push(device);
        Emptied { device, of: Arc::clone(this) }
    }

    /// Waits until no port of a device is being emptied, but not for a driver that hangs.
    fn wait_for(&self, device: &Path) {
        let Ok(device) = std::fs::metadata(device).map(|found| found.rdev()) else { return };
        self.wait_while(CLOSING * 2, |devices| devices.contains(&Some(device)));
    }

    fn wait_while(&self, limit: Duration, is_so: impl Fn(&[Option<u64>]) -> bool) {
        let waited =
            self.is_one_less.wait_timeout_while(self.devices(), limit, |devices| is_so(devices));
        drop(waited);
    }

    fn devices(&self) -> MutexGuard<'_, Vec<Option<u64>>> {
        // Whoever had it can have left nothing half done.
        self.devices.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// See [`Emptying::begin`].
struct Emptied {
    device: Option<u64>,
    of: Arc<Emptying>,
}

impl Drop for Emptied {
    fn drop(&mut self) {
        let mut devices = self.of.devices();
        if let Some(at) = devices.iter().position(|device| *device == self.device) {
            devices.swap_remove(at);
        }
        drop(devices);
        self.of.is_one_less.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mio::{Poll, Token};

    #[test]
    fn what_cannot_be_opened_is_told_and_wakes_the_loop() {
        let mut poll = Poll::new().unwrap();
        let waker = Waker::new(poll.registry(), Token(7)).unwrap();
        let opener = Opener::new(Arc::new(waker));
        let settings = SerialSettings { baud: 57_600, rtscts: false };
        opener.open(3, Some("/dev/null".into()), settings).unwrap();
        let mut events = mio::Events::with_capacity(1);
        poll.poll(&mut events, None).unwrap();
        let answer = opener.poll().unwrap();
        assert_eq!(answer.asker, 3);
        let SerialOutcome::Opened { device, port: Err(error), .. } = answer.outcome else {
            panic!("/dev/null is no serial port");
        };
        assert_eq!(device, Some("/dev/null".into()));
        assert_eq!(error.raw_os_error(), Some(libc::ENOTTY));
    }

    #[test]
    fn a_port_is_opened_when_its_predecessor_is_empty_and_not_before() {
        let poll = Poll::new().unwrap();
        let opener = Opener::new(Arc::new(Waker::new(poll.registry(), Token(7)).unwrap()));
        let settings = SerialSettings { baud: 57_600, rtscts: false };
        let emptied = Emptying::begin(&opener.emptying, &File::open("/dev/null").unwrap());
        opener.open(1, Some("/dev/null".into()), settings).unwrap();
        opener.open(2, Some("/dev/zero".into()), settings).unwrap();
        let other = opener.wait(Duration::from_secs(60)).unwrap();
        assert_eq!(other.asker, 2, "another device does not wait");
        drop(emptied);
        assert_eq!(opener.wait(Duration::from_secs(60)).unwrap().asker, 1);
        // A port that is closed is waited for, and not for ever.
        opener.close(File::open("/dev/null").unwrap());
        opener.open(3, Some("/dev/null".into()), settings).unwrap();
        assert_eq!(opener.wait(Duration::from_secs(60)).unwrap().asker, 3);
        assert_eq!(opener.emptying.devices().len(), 0);
    }
}
