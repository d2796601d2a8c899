//! Serial ports: 8N1, raw, exclusive. Drivers may take their time over any of this, and reading and
//! writing excepted, it is [`super::opener`] that calls it.

use std::fs::File;
use std::io;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, Mode, OFlags, flock};
use rustix::io::Errno;
use rustix::termios::{self, ControlModes, InputModes, OptionalActions, QueueSelector, Termios};

use super::sys;

/// How a port is set up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SerialSettings {
    /// Bits a second; any rate that the hardware takes.
    pub baud: u32,
    /// Whether the wires RTS and CTS say when each side may send.
    pub rtscts: bool,
}

/// Opens a serial port for this program alone, with calls that return instead of waiting.
///
/// # Errors
///
/// As `open(2)`; `EBUSY` if another program has it, `ENOTTY` if it is no serial port.
pub(super) fn open_serial(device: &Path, settings: SerialSettings) -> io::Result<File> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = rustix::fs::open(device, flags, Mode::empty())?;
    // The lock is asked for first: who does not get it must leave the other's port as it is.
    match flock(&port, FlockOperation::NonBlockingLockExclusive) {
        Err(Errno::WOULDBLOCK) => return Err(Errno::BUSY.into()),
        locked => locked?,
    }
    termios::ioctl_tiocexcl(&port)?;
    let mut attributes = termios::tcgetattr(&port)?;
    set_up(&mut attributes, settings)?;
    termios::tcsetattr(&port, OptionalActions::Now, &attributes)?;
    // Frames in a few milliseconds instead of sixteen, where the driver can; many cannot.
    let _ = sys::set_low_latency(&port);
    Ok(port.into())
}

fn set_up(attributes: &mut Termios, settings: SerialSettings) -> io::Result<()> {
    attributes.make_raw();
    attributes.input_modes -= InputModes::IXOFF | InputModes::IXANY;
    attributes.control_modes -= ControlModes::CSTOPB;
    // CLOCAL: a radio that has no carrier is no reason to hang up.
    attributes.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL;
    attributes.control_modes.set(ControlModes::CRTSCTS, settings.rtscts);
    Ok(attributes.set_speed(settings.baud)?)
}

/// Changes the baud rate of a port that is open.
///
/// # Errors
///
/// As `tcsetattr(3)`.
pub(super) fn set_baud(port: &File, baud: u32) -> io::Result<()> {
    let mut attributes = termios::tcgetattr(port)?;
    attributes.set_speed(baud)?;
    // What was received at the other rate makes no sense.
    termios::tcflush(port, QueueSelector::IFlush)?;
    Ok(termios::tcsetattr(port, OptionalActions::Now, &attributes)?)
}

/// Lets other programs open a port that is about to be closed.
pub(super) fn release(port: &File) {
    // On a port that is gone, both fail, and nobody else can open it either.
    let _ = termios::ioctl_tiocnxcl(port);
    let _ = flock(port, FlockOperation::NonBlockingUnlock);
}

/// Waits until what was written to a port has left, at most until `limit` is over, and throws away
/// what has not: closing a port waits for that up to 30 s, if its line takes nothing.
pub(super) fn empty(port: &File, limit: Duration) {
    let end = Instant::now() + limit;
    while Instant::now() < end && sys::unsent_bytes(port).is_ok_and(|unsent| unsent > 0) {
        sleep(Duration::from_millis(2));
    }
    let _ = termios::tcflush(port, QueueSelector::OFlush);
}
