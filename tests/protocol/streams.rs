//! Finding frames in streams with noise, false starts and torn frames, however they are cut up.

use crate::frames::{Random, Receiver, frame, signed, telemetry};
use mavswitch::mavlink::{Component, Input, STX_V1, STX_V2, Version};

const VEHICLE: Component = Component::new(1, 1);
const HEARTBEAT: (u32, u8) = (0, 50);
const FTP: (u32, u8) = (110, 84);

fn heartbeat(seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, VEHICLE, HEARTBEAT, &[0, 0, 0, 0, 2, 3, 81, 3, 3])
}

/// A short stream with everything that hurts: noise, false starts, torn and damaged frames,
/// frames of both versions, signed, unknown, and unknown ones with start bytes inside.
fn troubled_stream() -> Vec<u8> {
    let mut torn = frame(Version::V2, 3, VEHICLE, (30, 39), &[7; 28]);
    torn.truncate(20);
    let mut torn_signature = signed(9, VEHICLE, HEARTBEAT, &[1; 9]);
    torn_signature.truncate(torn_signature.len() - 6);
    let mut damaged = frame(Version::V1, 4, VEHICLE, (30, 39), &[STX_V2; 28]);
    damaged[12] ^= 0x40;
    let pieces = [
        vec![0x00, STX_V2, 0x07, STX_V1, 0x01],
        heartbeat(1),
        frame(Version::V1, 2, VEHICLE, (30, 39), &[STX_V2; 28]),
        torn,
        signed(3, VEHICLE, HEARTBEAT, &[STX_V1; 9]),
        torn_signature,
        heartbeat(10),
        damaged,
        frame(Version::V2, 5, VEHICLE, (54_321, 77), &[STX_V1, 9, STX_V2, 9]),
        frame(Version::V2, 6, VEHICLE, (54_321, 77), &[1, 2, 3]),
        vec![STX_V2; 5],
        frame(Version::V1, 7, VEHICLE, HEARTBEAT, &[STX_V1; 9]),
        vec![STX_V1, 0x30],
        heartbeat(8),
    ];
    pieces.concat()
}

#[test]
fn every_possible_chunking_gives_the_same_frames() {
    let stream = troubled_stream();
    let expected = Receiver::new().receive_all(&stream);
    let sequence: Vec<u8> =
        expected.iter().map(|f| f[if f[0] == STX_V2 { 4 } else { 2 }]).collect();
    assert_eq!(sequence, [1, 2, 3, 9, 10, 5, 6, 7, 8], "all whole frames, none of the wreckage");
    for first in 0..stream.len() {
        for second in first..stream.len() {
            let mut receiver = Receiver::new();
            let chunks = [&stream[..first], &stream[first..second], &stream[second..]];
            let mut taken = Vec::new();
            for chunk in chunks {
                taken.extend(receiver.receive(chunk, Input::Flowing));
            }
            taken.extend(receiver.receive(&[], Input::Paused));
            let taken: Vec<Vec<u8>> = taken.into_iter().map(|frame| frame.bytes).collect();
            assert_eq!(taken, expected, "cut at {first} and {second}");
        }
    }
}

#[test]
fn every_chunk_size_gives_the_same_frames() {
    let stream = troubled_stream();
    let expected = Receiver::new().receive_all(&stream);
    for size in 1..stream.len() {
        let mut receiver = Receiver::new();
        let mut taken = Vec::new();
        for chunk in stream.chunks(size) {
            taken.extend(receiver.receive(chunk, Input::Flowing));
        }
        taken.extend(receiver.receive(&[], Input::Paused));
        let taken: Vec<Vec<u8>> = taken.into_iter().map(|frame| frame.bytes).collect();
        assert_eq!(taken, expected, "in pieces of {size}");
    }
}

#[test]
fn rule_17_all_frames_between_random_bytes_arrive() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let frames = telemetry(3_000, &mut random);
        let mut stream = Vec::new();
        for frame in &frames {
            let noise = random.below(20);
            stream.extend(random.bytes(noise));
            stream.extend(frame);
        }
        let taken = Receiver::new().receive_all(&stream);
        let mut expected = frames.iter().peekable();
        let mut extra = 0;
        for frame in &taken {
            match expected.peek() {
                Some(next) if *next == frame => drop(expected.next()),
                _ => extra += 1,
            }
        }
        assert_eq!(expected.count(), 0, "seed {seed}: all 3,000 arrive");
        assert!(extra <= 2, "seed {seed}: {extra} frames made of noise");
    }
}

#[test]
fn rule_17_damage_costs_the_damaged_frames_only() {
    let mut missing = 0;
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let frames = telemetry(3_000, &mut random);
        let mut stream = Vec::new();
        let mut whole = 0;
        for frame in &frames {
            match random.below(20) {
                0 => stream.extend(&frame[..random.below(frame.len())]),
                1 => {
                    let lost = random.below(frame.len());
                    stream.extend(frame[..lost].iter().chain(&frame[lost + 1..]));
                }
                _ => {
                    stream.extend(frame);
                    whole += 1;
                }
            }
        }
        let taken = Receiver::new().receive_all(&stream);
        let arrived = taken.iter().filter(|frame| frames.contains(frame)).count();
        missing += whole - whole.min(arrived);
    }
    // Of some 54,000 whole frames; wreckage passes a 16-bit check once in a while.
    assert!(missing <= 2, "{missing} whole frames are missing");
}

#[test]
fn a_stream_that_begins_in_mid_frame_loses_only_that_frame() {
    let ftp: Vec<Vec<u8>> =
        (0..6).map(|seq| frame(Version::V2, seq, VEHICLE, FTP, &[STX_V2; 251])).collect();
    let stream = ftp.concat();
    for cut in 0..300 {
        let taken = Receiver::new().receive_all(&stream[cut..]);
        let first = cut.div_ceil(ftp[0].len());
        assert_eq!(taken, ftp[first..], "cut at {cut}");
    }
}

#[test]
fn rule_18_a_false_start_does_not_hold_back_complete_frames_for_ever() {
    let mut receiver = Receiver::new();
    let mut stream = vec![STX_V2, 0xff, 0x00];
    stream.extend(heartbeat(1));
    assert_eq!(receiver.receive(&stream, Input::Flowing), []);
    let taken = receiver.receive(&[], Input::Paused);
    assert_eq!(taken.len(), 1);
    assert_eq!(taken[0].bytes, heartbeat(1));
    assert!(!receiver.splitter.is_waiting());
}

#[test]
fn rule_18_a_pause_in_mid_frame_loses_nothing() {
    let frame = heartbeat(1);
    let mut receiver = Receiver::new();
    let (last, all_but_last) = frame.split_last().unwrap();
    for byte in all_but_last {
        assert_eq!(receiver.receive(&[*byte], Input::Paused), []);
    }
    assert_eq!(receiver.receive(&[*last], Input::Paused)[0].bytes, frame);
}

#[test]
fn rule_19_unknown_frames_inside_a_damaged_one_are_not_believed() {
    let unknown = frame(Version::V2, 9, VEHICLE, (54_321, 77), &[1, 2, 3]);
    let known = heartbeat(9);
    let mut outer = frame(Version::V2, 1, VEHICLE, FTP, &[&unknown[..], &known[..]].concat());
    outer[10 + unknown.len() + known.len()] ^= 1;
    assert_eq!(Receiver::new().receive_all(&outer), [known]);
}

#[test]
fn frames_inside_a_whole_frame_stay_inside() {
    let outer = frame(Version::V2, 1, VEHICLE, FTP, &[heartbeat(1), heartbeat(2)].concat());
    for size in 1..outer.len() {
        let mut receiver = Receiver::new();
        let mut taken = Vec::new();
        for chunk in outer.chunks(size) {
            taken.extend(receiver.receive(chunk, Input::Flowing));
        }
        assert_eq!(taken.len(), 1, "in pieces of {size}");
        assert_eq!(taken[0].bytes, outer);
    }
}

#[test]
fn half_a_frame_of_one_is_not_joined_with_what_another_sends() {
    let mut receiver = Receiver::new();
    let (torn, next) = (heartbeat(1), heartbeat(2));
    assert_eq!(receiver.receive(&torn[..12], Input::Flowing), []);
    assert!(receiver.splitter.is_waiting());
    receiver.splitter.forget();
    assert!(!receiver.splitter.is_waiting());
    let taken = receiver.receive(&[&torn[12..], &next].concat(), Input::Flowing);
    assert_eq!(taken.iter().map(|frame| &frame.bytes).collect::<Vec<_>>(), [&next]);
    assert_eq!(receiver.splitter.stats().skipped_bytes, torn.len() as u64);
}

#[test]
fn rule_23_an_unknown_message_is_believed_from_the_second_one_on() {
    let mut receiver = Receiver::new();
    let unknown = |extra, byte| frame(Version::V2, byte, VEHICLE, (54_321, extra), &[byte; 7]);
    let stream = [unknown(77, 1), unknown(77, 2), unknown(77, 3)].concat();
    let taken = receiver.receive(&stream, Input::Flowing);
    assert_eq!(taken.iter().map(|frame| frame.verified).collect::<Vec<_>>(), [false, true, true]);
    // What contradicts them is damaged, as far as anybody can tell.
    assert_eq!(receiver.receive(&unknown(78, 4), Input::Flowing), []);
}

#[test]
fn endless_start_bytes_are_passed_over() {
    for start in [STX_V1, STX_V2] {
        let mut receiver = Receiver::new();
        let mut stream = vec![start; 100_000];
        stream.extend(heartbeat(1));
        let taken = receiver.receive_all(&stream);
        assert_eq!(taken, [heartbeat(1)]);
        assert_eq!(receiver.splitter.stats().skipped_bytes, 100_000);
    }
}
