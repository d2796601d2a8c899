//! The metrics, the status as JSON and the status page over HTTP, served by the loop between two
//! turns.
//!
//! A connection is one request and one answer. Connections, what a request may be and how long
//! either may take are bounded; while all places are taken, whoever comes waits in the kernel.

mod connection;
mod request;
mod response;

use std::net::SocketAddr;
use std::time::Duration;

use mio::event::Event;
use mio::net::TcpListener;
use mio::{Interest, Registry, Token};
use tracing::{info, warn};

use self::connection::{Connection, Progress};
use self::request::{Request, Resource};
use self::response::{Response, Status};
use super::error::{already, collide};
use super::event_loop::{Daemon, Meaning};
use super::peers::{ACCEPT_AGAIN, next_caller};
use super::timers::Timer;
use crate::link::listen;
use crate::routing::Time;
use crate::status::{Metrics, PAGE};

pub use self::request::fuzz_http_request;

/// How many connections there can be at the same time.
pub const MAX_HTTP_CLIENTS: usize = 16;

/// When to try again to listen, where that failed.
const RETRY: Duration = Duration::from_secs(5);

/// The port, and who is connected.
pub(super) struct Http {
    /// Where to listen, and the socket that does.
    address: Option<SocketAddr>,
    listener: Option<TcpListener>,
    /// Whether it was told that there is none.
    has_warned: bool,
    connections: [Option<Connection>; MAX_HTTP_CLIENTS],
    /// Whether somebody may wait to be accepted.
    is_knocked: bool,
    /// Whether there may be anything to do before the next turn.
    has_work: bool,
    /// Which connection has the first right to a picture of everything; only one is made a turn, as
    /// frames wait meanwhile.
    first: usize,
    /// When to try to listen again.
    retry_at: Option<Time>,
    /// When to try again to accept, where that failed.
    accept_at: Option<Time>,
    /// What [`Timer::Http`] was last set for.
    deadline: Option<Time>,
    metrics: Metrics,
}

impl Http {
    /// No port, and nobody there.
    pub(super) fn closed() -> Self {
        Self {
            address: None,
            listener: None,
            has_warned: false,
            connections: [const { None }; MAX_HTTP_CLIENTS],
            is_knocked: false,
            has_work: false,
            first: 0,
            retry_at: None,
            accept_at: None,
            deadline: None,
            metrics: Metrics::default(),
        }
    }

    /// Something has happened to the listener, `number` 0, or to a connection.
    pub(super) fn handle_event(&mut self, number: u8, event: &Event) {
        self.has_work = true;
        match usize::from(number).checked_sub(1) {
            None => self.is_knocked = true,
            Some(slot) => {
                if let Some(Some(connection)) = self.connections.get_mut(slot) {
                    connection.handle_event(event);
                }
            }
        }
    }

    /// A deadline has come.
    pub(super) fn handle_timeout(&mut self) {
        (self.has_work, self.deadline) = (true, None);
    }

    /// Whether it has the TCP port that is wanted at this address.
    pub(super) fn listens_at(&self, wanted: SocketAddr) -> bool {
        let local = self.listener.as_ref().and_then(|listener| listener.local_addr().ok());
        local.is_some_and(|local| collide(local, wanted))
    }

    /// Whether requests have to name this computer by its address, or as `localhost`: else a page
    /// of anybody's in a browser here could have its own name lead to us, and read our answers.
    fn is_local(&self) -> bool {
        self.address.is_some_and(|address| address.ip().is_loopback())
    }

    fn accept_all(&mut self, registry: &Registry, now: Time) {
        self.accept_at = None;
        while let (true, Some(listener)) = (self.is_knocked, &self.listener) {
            let Some(slot) = self.connections.iter().position(Option::is_none) else { return };
            match next_caller(|| listener.accept()) {
                Ok(Some((stream, _))) => {
                    // The listener is number 0.
                    let token = Meaning::Http(slot as u8 + 1).token();
                    self.connections[slot] = Connection::new(stream, registry, token, now).ok();
                }
                Ok(None) => self.is_knocked = false,
                Err(_) => {
                    self.accept_at = Some(now + ACCEPT_AGAIN);
                    return;
                }
            }
        }
    }
}

impl Daemon {
    /// Listens where that is wanted now. Without it everything else works as well.
    pub(super) fn open_http(&mut self) {
        let wanted = self.general.metrics;
        if wanted != self.http.address {
            self.http.address = wanted;
            self.http.listener = None;
            self.http.has_warned = false;
            self.http.retry_at = None;
        }
        if let (Some(address), None) = (wanted, &self.http.listener) {
            self.listen_http(address);
        }
        self.set_http_timer();
    }

    fn listen_http(&mut self, address: SocketAddr) {
        let token = Meaning::Http(0).token();
        self.http.retry_at = None;
        match open(address, self.poll.registry(), token) {
            Ok((listener, address)) => {
                info!("metrics and status page at http://{address}/");
                self.http.listener = Some(listener);
                (self.http.is_knocked, self.http.has_warned) = (true, false);
            }
            Err(error) => {
                if !std::mem::replace(&mut self.http.has_warned, true) {
                    let holder = already(self.endpoint_at(false, address).as_deref());
                    warn!("no metrics: cannot listen on {address}: {error}{holder}; trying again");
                }
                self.http.retry_at = Some(self.now + RETRY);
            }
        }
    }

    /// Serves whoever has asked; says whether the next turn may not wait.
    pub(super) fn serve_http(&mut self) -> bool {
        if !std::mem::take(&mut self.http.has_work) {
            return false;
        }
        self.now = self.clock();
        if self.http.retry_at.is_some_and(|at| at <= self.now) {
            self.open_http();
        }
        let mut may_picture = true;
        for slot in slots_from(self.http.first) {
            self.serve_connection(slot, &mut may_picture);
        }
        // Whoever has gone made room.
        self.http.accept_all(self.poll.registry(), self.now);
        self.set_http_timer();
        // Whoever was put off.
        self.http.has_work
    }

    /// Reads, answers, writes: as far as it goes without waiting.
    fn serve_connection(&mut self, slot: usize, may_picture: &mut bool) {
        let now = self.now;
        let Some(connection) = &mut self.http.connections[slot] else { return };
        let mut progress = connection.advance(now);
        if let Progress::Asked(request) = progress {
            if request.resource != Resource::Page {
                if !std::mem::take(may_picture) {
                    connection.put_off(request);
                    self.http.has_work = true;
                    return;
                }
                self.http.first = slot + 1;
            }
            let response = self.respond(&request);
            let Some(connection) = &mut self.http.connections[slot] else { return };
            connection.answer(&response, request.is_head);
            progress = connection.advance(now);
        }
        if let Progress::Over = progress
            && let Some(mut connection) = self.http.connections[slot].take()
        {
            connection.close(self.poll.registry());
        }
    }

    fn respond(&mut self, request: &Request) -> Response {
        if self.http.is_local() && !request.is_for_this_computer {
            return Response::refusal(Status::WrongHost);
        }
        match request.resource {
            Resource::Page => Response::page(PAGE),
            Resource::Status => Response::json(&self.snapshot()),
            Resource::Metrics(format) => {
                let snapshot = self.snapshot();
                Response::metrics(self.http.metrics.encode(snapshot, format), format)
            }
        }
    }

    fn set_http_timer(&mut self) {
        let connections = self.http.connections.iter().flatten();
        let ends = connections.map(Connection::deadline).chain(self.http.retry_at);
        let ends = ends.chain(self.http.accept_at);
        if let Some(at) = ends.min()
            && self.http.deadline.is_none_or(|set| set > at)
        {
            self.http.deadline = Some(at);
            self.timers.set(at, Timer::Http);
        }
    }
}

/// Each connection once, from one on.
fn slots_from(first: usize) -> impl Iterator<Item = usize> {
    (first..first + MAX_HTTP_CLIENTS).map(|slot| slot % MAX_HTTP_CLIENTS)
}

fn open(
    address: SocketAddr,
    registry: &Registry,
    token: Token,
) -> std::io::Result<(TcpListener, SocketAddr)> {
    let mut listener = listen(address, None, false)?;
    let address = listener.local_addr()?;
    registry.register(&mut listener, token, Interest::READABLE)?;
    Ok((listener, address))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_is_put_off_comes_before_those_who_were_answered() {
        for first in 0..=MAX_HTTP_CLIENTS {
            let slots: Vec<usize> = slots_from(first).collect();
            assert_eq!(slots.len(), MAX_HTTP_CLIENTS);
            assert_eq!(slots[0], first % MAX_HTTP_CLIENTS);
            assert!((0..MAX_HTTP_CLIENTS).all(|slot| slots.contains(&slot)));
        }
    }
}
