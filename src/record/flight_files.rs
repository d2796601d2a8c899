//! The flight-stack logs that are being written: pieces of a file at the places where they belong.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use tracing::{info, warn};

use super::feed::Piece;
use super::output::is_there;
use super::store::Store;

/// A slot as a bit: there are 32 of them.
pub(super) fn slot_bit(slot: u8) -> u32 {
    1_u32.unbounded_shl(slot.into())
}

/// Flight-stack logs by slot.
#[derive(Default)]
pub(super) struct FlightFiles(Vec<Flight>);

struct Flight {
    slot: u8,
    extension: &'static str,
    /// Made when there is something to write: nobody wants an empty file.
    file: Option<(File, PathBuf)>,
    is_touched: bool,
}

impl Flight {
    /// Has the system put on the disk what was written since that was done last.
    fn sync(&mut self) -> io::Result<()> {
        match &self.file {
            Some((file, _)) if std::mem::take(&mut self.is_touched) => file.sync_data(),
            _ => Ok(()),
        }
    }
}

impl FlightFiles {
    /// A log begins; whatever had its slot before ends.
    pub(super) fn open(&mut self, slot: u8, extension: &[u8]) {
        // What the disk says of the log before shows with the next.
        let _ = self.close(slot);
        let extension = if extension == b"ulg" { "ulg" } else { "bin" };
        self.0.push(Flight { slot, extension, file: None, is_touched: false });
    }

    /// Writes a piece at its place; says whether a file was made for it. A piece for a slot that is
    /// not open is nobody's.
    pub(super) fn write(&mut self, store: &Store, piece: &Piece<'_>) -> io::Result<bool> {
        let Some(flight) = self.0.iter_mut().find(|it| it.slot == piece.slot) else {
            return Ok(false);
        };
        let is_new = flight.file.is_none();
        if is_new {
            let made = store.create(flight.extension, SystemTime::now())?;
            info!("recording to {}", made.1.display());
            flight.file = Some(made);
        }
        if let Some((file, _)) = &flight.file {
            file.write_all_at(piece.bytes, piece.number)?;
            flight.is_touched = true;
        }
        Ok(is_new)
    }

    /// Whether there is a log in this slot.
    pub(super) fn is_open(&self, slot: u8) -> bool {
        self.0.iter().any(|flight| flight.slot == slot)
    }

    /// A log ends: with all of it on the disk, for the power may go next.
    pub(super) fn close(&mut self, slot: u8) -> io::Result<()> {
        let Some(at) = self.0.iter().position(|flight| flight.slot == slot) else { return Ok(()) };
        self.0.swap_remove(at).sync()
    }

    pub(super) fn close_all(&mut self) {
        // What the disk says now, nobody can act on.
        let _ = self.sync();
        self.0.clear();
    }

    /// Has the system put on the disk what was written: all of it, whatever it says of one file.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.0.iter_mut().map(Flight::sync).fold(Ok(()), io::Result::and)
    }

    /// A file that is not where it was made is no use, and neither is the rest of its log without the
    /// beginning: such logs break off. Their slots, as bits.
    pub(super) fn forget_vanished(&mut self) -> u32 {
        self.forget(|flight| {
            let gone = flight.file.as_ref().filter(|(file, path)| !is_there(file, path));
            if let Some((_, path)) = gone {
                warn!("record {} has vanished: asking for a log anew", path.display());
            }
            gone.is_some()
        })
    }

    /// The log in this slot breaks off if nothing of it is written yet: its beginning was lost. Its
    /// slot, as a bit.
    pub(super) fn forget_unbegun(&mut self, slot: u8) -> u32 {
        self.forget(|flight| flight.slot == slot && flight.file.is_none())
    }

    fn forget(&mut self, is_broken: impl Fn(&Flight) -> bool) -> u32 {
        let broken = self.0.extract_if(.., |flight| is_broken(flight));
        broken.fold(0, |slots, flight| slots | slot_bit(flight.slot))
    }

    /// The files that are being written, with their slots.
    pub(super) fn paths(&self) -> impl Iterator<Item = (u8, &Path)> {
        let open = self.0.iter().filter_map(|it| Some((it.slot, it.file.as_ref()?)));
        open.map(|(slot, (_, path))| (slot, path.as_path()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log whose disk fails: this is no file that could be put on one.
    fn broken(slot: u8) -> Flight {
        let file = File::options().write(true).open("/dev/null").unwrap();
        let file = Some((file, PathBuf::from("/dev/null")));
        Flight { slot, extension: "bin", file, is_touched: true }
    }

    #[test]
    fn the_end_of_one_log_neither_waits_for_others_nor_fails_with_them() {
        let dir = crate::test_dir::TestDir::new();
        let path = dir.path().join("0001.bin");
        let file = Some((File::create(&path).unwrap(), path));
        let whole = Flight { slot: 2, extension: "bin", file, is_touched: true };
        let mut files = FlightFiles(vec![broken(1), whole, broken(3)]);
        files.close(2).unwrap();
        assert!(!files.is_open(2));
        assert!(files.0.iter().all(|flight| flight.is_touched), "not the matter of this one");
        files.close(1).unwrap_err();
        assert!(!files.is_open(1));
        files.close(7).unwrap();
    }

    #[test]
    fn a_log_that_cannot_be_put_on_the_disk_keeps_no_other_from_it() {
        let mut files = FlightFiles(vec![broken(1), broken(2)]);
        files.sync().unwrap_err();
        assert!(files.0.iter().all(|flight| !flight.is_touched), "the second was not tried");
    }
}
