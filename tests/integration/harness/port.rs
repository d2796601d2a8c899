//! A port that somebody else is to listen at, where the number has to be known before.

use std::fs;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use super::eventually;

/// Below those that the system gives to who asks for any, so that it gives this one to nobody.
const FIRST: u32 = 20_000;
const COUNT: u32 = 10_000;

/// A port number of UDP and TCP that no other test has as long as this is kept.
pub(crate) struct FreePort {
    number: u16,
    /// A name that only one of all programs can have, and that ends with it.
    _mark: UnixDatagram,
}

impl FreePort {
    /// One at which nobody listens.
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        // Who runs at the same time begins elsewhere.
        let begin = process::id() * 61;
        let port = (0..COUNT).find_map(|_| {
            let at = begin.wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed)) % COUNT;
            let number = u16::try_from(FIRST + at).expect("a port number");
            let mark = mark(number)?;
            is_free(number).then_some(Self { number, _mark: mark })
        });
        port.expect("a free port")
    }

    /// This very one, once no other test has it; whether another program does is not said.
    pub(crate) fn of(number: u16) -> Self {
        let mut found = None;
        eventually(&format!("port {number} for this test alone"), || {
            found = mark(number);
            found.is_some()
        });
        Self { number, _mark: found.expect("a mark") }
    }

    /// Its number.
    pub(crate) fn number(&self) -> u16 {
        self.number
    }

    /// `127.0.0.1:PORT`.
    pub(crate) fn here(&self) -> String {
        format!("127.0.0.1:{}", self.number)
    }
}

fn mark(number: u16) -> Option<UnixDatagram> {
    let name = SocketAddr::from_abstract_name(format!("mavswitch-test-port-{number}"));
    UnixDatagram::bind_addr(&name.expect("a short name")).ok()
}

/// Looked up and not tried: a socket lives on in a process that is being forked just now.
fn is_free(number: u16) -> bool {
    let port = format!(":{number:04X}");
    ["udp", "udp6", "tcp", "tcp6"].iter().all(|table| {
        // There may be no IPv6.
        let table = fs::read_to_string(format!("/proc/net/{table}")).unwrap_or_default();
        let mut local = table.lines().filter_map(|line| line.split_whitespace().nth(1));
        !local.any(|address| address.ends_with(&port))
    })
}
