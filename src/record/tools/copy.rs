//! Makes a log of the chosen records of one, or of several in the order of their times.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use super::error::ToolError;
use super::progress::Progress;
use crate::mavlink::{Frame, MAX_FRAME};
use crate::record::{ReaderStats, Record, Selection, TlogReader, write_record};

/// What came of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Copied {
    /// Records that were written.
    pub written: u64,
    /// Records that were read.
    pub read: u64,
    /// Bytes that belong to no record.
    pub skipped_bytes: u64,
}

/// One log of several, with the record that comes next.
struct Source<'a> {
    path: &'a Path,
    reader: TlogReader<File>,
    head: Option<(u64, [u8; MAX_FRAME])>,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path) -> Result<(Self, u64), ToolError> {
        let file = File::open(path).map_err(ToolError::read(path))?;
        let size = file.metadata().map_or(0, |data| data.len());
        let mut source = Self { path, reader: TlogReader::new(file), head: None };
        source.advance()?;
        if source.head.is_none() {
            let bytes = source.reader.stats().bytes;
            return Err(ToolError::NoLog { path: path.to_owned(), bytes });
        }
        Ok((source, size))
    }

    /// Goes on to the next record.
    fn advance(&mut self) -> Result<(), ToolError> {
        let next = self.reader.next_record().map_err(ToolError::read(self.path))?;
        self.head = next.map(|Record { micros, frame }| {
            let mut bytes = [0; MAX_FRAME];
            bytes[..frame.bytes().len()].copy_from_slice(frame.bytes());
            (micros, bytes)
        });
        Ok(())
    }

    fn head(&self) -> Option<Record<'_>> {
        let (micros, bytes) = self.head.as_ref()?;
        Some(Record { micros: *micros, frame: Frame::parse(bytes).ok()? })
    }
}

/// Writes the records of `from` that `selection` takes to the new file `to`.
///
/// # Errors
///
/// If a file cannot be read or written, if `from` has no record, if `selection` takes none of them,
/// or if `to` is there already.
pub fn filter(from: &Path, to: &Path, selection: &mut Selection) -> Result<Copied, ToolError> {
    copy(&[from], to, |record| selection.takes(record))
}

/// Writes the records of all files to the new file `to`, each time the oldest that is next in any.
///
/// # Errors
///
/// As [`filter`].
pub fn merge(from: &[&Path], to: &Path) -> Result<Copied, ToolError> {
    copy(from, to, |_| true)
}

fn copy(
    from: &[&Path],
    to: &Path,
    mut takes: impl FnMut(&Record<'_>) -> bool,
) -> Result<Copied, ToolError> {
    let opened: Vec<_> = from.iter().map(|path| Source::open(path)).collect::<Result<_, _>>()?;
    let mut progress = Progress::new(opened.iter().map(|(_, size)| size).sum());
    let mut sources: Vec<_> = opened.into_iter().map(|(source, _)| source).collect();
    let file = File::create_new(to).map_err(ToolError::write(to))?;
    let (mut output, mut written) = (BufWriter::new(file), 0);
    let mut span = (u64::MAX, 0);
    loop {
        let heads = sources.iter_mut().filter(|source| source.head.is_some());
        let next = heads.min_by_key(|source| source.head.map(|(micros, _)| micros));
        let Some(source) = next else { break };
        span = source.head().map_or(span, |it| (span.0.min(it.micros), span.1.max(it.micros)));
        if let Some(record) = source.head()
            && takes(&record)
        {
            let bytes = record.frame.bytes();
            write_record(&mut output, record.micros, bytes).map_err(ToolError::write(to))?;
            written += 1;
        }
        let before = source.reader.stats().bytes;
        source.advance()?;
        progress.add(source.reader.stats().bytes - before);
    }
    output.flush().map_err(ToolError::write(to))?;
    if written == 0 {
        drop(output);
        fs::remove_file(to).map_err(ToolError::write(to))?;
        return Err(ToolError::nothing(to, span));
    }
    let all = sources.iter().map(|source| source.reader.stats());
    let sum = |of: fn(&ReaderStats) -> u64| all.clone().map(|stats| of(&stats)).sum();
    Ok(Copied { written, read: sum(|it| it.records), skipped_bytes: sum(|it| it.skipped_bytes) })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::mavlink::{Component, FrameSpec, MessageId};
    use crate::routing::FilterLists;
    use crate::test_dir::TestDir;

    /// A log with a HEARTBEAT and an ATTITUDE of a system, at each of these seconds.
    fn log(dir: &TestDir, name: &str, seconds: &[u64], system: u8) -> PathBuf {
        let mut log = Vec::new();
        for second in seconds {
            for (id, crc_extra) in [(0, 50), (30, 39)] {
                let source = Component::new(system, 1);
                let spec = FrameSpec::new(source, MessageId(id), crc_extra, &[1; 9]);
                write_record(&mut log, second * 1_000_000, &spec.to_frame()).unwrap();
            }
        }
        dir.write(name, log)
    }

    /// The second, the system and the message of each record.
    fn read(dir: &TestDir, name: &str) -> Vec<(u64, u8, u32)> {
        let file = File::open(dir.path().join(name)).unwrap();
        let (mut reader, mut records) = (TlogReader::new(file), Vec::new());
        while let Some(record) = reader.next_record().unwrap() {
            let header = record.frame.header();
            records.push((record.micros / 1_000_000, header.source.system, header.id.0));
        }
        records
    }

    fn part(from: &str, to: &str, lists: &FilterLists) -> Selection {
        Selection::new(from.parse().ok(), to.parse().ok(), lists).unwrap()
    }

    #[test]
    fn a_part_is_cut_out_by_time_since_the_start_and_by_date() {
        let dir = TestDir::new();
        let whole = log(&dir, "all", &[100, 101, 102, 103], 1);
        let lists = FilterLists { allow_messages: vec![MessageId(30)], ..FilterLists::default() };
        for (name, from, to) in [("a", "1", "3s"), ("b", "1970-01-01T00:01:41", "3")] {
            let copied =
                filter(&whole, &dir.path().join(name), &mut part(from, to, &lists)).unwrap();
            assert_eq!((copied.written, copied.read, copied.skipped_bytes), (2, 8, 0));
            assert_eq!(read(&dir, name), [(101, 1, 30), (102, 1, 30)]);
        }
    }

    #[test]
    fn where_nothing_is_chosen_nothing_is_left_behind() {
        let dir = TestDir::new();
        let whole = log(&dir, "all", &[100, 101, 190], 1);
        let new = dir.path().join("new");
        let error = filter(&whole, &new, &mut part("2m", "", &FilterLists::default()));
        let told = error.unwrap_err().to_string();
        let length = "the log goes from 1970-01-01T00:01:40Z to 1970-01-01T00:03:10Z, 1m 30s";
        assert!(told.starts_with("nothing to write to ") && told.ends_with(length), "{told}");
        assert!(!new.exists());
    }

    #[test]
    fn logs_are_merged_in_the_order_of_their_times() {
        let dir = TestDir::new();
        let (one, two) = (log(&dir, "one", &[1, 3], 1), log(&dir, "two", &[2, 3, 4], 2));
        merge(&[&one, &two], &dir.path().join("both")).unwrap();
        let times: Vec<_> = read(&dir, "both").iter().map(|it| (it.0, it.1)).collect();
        let expected =
            [(1, 1), (1, 1), (2, 2), (2, 2), (3, 1), (3, 1), (3, 2), (3, 2), (4, 2), (4, 2)];
        assert_eq!(times, expected);
    }

    #[test]
    fn nothing_is_overwritten_and_what_is_no_log_is_told() {
        let dir = TestDir::new();
        let whole = log(&dir, "log", &[1], 1);
        let all = || part("", "", &FilterLists::default());
        let error = filter(&whole, &whole, &mut all()).unwrap_err().to_string();
        assert!(error.ends_with("(choose another name, or remove it)"), "{error}");
        assert_eq!(read(&dir, "log").len(), 2);
        let text = dir.write("text", "no log");
        let error = filter(&text, &dir.path().join("new"), &mut all()).unwrap_err().to_string();
        assert!(error.ends_with("not one whole record in 6 bytes"), "{error}");
        assert!(!dir.path().join("new").exists());
    }
}
