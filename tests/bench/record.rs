//! What recording costs, and that it costs no frame.
//!
//! `cargo bench --bench record` prints the processor time of a recorded frame, on the loop and on
//! the writer; whether 1,000,000 frames at 20,000 a second are all recorded on the disk of the build
//! directory; and how late frames are that are routed while the disk is full, or stands still.

#![allow(clippy::unwrap_used)]

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};
use std::{env, fs, process, thread};

use mavswitch::config::RecordOptions;
use mavswitch::mavlink::{CheckedFrame, Component, Frame, FrameSpec, MessageId, Version, encode};
use mavswitch::record::{Recorder, TlogReader};
use mavswitch::routing::Time;
use rustix::process::{Pid, Signal, kill_process};
use rustix::time::{ClockId, clock_gettime};

/// How many frames are recorded, and how many a second where that is paced.
const FRAMES: u64 = 1_000_000;
const RATE: u64 = 20_000;

/// How many frames a turn of the loop has at that rate, one turn each millisecond.
const A_TURN: u64 = RATE / 1_000;

/// For how long latency is measured, and how many frames a second are sent.
const MEASURED: Duration = Duration::from_secs(12);
const PROBES: u64 = 1_000;

fn main() {
    // `cargo test --all-targets` runs this too, and wants no figures.
    if !env::args().any(|argument| argument == "--bench") {
        return;
    }
    record("as fast as it goes", None);
    record("20,000 frames a second", Some(Duration::from_millis(1)));
    let off = latency("nothing is recorded", &mut router(&[], &[]));
    let dir = directory("latency");
    let flags = |dir: &Path| -> Vec<String> {
        vec!["--record".into(), dir.display().to_string(), "--record-min-free=0".into()]
    };
    let on = latency("recorded to the disk", &mut router(&[], &flags(&dir)));
    compare(off, on);
    if let Some(card) = FullCard::mount() {
        compare(off, latency("the card is full", &mut router(&[], &flags(&card.0))));
    }
    let stuck = ["strace", "-D", "-f", "-qq", "-o", "/dev/null", "--seccomp-bpf"];
    let delay = ["-e", "trace=fdatasync", "-e", "inject=fdatasync:delay_enter=5s"];
    let strace = [&stuck[..], &delay].concat();
    if Command::new("strace").arg("-V").output().is_ok() {
        let plain = latency("nothing is recorded, traced", &mut router(&strace, &[]));
        compare(plain, latency("the disk stands still", &mut router(&strace, &flags(&dir))));
    }
    let _ = fs::remove_dir_all(dir);
}

fn directory(name: &str) -> PathBuf {
    let name = format!("record-{name}-{}", process::id());
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&dir).unwrap();
    dir
}

/// An ATTITUDE of 40 bytes with this number.
fn attitude(number: u64) -> Vec<u8> {
    let mut payload = [1; 28];
    payload[..8].copy_from_slice(&number.to_le_bytes());
    let mut frame = Vec::new();
    let spec = FrameSpec {
        version: Version::V2,
        seq: number as u8,
        source: Component::new(1, 1),
        id: MessageId(30),
        crc_extra: 39,
        payload: &payload,
        signature: None,
    };
    encode(&spec, &mut frame);
    frame
}

fn cpu(clock: ClockId) -> Duration {
    let time = clock_gettime(clock);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Records [`FRAMES`], a turn each `pace`, and counts what is in the files.
fn record(name: &str, pace: Option<Duration>) {
    let dir = directory("cost");
    let options = RecordOptions { dir: Some(dir.clone()), min_free: 0, ..RecordOptions::default() };
    let mut recorder = Recorder::start(&options, Time::ZERO).unwrap();
    let bytes = attitude(1);
    let header = Frame::parse(&bytes).unwrap().header();
    let target = Component::new(0, 0);
    let frame = CheckedFrame { bytes: &bytes, header, target, verified: true };
    let start = Instant::now();
    let (all, own) = (cpu(ClockId::ProcessCPUTime), cpu(ClockId::ThreadCPUTime));
    let mut in_loop = Duration::ZERO;
    for turn in 0..FRAMES / A_TURN {
        let before = cpu(ClockId::ThreadCPUTime);
        recorder.begin_turn(SystemTime::now(), Time::from_millis(turn));
        (0..A_TURN).for_each(|_| recorder.record(&frame));
        recorder.end_turn();
        in_loop += cpu(ClockId::ThreadCPUTime) - before;
        match pace {
            Some(pace) => {
                let due = start + pace * turn as u32;
                thread::sleep(due.saturating_duration_since(Instant::now()));
            }
            // A loop that never waits fills any ring: here the writer sets the pace.
            None if turn % 1_000 == 0 => thread::sleep(Duration::from_millis(20)),
            None => {}
        }
    }
    let own = cpu(ClockId::ThreadCPUTime) - own;
    let status = recorder.status();
    recorder.stop(Duration::from_secs(60));
    let writer = cpu(ClockId::ProcessCPUTime) - all - own;
    let ns = |time: Duration| time.as_nanos() as u64 / FRAMES;
    println!(
        "{name}: {} ns a frame on the loop, {} ns on the writer; {} of {FRAMES} recorded, {} lost, in {:.1} s",
        ns(in_loop),
        ns(writer),
        count(&dir),
        status.lost,
        start.elapsed().as_secs_f64(),
    );
    let _ = fs::remove_dir_all(dir);
}

/// How many records there are in all files.
fn count(dir: &Path) -> u64 {
    let files = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    let counts = files.map(|file| {
        let mut reader = TlogReader::new(fs::File::open(file).unwrap());
        while reader.next_record().unwrap().is_some() {}
        reader.stats().records
    });
    counts.sum()
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

/// The router with two UDP ports, ended when this is.
struct Router {
    child: Child,
    ports: [u16; 2],
}

fn router(before: &[&str], flags: &[String]) -> Router {
    // Free a moment ago; somebody else may take them, and then the run is void.
    let free = || UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let ports = [free(), free()];
    let words = [before, &[env!("CARGO_BIN_EXE_mavswitch")]].concat();
    let endpoints = ports.map(|port| format!("udpin:127.0.0.1:{port}"));
    let mut command = Command::new(words[0]);
    command.args(&words[1..]).args(flags).args(endpoints);
    let child = command.stderr(Stdio::null()).stdin(Stdio::null()).spawn().unwrap();
    Router { child, ports }
}

impl Drop for Router {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let _ = self.child.wait();
    }
}

/// How late frames are, in microseconds: half of them, and 99 of 100.
type Lateness = (u64, u64);

fn latency(name: &str, router: &mut Router) -> Lateness {
    let [from, to] = router.ports.map(|port| {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(("127.0.0.1", port)).unwrap();
        socket
    });
    to.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    let start = Instant::now();
    join(&from, &to);
    let receiver = thread::spawn(move || receive(&to, start));
    for number in 0..PROBES * MEASURED.as_secs() {
        let due = Duration::from_micros(number * 1_000_000 / PROBES);
        thread::sleep(due.saturating_sub(start.elapsed()));
        let _ = from.send(&attitude(start.elapsed().as_micros() as u64));
    }
    let mut late = receiver.join().unwrap();
    late.sort_unstable();
    let quantile = |share: usize| late[(late.len() - 1) * share / 100];
    let lateness = (quantile(50), quantile(99));
    println!("{name}: {} frames, p50 {} us, p99 {} us", late.len(), lateness.0, lateness.1);
    lateness
}

/// Speaks until the router knows both.
fn join(from: &UdpSocket, to: &UdpSocket) {
    let mut buffer = [0; 300];
    for number in 0_u8..=u8::MAX {
        let mut hello = Vec::new();
        let spec = FrameSpec {
            version: Version::V2,
            seq: number,
            source: Component::new(255, 190),
            id: MessageId::HEARTBEAT,
            crc_extra: 50,
            payload: &[0, 0, 0, 0, 6, 8, 0, 4, 3],
            signature: None,
        };
        encode(&spec, &mut hello);
        let _ = to.send(&hello);
        let _ = from.send(&attitude(u64::from(number)));
        if to.recv(&mut buffer).is_ok() {
            return;
        }
        // Before it listens, the system refuses at once.
        thread::sleep(Duration::from_millis(50));
    }
    panic!("the router does not answer");
}

/// How late each frame was, until none comes any more.
fn receive(socket: &UdpSocket, start: Instant) -> Vec<u64> {
    socket.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    let mut late = Vec::new();
    let mut buffer = [0; 300];
    while let Ok(len) = socket.recv(&mut buffer) {
        let now = start.elapsed().as_micros() as u64;
        let Ok(frame) = Frame::parse(&buffer[..len]) else { continue };
        let sent = frame.payload().first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        // What was said in order to join has a number and no time.
        if sent > 10_000 {
            late.push(now.saturating_sub(sent));
        }
    }
    late
}

fn compare(without: Lateness, with: Lateness) {
    let times = |a: u64, b: u64| b as f64 / a.max(1) as f64;
    let (p50, p99) = (times(without.0, with.0), times(without.1, with.1));
    println!("  {p50:.2} times the p50 and {p99:.2} times the p99");
}
