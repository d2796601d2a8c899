//! The floor: forwarders that never look at the bytes. What they cost is what the kernel asks for.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, IoSlice, IoSliceMut, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use mio::net::{TcpListener, TcpStream, UdpSocket};
use mio::unix::SourceFd;
use mio::{Events, Interest, Poll, Token};
use nix::sys::socket::{MsgFlags, MultiHeaders, SockaddrIn, recvmmsg, sendmmsg};
use socket2::SockRef;

/// How many datagrams a call moves.
const BATCH: usize = 32;

/// Longer datagrams are cut; the load has none.
const LONGEST: usize = 2048;

/// Which of the two.
#[derive(Subcommand)]
pub(crate) enum Blind {
    /// One call per datagram
    Single(Ends),
    /// As many datagrams a call as there are
    Batch(Ends),
}

/// What is joined.
#[derive(Args)]
pub(crate) struct Ends {
    #[arg(long)]
    udp_server: Option<SocketAddr>,
    #[arg(long)]
    udp_client: Option<SocketAddrV4>,
    #[arg(long)]
    tcp_server: Option<SocketAddr>,
    #[arg(long)]
    serial: Option<PathBuf>,
    /// Each datagram goes to the next client, instead of to all
    #[arg(long)]
    in_turn: bool,
}

const SERVER: Token = Token(0);
const LISTENER: Token = Token(1);
const SERIAL: Token = Token(2);

impl Blind {
    /// Forwards until it is killed.
    pub(crate) fn run(self) {
        let (ends, is_batch) = match self {
            Self::Single(ends) => (ends, false),
            Self::Batch(ends) => (ends, true),
        };
        let mut poll = Poll::new().expect("a poll");
        let mut forwarder = Forwarder::open(&ends, &poll);
        let mut events = Events::with_capacity(1024);
        loop {
            match poll.poll(&mut events, None) {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                result => result.expect("a poll that works"),
            }
            for event in &events {
                match event.token() {
                    SERVER if is_batch => forwarder.batches(),
                    SERVER => forwarder.datagrams(),
                    LISTENER => forwarder.accept(),
                    SERIAL => forwarder.line(),
                    _ => {}
                }
            }
        }
    }
}

struct Forwarder {
    server: Option<UdpSocket>,
    /// Sends; the other way is not measured.
    sender: UdpSocket,
    destination: Option<SocketAddrV4>,
    listener: Option<TcpListener>,
    clients: Clients,
    serial: Option<File>,
    room: Room,
}

/// What is read into and written from, made once.
struct Room {
    slots: Box<[[u8; LONGEST]; BATCH]>,
    incoming: MultiHeaders<SockaddrIn>,
    outgoing: MultiHeaders<SockaddrIn>,
}

impl Forwarder {
    fn open(ends: &Ends, poll: &Poll) -> Self {
        let registry = poll.registry();
        let server = ends.udp_server.map(|at| {
            let mut socket = UdpSocket::bind(at).expect("a UDP port");
            // As much room as the routers ask for.
            SockRef::from(&socket).set_recv_buffer_size(1 << 20).expect("room to receive");
            registry.register(&mut socket, SERVER, Interest::READABLE).expect("a socket");
            socket
        });
        let listener = ends.tcp_server.map(|at| {
            let mut listener = TcpListener::bind(at).expect("a TCP port");
            registry.register(&mut listener, LISTENER, Interest::READABLE).expect("a listener");
            listener
        });
        let serial = ends.serial.as_ref().map(|path| {
            let nonblocking = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();
            let mut options = OpenOptions::new();
            let file = options.read(true).write(true).custom_flags(nonblocking).open(path);
            let file = file.expect("a serial port");
            let descriptor = file.as_raw_fd();
            let mut source = SourceFd(&descriptor);
            registry.register(&mut source, SERIAL, Interest::READABLE).expect("a terminal");
            file
        });
        let any = SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0));
        Self {
            server,
            sender: UdpSocket::bind(any).expect("a UDP socket"),
            destination: ends.udp_client,
            listener,
            clients: Clients { streams: Vec::new(), in_turn: ends.in_turn, next: 0 },
            serial,
            room: Room::new(),
        }
    }

    fn accept(&mut self) {
        while let Some(Ok((stream, _))) = self.listener.as_ref().map(TcpListener::accept) {
            stream.set_nodelay(true).expect("no delay");
            self.clients.streams.push(stream);
        }
    }

    /// One call per datagram in, one per datagram and destination out.
    fn datagrams(&mut self) {
        let Some(server) = &self.server else { return };
        while let Ok(count) = server.recv(&mut self.room.slots[0]) {
            let bytes = &self.room.slots[0][..count];
            self.clients.send(bytes);
            send(&self.sender, self.destination, bytes);
        }
    }

    /// What the serial port has, as it comes.
    fn line(&mut self) {
        let Some(serial) = &mut self.serial else { return };
        while let Ok(count @ 1..) = serial.read(self.room.slots.as_flattened_mut()) {
            let bytes = &self.room.slots.as_flattened()[..count];
            self.clients.send(bytes);
            send(&self.sender, self.destination, bytes);
        }
    }

    /// As many datagrams a call as there are, in and out.
    fn batches(&mut self) {
        let Some(server) = self.server.as_ref().map(AsRawFd::as_raw_fd) else { return };
        loop {
            let Room { slots, incoming, outgoing } = &mut self.room;
            let mut pieces = slots.each_mut().map(|slot| [IoSliceMut::new(slot)]);
            let flags = MsgFlags::MSG_DONTWAIT;
            let Ok(received) = recvmmsg(server, incoming, pieces.iter_mut(), flags, None) else {
                return;
            };
            let (mut lengths, mut count) = ([0; BATCH], 0);
            for (length, message) in lengths.iter_mut().zip(received) {
                *length = message.bytes;
                count += 1;
            }
            let datagrams: [_; BATCH] =
                std::array::from_fn(|at| IoSlice::new(&slots[at][..lengths[at]]));
            self.clients.send_all(&datagrams[..count]);
            if let Some(destination) = self.destination {
                let pieces = datagrams.each_ref().map(|datagram| [*datagram]);
                let to = [Some(SockaddrIn::from(destination)); BATCH];
                let socket = self.sender.as_raw_fd();
                let _ = sendmmsg(socket, outgoing, &pieces[..count], to, [], flags);
            }
            // A short batch: there was no more.
            if count < BATCH {
                return;
            }
        }
    }
}

impl Room {
    fn new() -> Self {
        let headers = || MultiHeaders::preallocate(BATCH, None);
        let slots = Box::new([[0; LONGEST]; BATCH]);
        Self { slots, incoming: headers(), outgoing: headers() }
    }
}

/// What has no room is lost: who does not look at the bytes has no better choice.
fn send(socket: &UdpSocket, destination: Option<SocketAddrV4>, bytes: &[u8]) {
    if let Some(destination) = destination {
        let _ = socket.send_to(bytes, destination.into());
    }
}

struct Clients {
    streams: Vec<TcpStream>,
    /// Each datagram is for the next of them.
    in_turn: bool,
    next: usize,
}

impl Clients {
    fn send(&mut self, bytes: &[u8]) {
        if self.in_turn {
            self.next = (self.next + 1) % self.streams.len().max(1);
            if let Some(client) = self.streams.get_mut(self.next) {
                let _ = client.write(bytes);
            }
        } else {
            for client in &mut self.streams {
                let _ = client.write(bytes);
            }
        }
    }

    fn send_all(&mut self, datagrams: &[IoSlice<'_>]) {
        if self.in_turn {
            datagrams.iter().for_each(|datagram| self.send(datagram));
        } else {
            for client in &mut self.streams {
                let _ = client.write_vectored(datagrams);
            }
        }
    }
}
