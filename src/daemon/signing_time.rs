//! The time of signatures, over restarts: read at the start, kept in a file, put forward by the
//! clock of the system.
//!
//! Whoever verifies what we sign refuses a timestamp that is not newer than the last, and a computer
//! without a clock of its own begins in 1970 each time. So the file says which timestamps may have
//! been used: always some more than were, so that it is seldom written, and by a thread of its own.

use std::convert::Infallible;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use std::{env, thread};

use tracing::{error, warn};

use super::event_loop::Daemon;
use crate::mavlink::Timestamp;
use crate::routing::{SigningClock, Time};

/// How far ahead timestamps may be used of what is written: a minute.
const AHEAD: u64 = 6_000_000;

/// How often the clock of the system is looked at, at most.
const LOOK: Duration = Duration::from_secs(1);

/// How long the end waits for the disk.
const PATIENCE: Duration = Duration::from_millis(500);

/// The file, in the directory that the service manager gives.
const FILE: &str = "signing-time";

/// That directory where no service manager says otherwise, if it is there.
const DIRECTORY: &str = "/var/lib/mavswitch";

/// What is kept: two numbers on a line.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
struct Kept {
    /// The newest timestamp that was used when it was written.
    used: Timestamp,
    /// What the clock showed then.
    shown: Timestamp,
}

/// The time of signatures, while nothing is signed or verified only a default.
#[derive(Default, Debug)]
pub(super) struct SigningTime {
    is_on: bool,
    kept: Kept,
    looked: Time,
    writer: Option<Writer>,
}

/// The thread that writes the file.
#[derive(Debug)]
struct Writer {
    work: Sender<Kept>,
    /// Ends when the thread does.
    end: Receiver<Infallible>,
}

impl Daemon {
    /// Sets the clock of signatures, if an endpoint signs or verifies and it is not set yet. At the
    /// start, before frames flow, it waits for the disk.
    pub(super) fn begin_signing_time(&mut self, is_start: bool) {
        let mut gates = self.io.endpoints.iter().map(|endpoint| &endpoint.gate);
        let is_wanted = gates.any(|gate| gate.sign.is_some() || gate.verify.is_some());
        if self.signing_time.is_on || !is_wanted {
            return;
        }
        self.now = self.clock();
        let path = path();
        let before = path.as_deref().map(read).unwrap_or_default();
        let clock = begin(before, wall(), self.now);
        *self.router.signing_clock_mut() = clock;
        let kept = kept(&clock, self.now);
        let writer = path.filter(|path| !is_start || keep(path, kept)).and_then(start_writer);
        if let Some(writer) = writer.as_ref().filter(|_| !is_start) {
            // Fails only if the thread is gone, which has told why.
            let _ = writer.work.send(kept);
        }
        self.signing_time = SigningTime { is_on: true, kept, looked: self.now, writer };
    }

    /// Follows the clock of the system, and has the file written before its reserve is used up.
    pub(super) fn keep_signing_time(&mut self) {
        let (now, time) = (self.now, &mut self.signing_time);
        if !time.is_on || now.since(time.looked) < LOOK {
            return;
        }
        time.looked = now;
        let clock = self.router.signing_clock_mut();
        clock.put_forward(wall(), now);
        // Of what was used: where nothing was signed since, there is nothing to write, either.
        let is_due = clock.used() > time.kept.used.plus(AHEAD / 2);
        if is_due && let Some(writer) = &time.writer {
            time.kept = kept(clock, now);
            // Fails only if the thread is gone; then the reserve must do.
            let _ = writer.work.send(time.kept);
        }
    }

    /// Writes what was really used, so that the next start need not begin a minute later.
    pub(super) fn end_signing_time(&mut self) {
        let Some(Writer { work, end }) = self.signing_time.writer.take() else { return };
        let clock = self.router.signing_clock();
        let _ = work.send(Kept { used: clock.used().minus(AHEAD), shown: clock.show(self.now) });
        drop(work);
        // A disk that does not answer keeps nobody from ending.
        let _ = end.recv_timeout(PATIENCE);
    }
}

/// What to write: no timestamp that was used up to now, or could be used now, is newer.
fn kept(clock: &SigningClock, now: Time) -> Kept {
    let shown = clock.show(now);
    Kept { used: clock.used().max(shown), shown }
}

/// The clock to begin with: no timestamp that may have been used comes again.
fn begin(kept: Option<Kept>, wall: Timestamp, now: Time) -> SigningClock {
    match kept {
        Some(kept) => SigningClock::new(wall.max(kept.shown), kept.used.plus(AHEAD), now),
        None => SigningClock::new(wall, Timestamp::default(), now),
    }
}

/// What the clock of the system shows.
fn wall() -> Timestamp {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    Timestamp::from_unix(since_1970.unwrap_or_default())
}

/// Where the file is to be.
fn path() -> Option<PathBuf> {
    let given = env::var_os("STATE_DIRECTORY");
    // There may be several, with colons between.
    let first = given.map(|list| {
        let list = list.to_string_lossy().into_owned();
        PathBuf::from(list.split(':').next().unwrap_or_default())
    });
    let directory = first.or_else(|| Some(DIRECTORY.into()).filter(|dir: &PathBuf| dir.is_dir()));
    if directory.is_none() {
        warn!(
            "signing: there is no directory to keep the time in: after a restart with a clock that \
             is behind, what is signed will be refused (set STATE_DIRECTORY)"
        );
    }
    directory.map(|directory| directory.join(FILE))
}

/// What the file says; nothing if there is none yet.
fn read(path: &Path) -> Option<Kept> {
    match fs::read_to_string(path) {
        Ok(text) => {
            let kept = parse(&text);
            if kept.is_none() {
                warn!("signing: {} is not what was written there: ignored", path.display());
            }
            kept
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => {
            warn!("signing: cannot read {}: {error}", path.display());
            None
        }
    }
}

fn parse(text: &str) -> Option<Kept> {
    let (used, shown) = text.trim_end().split_once(' ')?;
    let number = |text: &str| text.parse().ok().map(Timestamp::new);
    Some(Kept { used: number(used)?, shown: number(shown)? })
}

/// Writes the file, and says whether it could; if not, that is told.
fn keep(path: &Path, kept: Kept) -> bool {
    let result = write(path, kept);
    if let Err(error) = &result {
        error!(
            "signing: cannot keep the time in {}: {error} (after a restart with a clock that is \
             behind, what is signed will be refused)",
            path.display()
        );
    }
    result.is_ok()
}

/// Replaces the file as a whole: the power may fail at any moment.
fn write(path: &Path, kept: Kept) -> io::Result<()> {
    let new = path.with_extension("new");
    let mut file = File::create(&new)?;
    writeln!(file, "{} {}", kept.used.units(), kept.shown.units())?;
    file.sync_all()?;
    fs::rename(&new, path)
}

fn start_writer(path: PathBuf) -> Option<Writer> {
    let (sender, receiver) = channel();
    let (ends, end) = channel();
    let work = move || {
        let _ends = ends;
        let mut is_told = false;
        for kept in receiver {
            // What goes wrong is told once.
            is_told |= if is_told { write(&path, kept).is_err() } else { !keep(&path, kept) };
        }
    };
    let thread = thread::Builder::new().name("signing-time".into()).spawn(work);
    thread.is_ok().then_some(Writer { work: sender, end })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Timestamp = Timestamp::new(37_000_000_000_000);

    #[test]
    fn a_clock_that_is_set_back_repeats_no_timestamp() {
        let mut clock = begin(None, NOW, Time::ZERO);
        let written = kept(&clock, Time::ZERO);
        let before = clock.next(Time::from_millis(59_000));
        assert!(before > NOW && before <= NOW.plus(AHEAD));
        // Without any word of what was used since, and in 1970.
        let mut clock = begin(Some(written), Timestamp::default(), Time::ZERO);
        assert!(clock.next(Time::ZERO) > before);
        assert_eq!(clock.show(Time::ZERO), NOW, "what is received is held against the older time");
    }

    #[test]
    fn what_is_written_is_read() {
        let path = env::temp_dir().join(format!("mavswitch-signing-{}", std::process::id()));
        assert_eq!(read(&path), None);
        let kept = Kept { used: NOW, shown: NOW.minus(5) };
        assert!(keep(&path, kept));
        assert_eq!(read(&path), Some(kept));
        fs::write(&path, "37 none").unwrap();
        assert_eq!(read(&path), None);
        fs::remove_file(&path).unwrap();
        assert!(!keep(&path.join("no-directory"), kept));
    }
}
