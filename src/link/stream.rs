//! A byte stream that is read and written without waiting: a TCP connection or a serial port.

use std::fs::File;
use std::io::{self, IoSlice, Read, Write};
use std::os::fd::AsRawFd;

use mio::event::Source;
use mio::net::TcpStream;
use mio::unix::SourceFd;
use mio::{Interest, Registry, Token};

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
