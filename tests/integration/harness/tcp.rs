//! Peers that speak TCP: clients of the router, and servers that it calls.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use mavswitch::mavlink::Component;
use socket2::{Domain, SockAddr, SockRef, Socket, Type};

use super::peer::{Peer, Received, Wire};
use super::udp::is_timeout;
use super::{PATIENCE, eventually};

/// One connection.
pub(crate) struct TcpWire {
    pub(crate) stream: TcpStream,
}

impl TcpWire {
    /// A connection to `router`.
    pub(crate) fn to(router: SocketAddr) -> Self {
        Self::new(TcpStream::connect(router).expect("a connection to the router"))
    }

    /// A connection with a receive buffer as small as can be had.
    pub(crate) fn narrow_to(router: SocketAddr) -> Self {
        let socket = Socket::new(Domain::for_address(router), Type::STREAM, None);
        let socket = socket.expect("a socket");
        socket.set_recv_buffer_size(4096).expect("a small buffer");
        socket.connect(&router.into()).expect("a connection to the router");
        Self::new(socket.into())
    }

    /// The next connection to that listener.
    pub(crate) fn accepted_by(listener: &TcpListener) -> Self {
        Self::new(listener.accept().expect("a call from the router").0)
    }

    fn new(stream: TcpStream) -> Self {
        stream.set_nodelay(true).expect("no delay");
        stream.set_write_timeout(Some(PATIENCE)).expect("a time limit");
        Self { stream }
    }
}

impl Wire for TcpWire {
    const DATAGRAMS: bool = false;

    fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the router reads");
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Received {
        self.stream.set_read_timeout(Some(timeout)).expect("a time limit");
        match self.stream.read(buffer) {
            Ok(0) => Received::Closed,
            Ok(count) => Received::Bytes(count),
            Err(error) if is_timeout(error.kind()) => Received::Nothing,
            Err(error) if error.kind() == ErrorKind::ConnectionReset => Received::Closed,
            Err(error) => panic!("receiving: {error}"),
        }
    }
}

impl Peer<TcpWire> {
    /// Says that it will send no more.
    pub(crate) fn half_close(&mut self) {
        // The router may have closed first.
        let _ = self.wire.stream.shutdown(Shutdown::Write);
    }

    /// Ends the connection without a goodbye.
    pub(crate) fn reset(self) {
        let socket = SockRef::from(&self.wire.stream);
        socket.set_linger(Some(Duration::ZERO)).expect("no lingering");
    }
}

/// A server for the router to call, on a port that stays its own while it is down.
pub(crate) struct TcpServer {
    /// Bound and never listening: keeps the port from everybody else.
    reservation: Socket,
    listener: Option<TcpListener>,
}

impl TcpServer {
    /// A port with nobody listening.
    pub(crate) fn down() -> Self {
        Self::at("127.0.0.1:0".parse().expect("an address"))
    }

    /// The same at an address that is to be had, or that another such server keeps.
    pub(crate) fn at(address: SocketAddr) -> Self {
        Self { reservation: reusable(&address.into()).expect("a free port"), listener: None }
    }

    /// Its address, up or down.
    pub(crate) fn address(&self) -> SocketAddr {
        let address = self.reservation.local_addr().expect("a bound socket");
        address.as_socket().expect("an IP address")
    }

    /// Begins to listen.
    pub(crate) fn up(&mut self) {
        // While another test starts a program, that child holds a copy of the last listener.
        let mut listener = None;
        eventually("the port is free again", || {
            listener = listening(&self.address().into(), 16).ok();
            listener.is_some()
        });
        let socket = listener.expect("a socket");
        socket.set_nonblocking(true).expect("a socket that does not wait");
        self.listener = Some(socket.into());
    }

    /// Stops listening.
    pub(crate) fn go_down(&mut self) {
        if let Some(listener) = self.listener.take() {
            // While another test starts a program, that child holds a copy, which would listen on.
            SockRef::from(&listener).shutdown(Shutdown::Both).expect("a listener");
        }
    }

    /// Waits for the router to call; the peer it then has is `me`.
    pub(crate) fn accept(&self, me: Component) -> Peer<TcpWire> {
        let mut accepted = None;
        eventually("the router calls the server", || {
            accepted = self.try_accept(me);
            accepted.is_some()
        });
        accepted.expect("a connection")
    }

    /// The router's call, if it has called.
    pub(crate) fn try_accept(&self, me: Component) -> Option<Peer<TcpWire>> {
        let listener = self.listener.as_ref().expect("a server that is up");
        let (stream, _) = listener.accept().ok()?;
        stream.set_nonblocking(false).expect("a socket that waits");
        Some(Peer::new(TcpWire::new(stream), me))
    }
}

/// A listener that answers no call, as an unreachable host: keep what this returns.
pub(crate) fn blackhole() -> (SocketAddr, Vec<Socket>) {
    let any: SocketAddr = "127.0.0.1:0".parse().expect("an address");
    let listener = listening(&any.into(), 0).expect("a free port");
    let address = listener.local_addr().expect("a bound socket");
    let mut kept = vec![listener];
    // Fill the queue of calls that nobody takes; from then on a call is not even refused.
    for _ in 0..4 {
        let caller = Socket::new(Domain::IPV4, Type::STREAM, None).expect("a socket");
        caller.set_nonblocking(true).expect("a socket that does not wait");
        // It is under way, or it already hangs: both are wanted.
        let _ = caller.connect(&address);
        kept.push(caller);
    }
    (address.as_socket().expect("an IP address"), kept)
}

fn listening(address: &SockAddr, backlog: i32) -> io::Result<Socket> {
    let socket = reusable(address)?;
    socket.listen(backlog)?;
    Ok(socket)
}

/// A bound socket, if nobody listens there.
fn reusable(address: &SockAddr) -> io::Result<Socket> {
    let socket = Socket::new(address.domain(), Type::STREAM, None)?;
    socket.set_reuse_address(true)?;
    socket.bind(address)?;
    Ok(socket)
}
