//! Readers that do not read, and bursts for those who do (rule 43): nobody pays for another.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::harness::*;

/// On a busy machine, a test may take longer than a reader is usually allowed to stall.
const TCP: &str = "tcpin:127.0.0.1:0?name=tcp&stall_timeout=10m";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// Frames of 267 bytes in one step, and how many steps make 24 MB.
const STEP: u32 = 200;
const STEPS: u32 = 450;

#[test]
fn a_reader_that_never_reads_harms_nobody_and_later_reads_whole_frames_only() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let mut stalled = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &stalled.wire);
    let before = router.process().resident_kib();
    for step in 0..STEPS {
        let frames: Vec<_> = (step * STEP..(step + 1) * STEP).map(|n| bulk(VEHICLE, n)).collect();
        vehicle.send(frames.concat());
        healthy.expect_each(&frames);
    }
    router.assert_grown_less_than(12, before);
    let received = stalled.meet(&mut vehicle);
    assert_rises_with_gaps(&received);
}

/// Each frame is one that was sent, to its last byte; their order is kept; many are missing.
fn assert_rises_with_gaps(received: &[Vec<u8>]) {
    assert!(!received.is_empty() && received.len() < (STEP * STEPS) as usize);
    let numbers: Vec<u32> = received.iter().map(|frame| number_in(frame)).collect();
    assert!(numbers.is_sorted_by(|a, b| a < b), "out of order: {numbers:?}");
    for (frame, n) in received.iter().zip(numbers) {
        assert_eq!(frame, &bulk(VEHICLE, n));
    }
}

#[test]
fn a_stalled_reader_does_not_stall_what_it_says_itself() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.udp("udp", GCS);
    let mut stalled = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &stalled.wire);
    for step in 0..100 {
        let frames: Vec<_> = (0..STEP).map(|n| bulk(VEHICLE, step * STEP + n)).collect();
        vehicle.send(frames.concat());
        healthy.expect_each(&frames);
    }
    stalled.send(command_long(GCS_2, VEHICLE));
    vehicle.expect(command_long(GCS_2, VEHICLE));
}

#[test]
fn a_slow_reader_is_told_what_is_new_and_not_what_was_new_long_ago() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let mut slow = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &slow.wire);
    let (newest, is_over) = (AtomicU64::new(0), AtomicBool::new(false));
    thread::scope(|scope| {
        // Some megabyte a second, of ten.
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                let frames = (0..16).map(|_| slow.receive());
                let numbers = frames.map(|frame| number_in(&frame).into());
                newest.fetch_max(numbers.max().unwrap_or(0), Ordering::Relaxed);
                thread::sleep(Duration::from_millis(4));
            }
        });
        let mut sent = 0;
        let give_up = Instant::now() + PATIENCE;
        let mut behind = u64::MAX;
        while sent < 100 * STEP || behind > 2_000 {
            if Instant::now() > give_up {
                is_over.store(true, Ordering::Relaxed);
                panic!("it is {behind} frames behind");
            }
            let frames: Vec<_> = (sent..sent + STEP).map(|n| bulk(VEHICLE, n)).collect();
            sent += STEP;
            vehicle.send(frames.concat());
            healthy.expect_each(&frames);
            behind = u64::from(sent) - newest.load(Ordering::Relaxed);
            thread::sleep(Duration::from_millis(5));
        }
        is_over.store(true, Ordering::Relaxed);
        // The reader may wait for the last of its sixteen.
        let rest: Vec<_> = (sent..sent + 16).map(|n| attitude(VEHICLE, n)).collect();
        rest.iter().for_each(|frame| vehicle.send(frame));
    });
}

#[test]
fn a_reader_that_pauses_for_less_than_its_stall_timeout_keeps_its_connection() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let mut stalled = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &stalled.wire);
    for step in 0..50 {
        let frames: Vec<_> = (0..STEP).map(|n| bulk(VEHICLE, step * STEP + n)).collect();
        vehicle.send(frames.concat());
        healthy.expect_each(&frames);
    }
    thread::sleep(Duration::from_secs(13));
    assert_rises_with_gaps(&stalled.meet(&mut vehicle));
}

#[test]
fn ten_thousand_frames_in_one_burst_arrive_from_tcp_to_tcp() {
    let router = Router::start(&[TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let frames: Vec<_> = (0..10_000).map(|n| attitude(VEHICLE, n)).collect();
    thread::scope(|scope| {
        scope.spawn(|| vehicle.send(frames.concat()));
        gcs.expect_each(&frames);
    });
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn a_serial_line_that_takes_nothing_harms_nobody_and_later_gives_whole_frames_only() {
    let line = Pty::new();
    let serial = format!("serial:{}:921600?name=radio", line.device());
    let router = Router::start(&[TCP, &serial]);
    let mut radio = router.serial("radio", line, OTHER);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let before = router.process().resident_kib();
    for step in 0..100 {
        let frames: Vec<_> = (0..STEP).map(|n| bulk(VEHICLE, step * STEP + n)).collect();
        vehicle.send(frames.concat());
        healthy.expect_each(&frames);
    }
    router.assert_grown_less_than(8, before);
    let received = radio.meet(&mut vehicle);
    assert_rises_with_gaps(&received);
}

#[test]
fn what_leaves_a_serial_line_slower_than_its_traffic_is_whole_frames() {
    let line = Pty::new();
    let serial = format!("serial:{}:57600?name=radio", line.device());
    let router = Router::start(&[TCP, &serial]);
    let mut radio = router.serial("radio", line, OTHER);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let frames: Vec<_> = (0..STEP).map(|n| bulk(VEHICLE, n)).collect();
    vehicle.send(frames.concat());
    let received = radio.meet(&mut vehicle);
    assert!(!received.is_empty() && received.iter().all(|frame| frames.contains(frame)));
}

#[test]
fn an_unreachable_tcp_server_does_not_delay_others() {
    let (nowhere, _kept) = blackhole();
    let router = Router::launch(&[&format!("tcpout:{nowhere}?name=out"), TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    for n in 0..100 {
        vehicle.send(attitude(VEHICLE, n));
        gcs.expect(attitude(VEHICLE, n));
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect(command_long(GCS, VEHICLE));
    }
}

/// How much of a flood may pass, on the average, while one command is answered. A fair loop takes
/// one megabyte or two from each link before it looks at the others; this is no measure of time,
/// so a busy machine does not change it.
const FAIR: u64 = 4 << 20;
const EXCHANGES: u64 = 200;

#[test]
fn a_flood_from_one_peer_does_not_starve_the_others() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut flooder = router.tcp("tcp", OTHER);
    // For nobody who is there, so that the flood ends in the router.
    let flood = command_long(OTHER, Component::new(42, 1)).repeat(2000);
    let (flooded, enough) = (AtomicU64::new(0), AtomicBool::new(false));
    let (mut answered, mut passed) = (0, 0);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !enough.load(Ordering::Relaxed) {
                flooder.send(&flood);
                flooded.fetch_add(flood.len() as u64, Ordering::Relaxed);
            }
        });
        let before = flooded.load(Ordering::Relaxed);
        while answered < EXCHANGES && passed < EXCHANGES * FAIR {
            if !answers(&mut gcs, &mut vehicle) {
                break;
            }
            answered += 1;
            passed = flooded.load(Ordering::Relaxed) - before;
        }
        enough.store(true, Ordering::Relaxed);
    });
    assert_eq!(answered, EXCHANGES, "answers came during {passed} bytes of flood");
}

/// A command and its acknowledgement; says whether both arrived, and never panics.
fn answers(gcs: &mut Peer<UdpWire>, vehicle: &mut Peer<TcpWire>) -> bool {
    gcs.send(command_long(GCS, VEHICLE));
    if vehicle.try_receive(PATIENCE) != Some(command_long(GCS, VEHICLE)) {
        return false;
    }
    vehicle.send(command_ack(VEHICLE, GCS));
    gcs.try_receive(PATIENCE) == Some(command_ack(VEHICLE, GCS))
}
