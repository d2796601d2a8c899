//! What the pure core costs a frame: split, check, route, queue; no system call, no socket.
//!
//! `cargo bench --bench core` prints nanoseconds, which hold for this machine and this minute, and
//! instructions as valgrind counts them, which hold for this compiler. The instructions are
//! compared with those in `core.tsv`, and 10 % more of them is a failure; `CORE_WRITE=1` writes that
//! file anew.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};
use std::{env, fs};

use mavswitch::mavlink::{
    CheckedFrame, Checker, Component, Dialect, FrameBuffer, FrameSpec, Header, Input, Key,
    MessageId, Splitter, Streams, Timestamp, Version, encode,
};
use mavswitch::routing::{LinkId, LinkOptions, Router, RouterOptions, Time};

/// Where the figures stand that are compared with.
const COMMITTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/bench/core.tsv");

/// How many frames are read at once, as a busy UDP socket or stream has them.
const FRAMES_A_TURN: usize = 16;

/// What is done with each frame.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// How many links hear it, if it is for everybody.
    links: u8,
    /// It is for the component on the last link.
    directed: bool,
    dedup: bool,
}

const CASES: [Case; 4] = [
    Case { name: "telemetry to 1 link", links: 1, directed: false, dedup: false },
    Case { name: "telemetry to 8 links", links: 8, directed: false, dedup: false },
    Case { name: "directed, 1 of 200 links", links: 200, directed: true, dedup: false },
    Case { name: "telemetry to 1 link, dedup", links: 1, directed: false, dedup: true },
];

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args().collect();
    if let [_, run, case, turns] = &arguments[..]
        && run == "run"
    {
        let case = CASES[case.parse::<usize>().expect("the number of a case")];
        Core::new(case).run(turns.parse().expect("a number of turns"));
        return ExitCode::SUCCESS;
    }
    // `cargo test --all-targets` runs this too, and wants no figures.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    let committed = committed();
    let mut counted = BTreeMap::new();
    println!("| | instructions/frame | committed | time/frame |\n|---|---|---|---|");
    for (at, case) in CASES.iter().enumerate() {
        let time = nanoseconds(*case);
        let known = committed.get(case.name).map_or_else(|| "-".to_owned(), u64::to_string);
        let count = instructions(at);
        let shown = count.map_or_else(|| "no valgrind".to_owned(), |count| count.to_string());
        println!("| {} | {shown} | {known} | {time:.0} ns |", case.name);
        counted.extend(count.map(|count| (case.name, count)));
    }
    println!("| checking a signature | - | - | {:.0} ns |", signature());
    if env::var_os("CORE_WRITE").is_some() {
        let lines = counted.iter().map(|(name, count)| format!("{name}\t{count}\n"));
        fs::write(COMMITTED, lines.collect::<String>()).expect("the file is written");
    }
    let is_worse = |(name, count): (&&str, &u64)| {
        committed.get(*name).is_some_and(|known| *count > known + known / 10)
    };
    if counted.iter().any(is_worse) {
        println!("\nThe core costs more than 10 % more than it did.");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn committed() -> BTreeMap<String, u64> {
    let text = fs::read_to_string(COMMITTED).unwrap_or_default();
    let lines = text.lines().filter_map(|line| line.split_once('\t'));
    lines.map(|(name, count)| (name.to_owned(), count.parse().expect("a number"))).collect()
}

/// The best of many short runs: what disturbs a run makes it longer, never shorter.
fn nanoseconds(case: Case) -> f64 {
    const TURNS: usize = 200;
    let mut core = Core::new(case);
    core.run(TURNS);
    let run = |_| {
        let begin = Instant::now();
        core.run(TURNS);
        begin.elapsed().as_secs_f64() * 1e9 / (TURNS * FRAMES_A_TURN) as f64
    };
    (0..500).map(run).fold(f64::INFINITY, f64::min)
}

/// Nanoseconds to believe a signed frame of 65 bytes: its signature, and its place in its stream.
fn signature() -> f64 {
    let key = Key::from_passphrase("bench");
    let begin = Timestamp::new(1_000_000);
    let plain = frame(1, None, 0);
    let header = Header::parse(&plain).expect("a frame");
    let target = Component::new(0, 0);
    let plain = CheckedFrame { bytes: &plain, header, target, verified: true };
    let mut buffers = vec![FrameBuffer::default(); 10_000];
    let later = (0..).map(|n| begin.plus(n));
    let signed = buffers.iter_mut().zip(later).map(|(buffer, at)| buffer.sign(&plain, &key, 1, at));
    let signed: Vec<_> = signed.map(|frame| frame.expect("an unsigned frame")).collect();
    let run = |_| {
        let mut streams = Streams::default();
        let start = Instant::now();
        let believed = signed.iter().filter(|frame| streams.accept(frame, &key, begin).is_ok());
        assert_eq!(believed.count(), signed.len());
        start.elapsed().as_secs_f64() * 1e9 / signed.len() as f64
    };
    (0..50).map(run).fold(f64::INFINITY, f64::min)
}

/// Instructions a frame: the difference between a long run and a short one.
fn instructions(case: usize) -> Option<u64> {
    const TURNS: u64 = 500;
    let frames = TURNS * FRAMES_A_TURN as u64;
    Some((collected(case, 2 * TURNS)? - collected(case, TURNS)?) / frames)
}

fn collected(case: usize, turns: u64) -> Option<u64> {
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    let me = env::current_exe().expect("the path of this program");
    valgrind.arg(me).args(["run", &case.to_string(), &turns.to_string()]);
    let output = valgrind.output().ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let (_, rest) = said.split_once("Collected :")?;
    rest.split_whitespace().next()?.parse().ok()
}

/// The core, and a turn's worth of bytes.
struct Core {
    checker: Checker,
    splitter: Splitter,
    router: Router,
    source: LinkId,
    buffer: Vec<u8>,
    bytes: Vec<u8>,
    /// Turns so far.
    turn: u64,
}

impl Core {
    fn new(case: Case) -> Self {
        let mut router = Router::new(RouterOptions::default());
        let dedup = case.dedup.then(|| Duration::from_millis(500));
        let options = || LinkOptions { dedup, ..LinkOptions::default() };
        let mut add = || router.add_link(options(), Time::ZERO).expect("there is room");
        let links: Vec<_> = (0..=case.links).map(|_| add()).collect();
        let bytes = Vec::new();
        let (splitter, buffer) = (Splitter::new(), vec![0; Splitter::CARRY + 8_192]);
        let checker = Checker::new(Dialect::builtin());
        let mut core = Self { checker, splitter, router, source: links[0], buffer, bytes, turn: 0 };
        // Everybody is known before it begins.
        for (system, link) in (1..).zip(&links) {
            core.bytes = frame(system, None, 0);
            core.pass(*link);
        }
        let target = case.directed.then(|| Component::new(case.links + 1, 1));
        core.bytes.clear();
        for n in 0..FRAMES_A_TURN {
            core.bytes.extend(frame(1, target, n));
        }
        core
    }

    fn run(&mut self, turns: usize) {
        for _ in 0..turns {
            self.pass(self.source);
        }
    }

    /// A read of all the bytes on a link, and the queues emptied as a flush does.
    fn pass(&mut self, link: LinkId) {
        self.turn += 1;
        let now = Time::from_millis(self.turn * 600);
        let received = self.bytes.len();
        self.buffer[Splitter::CARRY..][..received].copy_from_slice(&self.bytes);
        let mut cutter = self.splitter.cut(&mut self.buffer, received, Input::Flowing);
        while let Some(frame) = cutter.next(&mut self.checker) {
            self.router.handle(link, &frame, now);
        }
        for link in self.router.take_dirty().iter() {
            if let Some(port) = self.router.port_mut(link) {
                port.consume(port.backlog());
            }
        }
    }
}

/// A frame of 52 bytes: ATTITUDE_QUATERNION, or COMMAND_INT if it is for somebody.
fn frame(system: u8, target: Option<Component>, n: usize) -> Vec<u8> {
    let mut payload = [0x3f; 40];
    let (id, crc_extra, len) = match target {
        None => (MessageId(31), 246, 40),
        Some(to) => {
            (payload[30], payload[31]) = (to.system, to.component);
            (MessageId(75), 158, 35)
        }
    };
    let seq = n.to_le_bytes()[0];
    let (version, source) = (Version::V2, Component::new(system, 1));
    let payload = &payload[..len];
    let mut out = Vec::new();
    encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature: None }, &mut out);
    out
}
