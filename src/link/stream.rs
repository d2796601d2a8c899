//! A byte stream that is read and written without waiting: a TCP connection or a serial port.

use std::fs::File;
use std::io::{self, IoSlice, Read, Write};
use std::os::fd::AsRawFd;
use std::time::Duration;

use mio::event::Source;
use mio::net::TcpStream;
use mio::unix::SourceFd;
use mio::{Interest, Registry, Token};

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

/// How slow the other side of a stream is, by how long it keeps us waiting for room.
///
/// What one is slow to take shall wait in our queue, where we choose what to refuse, and not grow
/// old in the system's buffer.
#[derive(Clone, Copy, Default, Debug)]
pub struct Slowness {
    /// How long it counts as slow yet, once it does.
    until: Option<Time>,
}

impl Slowness {
    /// Who keeps us waiting for longer is slow: what it gets is at least as old.
    const SLOW: Duration = Duration::from_millis(250);
    /// For how long it is then taken to be.
    const REMEMBERED: Duration = Duration::from_secs(60);

    /// It took something at `now`, after it had taken nothing since `blocked_since`.
    pub fn handle_progress(&mut self, stream: &Stream, blocked_since: Option<Time>, now: Time) {
        let Stream::Tcp(stream) = stream else { return };
        let was_slow = self.until.is_some();
        if blocked_since.is_some_and(|since| now.since(since) > Self::SLOW) {
            self.until = Some(now + Self::REMEMBERED);
        } else if self.until.is_some_and(|until| until < now) {
            self.until = None;
        }
        if was_slow != self.until.is_some() {
            // A system that cannot do it does as before.
            let _ = limit_unsent(stream, !was_slow);
        }
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
