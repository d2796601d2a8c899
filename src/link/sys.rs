//! System calls by hand: the only `unsafe` of the program.
//!
//! Each function is safe to call; what it hands to the system lives in its arguments or on its own
//! stack for as long as the call lasts.
#![allow(unsafe_code)]

use std::ffi::CString;
use std::io;
use std::mem::{MaybeUninit, size_of, size_of_val, zeroed};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};
use std::os::fd::{AsFd, AsRawFd};

use socket2::SockRef;

/// How many datagrams one system call moves at most.
pub(super) const BATCH: usize = 32;

/// Where a received datagram came from, and how long it was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Received {
    /// Its length in bytes.
    pub len: usize,
    /// Its source; `None` if it is of no address family that we know.
    pub source: Option<SocketAddr>,
}

/// Receives datagrams, one into each of `buffers`; says how many came, of which `received` tells as
/// far as it is long enough.
///
/// The fewer buffers, the less there is to prepare.
///
/// # Errors
///
/// As `recvmmsg(2)`; `WouldBlock` if there is no datagram.
pub(super) fn receive_batch<const N: usize>(
    socket: impl AsFd,
    buffers: &mut [&mut [u8]; N],
    received: &mut [Received],
) -> io::Result<usize> {
    let mut names = [NO_NAME; N];
    let mut pieces = [NO_PIECE; N];
    let mut headers = [const { MaybeUninit::<libc::mmsghdr>::uninit() }; N];
    for (at, buffer) in buffers.iter_mut().enumerate() {
        pieces[at] = libc::iovec { iov_base: buffer.as_mut_ptr().cast(), iov_len: buffer.len() };
        let msg_hdr = header(&mut pieces[at..=at], (&raw mut names[at], NAME));
        headers[at].write(libc::mmsghdr { msg_hdr, msg_len: 0 });
    }
    // SAFETY: all `N` headers are written, and point to one piece and one name each, all of which
    // outlive the call; each piece is a buffer that is borrowed mutably and as long as said.
    let result = unsafe {
        libc::recvmmsg(
            socket.as_fd().as_raw_fd(),
            headers.as_mut_ptr().cast(),
            N as libc::c_uint,
            libc::MSG_DONTWAIT as _,
            std::ptr::null_mut(),
        )
    };
    let filled = usize::try_from(result).map_err(|_| io::Error::last_os_error())?;
    for (at, place) in received.iter_mut().take(filled).enumerate() {
        // SAFETY: all of them are written, and the system fills at most `N`.
        let len = unsafe { headers[at].assume_init_ref() }.msg_len as usize;
        *place = Received { len, source: socket_addr(&names[at]) };
    }
    Ok(filled)
}

/// The bytes of one datagram; the second piece may be empty.
pub(super) type Pieces<'a> = (&'a [u8], &'a [u8]);

/// Sends datagrams to one destination in order, at most [`BATCH`] of them; says how many were sent.
///
/// # Errors
///
/// As `sendmmsg(2)`, of the first datagram that was not sent.
pub(super) fn send_batch(
    socket: impl AsFd,
    destination: SocketAddr,
    datagrams: &[Pieces<'_>],
) -> io::Result<usize> {
    // What a quiet machine sends, mostly: the system has less to do for it than for a batch of one.
    if let [(whole, [])] = datagrams {
        let socket = socket.as_fd();
        let socket = SockRef::from(&socket);
        return socket
            .send_to_with_flags(whole, &destination.into(), libc::MSG_DONTWAIT)
            .map(|_| 1);
    }
    let mut name = NO_NAME;
    let length = write_socket_addr(destination, &mut name);
    let name = (&raw mut name, length);
    match datagrams {
        [datagram] => send_one(socket, name, *datagram),
        datagrams => send_many(socket, name, datagrams),
    }
}

fn send_one(socket: impl AsFd, name: NameOf, datagram: Pieces<'_>) -> io::Result<usize> {
    let (mut pieces, used) = outgoing_pieces(datagram);
    let header = header(&mut pieces[..used], name);
    // SAFETY: the header points to its pieces and to a name, which outlive the call; the system only
    // reads what the pieces point to, as long as the borrowed slices are.
    let result =
        unsafe { libc::sendmsg(socket.as_fd().as_raw_fd(), &raw const header, libc::MSG_DONTWAIT) };
    if result < 0 { Err(io::Error::last_os_error()) } else { Ok(1) }
}

fn send_many(socket: impl AsFd, name: NameOf, datagrams: &[Pieces<'_>]) -> io::Result<usize> {
    let count = datagrams.len().min(BATCH);
    let mut pieces = [[NO_PIECE; 2]; BATCH];
    let mut headers = [const { MaybeUninit::<libc::mmsghdr>::uninit() }; BATCH];
    for (at, datagram) in datagrams[..count].iter().enumerate() {
        let used;
        (pieces[at], used) = outgoing_pieces(*datagram);
        let msg_hdr = header(&mut pieces[at][..used], name);
        headers[at].write(libc::mmsghdr { msg_hdr, msg_len: 0 });
    }
    // SAFETY: the first `count` headers are written, and point to their pieces and to one name, all
    // of which outlive the call; the system only reads what the pieces point to, as long as the
    // borrowed slices are, and the name.
    let result = unsafe {
        libc::sendmmsg(
            socket.as_fd().as_raw_fd(),
            headers.as_mut_ptr().cast(),
            count as libc::c_uint,
            libc::MSG_DONTWAIT as _,
        )
    };
    usize::try_from(result).map_err(|_| io::Error::last_os_error())
}

/// How the system is told of the bytes of a datagram, and how many pieces of it count.
fn outgoing_pieces((first, second): Pieces<'_>) -> ([libc::iovec; 2], usize) {
    let piece = |bytes: &[u8]| {
        let iov_base = bytes.as_ptr().cast_mut().cast();
        libc::iovec { iov_base, iov_len: bytes.len() }
    };
    ([piece(first), piece(second)], if second.is_empty() { 1 } else { 2 })
}

/// An address of either family: that of IPv6 is as large as, and aligned for, that of IPv4.
type Name = libc::sockaddr_in6;

/// Where an address stands, and how long it is.
type NameOf = (*mut Name, libc::socklen_t);

/// How long a name is at most.
const NAME: libc::socklen_t = size_of::<Name>() as libc::socklen_t;

/// No address.
const NO_NAME: Name = Name {
    sin6_family: libc::AF_UNSPEC as libc::sa_family_t,
    sin6_port: 0,
    sin6_flowinfo: 0,
    sin6_addr: libc::in6_addr { s6_addr: [0; 16] },
    sin6_scope_id: 0,
};

/// No bytes.
const NO_PIECE: libc::iovec = libc::iovec { iov_base: std::ptr::null_mut(), iov_len: 0 };

/// A header that points to these pieces and to a name.
fn header(pieces: &mut [libc::iovec], (name, length): NameOf) -> libc::msghdr {
    // SAFETY: all-zero bytes are a valid value of this plain C structure.
    let mut header: libc::msghdr = unsafe { zeroed() };
    header.msg_iov = pieces.as_mut_ptr();
    header.msg_iovlen = pieces.len() as _;
    header.msg_name = name.cast();
    header.msg_namelen = length;
    header
}

/// Asks the driver of a serial port to hand over what it receives at once.
///
/// # Errors
///
/// As `ioctl(2)`; most drivers do not know of it.
pub(super) fn set_low_latency(port: impl AsFd) -> io::Result<()> {
    let port = port.as_fd().as_raw_fd();
    let mut settings = SerialStruct { flags_and_before: [0; 5], rest: [0; 64] };
    // SAFETY: the system writes a `serial_struct`, which is at most as long as this one.
    if unsafe { libc::ioctl(port, libc::TIOCGSERIAL, &raw mut settings) } < 0 {
        return Err(io::Error::last_os_error());
    }
    settings.flags_and_before[FLAGS] |= ASYNC_LOW_LATENCY;
    // SAFETY: the system reads what it wrote itself, but for one flag.
    if unsafe { libc::ioctl(port, libc::TIOCSSERIAL, &raw const settings) } < 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}

/// How many bytes were written to a terminal and have not left yet, or to a connection and have not
/// been acknowledged.
///
/// # Errors
///
/// As `ioctl(2)`, if it is neither or is gone.
pub(super) fn unsent_bytes(output: impl AsFd) -> io::Result<usize> {
    let mut count: libc::c_int = 0;
    // SAFETY: the system writes one number to where the pointer leads.
    if unsafe { libc::ioctl(output.as_fd().as_raw_fd(), libc::TIOCOUTQ, &raw mut count) } < 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(usize::try_from(count).unwrap_or_default())
}

/// `struct serial_struct` of the kernel: `flags` is the fifth of the numbers it begins with. It is
/// 72 bytes long where pointers have 64 bits; there is room to spare.
#[repr(C, align(8))]
struct SerialStruct {
    flags_and_before: [libc::c_int; 5],
    rest: [u8; 64],
}

/// Which of the numbers is `flags`.
const FLAGS: usize = 4;

/// `ASYNC_LOW_LATENCY` of `linux/tty_flags.h`.
const ASYNC_LOW_LATENCY: libc::c_int = 1 << 13;

/// Has a UDP socket told when a datagram was refused where it was sent to.
///
/// # Errors
///
/// As `setsockopt(2)`.
pub(super) fn report_refusals(socket: impl AsFd, is_ipv6: bool) -> io::Result<()> {
    let (level, option) = match is_ipv6 {
        false => (libc::IPPROTO_IP, libc::IP_RECVERR),
        true => (libc::IPPROTO_IPV6, libc::IPV6_RECVERR),
    };
    let (socket, on): (_, libc::c_int) = (socket.as_fd().as_raw_fd(), 1);
    let length = size_of_val(&on) as libc::socklen_t;
    // SAFETY: the system reads one number of that length from where the pointer leads.
    match unsafe { libc::setsockopt(socket, level, option, (&raw const on).cast(), length) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Takes what such a socket has to tell, at most `limit` of it; says whether there was anything.
pub fn take_refusals(socket: impl AsFd, limit: usize) -> bool {
    let flags = libc::MSG_ERRQUEUE | libc::MSG_DONTWAIT;
    let take = |_: &usize| {
        // SAFETY: the system writes nothing to a buffer of length zero.
        let result =
            unsafe { libc::recv(socket.as_fd().as_raw_fd(), std::ptr::null_mut(), 0, flags) };
        result >= 0
    };
    (0..limit).take_while(take).count() > 0
}

/// The number of the network interface with this name.
///
/// # Errors
///
/// As `if_nametoindex(3)`, or if the name has a zero in it.
pub fn interface_index(name: &str) -> io::Result<u32> {
    let name = CString::new(name)?;
    // SAFETY: the argument is a string that ends with a zero and outlives the call.
    match unsafe { libc::if_nametoindex(name.as_ptr()) } {
        0 => Err(io::Error::last_os_error()),
        index => Ok(index),
    }
}

fn socket_addr(name: &Name) -> Option<SocketAddr> {
    match i32::from(name.sin6_family) {
        libc::AF_INET => {
            // SAFETY: a `Name` is large enough and aligned for this type, of which every bit
            // pattern is a value; the family says that the system wrote one.
            let name = unsafe { *(&raw const *name).cast::<libc::sockaddr_in>() };
            let ip = Ipv4Addr::from(u32::from_be(name.sin_addr.s_addr));
            Some(SocketAddrV4::new(ip, u16::from_be(name.sin_port)).into())
        }
        libc::AF_INET6 => {
            let ip = Ipv6Addr::from(name.sin6_addr.s6_addr);
            let port = u16::from_be(name.sin6_port);
            Some(SocketAddrV6::new(ip, port, 0, name.sin6_scope_id).into())
        }
        _ => None,
    }
}

/// Writes an address where the system reads it, and says how long it is.
fn write_socket_addr(address: SocketAddr, name: &mut Name) -> libc::socklen_t {
    match address {
        SocketAddr::V4(v4) => {
            // SAFETY: a `Name` is large enough and aligned for this type, of which every bit
            // pattern is a value.
            let name = unsafe { &mut *(&raw mut *name).cast::<libc::sockaddr_in>() };
            name.sin_family = libc::AF_INET as libc::sa_family_t;
            name.sin_port = v4.port().to_be();
            name.sin_addr.s_addr = u32::from(*v4.ip()).to_be();
            size_of::<libc::sockaddr_in>() as libc::socklen_t
        }
        SocketAddr::V6(v6) => {
            name.sin6_family = libc::AF_INET6 as libc::sa_family_t;
            name.sin6_port = v6.port().to_be();
            name.sin6_addr.s6_addr = v6.ip().octets();
            name.sin6_scope_id = v6.scope_id();
            NAME
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::UdpSocket;

    /// Receives what was just sent, which a busy machine may deliver a moment later.
    fn receive<const N: usize>(
        socket: &UdpSocket,
        buffers: &mut [&mut [u8]; N],
        received: &mut [Received],
    ) -> io::Result<usize> {
        socket.set_read_timeout(Some(std::time::Duration::from_secs(60))).unwrap();
        socket.peek(&mut [0]).unwrap();
        receive_batch(socket, buffers, received)
    }

    #[test]
    fn datagrams_go_out_and_come_in_by_the_batch() {
        for host in ["127.0.0.1:0", "[::1]:0"] {
            let (from, to) = (UdpSocket::bind(host).unwrap(), UdpSocket::bind(host).unwrap());
            let destination = to.local_addr().unwrap();
            let datagrams: [Pieces<'_>; 2] = [(b"one", b""), (b"t", b"wo")];
            let mut received = [Received { len: 0, source: None }; 3];
            let (mut a, mut b, mut c) = ([0xa5; 8], [0xa5; 8], [0xa5; 8]);
            for attempt in 0.. {
                assert_eq!(send_batch(&from, destination, &datagrams).unwrap(), 2);
                let mut buffers: [&mut [u8]; 3] = [&mut a, &mut b, &mut c];
                if receive(&to, &mut buffers, &mut received).unwrap() == 2 {
                    break;
                }
                // The second one was not there yet.
                assert!(attempt < 100, "they never come together");
                receive(&to, &mut buffers, &mut received).unwrap();
            }
            assert_eq!(received[0].source, Some(from.local_addr().unwrap()));
            assert_eq!((&a[..received[0].len], &b[..received[1].len]), (&b"one"[..], &b"two"[..]));
            assert_eq!(c, [0xa5; 8]);
            let nothing = receive_batch(&to, &mut [&mut a], &mut received);
            assert_eq!(nothing.unwrap_err().kind(), io::ErrorKind::WouldBlock);
            assert_eq!(send_batch(&from, destination, &datagrams[1..]).unwrap(), 1);
            assert_eq!(receive(&to, &mut [&mut a], &mut received).unwrap(), 1);
            assert_eq!(&a[..received[0].len], b"two");
        }
    }
}
