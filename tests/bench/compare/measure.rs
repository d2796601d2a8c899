//! One measurement: a router, a load, and who hears it.

use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use mavswitch::mavlink::Component;
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use socket2::SockRef;

use super::layout::Layout;
use super::load::{Load, Outlet, heartbeat, say};
use super::router::{Candidate, Running};
use super::scenario::{Scenario, Source};
use super::sinks::Sinks;

/// What one measurement gave.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    /// Processor time for each frame that was offered, in microseconds.
    pub(crate) cpu_in: f64,
    /// The same for each that was delivered.
    pub(crate) cpu_out: f64,
    /// The part of the frames that did not arrive.
    pub(crate) loss: f64,
    /// The age of the frames on arrival, in microseconds: half, 99 and 99.9 of 100 were younger.
    pub(crate) ages: [f64; 3],
    /// The most memory in MiB.
    pub(crate) memory: f64,
    /// Context switches a second.
    pub(crate) switches: f64,
}

/// How long a router has to get going before it is called broken.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs one router under one load.
pub(crate) fn measure(candidate: &Candidate, scenario: &Scenario, time: Duration) -> Sample {
    let mut stage = Stage::set(candidate, scenario);
    stage.settle(scenario);
    stage.load.offer(scenario.rate, time / 10);
    stage.drain();
    let (before, heard_before) = (stage.router.usage(), stage.sinks.heard.frames());
    stage.sinks.begin();
    let begin = Instant::now();
    let sent = stage.load.offer(scenario.rate, time);
    let seconds = begin.elapsed().as_secs_f64();
    stage.drain();
    let (after, heard) = (stage.router.usage(), stage.sinks.heard.frames() - heard_before);
    let memory = stage.router.peak_kib() as f64 / 1024.0;
    let ages = stage.sinks.end();
    let cpu = (after.cpu - before.cpu).as_secs_f64() * 1e6;
    let expected = (sent * scenario.copies()) as f64;
    Sample {
        cpu_in: cpu / sent as f64,
        cpu_out: cpu / heard.max(1) as f64,
        loss: 1.0 - heard as f64 / expected,
        ages: [0.5, 0.99, 0.999].map(|part| quantile(&ages, part) / 1e3),
        memory,
        switches: (after.switches - before.switches) as f64 / seconds,
    }
}

/// The value that this part of the sorted `values` does not exceed.
fn quantile(values: &[u64], part: f64) -> f64 {
    let last = values.len().saturating_sub(1);
    values.get((last as f64 * part).round() as usize).map_or(f64::NAN, |value| *value as f64)
}

/// Everybody who takes part.
struct Stage {
    router: Running,
    load: Load,
    sinks: Sinks,
    /// The ends of connections that speak, and the far end of the line, kept open.
    _kept: Vec<OwnedFd>,
}

impl Stage {
    fn set(candidate: &Candidate, scenario: &Scenario) -> Self {
        let ground = roomy(bound());
        let mut layout = Layout {
            udp_client: (!scenario.directed).then(|| address(&ground)),
            tcp_server: (scenario.clients > 0).then(free_tcp),
            in_turn: scenario.directed,
            ..Layout::default()
        };
        let (mut kept, mut ears) = (Vec::new(), vec![ground]);
        let line = match scenario.source {
            Source::Udp(_) => {
                layout.udp_server = Some(free_udp());
                None
            }
            Source::Serial(baud) => {
                let (master, slave, path) = pty();
                layout.serial = Some((path.display().to_string(), baud));
                kept.push(slave);
                Some(master)
            }
        };
        let router = candidate.start(&layout);
        let outlet = match (line, scenario.source, layout.udp_server) {
            (None, Source::Udp(vehicles), Some(server)) => {
                let sockets: Vec<_> = (0..vehicles).map(|_| roomy(connected(server))).collect();
                if vehicles > 1 {
                    let heard = sockets.iter().map(|socket| socket.try_clone().expect("a copy"));
                    ears.extend(heard);
                }
                Outlet::Sockets(sockets)
            }
            (Some(line), ..) => Outlet::Line(line),
            _ => unreachable!("a load comes by UDP or by a line"),
        };
        let clients = layout.tcp_server.map(|at| connect_all(at, scenario.clients));
        let clients = clients.unwrap_or_default();
        let targets = if scenario.directed { introduce(&clients) } else { Vec::new() };
        let sinks = Sinks::new(ears, clients);
        Self { router, load: Load::new(outlet, targets), sinks, _kept: kept }
    }

    /// Offers a few frames until all who are to hear them do.
    fn settle(&mut self, scenario: &Scenario) {
        let begin = Instant::now();
        let round = match scenario.source {
            Source::Udp(vehicles) => usize::from(vehicles).max(self.load.targets.len()),
            Source::Serial(_) => 1,
        };
        loop {
            self.drain();
            let before = self.sinks.heard.frames();
            (0..round).for_each(|_| self.load.send());
            self.drain();
            let expected = round as u64 * scenario.copies();
            if self.sinks.heard.frames() - before >= expected || begin.elapsed() > PATIENCE {
                return;
            }
        }
    }

    /// Waits until nothing more comes.
    fn drain(&self) {
        let mut before = u64::MAX;
        while before != self.sinks.heard.frames() {
            before = self.sinks.heard.frames();
            thread::sleep(Duration::from_millis(100));
        }
    }
}

/// Each client tells who it is, so that it can be found.
fn introduce(clients: &[TcpStream]) -> Vec<Component> {
    let name = |n: usize| {
        let byte = |n: usize| u8::try_from(n).expect("at most 249 and 4");
        Component::new(byte(2 + n % 250), byte(1 + n / 250))
    };
    let names = (0..clients.len()).map(name);
    names
        .zip(clients)
        .map(|(name, client)| {
            say(client, &heartbeat(name));
            name
        })
        .collect()
}

fn connect_all(server: SocketAddr, clients: u16) -> Vec<TcpStream> {
    let connect = || {
        let begin = Instant::now();
        loop {
            match TcpStream::connect(server) {
                Ok(stream) => return stream,
                Err(error) if begin.elapsed() > PATIENCE => panic!("no connection: {error}"),
                Err(_) => thread::sleep(Duration::from_millis(10)),
            }
        }
    };
    (0..clients).map(|_| connect()).collect()
}

fn bound() -> UdpSocket {
    UdpSocket::bind("127.0.0.1:0").expect("a UDP socket")
}

fn connected(to: SocketAddr) -> UdpSocket {
    let socket = bound();
    socket.connect(to).expect("an address to send to");
    socket
}

/// With room for what piles up while the machine is busy elsewhere.
fn roomy(socket: UdpSocket) -> UdpSocket {
    SockRef::from(&socket).set_recv_buffer_size(4 << 20).expect("room to receive");
    socket
}

fn address(socket: &UdpSocket) -> SocketAddr {
    socket.local_addr().expect("a bound socket")
}

pub(crate) fn free_udp() -> SocketAddr {
    address(&bound())
}

pub(crate) fn free_tcp() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("its address")
}

/// A serial line: its far end, a handle that keeps it, and the device.
fn pty() -> (OwnedFd, OwnedFd, PathBuf) {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo terminal");
    grantpt(&master).expect("a pseudo terminal of our own");
    unlockpt(&master).expect("a pseudo terminal that opens");
    let name = ptsname(&master, Vec::new()).expect("a name");
    let path = PathBuf::from(name.into_string().expect("plain text"));
    let slave = rustix::fs::open(&path, OFlags::RDWR | OFlags::NOCTTY, Mode::empty());
    let slave = slave.expect("its other end");
    let mut settings = tcgetattr(&slave).expect("settings");
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings).expect("raw mode");
    (master, slave, path)
}
