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
use std::{env, fs, vec};

use mavswitch::mavlink::{
    CheckedFrame, Checker, Component, Dialect, FrameBuffer, FrameSpec, Header, Input, Key,
    MessageId, Splitter, Streams, Timestamp, Version, encode,
};
use mavswitch::routing::{
    GateOptions, LinkId, LinkOptions, OldFrames, Router, RouterOptions, Sign, Time, Verify,
};

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
    signing: Signing,
}

/// Where frames are signed, if they are.
#[derive(Clone, Copy, PartialEq)]
enum Signing {
    None,
    /// The link that they leave by signs them.
    Out,
    /// The link that they come by verifies them.
    In,
}

/// What each of the cases is unless it says something else.
const PLAIN: Case =
    Case { name: "", links: 1, directed: false, dedup: false, signing: Signing::None };

const CASES: [Case; 6] = [
    Case { name: "telemetry to 1 link", ..PLAIN },
    Case { name: "telemetry to 8 links", links: 8, ..PLAIN },
    Case { name: "directed, 1 of 200 links", links: 200, directed: true, ..PLAIN },
    Case { name: "telemetry to 1 link, dedup", dedup: true, ..PLAIN },
    Case { name: "telemetry to 1 link that signs", signing: Signing::Out, ..PLAIN },
    Case { name: "telemetry from a link that verifies", signing: Signing::In, ..PLAIN },
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
        if core.is_spent(TURNS) {
            core = Core::new(case);
            core.run(TURNS);
        }
        let begin = Instant::now();
        core.run(TURNS);
        begin.elapsed().as_secs_f64() * 1e9 / (TURNS * FRAMES_A_TURN) as f64
    };
    (0..500).map(run).fold(f64::INFINITY, f64::min)
}

/// Nanoseconds to believe a signed frame of 65 bytes: its signature, and its place in its stream.
fn signature() -> f64 {
    let key = key();
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
    /// What is read instead where each frame must have a signature of its own.
    signed: Option<vec::IntoIter<Vec<u8>>>,
    /// Turns so far.
    turn: u64,
}

/// For how many turns there are signed frames.
const SIGNED: u64 = 1_200;

impl Core {
    fn new(case: Case) -> Self {
        let mut router = Router::new(RouterOptions::default());
        let dedup = case.dedup.then(|| Duration::from_millis(500));
        let options = |at| LinkOptions { dedup, gate: gate(case, at), ..LinkOptions::default() };
        let mut add = |at| router.add_link(options(at), Time::ZERO).expect("there is room");
        let links: Vec<_> = (0..=case.links).map(&mut add).collect();
        let bytes = Vec::new();
        let (splitter, buffer) = (Splitter::new(), vec![0; Splitter::CARRY + 8_192]);
        let checker = Checker::new(Dialect::builtin());
        let (source, signed) = (links[0], None);
        let mut core = Self { checker, splitter, router, source, buffer, bytes, signed, turn: 0 };
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
        core.signed = (case.signing == Signing::In).then(|| signed_turns().into_iter());
        core
    }

    /// Whether there are not as many turns left.
    fn is_spent(&self, turns: usize) -> bool {
        self.signed.as_ref().is_some_and(|signed| signed.len() < turns)
    }

    fn run(&mut self, turns: usize) {
        for _ in 0..turns {
            self.pass(self.source);
        }
    }

    /// A read of all the bytes on a link, and the queues emptied as a flush does.
    fn pass(&mut self, link: LinkId) {
        self.turn += 1;
        if let Some(signed) = &mut self.signed {
            self.bytes = signed.next().expect("signed frames");
        }
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

/// The gate of a link; number 0 is the one that frames come by.
fn gate(case: Case, link: u8) -> GateOptions {
    let none = GateOptions::default();
    match case.signing {
        Signing::Out if link != 0 => {
            GateOptions { sign: Some(Sign { key: key(), v1: OldFrames::Pass }), ..none }
        }
        Signing::In if link == 0 => {
            let (allow_unsigned, strip) = (Vec::new(), false);
            let verify = Verify { key: key(), allow_unsigned, strip, before_sending: false };
            GateOptions { verify: Some(verify), ..none }
        }
        _ => none,
    }
}

fn key() -> Key {
    Key::from_passphrase("bench")
}

/// Turns of frames that are signed one after the other.
fn signed_turns() -> Vec<Vec<u8>> {
    let signed = |number: u64| {
        let plain = frame(1, None, number as usize);
        let header = Header::parse(&plain).expect("a frame");
        let target = Component::new(0, 0);
        let plain = CheckedFrame { bytes: &plain, header, target, verified: true };
        let mut buffer = FrameBuffer::default();
        let at = Timestamp::new(1_000_000).plus(number);
        buffer.sign(&plain, &key(), 1, at).expect("an unsigned frame").bytes.to_vec()
    };
    let turn = FRAMES_A_TURN as u64;
    (0..SIGNED).map(|at| (at * turn..(at + 1) * turn).flat_map(signed).collect()).collect()
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
