//! SIGINT, SIGTERM and SIGHUP, readable on a socket of the poll loop.

use std::io::{self, Read};
use std::os::unix::net::UnixStream;

use mio::{Interest, Registry, Token};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::pipe;

/// The end of the pipe that the loop watches.
pub(super) struct Signals {
    pipe: mio::net::UnixStream,
}

impl Signals {
    /// From now on, signals are events of `token`.
    ///
    /// # Errors
    ///
    /// If the system refuses sockets or handlers.
    pub(super) fn register(registry: &Registry, token: Token) -> io::Result<Self> {
        let (read, write) = UnixStream::pair()?;
        read.set_nonblocking(true)?;
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            pipe::register(signal, write.try_clone()?)?;
        }
        let mut pipe = mio::net::UnixStream::from_std(read);
        registry.register(&mut pipe, token, Interest::READABLE)?;
        Ok(Self { pipe })
    }

    /// Whether a signal came since the last call.
    pub(super) fn take(&mut self) -> bool {
        let mut bytes = [0; 64];
        matches!(self.pipe.read(&mut bytes), Ok(count) if count > 0)
    }
}
