//! What the tests of the sessions share: chance that can be repeated, and files in memory.

use super::sink::Sink;

/// Chance with a seed.
pub(super) struct Chance(u64);

impl Chance {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// A number below `end`.
    pub(super) fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % end
    }

    /// Whether it happens, in so many of a hundred cases.
    pub(super) fn happens(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }
}

/// Files in memory.
#[derive(Default)]
pub(super) struct Files {
    pub(super) files: Vec<(&'static str, Vec<u8>)>,
    pub(super) is_open: bool,
    pub(super) is_full: bool,
}

impl Files {
    pub(super) fn contents(&self) -> Vec<&[u8]> {
        self.files.iter().map(|(_, bytes)| &bytes[..]).collect()
    }
}

impl Sink for Files {
    fn open(&mut self, extension: &'static str) {
        self.files.push((extension, Vec::new()));
        self.is_open = true;
    }

    fn has_room(&self, _: usize) -> bool {
        !self.is_full
    }

    fn write(&mut self, at: u64, bytes: &[u8]) -> bool {
        assert!(self.is_open, "written to a file that is closed");
        let (_, file) = self.files.last_mut().unwrap();
        let end = at as usize + bytes.len();
        file.resize(file.len().max(end), 0);
        file[at as usize..end].copy_from_slice(bytes);
        true
    }

    fn close(&mut self) {
        assert!(self.is_open);
        self.is_open = false;
    }
}
