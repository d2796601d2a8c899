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

/// How far ahead of the clock of the system a time is that somebody should look at: a day.
const DOUBTFUL: u64 = 24 * 60 * 60 * 100_000;

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
    /// What was there at the start. Nobody else writes the file, so it holds until we do.
    found: Found,
    is_on: bool,
    kept: Kept,
    looked: Time,
    writer: Option<Writer>,
}

/// The file, and what it said.
#[derive(Default, Debug)]
struct Found {
    path: Option<PathBuf>,
    kept: Option<Kept>,
    /// Why it said nothing, if that is not as it should be.
    problem: Option<String>,
}

/// The thread that writes the file.
#[derive(Debug)]
struct Writer {
    work: Sender<Kept>,
    /// Ends when the thread does.
    end: Receiver<Infallible>,
}

impl Daemon {
    /// Looks for the file, and sets the clock of signatures if an endpoint signs or verifies. It waits
    /// for the disk: no frames flow yet. A reload that is the first to ask for signatures does not.
    pub(super) fn start_signing_time(&mut self) {
        self.signing_time.found = find();
        self.begin_signing_time(true);
    }

    /// Sets the clock of signatures, if an endpoint signs or verifies and it is not set yet.
    pub(super) fn begin_signing_time(&mut self, is_start: bool) {
        let mut gates = self.io.endpoints.iter().map(|endpoint| &endpoint.gate);
        let is_wanted = gates.any(|gate| gate.sign.is_some() || gate.verify.is_some());
        if self.signing_time.is_on || !is_wanted {
            return;
        }
        self.now = self.clock();
        let Found { path, kept: before, problem } = std::mem::take(&mut self.signing_time.found);
        let problem = problem.or_else(|| doubt(path.as_deref()?, before?, wall()));
        if let Some(problem) = problem {
            warn!("signing: {problem}");
        }
        let clock = begin(before, wall(), self.now);
        *self.router.signing_clock_mut() = clock;
        let kept = kept(&clock, self.now);
        let writer = path.filter(|path| !is_start || keep(path, kept)).and_then(start_writer);
        if let Some(writer) = writer.as_ref().filter(|_| !is_start) {
            // Fails only if the thread is gone, which has told why.
            let _ = writer.work.send(kept);
        }
        let (found, looked) = (Found::default(), self.now);
        self.signing_time = SigningTime { found, is_on: true, kept, looked, writer };
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

/// What to tell of a time that is far ahead of the clock of the system. One that shows a time before
/// 2015 was never set, and is behind for that reason.
fn doubt(path: &Path, kept: Kept, wall: Timestamp) -> Option<String> {
    let newest = kept.used.max(kept.shown);
    let days = newest.units().saturating_sub(wall.units()) / DOUBTFUL;
    (wall > Timestamp::default() && days > 0).then(|| {
        format!(
            "the time in {} is {days} days ahead of this computer's clock: whoever signs with the \
             right time is refused as too old (set the clock; if that is right, stop the router and \
             delete the file)",
            path.display()
        )
    })
}

/// Looks for the file.
fn find() -> Found {
    let Some(path) = path() else {
        let problem = "there is no directory to keep the time in: after a restart with a clock that \
                       is behind, what is signed will be refused (set STATE_DIRECTORY)";
        return Found { problem: Some(problem.to_owned()), ..Found::default() };
    };
    let (kept, problem) = match read(&path) {
        Ok(kept) => (kept, None),
        Err(problem) => (None, Some(problem)),
    };
    Found { path: Some(path), kept, problem }
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
    directory.map(|directory| directory.join(FILE))
}

/// What the file says; nothing if there is none yet.
fn read(path: &Path) -> Result<Option<Kept>, String> {
    match fs::read_to_string(path) {
        Ok(text) => {
            let strange = || format!("{} is not what was written there: ignored", path.display());
            parse(&text).ok_or_else(strange).map(Some)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(format!("cannot read {}: {error}", path.display())),
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
mod tests;
