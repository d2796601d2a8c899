//! How late routed frames are while a disk is full or stands still, beside routers that record
//! nothing.
//!
//! All routers run at once and have short turns, round after round and each time in another order,
//! so that what disturbs the machine disturbs all of them alike. On a machine that has more to do,
//! `chrt -f 5` in front of all helps more than many rounds.

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use std::{fs, thread};

use mavswitch::mavlink::{Component, Frame, FrameSpec, MessageId};
use rustix::process::{Pid, Signal, kill_process};

use super::{attitude, directory};

/// How many rounds there are, and how many frames a router gets in its turn, one each millisecond.
const ROUNDS: usize = 100;
const PROBES: usize = 200;

/// For how long a frame that does not come is waited for.
const LATE: Duration = Duration::from_millis(300);

/// Prints how late frames are, and how many times as late as without recording.
pub(crate) fn compare() {
    let dir = directory("latency");
    let card = FullCard::mount();
    let mut arms = arms(&dir, card.as_ref());
    let count = arms.len();
    for round in 0..ROUNDS {
        (0..count).for_each(|turn| arms[(round + turn) % count].measure());
    }
    arms.iter_mut().for_each(|arm| arm.late.sort_unstable());
    for arm in &arms {
        let times =
            |share: usize| arm.quantile(share) as f64 / arms[arm.beside].quantile(share) as f64;
        println!(
            "{:<34} p50 {:>5} us ({:.2} times), p99 {:>5} us ({:.2} times), {} of {} frames",
            arm.name,
            arm.quantile(50),
            times(50),
            arm.quantile(99),
            times(99),
            arm.late.len(),
            ROUNDS * PROBES,
        );
    }
    drop(arms);
    let _ = fs::remove_dir_all(dir);
}

/// The routers that are compared.
fn arms(dir: &Path, card: Option<&FullCard>) -> Vec<Arm> {
    let mut arms = vec![
        Arm::new("nothing is recorded", 0, &[], None),
        Arm::new("recorded to the disk", 0, &[], Some(dir)),
    ];
    if let Some(card) = card {
        arms.push(Arm::new("the card is full", 0, &[], Some(&card.0)));
    }
    let stuck = ["strace", "-D", "-f", "-qq", "-o", "/dev/null", "--seccomp-bpf"];
    let delay = ["-e", "trace=fdatasync", "-e", "inject=fdatasync:delay_enter=5s"];
    let strace = [&stuck[..], &delay].concat();
    if Command::new("strace").arg("-V").stdout(Stdio::null()).status().is_ok() {
        let beside = arms.len();
        arms.push(Arm::new("nothing is recorded, traced", beside, &strace, None));
        arms.push(Arm::new("the disk stands still, traced", beside, &strace, Some(dir)));
    }
    arms
}

/// A router, who speaks and who listens, and how late frames were, in microseconds.
struct Arm {
    name: &'static str,
    /// Which arm is the same without recording.
    beside: usize,
    from: UdpSocket,
    to: UdpSocket,
    late: Vec<u64>,
    _router: Router,
}

impl Arm {
    fn new(name: &'static str, beside: usize, before: &[&str], dir: Option<&Path>) -> Self {
        let router = Router::start(before, dir);
        let [from, to] = router.ports.map(|port| {
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            socket.connect(("127.0.0.1", port)).unwrap();
            socket
        });
        join(&from, &to);
        Self { name, beside, from, to, late: Vec::new(), _router: router }
    }

    /// One turn.
    fn measure(&mut self) {
        let _ = self.to.send(&heartbeat(0));
        let start = Instant::now();
        let to = self.to.try_clone().unwrap();
        let receiver = thread::spawn(move || receive(&to, start));
        for number in 0..PROBES {
            let due = Duration::from_millis(number as u64);
            thread::sleep(due.saturating_sub(start.elapsed()));
            let _ = self.from.send(&attitude(stamp(start)));
        }
        let late = receiver.join().unwrap();
        assert!(late.len() > PROBES / 2, "{}: frames are lost", self.name);
        self.late.extend(late);
    }

    /// What so many of a hundred frames take at most, once they are sorted.
    fn quantile(&self, share: usize) -> u64 {
        self.late[(self.late.len() - 1) * share / 100].max(1)
    }
}

/// What is told apart from the numbers of who joins by being large.
fn stamp(start: Instant) -> u64 {
    START + start.elapsed().as_micros() as u64
}

const START: u64 = 1_000_000;

/// How late each frame was, until all have come or none comes any more.
fn receive(socket: &UdpSocket, start: Instant) -> Vec<u64> {
    socket.set_read_timeout(Some(LATE)).unwrap();
    let mut late = Vec::new();
    let mut buffer = [0; 300];
    while late.len() < PROBES
        && let Ok(len) = socket.recv(&mut buffer)
    {
        let now = stamp(start);
        let Ok(frame) = Frame::parse(&buffer[..len]) else { continue };
        let sent = frame.payload().first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        if sent >= START {
            late.push(now.saturating_sub(sent));
        }
    }
    late
}

/// The router with two UDP ports, ended when this is.
struct Router {
    child: Child,
    ports: [u16; 2],
}

impl Router {
    /// Records to `dir`, if there is one; `before` are the words before its command line.
    fn start(before: &[&str], dir: Option<&Path>) -> Self {
        // Free a moment ago; somebody else may take them, and then the run is void.
        let free = || UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let ports = [free(), free()];
        let words = [before, &[env!("CARGO_BIN_EXE_mavswitch")]].concat();
        let endpoints = ports.map(|port| format!("udpin:127.0.0.1:{port}"));
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).args(endpoints);
        if let Some(dir) = dir {
            command.arg("--record").arg(dir).arg("--record-min-free=0");
        }
        let child = command.stderr(Stdio::null()).stdin(Stdio::null()).spawn().unwrap();
        Self { child, ports }
    }
}

impl Drop for Router {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let _ = self.child.wait();
    }
}

/// Speaks until the router knows both.
fn join(from: &UdpSocket, to: &UdpSocket) {
    to.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    let mut buffer = [0; 300];
    for number in 0_u8..=u8::MAX {
        let _ = to.send(&heartbeat(number));
        let _ = from.send(&attitude(u64::from(number)));
        if to.recv(&mut buffer).is_ok() {
            return;
        }
        // Before it listens, the system refuses at once.
        thread::sleep(Duration::from_millis(50));
    }
    panic!("the router does not answer");
}

fn heartbeat(seq: u8) -> Vec<u8> {
    let (source, payload) = (Component::new(255, 190), [0, 0, 0, 0, 6, 8, 0, 4, 3]);
    let spec = FrameSpec::new(source, MessageId::HEARTBEAT, 50, &payload);
    FrameSpec { seq, ..spec }.to_frame()
}

/// A file system without room, gone when this is.
struct FullCard(PathBuf);

impl FullCard {
    /// `None` without the right to mount anything.
    fn mount() -> Option<Self> {
        let dir = directory("card");
        let options = ["-t", "tmpfs", "-o", "size=8k", "tmpfs"];
        let mounted = Command::new("mount").args(options).arg(&dir).status();
        mounted.is_ok_and(|status| status.success()).then(|| {
            fs::write(dir.join("photos"), [1; 8192]).unwrap();
            Self(dir)
        })
    }
}

impl Drop for FullCard {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
        let _ = fs::remove_dir(&self.0);
    }
}
