//! A peer that speaks UDP.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use mavswitch::mavlink::Component;
use socket2::SockRef;

use super::peer::{Peer, Received, Wire};

/// A UDP socket and the router's address.
pub(crate) struct UdpWire {
    pub(crate) socket: UdpSocket,
    /// Where to send; without one, to whoever sent last.
    router: Option<SocketAddr>,
    last: Option<SocketAddr>,
}

impl UdpWire {
    /// A socket of its own that sends to `router`.
    pub(crate) fn to(router: SocketAddr) -> Self {
        let local = if router.is_ipv4() { "127.0.0.1:0" } else { "[::1]:0" };
        let socket = roomy_udp_socket(local.parse().expect("an address"));
        Self { socket, router: Some(router), last: None }
    }

    /// A socket that exists already, and sends to `router`.
    pub(crate) fn between(socket: UdpSocket, router: SocketAddr) -> Self {
        Self { socket, router: Some(router), last: None }
    }

    /// Whether it knows where to send before it has been sent to.
    pub(crate) fn may_speak_first(&self) -> bool {
        self.router.is_some()
    }

    /// A socket at which the router is to call: it answers whoever sent last.
    pub(crate) fn awaiting(socket: UdpSocket) -> Self {
        Self { socket, router: None, last: None }
    }

    /// Its own address.
    pub(crate) fn address(&self) -> SocketAddr {
        self.socket.local_addr().expect("a bound socket")
    }

    /// Who sent last.
    pub(crate) fn last_sender(&self) -> SocketAddr {
        self.last.expect("somebody sent something")
    }
}

impl Wire for UdpWire {
    const DATAGRAMS: bool = true;

    fn send(&mut self, bytes: &[u8]) {
        let to = self.router.or(self.last).expect("the router has not called yet");
        // A refusal is the answer to an earlier datagram, and says nothing about this one.
        if self.socket.send_to(bytes, to).is_err() {
            self.socket.send_to(bytes, to).expect("a datagram to the router");
        }
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Received {
        self.socket.set_read_timeout(Some(timeout)).expect("a time limit");
        match self.socket.recv_from(buffer) {
            Ok((count, from)) => {
                self.last = Some(from);
                Received::Bytes(count)
            }
            Err(error) if is_timeout(error.kind()) => Received::Nothing,
            Err(error) => panic!("receiving a datagram: {error}"),
        }
    }
}

impl Peer<UdpWire> {
    /// A peer at which the router is to call.
    pub(crate) fn awaiting(me: Component) -> Self {
        let socket = roomy_udp_socket("127.0.0.1:0".parse().expect("an address"));
        Self::new(UdpWire::awaiting(socket), me)
    }
}

/// A socket with room for everything that a test lets pile up.
pub(crate) fn roomy_udp_socket(local: SocketAddr) -> UdpSocket {
    let socket = UdpSocket::bind(local).expect("a UDP socket");
    SockRef::from(&socket).set_recv_buffer_size(4 << 20).expect("room to receive");
    socket
}

/// Whether this is how the system says that the time is up.
pub(super) fn is_timeout(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
