//! One telemetry log that is being written: whole records, or what a full card leaves of them.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};

use super::tlog::write_record;

/// How much is written at once.
pub(super) const PORTION: usize = 64 * 1024;

/// A telemetry log that is being written.
pub(super) struct Output {
    file: File,
    path: PathBuf,
    /// Where the next portion goes. Invariant: what stands before it are whole records.
    position: u64,
    /// Whole records that are not yet written, and how many.
    buffer: Vec<u8>,
    frames: u64,
}

impl Output {
    /// A new file, empty.
    pub(super) fn new(file: File, path: PathBuf) -> Self {
        Self { file, path, position: 0, buffer: Vec::with_capacity(PORTION), frames: 0 }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// How many bytes are written.
    pub(super) fn len(&self) -> u64 {
        self.position
    }

    /// How many frames it has taken that are not written yet.
    pub(super) fn waiting(&self) -> u64 {
        self.frames
    }

    /// Takes a record; says whether it is time to write.
    pub(super) fn add(&mut self, micros: u64, frame: &[u8]) -> bool {
        // Writing to memory does not fail.
        let _ = write_record(&mut self.buffer, micros, frame);
        self.frames += 1;
        self.buffer.len() >= PORTION
    }

    /// Writes what it has taken; says how many frames and bytes that was. What cannot be written is
    /// forgotten, and the file ends with a whole record.
    ///
    /// # Errors
    ///
    /// The number of frames that are lost, and why.
    pub(super) fn write(&mut self) -> Result<(u64, u64), (u64, io::Error)> {
        let (frames, bytes) = (std::mem::take(&mut self.frames), self.buffer.len() as u64);
        let outcome = self.file.write_all_at(&self.buffer, self.position);
        self.buffer.clear();
        match outcome {
            Ok(()) => {
                self.position += bytes;
                Ok((frames, bytes))
            }
            Err(error) => {
                // If even that fails, a reader passes over the piece of a record.
                let _ = self.file.set_len(self.position);
                Err((frames, error))
            }
        }
    }

    /// Has the system put on the disk what was written.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Whether the file is still where it was made.
    pub(super) fn is_there(&self) -> bool {
        is_there(&self.file, &self.path)
    }
}

impl Drop for Output {
    /// A file without a record is of no use to anybody.
    fn drop(&mut self) {
        if self.position == 0 && self.is_there() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Whether `path` still names this file.
pub(super) fn is_there(file: &File, path: &Path) -> bool {
    let identity = |data: fs::Metadata| (data.dev(), data.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(named)) => identity(open) == identity(named),
        _ => false,
    }
}
