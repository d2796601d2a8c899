//! A stand-in for the service manager: the socket that it listens to, and what it hears there.

use std::io::ErrorKind;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::process::{self, Command};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use crate::harness::*;

/// The manager's end.
pub(crate) struct Manager {
    socket: UnixDatagram,
    /// What the program finds in `NOTIFY_SOCKET`.
    name: String,
    _dir: Option<TempDir>,
}

impl Manager {
    /// One with an abstract address.
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("mavswitch-service-{}-{number}", process::id());
            let address = SocketAddr::from_abstract_name(&name).unwrap();
            match UnixDatagram::bind_addr(&address) {
                Ok(socket) => return Self::on(socket, format!("@{name}"), None),
                // One with our number, in a container that has numbers of its own.
                Err(error) if error.kind() == ErrorKind::AddrInUse => {}
                Err(error) => panic!("no ear for the program: {error}"),
            }
        }
    }

    /// One with a file for an address.
    pub(crate) fn at_a_path() -> Self {
        let dir = TempDir::new();
        let path = dir.path("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        Self::on(socket, path.to_str().unwrap().to_owned(), Some(dir))
    }

    fn on(socket: UnixDatagram, name: String, dir: Option<TempDir>) -> Self {
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        Self { socket, name, _dir: dir }
    }

    /// Starts the program as a service of this manager.
    pub(crate) fn launch(&self, arguments: &[&str]) -> Router {
        self.launch_in(arguments, |_| {})
    }

    /// The same with a watchdog that waits for so long.
    pub(crate) fn launch_watched(&self, timeout: Duration, arguments: &[&str]) -> Router {
        let timeout = timeout.as_micros().to_string();
        self.launch_in(arguments, |command| {
            command.env("WATCHDOG_USEC", timeout);
        })
    }

    /// The same in surroundings of which `prepare` says more.
    pub(crate) fn launch_in(
        &self,
        arguments: &[&str],
        prepare: impl FnOnce(&mut Command),
    ) -> Router {
        Router::launch_in(arguments, |command| {
            command.env("NOTIFY_SOCKET", &self.name);
            prepare(command);
        })
    }

    /// The next message, which is to come.
    #[track_caller]
    pub(crate) fn hear(&self) -> String {
        self.receive().expect("a message")
    }

    /// Asserts that nothing was said that was not heard yet; who could speak has ended.
    #[track_caller]
    pub(crate) fn assert_heard_all(&self) {
        self.socket.set_nonblocking(true).unwrap();
        assert_eq!(self.receive(), None);
        self.socket.set_nonblocking(false).unwrap();
    }

    fn receive(&self) -> Option<String> {
        let mut bytes = [0; 4096];
        let count = self.socket.recv(&mut bytes).ok()?;
        Some(String::from_utf8(bytes[..count].to_vec()).unwrap())
    }
}
