//! Logs that are whole, cut off, damaged, and made of anything.

use super::*;
use crate::mavlink::{Component, FrameSpec, MessageId, Version, encode};

/// A log of so many records, one each millisecond: known and unknown messages of both versions.
fn log(count: u8) -> Vec<u8> {
    let mut log = Vec::new();
    for number in 0..count {
        log.extend((1_700_000_000_000_000 + u64::from(number) * 1_000).to_be_bytes());
        let (version, id, crc_extra) = match number % 4 {
            0 => (Version::V1, 0, 50),
            1 => (Version::V2, 0, 50),
            2 => (Version::V2, 54_321, 77),
            _ => (Version::V2, 30, 39),
        };
        let spec = FrameSpec {
            version,
            seq: number,
            source: Component::new(1, 1),
            id: MessageId(id),
            crc_extra,
            payload: &[number; 9],
            signature: (number % 8 == 7).then_some([number; 13]),
        };
        encode(&spec, &mut log);
    }
    log
}

fn times(log: &[u8]) -> (Vec<u64>, ReaderStats) {
    let mut reader = TlogReader::new(log);
    let mut times = Vec::new();
    while let Some(record) = reader.next_record().unwrap() {
        times.push(record.micros - 1_700_000_000_000_000);
    }
    (times, reader.stats())
}

#[test]
fn every_record_of_a_whole_log_is_read_and_nothing_is_passed_over() {
    let log = log(200);
    let (times, stats) = times(&log);
    assert_eq!(times, (0..200).map(|number| number * 1_000).collect::<Vec<_>>());
    let whole = ReaderStats { records: 200, bytes: log.len() as u64, skipped_bytes: 0 };
    assert_eq!(stats, whole);
}

#[test]
fn what_is_read_is_written_the_same() {
    let log = log(50);
    let (mut reader, mut again) = (TlogReader::new(&log[..]), Vec::new());
    while let Some(record) = reader.next_record().unwrap() {
        write_record(&mut again, record.micros, record.frame.bytes()).unwrap();
    }
    assert_eq!(again, log);
}

#[test]
fn a_file_cut_off_at_any_byte_reads_up_to_its_last_whole_frame() {
    let log = log(12);
    let ends: Vec<usize> = (0..=12).map(|count| self::log(count).len()).collect();
    for cut in 0..=log.len() {
        let whole = ends.iter().filter(|end| **end > 0 && **end <= cut).count();
        let (times, stats) = times(&log[..cut]);
        assert_eq!(times.len(), whole, "cut off at {cut}");
        assert_eq!(stats.skipped_bytes, (cut - ends[whole]) as u64, "cut off at {cut}");
    }
}

#[test]
fn behind_any_damaged_byte_the_next_whole_record_is_found() {
    let log = log(9);
    for at in 0..log.len() {
        let mut damaged = log.clone();
        damaged[at] ^= 0x5a;
        let mut reader = TlogReader::new(&damaged[..]);
        let mut records = 0;
        while reader.next_record().unwrap().is_some() {
            records += 1;
        }
        // One frame at most is lost; of a time, nobody can tell.
        assert!(records >= 8, "{records} records with byte {at} damaged");
    }
}

#[test]
fn garbage_before_and_between_is_passed_over() {
    let (first, second) = (log(5), log(3));
    let garbage = [0xfd; 700];
    let bytes = [&garbage[..], &first, &garbage, &second].concat();
    let (times, stats) = times(&bytes);
    assert_eq!(times, [0, 1_000, 2_000, 3_000, 4_000, 0, 1_000, 2_000]);
    assert_eq!(stats.skipped_bytes, 1_400);
}

#[test]
fn input_that_comes_byte_by_byte_is_read_the_same() {
    struct Slow<'a>(&'a [u8]);
    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0.read(&mut buffer[..1])
        }
    }
    let log = log(40);
    let mut reader = TlogReader::new(Slow(&log));
    while reader.next_record().unwrap().is_some() {}
    assert_eq!(reader.stats(), times(&log).1);
}

#[test]
fn exercise_fuzz_tlog() {
    fuzz_tlog(&[]);
    fuzz_tlog(&[0xfd; 999]);
    let mut log = log(20);
    fuzz_tlog(&log);
    log[77] ^= 1;
    fuzz_tlog(&log[3..]);
}
