//! UDP sockets: for servers, senders, broadcast and multicast.

use std::io;
use std::net::{IpAddr, SocketAddr};

use mio::net::UdpSocket;
use socket2::{Domain, InterfaceIndexOrAddress, Protocol, SockRef, Socket, Type};

use super::sys;

/// The kernel's receive buffer that we ask for, in bytes: a burst of some thousand frames.
const RECEIVE_BUFFER: usize = 1 << 20;

/// How a UDP socket is set up.
#[derive(Clone, Copy, Default, Debug)]
pub struct UdpSettings<'a> {
    /// Only this interface.
    pub device: Option<&'a str>,
    /// May send to broadcast addresses.
    pub broadcast: bool,
    /// May share its port with others, as the listeners of a multicast group do.
    pub shared: bool,
    /// At an IPv6 address, speaks with IPv4 peers as well.
    pub takes_ipv4: bool,
    /// Is told when what it sends is refused; see [`super::take_refusals`].
    pub hears_refusals: bool,
    /// How many networks a multicast datagram may pass.
    pub multicast_ttl: Option<u8>,
}

/// Opens a socket at a local address.
///
/// # Errors
///
/// As `bind(2)`; `AddrInUse` if another program is there.
pub fn open_udp(local: SocketAddr, settings: UdpSettings<'_>) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::for_address(local), Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    if local.is_ipv6() {
        socket.set_only_v6(!settings.takes_ipv4)?;
    }
    if let Some(device) = settings.device {
        socket.bind_device(Some(device.as_bytes()))?;
    }
    socket.set_reuse_address(settings.shared)?;
    socket.set_broadcast(settings.broadcast)?;
    if let Some(ttl) = settings.multicast_ttl {
        match local {
            SocketAddr::V4(_) => socket.set_multicast_ttl_v4(ttl.into())?,
            SocketAddr::V6(_) => socket.set_multicast_hops_v6(ttl.into())?,
        }
    }
    if settings.hears_refusals {
        sys::report_refusals(&socket, local.is_ipv6())?;
    }
    // The system may grant less; that is no reason to stop.
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER);
    socket.bind(&local.into())?;
    Ok(UdpSocket::from_std(socket.into()))
}

/// Joins a multicast group, on the interface with this index; 0: the system chooses.
///
/// # Errors
///
/// As `setsockopt(2)`; no device or no address while no interface takes multicast.
pub fn join_multicast(socket: &UdpSocket, group: IpAddr, interface: u32) -> io::Result<()> {
    let socket = SockRef::from(socket);
    match group {
        IpAddr::V4(group) => {
            socket.join_multicast_v4_n(&group, &InterfaceIndexOrAddress::Index(interface))
        }
        IpAddr::V6(group) => socket.join_multicast_v6(&group, interface),
    }
}
