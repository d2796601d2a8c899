//! The frames that are offered, and the clock in them.

use std::io::Write;
use std::net::UdpSocket;
use std::os::fd::OwnedFd;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use mavswitch::mavlink::{Component, FrameSpec, MessageId, Version, encode};

/// The message that counts: ATTITUDE_QUATERNION, 52 bytes as a frame, for everybody.
pub(crate) const TELEMETRY: MessageId = MessageId(31);
/// The same with a target: COMMAND_LONG.
pub(crate) const COMMAND: MessageId = MessageId(76);

/// Frames that are due within this time go together; longer pauses are kept.
const TICK: Duration = Duration::from_micros(200);

/// Nanoseconds since this program first asked.
pub(crate) fn clock() -> u64 {
    static EPOCH: OnceLock<Instant> = OnceLock::new();
    let nanoseconds = EPOCH.get_or_init(Instant::now).elapsed().as_nanos();
    u64::try_from(nanoseconds).expect("a run is shorter than 584 years")
}

/// Where frames go in.
pub(crate) enum Outlet {
    /// A connected socket for each vehicle.
    Sockets(Vec<UdpSocket>),
    /// The far end of a serial line.
    Line(OwnedFd),
}

/// A vehicle, or a whole fleet.
pub(crate) struct Load {
    pub(crate) outlet: Outlet,
    /// Whom the frames are for, in turn; nobody: everybody.
    pub(crate) targets: Vec<Component>,
    buffer: Vec<u8>,
    sent: usize,
}

impl Load {
    pub(crate) fn new(outlet: Outlet, targets: Vec<Component>) -> Self {
        Self { outlet, targets, buffer: Vec::new(), sent: 0 }
    }

    /// Sends at an even rate for a while, and says how many were sent.
    pub(crate) fn offer(&mut self, rate: u32, time: Duration) -> u64 {
        let begin = Instant::now();
        let pause = TICK.max(Duration::from_secs(1) / rate);
        let mut sent = 0;
        loop {
            let elapsed = begin.elapsed();
            let due = elapsed.min(time).as_nanos() * u128::from(rate) / 1_000_000_000;
            while u128::from(sent) < due {
                self.send();
                sent += 1;
            }
            if elapsed >= time {
                return sent;
            }
            thread::sleep(pause);
        }
    }

    /// Sends one frame.
    pub(crate) fn send(&mut self) {
        let target = self.targets.get(self.sent % self.targets.len().max(1)).copied();
        let (from, socket) = match &self.outlet {
            Outlet::Sockets(sockets) => (self.sent % sockets.len(), self.sent % sockets.len()),
            Outlet::Line(_) => (0, 0),
        };
        self.buffer.clear();
        write_frame(vehicle(from), target, self.sent / self.vehicles(), &mut self.buffer);
        self.sent += 1;
        match &self.outlet {
            // What the kernel has no room for is lost, as it is on a network.
            Outlet::Sockets(sockets) => drop(sockets[socket].send(&self.buffer)),
            Outlet::Line(line) => write_line(line, &self.buffer),
        }
    }

    fn vehicles(&self) -> usize {
        match &self.outlet {
            Outlet::Sockets(sockets) => sockets.len(),
            Outlet::Line(_) => 1,
        }
    }
}

/// The n-th vehicle.
fn vehicle(n: usize) -> Component {
    Component::new(u8::try_from(n + 1).expect("fewer than 255 vehicles"), 1)
}

/// A frame that says when it was made.
fn write_frame(source: Component, target: Option<Component>, n: usize, out: &mut Vec<u8>) {
    let mut payload = [0x3f; 40];
    payload[..8].copy_from_slice(&clock().to_le_bytes());
    let (id, crc_extra, len) = match target {
        None => (TELEMETRY, 246, 40),
        Some(to) => {
            payload[28..33].copy_from_slice(&[0x90, 1, to.system, to.component, 1]);
            (COMMAND, 152, 33)
        }
    };
    let seq = n.to_le_bytes()[0];
    let (version, payload) = (Version::V2, &payload[..len]);
    encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature: None }, out);
}

/// HEARTBEAT: what makes a component known.
pub(crate) fn heartbeat(source: Component) -> Vec<u8> {
    FrameSpec::new(source, MessageId::HEARTBEAT, 50, &[0, 0, 0, 0, 6, 8, 0, 4, 3]).to_frame()
}

fn write_line(line: &OwnedFd, mut bytes: &[u8]) {
    while !bytes.is_empty() {
        match rustix::io::write(line, bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(rustix::io::Errno::AGAIN) => thread::yield_now(),
            Err(error) => panic!("writing to the serial line: {error}"),
        }
    }
}

/// Writes all of it to a stream.
pub(crate) fn say(mut stream: impl Write, bytes: &[u8]) {
    stream.write_all(bytes).expect("a router that reads");
}
