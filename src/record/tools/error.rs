//! Why a log tool could not do its work.

use std::io;
use std::path::{Path, PathBuf};

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
