//! TCP sockets: listening, and connecting without waiting for the answer.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use mio::net::{TcpListener, TcpStream};
use socket2::{Domain, Protocol, SockRef, Socket, TcpKeepalive, Type};

/// How many connections wait to be accepted.
const BACKLOG: i32 = 128;

/// A peer that answers nothing for less than this may yet be alive, whatever the user says.
const LEAST_PATIENCE: Duration = Duration::from_secs(10);

/// Listens at an address. An IPv6 socket takes IPv6 only, so that both may be named.
///
/// # Errors
///
/// As `bind(2)`; `AddrInUse` if another program listens there.
pub fn listen(address: SocketAddr, device: Option<&str>) -> io::Result<TcpListener> {
    let socket = open(address, device)?;
    socket.set_reuse_address(true)?;
    socket.bind(&address.into())?;
    socket.listen(BACKLOG)?;
    Ok(TcpListener::from_std(socket.into()))
}

/// Begins to connect; the stream is writable once that has succeeded or failed.
///
/// # Errors
///
/// As `connect(2)`, where it fails at once.
pub fn connect(
    address: SocketAddr,
    bind: Option<SocketAddr>,
    device: Option<&str>,
) -> io::Result<TcpStream> {
    let socket = open(address, device)?;
    if let Some(bind) = bind {
        socket.set_reuse_address(true)?;
        socket.bind(&bind.into())?;
    }
    match socket.connect(&address.into()) {
        Err(error) if error.raw_os_error() != Some(libc::EINPROGRESS) => Err(error),
        _ => Ok(TcpStream::from_std(socket.into())),
    }
}

/// Sets up a connection: frames leave at once, and a dead peer is noticed in seconds: after 11 s if
/// nothing is sent to it, after `patience` if something is.
///
/// The system counts a peer that is alive but takes nothing as dead, too, so `patience` must not be
/// shorter than such a peer is given.
///
/// # Errors
///
/// As `setsockopt(2)`.
pub fn tune(stream: &TcpStream, patience: Duration) -> io::Result<()> {
    let socket = SockRef::from(stream);
    let probe = TcpKeepalive::new()
        .with_time(Duration::from_secs(5))
        .with_interval(Duration::from_secs(2))
        .with_retries(3);
    socket.set_tcp_nodelay(true)?;
    socket.set_tcp_keepalive(&probe)?;
    socket.set_tcp_user_timeout(Some(patience.max(LEAST_PATIENCE)))
}

fn open(address: SocketAddr, device: Option<&str>) -> io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(address), Type::STREAM, Some(Protocol::TCP))?;
    socket.set_nonblocking(true)?;
    if address.is_ipv6() {
        socket.set_only_v6(true)?;
    }
    if let Some(device) = device {
        socket.bind_device(Some(device.as_bytes()))?;
    }
    Ok(socket)
}
