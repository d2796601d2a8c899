//! Why a log tool could not do its work.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

/// Why a log tool could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum ToolError {
    /// A log cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The log.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The new log cannot be made or written to.
    #[error("cannot write {}: {source}{hint}", path.display())]
    Write {
        /// The new log.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
        /// What to do about it.
        hint: &'static str,
    },
    /// No record was chosen.
    #[error("nothing to write to {}: no frame was chosen; {length}", path.display())]
    Nothing {
        /// The new log, which was not made.
        path: PathBuf,
        /// How long what was read is.
        length: String,
    },
    /// There is no record in it.
    #[error("{}: no telemetry log: not one whole record in {bytes} bytes", path.display())]
    NoLog {
        /// What was read.
        path: PathBuf,
        /// How much of it there is.
        bytes: u64,
    },
}

impl ToolError {
    /// No record was chosen of those from the first to the last of these times, in microseconds.
    pub(super) fn nothing(path: &Path, (start, end): (u64, u64)) -> Self {
        let time = |micros| UNIX_EPOCH + Duration::from_micros(micros);
        let whole = Duration::from_secs(end.saturating_sub(start) / 1_000_000);
        let length = format!(
            "the log goes from {} to {}, {}",
            humantime::format_rfc3339_seconds(time(start)),
            humantime::format_rfc3339_seconds(time(end)),
            humantime::format_duration(whole)
        );
        Self::Nothing { path: path.to_owned(), length }
    }

    /// Makes a read error of what the system says.
    pub(super) fn read(path: &Path) -> impl Fn(io::Error) -> Self + use<'_> {
        |source| Self::Read { path: path.to_owned(), source }
    }

    /// Makes a write error of what the system says.
    pub(super) fn write(path: &Path) -> impl Fn(io::Error) -> Self + use<'_> {
        |source| {
            let hint = match source.kind() {
                io::ErrorKind::AlreadyExists => " (choose another name, or remove it)",
                _ => "",
            };
            Self::Write { path: path.to_owned(), source, hint }
        }
    }
}
