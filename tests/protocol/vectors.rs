//! The 27 published frames of `tests/data/vectors.tsv` and their expected reading.

use crate::frames::Receiver;
use mavswitch::mavlink::{Component, Input, MessageId, Version};

struct Vector {
    number: u32,
    version: Version,
    id: MessageId,
    source: Component,
    seq: u8,
    /// As the table has it: -1 for a field that the message does not have, `-` for no frame at all.
    target: (String, String),
    len: u8,
    bytes: Vec<u8>,
}

fn vectors() -> Vec<Vector> {
    include_str!("../data/vectors.tsv").lines().skip(1).map(vector).collect()
}

fn vector(line: &str) -> Vector {
    let fields: Vec<&str> = line.split('\t').collect();
    let number = |index: usize| fields[index].parse::<u32>().unwrap();
    Vector {
        number: number(0),
        version: if number(2) == 1 { Version::V1 } else { Version::V2 },
        id: MessageId(number(3)),
        source: Component::new(number(4) as u8, number(5) as u8),
        seq: number(6) as u8,
        target: (fields[7].to_owned(), fields[8].to_owned()),
        len: number(9) as u8,
        bytes: unhex(fields[10]),
    }
}

fn unhex(text: &str) -> Vec<u8> {
    let pair = |at| u8::from_str_radix(&text[at..at + 2], 16).unwrap();
    (0..text.len()).step_by(2).map(pair).collect()
}

/// The number of the vector with an unknown incompatibility flag.
const INCOMPATIBLE: u32 = 25;

#[test]
fn every_vector_is_read_as_the_table_says() {
    let vectors = vectors();
    assert_eq!(vectors.len(), 27);
    for vector in vectors.iter().filter(|vector| vector.number != INCOMPATIBLE) {
        let taken = Receiver::new().receive(&vector.bytes, Input::Paused);
        let [frame] = &taken[..] else { panic!("vector {}: {taken:?}", vector.number) };
        let or_zero = |text: &str| text.parse::<i16>().unwrap().max(0) as u8;
        let target = Component::new(or_zero(&vector.target.0), or_zero(&vector.target.1));
        assert_eq!(frame.bytes, vector.bytes, "vector {}", vector.number);
        assert_eq!(frame.header.version, vector.version, "vector {}", vector.number);
        assert_eq!(frame.header.id, vector.id, "vector {}", vector.number);
        assert_eq!(frame.header.source, vector.source, "vector {}", vector.number);
        assert_eq!(frame.header.seq, vector.seq, "vector {}", vector.number);
        assert_eq!(frame.header.len, vector.len, "vector {}", vector.number);
        assert_eq!(frame.target, target, "vector {}", vector.number);
        assert_eq!(frame.verified, vector.id != MessageId(12_345), "vector {}", vector.number);
    }
}

#[test]
fn rule_7_an_unknown_incompatibility_flag_drops_the_frame_and_not_the_next() {
    let vectors = vectors();
    let incompatible = vectors.iter().find(|vector| vector.number == INCOMPATIBLE).unwrap();
    let mut stream = incompatible.bytes.clone();
    stream.extend(&vectors[0].bytes);
    let mut receiver = Receiver::new();
    assert_eq!(receiver.receive_all(&stream), [vectors[0].bytes.clone()]);
    assert_eq!(receiver.splitter.stats().incompatible, 1);
}

#[test]
fn all_vectors_in_one_stream() {
    let vectors = vectors();
    let stream: Vec<u8> = vectors.iter().flat_map(|vector| vector.bytes.clone()).collect();
    let expected = vectors.iter().filter(|vector| vector.number != INCOMPATIBLE);
    let expected: Vec<Vec<u8>> = expected.map(|vector| vector.bytes.clone()).collect();
    assert_eq!(Receiver::new().receive_all(&stream), expected);
}

#[test]
fn a_frame_with_one_flipped_bit_is_not_taken() {
    for vector in vectors().iter().filter(|vector| vector.number != INCOMPATIBLE) {
        let signature = if vector.bytes[0] == 0xfd && vector.bytes[2] & 1 == 1 { 13 } else { 0 };
        // The signature is not under the checksum, and the start byte and length decide where a
        // frame is looked for at all.
        for bit in 16..(vector.bytes.len() - signature) * 8 {
            let mut damaged = vector.bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let taken = Receiver::new().receive(&damaged, Input::Paused);
            let whole = taken.iter().filter(|frame| frame.verified).count();
            assert_eq!(whole, 0, "vector {}, bit {bit}", vector.number);
        }
    }
}
