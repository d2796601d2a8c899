//! What an endpoint does next: opened at the start, tried again when that failed, connected,
//! opened again when its link broke.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use super::endpoint::{Failure, Role, State};
use super::endpoint_table::EndpointId;
use super::error::{StartError, already, may_pass};
use super::event_loop::Daemon;
use super::open::{OpenError, socket_address};
use super::timers::Timer;
use crate::config::{Address, Host};
use crate::link::{Stream, interface_index, tune};
use crate::routing::LinkId;
use tracing::debug;

/// How long a TCP connection may take to be made.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

impl Daemon {
    /// Opens all endpoints. What may yet come, as a device that is not plugged in, is waited for.
    ///
    /// # Errors
    ///
    /// If one cannot be opened and waiting would not help.
    pub(super) fn open_all(&mut self) -> Result<(), StartError> {
        self.start_signing_time();
        for index in self.io.endpoints.ids() {
            let Err(failure) = self.open(index) else {
                continue;
            };
            let config = &self.io.endpoints[index].config;
            if !may_pass(config, &failure.error) {
                let OpenError { action, error } = failure;
                let holder = self.holder(config, &error);
                return Err(StartError::endpoint(config, action, error, holder.as_deref()));
            }
            self.try_later(index, failure);
        }
        self.await_serial_ports()?;
        self.now = self.clock();
        Ok(())
    }

    /// Opens an endpoint, or asks for the address of its host first.
    pub(super) fn open(&mut self, index: EndpointId) -> Result<(), OpenError> {
        let endpoint = &mut self.io.endpoints[index];
        if !endpoint.options().enabled {
            return Ok(());
        }
        let Some(host_port) = endpoint.config.address.host_port() else {
            return match endpoint.config.address {
                Address::Serial { .. } => self.open_serial(index),
                Address::Tlog(_) => self.open_replay(index),
                Address::Sim => self.open_sim(index),
                // Whoever has added it has opened it.
                _ => Ok(()),
            };
        };
        if let Some(address) = endpoint.addresses.get(endpoint.next_address).copied() {
            endpoint.next_address += 1;
            return self.open_at(index, address);
        }
        let failed = |error| OpenError { action: format!("use {host_port}"), error };
        match socket_address(host_port).map_err(failed)? {
            Some(address) => self.open_at(index, address),
            None => self.resolve(index),
        }
    }

    fn open_at(&mut self, index: EndpointId, address: SocketAddr) -> Result<(), OpenError> {
        if let Some(device) = &self.io.endpoints[index].config.options.dev {
            let action = format!("use the network interface {device}");
            interface_index(device).map_err(|error| OpenError { action, error })?;
        }
        self.open_socket(index, address)?;
        let endpoint = &self.io.endpoints[index];
        match endpoint.state {
            State::Connecting(..) => self.set_deadline(index, CONNECT_TIMEOUT),
            _ => self.begin_upkeep(index, address),
        }
        Ok(())
    }

    fn resolve(&mut self, index: EndpointId) -> Result<(), OpenError> {
        let endpoint = &mut self.io.endpoints[index];
        let Some(host_port) = endpoint.config.address.host_port() else {
            return Ok(());
        };
        let Host::Name(name) = &host_port.host else {
            return Ok(());
        };
        let action = format!("resolve {name}");
        if !endpoint.is_asking {
            let asked = self.resolver.ask(index, name.clone(), host_port.port);
            asked.map_err(|error| OpenError { action, error })?;
            endpoint.is_asking = true;
        }
        endpoint.set_state(State::Resolving, self.now);
        Ok(())
    }

    /// Does what was put off.
    pub(super) fn handle_deadline(&mut self, index: EndpointId) {
        let Some(endpoint) = self.io.endpoints.get_mut(index) else { return };
        if endpoint.deadline.is_none_or(|deadline| deadline > self.now) {
            return;
        }
        endpoint.deadline = None;
        match &endpoint.state {
            State::Waiting => {
                if let Err(failure) = self.open(index) {
                    self.try_later(index, failure);
                }
            }
            State::Connecting(_, address) => {
                let action = format!("connect to {address}");
                self.try_later(index, OpenError { action, error: io::ErrorKind::TimedOut.into() });
            }
            State::Up(link) => {
                let link = *link;
                self.check_serial(index, link);
            }
            State::Listening(..) | State::Datagrams(_) => self.look_after(index),
            State::Opening => self.warn_of_slow_open(index),
            State::Resolving => {}
        }
    }

    /// Finds out what became of a TCP connection that is being made.
    pub(super) fn check_connected(&mut self, index: EndpointId) {
        let endpoint = &mut self.io.endpoints[index];
        let State::Connecting(stream, address) = &endpoint.state else {
            return;
        };
        let (address, patience) = (*address, endpoint.config.options.stall_timeout);
        let outcome = match stream.take_error() {
            Ok(Some(error)) | Err(error) => Err(error),
            // Not yet: an event for another reason.
            Ok(None) if stream.peer_addr().is_err() => return,
            Ok(None) => Ok(()),
        };
        let State::Connecting(mut stream, _) =
            std::mem::replace(&mut endpoint.state, State::Waiting)
        else {
            return;
        };
        let outcome = outcome
            .and_then(|()| self.poll.registry().deregister(&mut stream))
            .and_then(|()| tune(&stream, patience))
            .and_then(|()| self.add_stream(index, address.to_string(), Stream::Tcp(stream)));
        match outcome {
            Ok(link) => self.set_open(index, State::Up(link)),
            Err(error) => {
                let action = format!("connect to {address}");
                self.try_later(index, OpenError { action, error });
            }
        }
    }

    /// An endpoint is open: the next failure will be a new one.
    pub(super) fn set_open(&mut self, index: EndpointId, state: State) {
        let endpoint = &mut self.io.endpoints[index];
        endpoint.set_state(state, self.now);
        endpoint.openings += 1;
        endpoint.failure = None;
        endpoint.told = None;
        endpoint.is_missed = false;
        endpoint.is_refusing = false;
        endpoint.deadline = None;
        // The others are for when it fails; the next time it begins with the first again.
        endpoint.forget_addresses();
        if !matches!(endpoint.state, State::Up(_)) {
            endpoint.backoff.reset();
        }
    }

    /// Tells of a failure, once, and tries again later.
    pub(super) fn try_later(&mut self, index: EndpointId, OpenError { action, error }: OpenError) {
        let holder = self.holder(&self.io.endpoints[index].config, &error);
        let endpoint = &mut self.io.endpoints[index];
        endpoint.set_state(State::Waiting, self.now);
        let failure = Failure::new(&endpoint.config, &action, &error, holder.as_deref());
        endpoint.failure = Some(failure);
        // Several addresses that fail in turn for the same reason are one failure.
        let verb = action.split(' ').next().unwrap_or_default().to_owned();
        let failure = Some((verb, error.kind()));
        if endpoint.is_missed && is_absence(&error) {
            debug!("{}: cannot {action}: {error}", endpoint.name);
        } else if endpoint.told != failure {
            endpoint.told = failure;
            let outlook = if endpoint.tries_once() { "" } else { "; waiting for it" };
            let holder = already(holder.as_deref());
            self.warn(index, &format!("cannot {action}: {error}{holder}{outlook}"));
        }
        self.try_again(index);
    }

    /// Tries again after a while, or the next of several addresses at once.
    pub(super) fn try_again(&mut self, index: EndpointId) {
        let endpoint = &mut self.io.endpoints[index];
        let has_more = endpoint.next_address < endpoint.addresses.len();
        if !has_more && endpoint.tries_once() {
            return self.tell(index, "not tried again (retry=0)");
        }
        let delay = if has_more { Duration::ZERO } else { endpoint.backoff.next_delay() };
        if !has_more {
            endpoint.forget_addresses();
        }
        self.set_deadline(index, delay);
    }

    pub(super) fn set_deadline(&mut self, index: EndpointId, delay: Duration) {
        let at = self.now + delay;
        self.io.endpoints[index].deadline = Some(at);
        self.timers.set(at, Timer::Endpoint(index));
    }

    /// A link of an endpoint is gone; `was_heard`: it had brought frames.
    pub(super) fn handle_closed(&mut self, index: EndpointId, link: LinkId, was_heard: bool) {
        let endpoint = &mut self.io.endpoints[index];
        match &mut endpoint.state {
            State::Listening(_, count) => *count = count.saturating_sub(1),
            State::Datagrams(port) => {
                if let Role::Server(peers) = &mut port.role {
                    peers.remove(link);
                }
            }
            State::Up(up) if *up == link => {
                endpoint.set_state(State::Waiting, self.now);
                if was_heard {
                    endpoint.backoff.reset();
                }
                self.try_again(index);
            }
            _ => {}
        }
    }
}

/// Whether an error says no more than that a device, a host or a network is not there.
fn is_absence(error: &io::Error) -> bool {
    use io::ErrorKind::{
        AddrNotAvailable, ConnectionAborted, ConnectionRefused, ConnectionReset, HostUnreachable,
        NetworkDown, NetworkUnreachable, NotConnected, NotFound, TimedOut,
    };
    let absences = [libc::ENXIO, libc::ENODEV, libc::EIO];
    error.raw_os_error().is_some_and(|code| absences.contains(&code))
        || matches!(
            error.kind(),
            AddrNotAvailable
                | ConnectionAborted
                | ConnectionRefused
                | ConnectionReset
                | HostUnreachable
                | NetworkDown
                | NetworkUnreachable
                | NotConnected
                | NotFound
                | TimedOut
        )
}
