//! A telemetry log that is played back: the other side of a link, whose frames come from a file.
//!
//! A thread of its own reads the file ahead, a bounded part of it, so that the loop never waits for a
//! disk. The frames are said at the pace at which they were recorded, or as fast as the others take
//! them.

mod progress;

use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SendError, SyncSender, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use self::progress::{Figures, Progress};
use super::tlog::{TIMESTAMP, TlogReader};
use crate::mavlink::Frame;
use crate::routing::{LocalPeer, Precedence, Time};

/// How much of the file is read at once, in bytes of frames, and how many such parts may wait.
const PART: usize = 64 * 1024;
const PARTS: usize = 2;

/// When it is looked again whether the disk has given anything.
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// Microseconds from one record to the next that are too many: a clock was set, or nothing came for
/// long. What comes then is said at once; so it is where the time steps back by more than [`BACK`].
const STEP: u64 = 60_000_000;

/// Microseconds by which a record may be older than one before it without any clock set: whoever
/// writes down several links does not do it quite in order.
const BACK: u64 = 1_000_000;

/// How long one round of a loop takes at least: a log of one moment shall not flood anybody.
const LAP: Duration = Duration::from_secs(1);

/// How a log is played back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ReplayOptions {
    /// How many times as fast as it was recorded; 0: as fast as the others take it.
    pub speed: f32,
    /// Whether it begins anew when it has ended.
    pub is_loop: bool,
}

/// A log that is played back; see the module.
pub struct Replay {
    path: PathBuf,
    options: ReplayOptions,
    parts: Receiver<Part>,
    part: Part,
    /// Which record of the part comes next.
    next: usize,
    /// The time of a record, and when that was said: the others follow from there.
    anchor: Option<(u64, Time)>,
    /// The time of the newest record that was said since a clock was set.
    last: u64,
    /// When the first record may be said: at once, or when the round before has had its time.
    lap_at: Time,
    /// When it is looked again for what the disk has not given yet.
    look_at: Option<Time>,
    end: Option<End>,
    /// Bytes of the log that were said in this round, and who shows them, if anybody does.
    said: u64,
    progress: Option<Progress>,
}

/// A part of the log.
#[derive(Default)]
struct Part {
    frames: Vec<u8>,
    /// The time of each record, and where in `frames` it ends.
    records: Vec<(u64, usize)>,
    /// Whether the log begins here.
    is_first: bool,
    /// Why nothing comes after this.
    end: Option<End>,
}

/// Why nothing comes any more.
struct End {
    reason: String,
    is_failure: bool,
}

impl End {
    fn failure(reason: String) -> Self {
        Self { reason, is_failure: true }
    }
}

impl Replay {
    /// Begins to read the log at `path`. If that cannot be read, its end says so.
    ///
    /// # Errors
    ///
    /// If the system refuses a thread.
    pub fn start(path: &Path, options: ReplayOptions) -> io::Result<Self> {
        let (sender, parts) = sync_channel(PARTS);
        let file = path.to_owned();
        let figures = Arc::<Figures>::default();
        let progress = Progress::start(path, &figures)?;
        let read = move || {
            // Fails when nobody wants to know any more.
            let _ = read(&file, options.is_loop, &sender, &figures);
        };
        thread::Builder::new().name("replay".into()).spawn(read)?;
        Ok(Self {
            path: path.to_owned(),
            options,
            parts,
            part: Part::default(),
            next: 0,
            anchor: None,
            last: 0,
            lap_at: Time::ZERO,
            look_at: Some(Time::ZERO),
            end: None,
            said: 0,
            progress,
        })
    }

    /// Has the next record at hand, if the disk has given it.
    fn load(&mut self, now: Time) -> bool {
        while self.next == self.part.records.len() && self.end.is_none() {
            self.end = self.part.end.take();
            if self.end.is_some() {
                break;
            }
            match self.parts.try_recv() {
                Ok(part) => {
                    if part.is_first {
                        (self.anchor, self.said) = (None, 0);
                    }
                    (self.part, self.next) = (part, 0);
                }
                Err(TryRecvError::Empty) => {
                    self.look_at = Some(now + LOOK_AGAIN);
                    return false;
                }
                Err(TryRecvError::Disconnected) => {
                    self.end = Some(End::failure("its reader has ended".to_owned()));
                }
            }
        }
        self.look_at = None;
        self.end.is_none()
    }

    /// The time of the next record.
    fn micros(&self) -> Option<u64> {
        self.part.records.get(self.next).map(|(micros, _)| *micros)
    }

    /// When the next record is to be said; the first one, at once.
    fn due(&self) -> Option<Time> {
        let micros = self.micros()?;
        let Some((first, since)) = self.anchor else { return Some(self.lap_at) };
        let micros = if self.is_step(micros) { self.last } else { micros };
        // The speed is not 0: then nothing has its time. What is too long is the end of time.
        let elapsed = micros.saturating_sub(first) as f64 / f64::from(self.options.speed);
        Some(since + Duration::from_micros(elapsed.round() as u64))
    }

    /// Whether a clock was set before this record.
    fn is_step(&self, micros: u64) -> bool {
        micros.saturating_add(BACK) < self.last || micros > self.last.saturating_add(STEP)
    }

    /// The next record is said, at `now`: its time is that of the log.
    fn follow(&mut self, micros: u64, now: Time) {
        if self.anchor.is_none() {
            (self.anchor, self.lap_at) = (Some((micros, now)), now + LAP);
            self.last = micros;
        } else if self.is_step(micros) {
            self.anchor = self.due().map(|at| (micros, at));
            self.last = micros;
        }
        self.last = self.last.max(micros);
    }

    fn say(&mut self, out: &mut Vec<u8>) {
        let begin = match self.next {
            0 => 0,
            next => self.part.records[next - 1].1,
        };
        let frame = &self.part.frames[begin..self.part.records[self.next].1];
        out.extend_from_slice(frame);
        self.next += 1;
        self.said += (TIMESTAMP + frame.len()) as u64;
        if let Some(progress) = &self.progress {
            progress.set(self.said);
        }
    }
}

impl LocalPeer for Replay {
    /// It was recorded: nobody can change what it says.
    fn handle_frame(&mut self, _: &Frame<'_>, _: Time) {}

    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        if !self.load(now) || self.options.speed == 0.0 || self.due().is_none_or(|at| at > now) {
            return false;
        }
        if let Some(micros) = self.micros() {
            self.follow(micros, now);
        }
        self.say(out);
        self.load(now);
        true
    }

    fn bulk(&self, _: Time) -> Option<Precedence> {
        let has_more = self.options.speed == 0.0 && self.micros().is_some();
        has_more.then_some(Precedence::Routine)
    }

    fn poll_bulk(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        if !self.load(now) {
            return false;
        }
        self.say(out);
        self.load(now);
        true
    }

    fn poll_timeout(&self) -> Option<Time> {
        match self.look_at {
            _ if self.end.is_some() => None,
            None if self.options.speed == 0.0 => None,
            None => self.due(),
            look_at => look_at,
        }
    }

    fn ended(&self) -> Option<&str> {
        self.end.as_ref().map(|end| end.reason.as_str())
    }

    fn has_failed(&self) -> bool {
        self.end.as_ref().is_some_and(|end| end.is_failure)
    }
}

impl fmt::Debug for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Replay({})", self.path.display())
    }
}

/// Looks whether there is anything to play back at `path`. It may take as long as the disk likes.
///
/// What is no file, such as a pipe, is left to who plays it back: to look would take it away.
///
/// # Errors
///
/// If the file cannot be read, or has not one whole record.
pub fn look_at_log(path: &Path) -> io::Result<()> {
    let kind = path.metadata()?;
    if !kind.is_file() && !kind.is_dir() {
        return Ok(());
    }
    let record = TlogReader::new(File::open(path)?).next_record()?.map(drop);
    record.ok_or_else(no_log)
}

fn no_log() -> io::Error {
    io::Error::other("it is no telemetry log: there is not one whole record in it")
}

/// Reads the log, again and again if it is a loop, and hands it over part by part.
fn read(
    path: &Path,
    is_loop: bool,
    parts: &SyncSender<Part>,
    figures: &Figures,
) -> Result<(), SendError<Part>> {
    loop {
        let end = match File::open(path).and_then(|file| read_once(file, parts, figures)) {
            Ok(ReadOnce::Unwanted) => return Ok(()),
            Ok(ReadOnce::Whole) if is_loop => continue,
            Ok(ReadOnce::Whole) => {
                End { reason: "the log has ended".to_owned(), is_failure: false }
            }
            Ok(ReadOnce::NoLog) => End::failure(format!("{}: {}", path.display(), no_log())),
            Err(error) => End::failure(format!("cannot read {}: {error}", path.display())),
        };
        return parts.send(Part { end: Some(end), ..Part::default() });
    }
}

/// What came of reading a log.
enum ReadOnce {
    Whole,
    NoLog,
    /// Nobody takes it any more.
    Unwanted,
}

fn read_once(file: File, parts: &SyncSender<Part>, figures: &Figures) -> io::Result<ReadOnce> {
    figures.set_total(file.metadata()?.len());
    let mut reader = TlogReader::new(file);
    let mut part = Part { is_first: true, ..Part::default() };
    while let Some(record) = reader.next_record()? {
        part.frames.extend_from_slice(record.frame.bytes());
        part.records.push((record.micros, part.frames.len()));
        if part.frames.len() >= PART && parts.send(std::mem::take(&mut part)).is_err() {
            return Ok(ReadOnce::Unwanted);
        }
    }
    if parts.send(part).is_err() {
        return Ok(ReadOnce::Unwanted);
    }
    Ok(if reader.stats().records == 0 { ReadOnce::NoLog } else { ReadOnce::Whole })
}

#[cfg(test)]
mod tests;
