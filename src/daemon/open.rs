//! Opens sockets, each kind in its way, at an address that is known.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV6};

use mio::Interest;
use mio::net::UdpSocket;
use tracing::info;

use super::endpoint::{Answerer, DatagramPort, Endpoint, Peers, Role, State};
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, Meaning};
use super::links::Output;
use super::transmit::UNLESS_FULL;
use crate::config::{Address, Host, HostPort};
use crate::link::{UdpSettings, connect, interface_index, join_multicast, listen, open_udp};
use crate::routing::LinkId;

/// What could not be done, and why.
#[derive(Debug)]
pub(super) struct OpenError {
    /// What was tried: `listen on 0.0.0.0:14550`.
    pub(super) action: String,
    pub(super) error: io::Error,
}

/// Says what was tried when it fails.
fn doing<T>(action: impl FnOnce() -> String, result: io::Result<T>) -> Result<T, OpenError> {
    result.map_err(|error| OpenError { action: action(), error })
}

impl Daemon {
    /// Opens whatever listens, sends or connects at `address`.
    pub(super) fn open_socket(
        &mut self,
        index: EndpointId,
        address: SocketAddr,
    ) -> Result<(), OpenError> {
        match self.io.endpoints[index].config.address {
            Address::UdpIn(_) => self.open_udp_server(index, address),
            Address::UdpOut(_) => self.open_udp_sender(index, address),
            Address::UdpBroadcast(_) | Address::Multicast(_) => {
                self.open_udp_shared(index, address)
            }
            Address::TcpIn(_) => self.open_tcp_server(index, address),
            Address::TcpOut(_) => self.open_tcp_client(index, address),
            Address::Serial { .. } | Address::Tlog(_) | Address::Sim | Address::Internal(_) => {
                Ok(())
            }
        }
    }

    fn open_tcp_server(&mut self, index: EndpointId, address: SocketAddr) -> Result<(), OpenError> {
        let action = || format!("listen on {address}");
        let endpoint = &self.io.endpoints[index];
        let device = endpoint.options().dev.as_deref();
        let mut listener = doing(action, listen(address, device, self.takes_ipv4(index, address)))?;
        let token = Meaning::Endpoint(index.slot()).token();
        doing(action, self.registry().register(&mut listener, token, Interest::READABLE))?;
        let local = doing(action, listener.local_addr())?;
        info!("{}: listening on {local}", endpoint.name);
        self.set_open(index, State::Listening(listener, 0));
        Ok(())
    }

    /// Whether a server at `address` is for IPv4 peers, too: at `[::]` it is, unless another
    /// endpoint has the same port for IPv4.
    fn takes_ipv4(&self, index: EndpointId, address: SocketAddr) -> bool {
        let config = &self.io.endpoints[index].config;
        let all = self.io.endpoints.iter().map(|endpoint| &endpoint.config);
        address.ip() == Ipv6Addr::UNSPECIFIED && !config.leaves_ipv4_to(all)
    }

    fn open_tcp_client(&mut self, index: EndpointId, address: SocketAddr) -> Result<(), OpenError> {
        let action = || format!("connect to {address}");
        let options = self.io.endpoints[index].options();
        let bind = doing(action, bind_address(options.bind.as_ref(), address))?;
        let bind = options.bind.as_ref().map(|_| bind);
        let mut stream = doing(action, connect(address, bind, options.dev.as_deref()))?;
        let token = Meaning::Endpoint(index.slot()).token();
        let interest = Interest::READABLE | Interest::WRITABLE;
        doing(action, self.registry().register(&mut stream, token, interest))?;
        let now = self.now;
        self.io.endpoints[index].set_state(State::Connecting(stream, address), now);
        Ok(())
    }

    fn open_udp_server(&mut self, index: EndpointId, address: SocketAddr) -> Result<(), OpenError> {
        let action = || format!("listen on {address}");
        let endpoint = &self.io.endpoints[index];
        let device = endpoint.options().dev.as_deref();
        let takes_ipv4 = self.takes_ipv4(index, address);
        let settings = UdpSettings { device, takes_ipv4, ..UdpSettings::default() };
        let socket = doing(action, open_udp(address, settings))?;
        let local = doing(action, socket.local_addr())?;
        info!("{}: listening on {local}", endpoint.name);
        let sockets = (socket, None);
        self.open_datagrams(index, sockets, action, |_| Ok(Role::Server(Peers::default())))
    }

    fn open_udp_sender(&mut self, index: EndpointId, remote: SocketAddr) -> Result<(), OpenError> {
        let action = || format!("send to {remote}");
        let options = self.io.endpoints[index].options();
        let local = doing(action, bind_address(options.bind.as_ref(), remote))?;
        // Who refuses may have moved, if it is known by name.
        let hears_refusals = self.host_name(index).is_some();
        let device = options.dev.as_deref();
        let settings = UdpSettings { device, hears_refusals, ..UdpSettings::default() };
        let socket = doing(|| format!("send from {local}"), open_udp(local, settings))?;
        let local = doing(action, socket.local_addr())?;
        self.open_datagrams(index, (socket, None), action, |daemon| {
            Ok(Role::Sender { link: daemon.add_sender_link(index, remote, local)?, remote })
        })
    }

    fn open_udp_shared(
        &mut self,
        index: EndpointId,
        everybody: SocketAddr,
    ) -> Result<(), OpenError> {
        let action = || format!("send to {everybody}");
        let endpoint = &self.io.endpoints[index];
        let options = endpoint.options();
        let is_multicast = everybody.ip().is_multicast();
        let local = doing(action, bind_address(options.bind.as_ref(), everybody))?;
        let settings = UdpSettings {
            device: options.dev.as_deref(),
            broadcast: !is_multicast,
            multicast_ttl: is_multicast.then_some(options.ttl),
            ..UdpSettings::default()
        };
        let socket = doing(|| format!("send from {local}"), open_udp(local, settings))?;
        let local = doing(action, socket.local_addr())?;
        let group_socket = if is_multicast {
            Some(doing(|| format!("join {everybody}"), open_group(endpoint, everybody))?)
        } else {
            None
        };
        let own = doing(action, own_address(everybody, local, options.dev.as_deref()))?;
        self.open_datagrams(index, (socket, group_socket), action, |daemon| {
            let link = daemon.add_sender_link(index, everybody, local)?;
            Ok(Role::Shared { link, everybody, own, answerer: Answerer::default() })
        })
    }

    /// Makes the one link of a UDP endpoint that sends from the start.
    fn add_sender_link(
        &mut self,
        index: EndpointId,
        remote: SocketAddr,
        local: SocketAddr,
    ) -> Result<LinkId, OpenError> {
        let peer = format!("{remote} from {local}");
        let link = self.add_link(index, peer, Output::Datagrams(remote));
        let link = link.map_err(|_| io::Error::other("too many links"));
        doing(|| format!("send to {remote}"), link)
    }

    /// Has sockets watched, and only then finds out what they are for: where that makes a link, nothing
    /// can fail any more that would leave it without them.
    fn open_datagrams(
        &mut self,
        index: EndpointId,
        (mut socket, mut group_socket): (UdpSocket, Option<UdpSocket>),
        action: impl Fn() -> String,
        role: impl FnOnce(&mut Self) -> Result<Role, OpenError>,
    ) -> Result<(), OpenError> {
        let token = Meaning::Endpoint(index.slot()).token();
        for socket in [Some(&mut socket), group_socket.as_mut()].into_iter().flatten() {
            doing(&action, self.registry().register(socket, token, UNLESS_FULL))?;
        }
        let role = role(self)?;
        let port = DatagramPort { socket, group_socket, writable: true, role };
        self.set_open(index, State::Datagrams(port));
        Ok(())
    }
}

/// The socket that hears a multicast group.
fn open_group(endpoint: &Endpoint, group: SocketAddr) -> io::Result<UdpSocket> {
    let device = endpoint.options().dev.as_deref();
    let settings = UdpSettings { device, shared: true, ..UdpSettings::default() };
    let socket = open_udp(group, settings)?;
    let interface = match (device, group) {
        (Some(device), _) => interface_index(device)?,
        (None, SocketAddr::V6(v6)) => v6.scope_id(),
        (None, SocketAddr::V4(_)) => 0,
    };
    join_multicast(&socket, group.ip(), interface)?;
    Ok(socket)
}

/// Where our own datagrams to everybody come from, to know them when they come back.
pub(super) fn own_address(
    everybody: SocketAddr,
    local: SocketAddr,
    device: Option<&str>,
) -> io::Result<SocketAddr> {
    if !local.ip().is_unspecified() {
        return Ok(local);
    }
    // Connecting a datagram socket sends nothing; it asks the system for the route.
    let settings = UdpSettings { device, broadcast: true, ..UdpSettings::default() };
    let probe = open_udp(SocketAddr::new(local.ip(), 0), settings)?;
    probe.connect(everybody)?;
    Ok(SocketAddr::new(probe.local_addr()?.ip(), local.port()))
}

/// The local address to send to `remote` from: what the user says, or any of the same family.
pub(super) fn bind_address(bind: Option<&HostPort>, remote: SocketAddr) -> io::Result<SocketAddr> {
    let any = any_address(remote);
    let Some(bind) = bind else { return Ok(any) };
    match socket_address(bind)? {
        Some(address) if !address.ip().is_unspecified() => Ok(address),
        Some(address) => Ok(SocketAddr::new(any.ip(), address.port())),
        None => Err(io::Error::other("bind takes an IP address, not a name")),
    }
}

/// Any address of this computer, and any port, of the family of `remote`.
pub(super) fn any_address(remote: SocketAddr) -> SocketAddr {
    let any: IpAddr = match remote {
        SocketAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
        SocketAddr::V6(_) => Ipv6Addr::UNSPECIFIED.into(),
    };
    SocketAddr::new(any, 0)
}

/// The address, unless the host is a name.
///
/// # Errors
///
/// If there is no network interface of the name that the address gives.
pub(super) fn socket_address(host_port: &HostPort) -> io::Result<Option<SocketAddr>> {
    Ok(match &host_port.host {
        Host::Ip(ip) => Some(SocketAddr::new(*ip, host_port.port)),
        Host::Zoned(ip, zone) => {
            let index = zone.parse().or_else(|_| interface_index(zone))?;
            Some(SocketAddrV6::new(*ip, host_port.port, 0, index).into())
        }
        Host::Name(_) => None,
    })
}

#[cfg(test)]
mod tests;
