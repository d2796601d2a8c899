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
    clients: Vec<TcpStream>,
    serial: Option<File>,
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
        let sender = UdpSocket::bind(any).expect("a UDP socket");
        let destination = ends.udp_client;
        Self { server, sender, destination, listener, clients: Vec::new(), serial }
    }

    fn accept(&mut self) {
        while let Some(Ok((stream, _))) = self.listener.as_ref().map(TcpListener::accept) {
            stream.set_nodelay(true).expect("no delay");
            self.clients.push(stream);
        }
    }

    /// One call per datagram in, one per datagram and destination out.
    fn datagrams(&mut self) {
        let mut buffer = [0; LONGEST];
        loop {
            let Some(Ok(count)) = self.server.as_ref().map(|socket| socket.recv(&mut buffer))
            else {
                return;
            };
            self.send(&buffer[..count]);
        }
    }

    /// What the serial port has, as it comes.
    fn line(&mut self) {
        let mut buffer = [0; 1 << 16];
        loop {
            let count = self.serial.as_mut().map(|file| file.read(&mut buffer));
            let Some(Ok(count @ 1..)) = count else { return };
            self.send(&buffer[..count]);
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        // What has no room is lost: who does not look at the bytes has no better choice.
        if let Some(destination) = self.destination {
            let _ = self.sender.send_to(bytes, destination.into());
        }
        for client in &mut self.clients {
            let _ = client.write(bytes);
        }
    }

    /// As many datagrams a call as there are, in and out.
    fn batches(&mut self) {
        let Some(server) = &self.server else { return };
        let mut slots = [[0; LONGEST]; BATCH];
        let mut headers = MultiHeaders::<SockaddrIn>::preallocate(BATCH, None);
        let mut lengths = [0; BATCH];
        loop {
            let mut pieces = slots.each_mut().map(|slot| [IoSliceMut::new(slot)]);
            let flags = MsgFlags::MSG_DONTWAIT;
            let received =
                recvmmsg(server.as_raw_fd(), &mut headers, pieces.iter_mut(), flags, None);
            let Ok(received) = received else { return };
            let mut count = 0;
            for (length, message) in lengths.iter_mut().zip(received) {
                *length = message.bytes;
                count += 1;
            }
            let datagrams: Vec<_> = slots.iter().zip(lengths).take(count).collect();
            let datagrams = datagrams.iter().map(|(slot, length)| IoSlice::new(&slot[..*length]));
            let datagrams: Vec<_> = datagrams.collect();
            for client in &mut self.clients {
                let _ = client.write_vectored(&datagrams);
            }
            if let Some(destination) = self.destination {
                send_batch(&self.sender, destination, &datagrams);
            }
            // A short batch: there was no more.
            if count < BATCH {
                return;
            }
        }
    }
}

fn send_batch(socket: &UdpSocket, destination: SocketAddrV4, datagrams: &[IoSlice<'_>]) {
    let mut headers = MultiHeaders::<SockaddrIn>::preallocate(BATCH, None);
    let pieces: Vec<_> = datagrams.iter().map(|datagram| [*datagram]).collect();
    let destinations = vec![Some(SockaddrIn::from(destination)); pieces.len()];
    let flags = MsgFlags::MSG_DONTWAIT;
    let _ = sendmmsg(socket.as_raw_fd(), &mut headers, &pieces, destinations, [], flags);
}
