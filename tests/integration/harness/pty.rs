//! A pseudo terminal in raw mode: the router opens one end as a serial port, the test has the other.

use std::ffi::OsString;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStringExt;
use std::path::PathBuf;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, ioctl_fionbio, read, write};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::PATIENCE;
use super::peer::{Received, Wire};

/// Both ends.
pub(crate) struct Pty {
    /// The test's end.
    pub(crate) wire: PtyWire,
    /// What the router is to open.
    pub(crate) path: PathBuf,
}

/// The test's end of a pseudo terminal.
pub(crate) struct PtyWire {
    master: OwnedFd,
    /// Keeps the terminal alive until the router has opened it, and its settings between openings.
    _slave: OwnedFd,
}

impl Pty {
    /// A new terminal, raw before anybody opens it.
    pub(crate) fn new() -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC);
        let master = master.expect("a pseudo terminal");
        grantpt(&master).expect("a pseudo terminal of our own");
        unlockpt(&master).expect("a pseudo terminal that opens");
        let name = ptsname(&master, Vec::new()).expect("a name");
        let path = PathBuf::from(OsString::from_vec(name.into_bytes()));
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let slave = open(&path, flags, Mode::empty()).expect("its other end");
        let mut settings = tcgetattr(&slave).expect("settings");
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings).expect("raw mode");
        ioctl_fionbio(&master, true).expect("an end that does not wait");
        Self { wire: PtyWire { master, _slave: slave }, path }
    }

    /// The path as text.
    pub(crate) fn device(&self) -> &str {
        self.path.to_str().expect("plain text")
    }
}

impl PtyWire {
    /// The baud rate that the other side has set.
    pub(crate) fn baud(&self) -> u32 {
        tcgetattr(&self.master).expect("settings").output_speed()
    }

    /// Takes out at most as many bytes as `buffer` holds, without waiting.
    pub(crate) fn take(&mut self, buffer: &mut [u8]) -> usize {
        match read(&self.master, buffer) {
            Ok(count) => count,
            Err(Errno::AGAIN | Errno::INTR) => 0,
            Err(error) => panic!("reading from the terminal: {error}"),
        }
    }

    /// Waits until the terminal can do `what`.
    fn wait(&self, what: PollFlags, timeout: Duration) -> bool {
        let timeout = Timespec::try_from(timeout).expect("a time limit");
        let mut fds = [PollFd::new(&self.master, what)];
        match poll(&mut fds, Some(&timeout)) {
            Ok(ready) => ready > 0,
            Err(Errno::INTR) => false,
            Err(error) => panic!("waiting for the terminal: {error}"),
        }
    }
}

impl Wire for PtyWire {
    const DATAGRAMS: bool = false;

    fn send(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            match write(&self.master, bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(Errno::AGAIN | Errno::INTR) => {
                    assert!(self.wait(PollFlags::OUT, PATIENCE), "the router does not read");
                }
                Err(error) => panic!("writing to the terminal: {error}"),
            }
        }
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Received {
        if !self.wait(PollFlags::IN, timeout) {
            return Received::Nothing;
        }
        match read(&self.master, buffer) {
            Ok(0) | Err(Errno::IO) => Received::Closed,
            Ok(count) => Received::Bytes(count),
            Err(Errno::AGAIN | Errno::INTR) => Received::Nothing,
            Err(error) => panic!("reading from the terminal: {error}"),
        }
    }
}
