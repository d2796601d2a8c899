//! Nothing on a frame's way allocates: splitter, checker, router and queues, once warm; gates that
//! sign, verify, strip and remap; the recorder; the router's own component.

use allocation_counter::measure;
use mavswitch::config::RecordOptions;
use mavswitch::mavlink::{
    CheckedFrame, Checker, Component, Dialect, Frame, FrameSpec, Input, Key, MessageId, Recipes,
    Splitter, SystemMap, Timing, Version, encode,
};
use mavswitch::own::OwnComponent;
use mavswitch::record::Recorder;
use mavswitch::routing::{
    GateOptions, LinkId, LinkOptions, LocalPeer, OldFrames, RateCap, Router, RouterOptions, Sign,
    Time, Verify,
};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use std::{env, fs};

const ROUNDS: u64 = 20_000;

/// One of every kind of frame: broadcast, directed, unknown, damaged, without a route, noise.
fn stream() -> Vec<u8> {
    let mut stream = Vec::new();
    let mut add = |system, id, crc_extra, payload: &[u8]| {
        let spec = FrameSpec {
            version: if system == 1 { Version::V2 } else { Version::V1 },
            seq: 0,
            source: Component::new(system, 1),
            id: MessageId(id),
            crc_extra,
            payload,
            signature: None,
        };
        encode(&spec, &mut stream);
    };
    let mut command = [1; 33];
    add(1, 0, 50, &[3; 9]);
    add(1, 30, 39, &[7; 28]);
    add(1, 2, 137, &[7; 12]);
    (command[30], command[31]) = (2, 1);
    add(1, 76, 152, &command);
    command[30] = 99;
    add(1, 76, 152, &command);
    add(1, 54_321, 77, &[1, 2, 3]);
    add(1, 0, 51, &[4; 9]);
    stream.extend([0xfd, 0x10, 0xfe, 0x55, 0x00, 0xfd, 0x09, 0x00]);
    stream
}

struct Bench {
    checker: Checker,
    splitter: Splitter,
    router: Router,
    links: [LinkId; 3],
    buffer: Vec<u8>,
}

impl Bench {
    fn new() -> Self {
        let options = || LinkOptions {
            caps: vec![RateCap { id: MessageId(30), interval: Duration::from_millis(100) }],
            dedup: Some(Duration::from_millis(1)),
            ..LinkOptions::default()
        };
        Self::with_links([options(), options(), options()])
    }

    fn with_links(options: [LinkOptions; 3]) -> Self {
        let mut router = Router::new(RouterOptions::default());
        let links = options.map(|it| router.add_link(it, Time::ZERO).expect("there is room"));
        Self {
            checker: Checker::new(Dialect::builtin()),
            splitter: Splitter::new(),
            router,
            links,
            buffer: vec![0; Splitter::CARRY + 4_096],
        }
    }

    /// A read of `bytes` on a link, and what it brings about; some queues are emptied, one is not.
    fn turn(&mut self, link: usize, bytes: &[u8], now: Time) {
        self.buffer[Splitter::CARRY..][..bytes.len()].copy_from_slice(bytes);
        let mut cutter = self.splitter.cut(&mut self.buffer, bytes.len(), Input::Flowing);
        while let Some(frame) = cutter.next(&mut self.checker) {
            self.router.handle(self.links[link], &frame, now);
        }
        self.router.take_filling();
        for link in self.router.take_dirty().iter().filter(|link| link.index() < 2) {
            if let Some(port) = self.router.port_mut(link) {
                port.consume(port.backlog());
            }
        }
        self.router.handle_timeout(now);
        while self.router.poll_event().is_some() {}
    }
}

#[test]
fn nothing_on_a_frames_way_allocates() {
    let mut bench = Bench::new();
    let stream = stream();
    let torn = &stream[..stream.len() / 2];
    let other: Vec<u8> = stream.iter().copied().filter(|byte| *byte != 0x55).collect();
    let mut round = |number: u64| {
        let now = Time::from_millis(number);
        bench.turn(0, &stream, now);
        bench.turn(0, torn, now);
        bench.turn(1, &other, now);
    };
    (0..100).for_each(&mut round);
    let allocations = measure(|| (100..ROUNDS).for_each(&mut round));
    assert_eq!(allocations.count_total, 0, "in {ROUNDS} rounds");
    let counters = bench.router.counters(bench.links[0]).expect("the link is there");
    assert!(counters.frames_in > ROUNDS * 7, "the frames did arrive");
    assert!(counters.dropped() > ROUNDS, "some were dropped for lack of a route");
}

/// A link whose frames go through a gate.
fn gated(gate: GateOptions) -> LinkOptions {
    LinkOptions { gate, ..LinkOptions::default() }
}

/// What the air between two gateways carries, without a buffer of its own.
struct Air {
    bytes: [u8; 4_096],
    len: usize,
}

impl Air {
    /// Takes what waits for a link, in the shape in which it leaves.
    fn take(&mut self, from: &mut Bench, link: usize) {
        let port = from.router.port_mut(from.links[link]).expect("the link is there");
        let (first, second) = port.head(usize::MAX);
        self.len = first.len() + second.len();
        self.bytes[..first.len()].copy_from_slice(first);
        self.bytes[first.len()..self.len].copy_from_slice(second);
        port.consume(self.len);
    }
}

/// A vehicle with a number of its own behind the near gateway, which signs; the far one verifies,
/// takes the signature off and gives the vehicle another number.
#[test]
fn gates_that_sign_verify_strip_and_remap_allocate_nothing() {
    let key = || Key::from_passphrase("the key of this vehicle");
    let recipes = Arc::new(Recipes::new(&Dialect::builtin()));
    let sign = Some(Sign { key: key(), v1: OldFrames::Upgrade });
    let (allow_unsigned, strip) = (vec![MessageId::RADIO_STATUS], true);
    let verify = Some(Verify { key: key(), allow_unsigned, strip, before_sending: false });
    let remap = SystemMap::new(&[(1, 7)]).map(Arc::new);
    let near = GateOptions { sign, ..GateOptions::default() };
    let far = GateOptions { verify, remap, recipes: Some(recipes), ..GateOptions::default() };
    let plain = LinkOptions::default;
    // What leaves by the last link of each stays until it is taken.
    let mut near = Bench::with_links([plain(), plain(), gated(near)]);
    let mut far = Bench::with_links([gated(far), plain(), plain()]);
    let stream = stream();
    let mut air = Air { bytes: [0; 4_096], len: 0 };
    let mut round = |number: u64| {
        let now = Time::from_millis(number);
        near.turn(0, &stream, now);
        air.take(&mut near, 2);
        far.turn(0, &air.bytes[..air.len], now);
        air.take(&mut far, 2);
        air.len
    };
    for number in 0..100 {
        round(number);
    }
    let mut arrived = 0;
    let allocations = measure(|| arrived = (100..ROUNDS).map(&mut round).sum());
    assert_eq!(allocations.count_total, 0, "in {ROUNDS} rounds");
    let counters = far.router.counters(far.links[0]).expect("the link is there");
    assert!(counters.frames_in > ROUNDS * 3, "the frames did arrive");
    assert_eq!(counters.dropped(), 0, "each had a signature that is right");
    assert!(arrived > 50 * ROUNDS as usize, "and they went on");
    assert!(far.router.table().find(Component::new(7, 1)).is_some(), "as those of system 7");
}

/// The frames of a stream, each by itself.
fn each(stream: &[u8], mut act: impl FnMut(&CheckedFrame<'_>)) {
    let (mut splitter, mut checker) = (Splitter::new(), Checker::new(Dialect::builtin()));
    let mut buffer = vec![0; Splitter::CARRY + 4_096];
    buffer[Splitter::CARRY..][..stream.len()].copy_from_slice(stream);
    let mut cutter = splitter.cut(&mut buffer, stream.len(), Input::Paused);
    while let Some(frame) = cutter.next(&mut checker) {
        act(&frame);
    }
}

#[test]
fn the_recorder_allocates_nothing_for_a_frame() {
    let dir = env::temp_dir().join(format!("mavswitch-allocations-{}", std::process::id()));
    // Of an earlier run whose process had the same number.
    let _ = fs::remove_dir_all(&dir);
    let options = RecordOptions { dir: Some(dir.clone()), min_free: 0, ..Default::default() };
    let mut recorder = Recorder::start(&options, Time::ZERO).expect("a thread for it");
    let wall = SystemTime::now();
    let mut frames = 0;
    each(&stream(), |frame| {
        let mut round = |number: u64| {
            let (wall, now) = (wall + Duration::from_millis(number), Time::from_millis(number));
            recorder.begin_turn(wall, now);
            recorder.record(frame);
            recorder.end_turn();
            frames += 1;
        };
        (0..100).for_each(&mut round);
        let allocations = measure(|| (100..ROUNDS / 4).for_each(&mut round));
        assert_eq!(allocations.count_total, 0, "in {ROUNDS} rounds");
    });
    recorder.stop(Duration::from_secs(60));
    let files = fs::read_dir(&dir).expect("a directory").map(|entry| entry.expect("a file"));
    let bytes: u64 = files.map(|file| file.metadata().expect("its length").len()).sum();
    assert!(frames > ROUNDS && bytes > 20 * ROUNDS, "it was recorded: {bytes} bytes");
    fs::remove_dir_all(&dir).expect("the directory goes");
}

#[test]
fn the_own_component_allocates_nothing_for_a_question_and_its_answer() {
    let (own, gcs) = (Component::new(1, 191), Component::new(255, 190));
    let mut component = OwnComponent::new(Some(own));
    let (mut question, mut answer) = (Vec::with_capacity(300), Vec::with_capacity(300));
    let mut answers = 0;
    let mut round = |number: u64| {
        let now = Time::from_millis(number);
        question.clear();
        let timing = match number % 2 {
            0 => Timing::timesync(0, number as i64, own),
            _ => Timing::ping(number, 1, Component::new(0, 0)),
        };
        timing.encode(gcs, number as u8, &mut question);
        component.handle_frame(&Frame::parse(&question).expect("a frame"), now);
        answer.clear();
        while component.poll_transmit(now, &mut answer) {
            answers += 1;
        }
    };
    (0..100).for_each(&mut round);
    let allocations = measure(|| (100..ROUNDS).for_each(&mut round));
    assert_eq!(allocations.count_total, 0, "in {ROUNDS} rounds");
    assert_eq!(answers, ROUNDS, "each had its answer");
}
