//! The format of telemetry logs: 8 bytes of time, big-endian, in microseconds since 1970, and the
//! frame.
//!
//! The reader believes nothing: what is no record is passed over, byte by byte, until there is one
//! again. So a file that was cut off, or that a card has damaged, gives all whole records it has.

use std::io::{self, ErrorKind, Read, Write};

use crate::mavlink::{Crc, Dialect, Frame, FrameError, MAX_FRAME, STX_V1, STX_V2, implied_extra};

/// The bytes of time before each frame.
pub const TIMESTAMP: usize = 8;

/// How much is read at a time.
const PORTION: usize = 64 * 1024;

/// A record looks no further than itself, the time of the next, and the start byte of that.
const LOOK_AHEAD: usize = 2 * TIMESTAMP + MAX_FRAME + 1;

/// Times from here on are none, by which garbage is known: it is the year 4253.
const END_OF_TIME: u64 = 1 << 56;

/// One record of a telemetry log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Record<'a> {
    /// When the frame was recorded, in microseconds since 1970, below 2^56.
    pub micros: u64,
    /// The frame; some CRC_EXTRA explains its checksum.
    pub frame: Frame<'a>,
}

/// What a reader has come by. Counts from the start of the file.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct ReaderStats {
    /// Whole records.
    pub records: u64,
    /// Bytes of the file so far.
    pub bytes: u64,
    /// Bytes of these that belong to no record.
    pub skipped_bytes: u64,
}

/// Reads a telemetry log from beginning to end, in memory that does not grow.
pub struct TlogReader<R> {
    input: R,
    dialect: Dialect,
    /// Invariant: the bytes not yet used are `buffer[start..end]`.
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Whether the input has come to its end.
    is_at_end: bool,
    /// Whether a record has ended here, or the file begins.
    is_in_step: bool,
    stats: ReaderStats,
}

/// What stands where a record might begin.
enum Look {
    /// A record of this length.
    Record(usize),
    /// None.
    Nothing,
    /// That cannot be told without more bytes.
    Unclear,
}

impl<R: Read> TlogReader<R> {
    /// Reads from `input`, which need not be buffered.
    pub fn new(input: R) -> Self {
        Self {
            input,
            dialect: Dialect::builtin(),
            buffer: vec![0; PORTION],
            start: 0,
            end: 0,
            is_at_end: false,
            is_in_step: true,
            stats: ReaderStats::default(),
        }
    }

    /// The next whole record; `None` at the end of the file.
    ///
    /// # Errors
    ///
    /// If the input cannot be read.
    pub fn next_record(&mut self) -> io::Result<Option<Record<'_>>> {
        let len = loop {
            match self.look() {
                Look::Record(len) => break len,
                Look::Nothing => self.skip(),
                Look::Unclear if !self.is_at_end => self.fill()?,
                Look::Unclear if self.start == self.end => return Ok(None),
                Look::Unclear => self.skip(),
            }
        };
        self.stats.records += 1;
        self.stats.bytes += len as u64;
        self.start += len;
        self.is_in_step = true;
        let bytes = &self.buffer[self.start - len..self.start];
        let frame = Frame::parse(&bytes[TIMESTAMP..]).ok();
        Ok(frame.map(|frame| Record { micros: micros(bytes), frame }))
    }

    /// What was come by so far.
    pub fn stats(&self) -> ReaderStats {
        self.stats
    }

    fn look(&self) -> Look {
        let bytes = &self.buffer[self.start..self.end];
        if bytes.len() <= TIMESTAMP {
            return Look::Unclear;
        }
        if micros(bytes) >= END_OF_TIME {
            return Look::Nothing;
        }
        let frame = match Frame::parse(&bytes[TIMESTAMP..]) {
            Ok(frame) => frame,
            Err(FrameError::Incomplete) => return Look::Unclear,
            Err(FrameError::NoStart | FrameError::Incompatible) => return Look::Nothing,
        };
        let len = TIMESTAMP + frame.bytes().len();
        let crc = Crc::of(frame.checked_bytes());
        match implied_extra(crc, frame.checksum()) {
            None => Look::Nothing,
            Some(extra) => {
                let is_known = self.dialect.by_pair(frame.header().id, extra).is_some();
                if is_known || self.is_in_step { Look::Record(len) } else { self.look_behind(len) }
            }
        }
    }

    /// Amid garbage, a message that nobody defined is taken for one if a record, or nothing, follows.
    fn look_behind(&self, len: usize) -> Look {
        let behind = &self.buffer[self.start + len..self.end];
        match behind.get(TIMESTAMP) {
            Some(&STX_V1 | &STX_V2) => Look::Record(len),
            Some(_) => Look::Nothing,
            None if !self.is_at_end => Look::Unclear,
            // At the end of the file, or where the last record was cut off.
            None => Look::Record(len),
        }
    }

    fn skip(&mut self) {
        self.start += 1;
        self.is_in_step = false;
        self.stats.skipped_bytes += 1;
        self.stats.bytes += 1;
    }

    fn fill(&mut self) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        debug_assert!(self.end <= LOOK_AHEAD);
        match self.input.read(&mut self.buffer[self.end..]) {
            Ok(0) => self.is_at_end = true,
            Ok(count) => self.end += count,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

/// The time at the start of a record.
fn micros(bytes: &[u8]) -> u64 {
    bytes.iter().take(TIMESTAMP).fold(0, |sum, byte| sum << 8 | u64::from(*byte))
}

/// Writes a record: a time in microseconds since 1970, and a whole frame.
///
/// # Errors
///
/// If `output` cannot be written to.
pub fn write_record(output: &mut impl Write, micros: u64, frame: &[u8]) -> io::Result<()> {
    output.write_all(&micros.to_be_bytes())?;
    output.write_all(frame)
}

/// Reads any bytes as a log: whatever it finds is made of what it was given, in order, and the
/// counts add up.
///
/// # Panics
///
/// If they do not.
pub fn fuzz_tlog(data: &[u8]) {
    let mut reader = TlogReader::new(data);
    let mut written = Vec::new();
    let mut at = 0;
    while let Ok(Some(Record { micros, frame })) = reader.next_record() {
        written.clear();
        // Writing to memory does not fail.
        let _ = write_record(&mut written, micros, frame.bytes());
        let found = data[at..].windows(written.len()).position(|window| window == written);
        assert!(found.is_some(), "a record that is not there");
        at += found.unwrap_or_default() + written.len();
    }
    let stats = reader.stats();
    assert_eq!(stats.bytes, data.len() as u64);
    assert!(stats.skipped_bytes + stats.records * (TIMESTAMP as u64 + 8) <= stats.bytes);
}

#[cfg(test)]
mod tests;
