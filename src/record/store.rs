//! The directory of records: names that no file has yet, and room that is made by deleting the
//! oldest.
//!
//! A name is a counter, then the date: `00017-2026-11-22_10-30-00.tlog`. The counter is one more
//! than the highest there is, so names are unique and sorted by age although the clock may be wrong.
//! Only files with such names are ever deleted.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The extensions of records.
const EXTENSIONS: [&str; 3] = ["tlog", "ulg", "bin"];

/// How much is written to try whether that works: as much as a record takes at once.
const TRIAL: usize = 64 * 1024;

/// How many names are tried: others may make files in the directory too.
const TRIES: u32 = 100;

/// The directory of records.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Store {
    /// Where records are.
    pub(super) dir: PathBuf,
    /// How many bytes are to stay free; 0: that does not matter.
    pub(super) min_free: u64,
    /// How many records there may be; 0: any number.
    pub(super) max_files: usize,
}

impl Store {
    /// Makes a file for a new record, and the directory if it is not there.
    pub(super) fn create(&self, extension: &str, now: SystemTime) -> io::Result<(File, PathBuf)> {
        fs::create_dir_all(&self.dir)?;
        let mut number = self.records()?.last().map_or(1, |(last, _)| last.saturating_add(1));
        for _ in 0..TRIES {
            let path = self.dir.join(format!("{number:05}-{}.{extension}", date(now)));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((file, path)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
            number = number.saturating_add(1);
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "no name is left for another record"))
    }

    /// Tries whether a record can be made and written: one that is deleted at once.
    ///
    /// # Errors
    ///
    /// If not.
    pub(super) fn try_out(&self) -> io::Result<()> {
        let (mut file, path) = self.create("bin", SystemTime::now())?;
        let outcome = file.write_all(&[0; TRIAL]).and_then(|()| file.sync_data());
        fs::remove_file(path)?;
        outcome
    }

    /// Deletes the oldest records until the limits are held, but none of `open`.
    ///
    /// # Errors
    ///
    /// If there is too little room and nothing to delete.
    pub(super) fn make_room(&self, open: &[&Path]) -> io::Result<()> {
        if self.max_files == 0 && self.has_room() {
            return Ok(());
        }
        let records = self.records()?;
        let mut left = records.len();
        for (_, path) in records.iter().filter(|(_, path)| !open.contains(&path.as_path())) {
            let is_many = self.max_files != 0 && left > self.max_files;
            if !is_many && self.has_room() {
                break;
            }
            if fs::remove_file(path).is_ok() {
                left -= 1;
                tracing::info!("record {} deleted to make room", path.display());
            }
        }
        if self.has_room() {
            return Ok(());
        }
        let why = format!("less than {} bytes are free", self.min_free);
        Err(io::Error::new(io::ErrorKind::StorageFull, why))
    }

    /// Whether as much is free as is to be. Who cannot be asked, or does not know, shall not have the
    /// records deleted: whether there is room shows when something is written.
    fn has_room(&self) -> bool {
        self.min_free == 0 || self.free().is_none_or(|free| free >= self.min_free)
    }

    /// How many bytes are free, if the file system says so: some have no blocks to count.
    fn free(&self) -> Option<u64> {
        let answer = rustix::fs::statvfs(&self.dir).ok().filter(|it| it.f_blocks > 0)?;
        Some(answer.f_bavail.saturating_mul(answer.f_frsize))
    }

    /// The records there are, the oldest first.
    fn records(&self) -> io::Result<Vec<(u64, PathBuf)>> {
        let mut records = Vec::new();
        for entry in fs::read_dir(&self.dir)? {
            let path = entry?.path();
            records.extend(number_of(&path).map(|number| (number, path)));
        }
        records.sort();
        Ok(records)
    }
}

/// The counter in the name of a record, if it is one.
fn number_of(path: &Path) -> Option<u64> {
    let extension = path.extension()?.to_str()?;
    let (number, _) = path.file_stem()?.to_str()?.split_once('-')?;
    let is_number = number.len() >= 5 && number.bytes().all(|byte| byte.is_ascii_digit());
    (EXTENSIONS.contains(&extension) && is_number).then(|| number.parse().ok())?
}

/// `2026-11-22_10-30-00`, in UTC.
fn date(now: SystemTime) -> String {
    // Dates that cannot be written are those of a clock that is wrong.
    let last = UNIX_EPOCH + Duration::from_secs(253_402_300_799);
    let text = humantime::format_rfc3339_seconds(now.clamp(UNIX_EPOCH, last)).to_string();
    text.trim_end_matches('Z').replace('T', "_").replace(':', "-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_dir::TestDir;

    fn store(dir: &TestDir) -> Store {
        Store { dir: dir.path().join("records"), min_free: 0, max_files: 0 }
    }

    fn at(seconds: u64) -> SystemTime {
        UNIX_EPOCH + Duration::from_secs(seconds)
    }

    fn names(store: &Store) -> Vec<String> {
        let records = store.records().unwrap();
        let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
        records.iter().map(|(_, path)| name(path)).collect()
    }

    #[test]
    fn names_are_unique_and_sorted_by_age_though_the_clock_steps_back() {
        let dir = TestDir::new();
        let store = store(&dir);
        for (seconds, extension) in [(1_795_343_400, "tlog"), (60, "ulg"), (60, "tlog"), (0, "bin")]
        {
            store.create(extension, at(seconds)).unwrap();
        }
        let expected = [
            "00001-2026-11-22_10-30-00.tlog",
            "00002-1970-01-01_00-01-00.ulg",
            "00003-1970-01-01_00-01-00.tlog",
            "00004-1970-01-01_00-00-00.bin",
        ];
        assert_eq!(names(&store), expected);
    }

    #[test]
    fn the_oldest_go_but_neither_those_that_are_open_nor_files_of_others() {
        let dir = TestDir::new();
        let mut store = store(&dir);
        let made: Vec<_> = (0..5).map(|_| store.create("tlog", at(0)).unwrap().1).collect();
        let other = store.dir.join("00000-holiday.jpg");
        fs::write(&other, "x").unwrap();
        store.max_files = 2;
        store.make_room(&[&made[0]]).unwrap();
        let left: Vec<_> = made.iter().map(|path| path.exists()).collect();
        assert_eq!(left, [true, false, false, false, true]);
        assert!(other.exists());
    }

    #[test]
    fn a_disk_that_does_not_say_how_much_is_free_has_no_record_deleted() {
        let unknown = |dir: &str| Store { dir: dir.into(), min_free: u64::MAX, max_files: 0 };
        // It has no blocks to count.
        assert!(unknown("/proc").has_room());
        let gone = TestDir::new();
        assert!(unknown(gone.path().join("gone").to_str().unwrap()).has_room());
        assert!(!unknown(gone.path().to_str().unwrap()).has_room());
    }

    #[test]
    fn a_record_is_tried_out_and_leaves_nothing_behind() {
        let dir = TestDir::new();
        let store = store(&dir);
        store.try_out().unwrap();
        assert_eq!(names(&store), [""; 0]);
        fs::remove_dir(&store.dir).unwrap();
        fs::write(&store.dir, "").unwrap();
        assert!(store.try_out().is_err());
    }

    #[test]
    fn without_room_all_that_may_go_does_and_it_is_told() {
        let dir = TestDir::new();
        let mut store = store(&dir);
        let made: Vec<_> = (0..3).map(|_| store.create("bin", at(0)).unwrap().1).collect();
        store.min_free = u64::MAX;
        let error = store.make_room(&[&made[2]]).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(names(&store).len(), 1);
        store.min_free = 1;
        store.make_room(&[]).unwrap();
        assert_eq!(names(&store).len(), 1);
    }
}
