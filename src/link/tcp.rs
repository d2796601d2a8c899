//! TCP sockets: listening, and connecting without waiting for the answer.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use mio::net::{TcpListener, TcpStream};
use socket2::{Domain, Protocol, SockRef, Socket, TcpKeepalive, Type};

/// How many connections wait to be accepted.
const BACKLOG: i32 = 1_024;

/// A peer that answers nothing for less than this may yet be alive, whatever the user says.
const LEAST_PATIENCE: Duration = Duration::from_secs(10);

/// How much may stand in the system's buffer for a slow peer before it has been sent once, in bytes.
const NOT_SENT: u32 = 16_384;

/// Listens at an address. `takes_ipv4`: at an IPv6 address, IPv4 peers are served as well.
///
/// # Errors
///
/// As `bind(2)`; `AddrInUse` if another program listens there.
pub fn listen(
    address: SocketAddr,
    device: Option<&str>,
    takes_ipv4: bool,
) -> io::Result<TcpListener> {
    let socket = open(address, device)?;
    if address.is_ipv6() {
        socket.set_only_v6(!takes_ipv4)?;
    }
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

/// Lets little stand in the system's buffer, or again as much as the system likes: megabytes, good
/// for a burst, but on a slow connection what stands there grows old, and we can no more choose
/// what to refuse.
///
/// # Errors
///
/// As `setsockopt(2)`.
pub(super) fn limit_unsent(stream: &TcpStream, limited: bool) -> io::Result<()> {
    // 0 is what the system is set up for.
    SockRef::from(stream).set_tcp_notsent_lowat(if limited { NOT_SENT } else { 0 })
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn what_a_slow_peer_does_not_read_does_not_pile_up_in_the_system() {
        let server = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        server.set_recv_buffer_size(4_096).unwrap();
        server.bind(&SocketAddr::from(([127, 0, 0, 1], 0)).into()).unwrap();
        server.listen(1).unwrap();
        let address = server.local_addr().unwrap().as_socket().unwrap();
        let stream = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        stream.connect(&address.into()).unwrap();
        stream.set_nonblocking(true).unwrap();
        let mut stream = TcpStream::from_std(stream.into());
        limit_unsent(&stream, true).unwrap();
        let _silent = server.accept().unwrap();
        let mut taken = 0;
        while let Ok(written) = stream.write(&[0; 256]) {
            taken += written;
        }
        assert!((1..100_000).contains(&taken), "the system keeps {taken} bytes");
    }
}
