//! SIGINT and SIGTERM, which end the program, and SIGHUP, which reloads its configuration: readable
//! on a socket of the poll loop.

use std::io::{self, IsTerminal, Read};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use mio::{Interest, Registry, Token};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::low_level::pipe;

/// What signals ask for.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) struct Asked {
    pub(super) stop: bool,
    pub(super) reload: bool,
}

/// The end of the pipe that the loop watches, and what was asked for.
pub(super) struct Signals {
    pipe: mio::net::UnixStream,
    stop: Arc<AtomicBool>,
    reload: Arc<AtomicBool>,
    /// Whether each of the standard streams was a terminal at the start.
    terminals: [bool; 3],
}

impl Signals {
    /// From now on, signals are events of `token`.
    ///
    /// # Errors
    ///
    /// If the system refuses sockets or handlers.
    pub(super) fn register(registry: &Registry, token: Token) -> io::Result<Self> {
        let (signals, write) = Self::unregistered(registry, token)?;
        for (signal, is_asked) in
            [(SIGINT, &signals.stop), (SIGTERM, &signals.stop), (SIGHUP, &signals.reload)]
        {
            // The flag comes first: whoever is woken by the pipe finds it.
            flag::register(signal, Arc::clone(is_asked))?;
            pipe::register(signal, write.try_clone()?)?;
        }
        Ok(signals)
    }

    /// Ears that hear nothing yet; what is written to the pipe is an event of `token`.
    fn unregistered(registry: &Registry, token: Token) -> io::Result<(Self, UnixStream)> {
        let (read, write) = UnixStream::pair()?;
        read.set_nonblocking(true)?;
        let mut pipe = mio::net::UnixStream::from_std(read);
        registry.register(&mut pipe, token, Interest::READABLE)?;
        let (stop, reload) = <(Arc<AtomicBool>, Arc<AtomicBool>)>::default();
        Ok((Self { pipe, stop, reload, terminals: terminals() }, write))
    }

    /// Ears that never hear anything, for tests that run a loop of their own.
    ///
    /// # Errors
    ///
    /// If the system refuses sockets.
    #[cfg(test)]
    pub(super) fn deaf(registry: &Registry, token: Token) -> io::Result<Self> {
        Self::unregistered(registry, token).map(|(signals, _)| signals)
    }

    /// What was asked for since the last call.
    ///
    /// A terminal that is closed sends SIGHUP too; whoever was started there is to end with it.
    pub(super) fn take(&mut self) -> Asked {
        let mut bytes = [0; 64];
        // What does not fit in is another event.
        let _ = self.pipe.read(&mut bytes);
        let is_hung_up = self.reload.swap(false, Ordering::Relaxed);
        let is_gone = |(was, is): (bool, bool)| was && !is;
        let has_lost_terminal =
            is_hung_up && self.terminals.into_iter().zip(terminals()).any(is_gone);
        Asked {
            stop: self.stop.swap(false, Ordering::Relaxed) || has_lost_terminal,
            reload: is_hung_up && !has_lost_terminal,
        }
    }
}

/// Whether standard input, output and error are terminals.
fn terminals() -> [bool; 3] {
    [io::stdin().is_terminal(), io::stdout().is_terminal(), io::stderr().is_terminal()]
}
