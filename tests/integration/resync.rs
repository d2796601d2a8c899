//! Finding frames in a stream: cut anywhere, begun anywhere, with anything in between (rules 17-19).

use std::thread;
use std::time::{Duration, Instant};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

#[test]
fn frames_cut_into_single_bytes_arrive() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for frame in every_shape(VEHICLE) {
        vehicle.send_bytewise(&frame);
        gcs.expect(&frame);
    }
}

#[test]
fn after_a_damaged_frame_three_good_ones_of_the_same_write_arrive_at_once() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let good: Vec<_> = (0..3).map(|n| attitude(VEHICLE, n)).collect();
    for bad in [corrupted(&heartbeat(VEHICLE)), corrupted(&bulk(VEHICLE, 9))] {
        vehicle.send([bad, good.concat()].concat());
        gcs.expect_each(&good);
    }
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn a_connection_that_pauses_within_a_frame_with_a_frame_in_it_gives_the_outer_one() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for n in 0..20 {
        let mut payload = heartbeat(OTHER);
        payload.resize(200, 1);
        let outer = Draft::new(VEHICLE, ENCAPSULATED_DATA, payload).build();
        let began = Instant::now();
        vehicle.send(&outer[..100]);
        // As long as TCP takes to repeat what was lost.
        thread::sleep(Duration::from_millis(200));
        vehicle.send(&outer[100..]);
        vehicle.send(attitude(VEHICLE, n));
        let sent_within = began.elapsed();
        let received = gcs.receive_rest_from(&mut vehicle);
        // On a machine that pauses here for longer, once more.
        if sent_within < Duration::from_millis(350) {
            assert_eq!(received, [outer, attitude(VEHICLE, n)]);
            return;
        }
    }
    panic!("the machine is too busy to tell");
}

/// Forty frames full of start bytes, for the ground station; no two transfers have one in common.
fn file_transfer(number: u16) -> Vec<Vec<u8>> {
    (0..40).map(|seq| ftp_of_transfer(number, VEHICLE, GCS, seq)).collect()
}

/// The frames of `file_transfer` that begin at `offset` or behind it.
fn whole_after(offset: usize, frames: &[Vec<u8>]) -> &[Vec<u8>] {
    let lost = offset.div_ceil(frames[0].len());
    &frames[lost..]
}

#[test]
fn a_stream_begun_anywhere_within_a_frame_gives_all_whole_frames_and_no_garbage() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    for offset in 0..300 {
        let frames = file_transfer(offset as u16);
        let stream = frames.concat();
        let mut vehicle = router.tcp_unnoticed("tcp", VEHICLE);
        vehicle.send(&stream[offset..]);
        gcs.expect_each(whole_after(offset, &frames));
    }
}

#[test]
fn a_udp_peer_that_begins_within_a_frame_loses_only_that_one() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    for offset in (1..300).step_by(13) {
        let frames = file_transfer(offset as u16);
        let stream = frames[..8].concat();
        let mut vehicle = Peer::new(UdpWire::to(router.address("udp")), VEHICLE);
        // Each long enough for a whole frame: it is a whole one that lets a stranger in.
        for datagram in stream[offset..].chunks(800) {
            vehicle.send(datagram);
        }
        gcs.expect_each(whole_after(offset, &frames[..8]));
    }
}

#[test]
fn rule_18_a_false_start_holds_nothing_back_for_ever() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    // Headers that claim more than two hundred bytes, and then silence behind one frame.
    for claim in [&[0xfd, 0xff, 0x00][..], &[0xfe, 0xff], &[0xfd, 0xfe, 0x01, 0, 0, 0, 0, 0]] {
        vehicle.send([claim, &attitude(VEHICLE, 5)].concat());
        gcs.expect(attitude(VEHICLE, 5));
    }
}

#[test]
fn a_frame_with_a_long_pause_in_its_middle_arrives_all_the_same() {
    let pty = Pty::new();
    let serial = format!("serial:{}:921600?name=fc", pty.device());
    let router = Router::start(&[TCP, UDP, &serial]);
    let mut gcs = router.udp("udp", GCS);
    let mut camera = router.serial("fc", pty, CAMERA);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let (by_tcp, by_serial) = (bulk(VEHICLE, 1), bulk(CAMERA, 2));
    vehicle.send(&by_tcp[..150]);
    camera.send(&by_serial[..150]);
    // As long as a mobile network is sometimes silent.
    thread::sleep(Duration::from_secs(1));
    vehicle.send(&by_tcp[150..]);
    gcs.expect(&by_tcp);
    camera.send(&by_serial[150..]);
    gcs.expect(&by_serial);
}

#[test]
fn frames_sent_right_before_the_end_of_a_connection_arrive() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    for n in 0..50 {
        let mut vehicle = router.tcp_unnoticed("tcp", VEHICLE);
        // A false start before them: the end of the stream proves it false.
        vehicle.send([&[0xfd, 0xff, 0x00], &attitude(VEHICLE, n)[..], &bulk(VEHICLE, n)].concat());
        drop(vehicle);
        gcs.expect(attitude(VEHICLE, n));
        gcs.expect(bulk(VEHICLE, n));
    }
}

#[test]
fn three_thousand_frames_with_noise_between_them_all_arrive() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut noise = Noise::new(20);
    for batch in 0..30 {
        let frames: Vec<_> = (0..100).map(|n| attitude(VEHICLE, batch * 100 + n)).collect();
        let mut stream = Vec::new();
        for frame in &frames {
            let count = noise.below(40);
            stream.extend(noise.bytes(count));
            stream.extend_from_slice(frame);
        }
        vehicle.send(stream);
        let mut received = Vec::new();
        while received.len() < frames.len() {
            // Noise that passes for an unknown message is none of our business here.
            received.push(gcs.receive());
            received.retain(|frame| source_of(frame) == VEHICLE);
        }
        assert_eq!(received, frames);
    }
}
