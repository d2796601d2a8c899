//! Looks after what is open: whether a name still means the same address, and whether a network
//! interface is still the one that a socket was opened on.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tracing::info;

use super::endpoint::{Bound, Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Ready};
use super::links::Output;
use super::open::{OpenError, bind_address, own_address};
use crate::config::{Address, Host, HostPort};
use crate::link::{BATCH, Resolved, interface_index, join_multicast, take_refusals};

/// How often a name is asked for again while its address is in use.
const ASK_AGAIN: Duration = Duration::from_secs(30);

/// The same after a datagram could not be sent there.
const ASK_SOON: Duration = Duration::from_secs(2);

/// How often an interface is looked at.
const LOOK_AGAIN: Duration = Duration::from_secs(2);

impl Daemon {
    /// An endpoint was opened at an address: remembers what that depends on.
    pub(super) fn begin_upkeep(&mut self, index: EndpointId, address: SocketAddr) {
        // It was found out a moment ago, in order to open the endpoint.
        let bound = self.bound_to(index, address).unwrap_or_default();
        let endpoint = &mut self.io.endpoints[index];
        (endpoint.bound, endpoint.address) = (bound, Some(address));
        self.set_upkeep_deadline(index);
    }

    /// What the sockets of an endpoint are bound to, by which it shows that they have become
    /// useless.
    fn bound_to(&self, index: EndpointId, address: SocketAddr) -> io::Result<Bound> {
        let config = &self.io.endpoints[index].config;
        let (device, bind) = (config.options.dev.as_deref(), config.options.bind.as_ref());
        let source = match config.address {
            Address::Multicast(_) | Address::UdpBroadcast(_) => {
                Some(own_address(address, bind_address(bind, address)?, device)?)
            }
            _ => None,
        };
        Ok(Bound { interface: device.map(interface_index).transpose()?, source })
    }

    fn set_upkeep_deadline(&mut self, index: EndpointId) {
        let endpoint = &self.io.endpoints[index];
        let is_sender = matches!(endpoint.config.address, Address::UdpOut(_));
        if endpoint.bound != Bound::default() {
            self.set_deadline(index, LOOK_AGAIN);
        } else if is_sender && self.host_name(index).is_some() {
            self.set_deadline(index, ASK_AGAIN);
        }
    }

    pub(super) fn host_name(&self, index: EndpointId) -> Option<(String, u16)> {
        match self.io.endpoints[index].config.address.host_port()? {
            HostPort { host: Host::Name(name), port } => Some((name.clone(), *port)),
            _ => None,
        }
    }

    /// Something that is open wants to be looked at.
    pub(super) fn look_after(&mut self, index: EndpointId) {
        let endpoint = &self.io.endpoints[index];
        if let Some(address) = endpoint.address
            && endpoint.bound != Bound::default()
        {
            match self.bound_to(index, address) {
                Ok(bound) if bound == self.io.endpoints[index].bound => {}
                Ok(_) => return self.reopen(index, io::Error::other("the interface has changed")),
                // Short of descriptors: that says nothing of the interface.
                Err(error) if is_shortage(&error) => {}
                Err(error) => return self.reopen(index, error),
            }
        }
        self.rejoin(index);
        // Where receiving or accepting has failed, it is tried again now.
        self.ready.push(Ready::Endpoint(index));
        if let Address::UdpOut(_) = self.io.endpoints[index].config.address
            && let Some((name, port)) = self.host_name(index)
            && !std::mem::replace(&mut self.io.endpoints[index].is_asking, true)
        {
            // If there is no thread for it now, the next time will do.
            let asked = self.resolver.ask(index, name, port);
            self.io.endpoints[index].is_asking = asked.is_ok();
        }
        if self.io.endpoints[index].deadline.is_none() {
            self.set_upkeep_deadline(index);
        }
    }

    /// Joins a multicast group once more: an interface that went away has taken the membership with
    /// it. As long as it is there, the system refuses to join twice.
    fn rejoin(&self, index: EndpointId) {
        let endpoint = &self.io.endpoints[index];
        if let State::Datagrams(port) = &endpoint.state
            && let (Some(socket), Some(group)) = (&port.group_socket, endpoint.address)
            && endpoint.bound.interface.is_none()
        {
            let _ = join_multicast(socket, group.ip(), 0);
        }
    }

    /// Closes all that an endpoint has, and opens it anew.
    fn reopen(&mut self, index: EndpointId, error: io::Error) {
        let endpoint = &mut self.io.endpoints[index];
        endpoint.forget_addresses();
        if endpoint.is_server() {
            self.close_endpoint(index, &error.to_string());
        } else {
            // The line about its one link tells it all.
            self.close_endpoint(index, &format!("{error}; waiting for it"));
            self.io.endpoints[index].is_missed = true;
            return self.try_again(index);
        }
        let name = self.io.endpoints[index].config.options.dev.clone();
        let action = format!("use the network interface {}", name.unwrap_or_default());
        self.try_later(index, OpenError { action: action.trim_end().to_owned(), error });
    }

    /// Somebody may have refused what was sent by a UDP socket.
    pub(super) fn handle_refusals(&mut self, index: EndpointId) {
        if let State::Datagrams(port) = &self.io.endpoints[index].state
            && let Role::Sender { link, .. } = port.role
            && take_refusals(&port.socket, BATCH)
        {
            self.io.unsent.insert(link);
        }
    }

    /// Datagrams to these links could not be sent in this turn, or did not arrive: perhaps a name
    /// has moved.
    pub(super) fn handle_unsent(&mut self) {
        for link in std::mem::take(&mut self.io.unsent).iter() {
            let Some(index) = self.io.links.get(link).map(|link| link.endpoint) else { continue };
            self.tell_unsendable(index);
            let soon = self.now + ASK_SOON;
            let is_set = self.io.endpoints[index].deadline.is_some_and(|at| at <= soon);
            if !is_set && self.host_name(index).is_some() {
                self.set_deadline(index, ASK_SOON);
            }
        }
    }

    fn tell_unsendable(&mut self, index: EndpointId) {
        let endpoint = &mut self.io.endpoints[index];
        if let Some((destination, error)) = &endpoint.unsendable
            && !std::mem::replace(&mut endpoint.unsendable_is_told, true)
        {
            let text = format!("cannot send to {destination}: {error}");
            self.warn(index, &text);
        }
    }

    /// Takes what the resolver found out.
    pub(super) fn handle_answers(&mut self) {
        while let Some(Resolved { asker, addresses }) = self.resolver.poll() {
            // It may have gone while its question was open.
            let Some(endpoint) = self.io.endpoints.get_mut(asker) else { continue };
            endpoint.is_asking = false;
            if !endpoint.options().enabled {
                continue;
            }
            match addresses {
                Ok(addresses) if !addresses.is_empty() => self.handle_addresses(asker, addresses),
                Ok(_) => self.handle_unresolved(asker, io::Error::other("it has no address")),
                Err(error) => self.handle_unresolved(asker, error),
            }
        }
    }

    /// A name means these addresses. IPv4 comes first: that is where ground stations listen.
    fn handle_addresses(&mut self, index: EndpointId, mut addresses: Vec<SocketAddr>) {
        addresses.sort_by_key(SocketAddr::is_ipv6);
        if let State::Datagrams(_) = self.io.endpoints[index].state {
            return self.redirect(index, &addresses);
        }
        self.io.endpoints[index].addresses = addresses;
        self.io.endpoints[index].next_address = 0;
        if let Err(failure) = self.open(index) {
            self.try_later(index, failure);
        }
    }

    fn handle_unresolved(&mut self, index: EndpointId, error: io::Error) {
        if let State::Datagrams(_) = self.io.endpoints[index].state {
            // What it was is still good.
            return;
        }
        let name = self.host_name(index).unwrap_or_default().0;
        self.try_later(index, OpenError { action: format!("resolve {name}"), error });
    }

    /// The host of a sender has these addresses now.
    fn redirect(&mut self, index: EndpointId, addresses: &[SocketAddr]) {
        let endpoint = &mut self.io.endpoints[index];
        let State::Datagrams(port) = &mut endpoint.state else { return };
        let Role::Sender { link, remote } = &mut port.role else { return };
        let same_family = |address: &&SocketAddr| address.is_ipv4() == remote.is_ipv4();
        if addresses.contains(remote) {
            return;
        }
        let Some(new) = addresses.iter().find(same_family) else {
            // Another family needs another socket.
            return self.reopen(index, io::Error::other("its host has moved"));
        };
        info!("{}: now sending to {new}", endpoint.name);
        *remote = *new;
        if let Some(link) = self.io.links.get_mut(*link) {
            link.peer = new.to_string();
            link.output = Output::Datagrams(*new);
        }
    }
}

/// Whether the system was only short of something when it was asked.
fn is_shortage(error: &io::Error) -> bool {
    let shortages = [libc::EMFILE, libc::ENFILE, libc::ENOMEM, libc::ENOBUFS];
    error.raw_os_error().is_some_and(|code| shortages.contains(&code))
}
