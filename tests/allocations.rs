//! Nothing on a frame's way allocates: splitter, checker, router and queues, once warm.

use allocation_counter::measure;
use mavswitch::mavlink::{
    Checker, Component, Dialect, FrameSpec, Input, MessageId, Splitter, Version, encode,
};
use mavswitch::routing::{LinkId, LinkOptions, RateCap, Router, RouterOptions, Time};
use std::time::Duration;

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
        let mut router = Router::new(RouterOptions::default());
        let options = || LinkOptions {
            caps: vec![RateCap { id: MessageId(30), interval: Duration::from_millis(100) }],
            dedup: Some(Duration::from_millis(1)),
            ..LinkOptions::default()
        };
        let mut link = || router.add_link(options(), Time::ZERO).expect("there is room");
        let links = std::array::from_fn(|_| link());
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
