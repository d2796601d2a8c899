//! A byte stream that is read and written without waiting: a TCP connection or a serial port.

use std::fs::File;
use std::io::{self, IoSlice, Read, Write};
use std::os::fd::AsRawFd;
use std::time::Duration;

use mio::event::Source;
use mio::net::TcpStream;
use mio::unix::SourceFd;
use mio::{Interest, Registry, Token};

use super::sys;
use super::tcp::limit_unsent;
use crate::routing::Time;

/// The stream.
#[derive(Debug)]
pub enum Stream {
    /// A TCP connection.
    Tcp(TcpStream),
    /// A serial port.
    Serial(File),
}

impl Stream {
    /// Reads what there is.
    ///
    /// # Errors
    ///
    /// As `read(2)`; `WouldBlock` if there is nothing.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.read(buffer),
            Self::Serial(file) => file.read(buffer),
        }
    }

    /// Writes as much of the two pieces as there is room for, in one call.
    ///
    /// # Errors
    ///
    /// As `writev(2)`; `WouldBlock` if there is no room.
    pub fn write(&mut self, (first, second): (&[u8], &[u8])) -> io::Result<usize> {
        let pieces = [IoSlice::new(first), IoSlice::new(second)];
        let pieces = if second.is_empty() { &pieces[..1] } else { &pieces[..] };
        match self {
            Self::Tcp(stream) => stream.write_vectored(pieces),
            Self::Serial(file) => file.write_vectored(pieces),
        }
    }
}

/// How slow the other side of a stream is: by how long it keeps us waiting for room, and by how much
/// stands in the system's buffer for it.
///
/// What one is slow to take shall wait in our queue, where we choose what to refuse, and not grow
/// old in the system's buffer.
#[derive(Clone, Copy, Default, Debug)]
pub struct Slowness {
    /// How long it counts as slow yet, once it does.
    until: Option<Time>,
    /// When the system's buffer is looked at again.
    next_look: Time,
    /// At how many looks in a row too much stood in it.
    backlogs: u8,
}

impl Slowness {
    /// Who keeps us waiting for longer is slow: what it gets is at least as old.
    const SLOW: Duration = Duration::from_millis(250);
    /// How often the system's buffer is looked at, and how many times in a row there may be too
    /// much in it: a burst is gone sooner.
    const LOOK: Duration = Duration::from_millis(250);
    const LOOKS: u8 = 4;
    /// More than this is too much, in bytes.
    const BACKLOG: usize = 65_536;
    /// For how long one is taken to be slow who was.
    const REMEMBERED: Duration = Duration::from_secs(60);

    /// It took something at `now`, after it had taken nothing since `blocked_since`.
    pub fn handle_progress(&mut self, stream: &Stream, blocked_since: Option<Time>, now: Time) {
        let Stream::Tcp(stream) = stream else { return };
        let was_slow = self.until.is_some();
        let is_slow = blocked_since.is_some_and(|since| now.since(since) > Self::SLOW);
        if self.look(stream, now) || is_slow {
            self.until = Some(now + Self::REMEMBERED);
        } else if self.until.is_some_and(|until| until < now) {
            self.until = None;
        }
        if was_slow != self.until.is_some() {
            // A system that cannot do it does as before.
            let _ = limit_unsent(stream, !was_slow);
        }
    }

    /// Whether too much has stood in the system's buffer for long.
    fn look(&mut self, stream: &TcpStream, now: Time) -> bool {
        if now < self.next_look {
            return false;
        }
        self.next_look = now + Self::LOOK;
        let is_too_much = sys::unsent_bytes(stream).is_ok_and(|unsent| unsent > Self::BACKLOG);
        self.backlogs = if is_too_much { self.backlogs.saturating_add(1) } else { 0 };
        self.backlogs >= Self::LOOKS
    }
}

impl Source for Stream {
    fn register(
        &mut self,
        registry: &Registry,
        token: Token,
        interest: Interest,
    ) -> io::Result<()> {
        match self {
            Self::Tcp(stream) => stream.register(registry, token, interest),
            Self::Serial(file) => SourceFd(&file.as_raw_fd()).register(registry, token, interest),
        }
    }

    fn reregister(
        &mut self,
        registry: &Registry,
        token: Token,
        interest: Interest,
    ) -> io::Result<()> {
        match self {
            Self::Tcp(stream) => stream.reregister(registry, token, interest),
            Self::Serial(file) => SourceFd(&file.as_raw_fd()).reregister(registry, token, interest),
        }
    }

    fn deregister(&mut self, registry: &Registry) -> io::Result<()> {
        match self {
            Self::Tcp(stream) => stream.deregister(registry),
            Self::Serial(file) => SourceFd(&file.as_raw_fd()).deregister(registry),
        }
    }
}
