//! The frame checksum, CRC-16/MCRF4XX (rule 15), and its last step, which mixes in CRC_EXTRA.
//!
//! The last step is one-to-one in CRC_EXTRA: from the checksum so far and the checksum received
//! follows the one CRC_EXTRA that explains them, or that none does (rule 23). So a frame is never
//! tried against a list of definitions; the definition falls out of the checksum.

use crc_any::CRCu16;

/// A running CRC-16/MCRF4XX: initial value 0xFFFF, reflected polynomial 0x1021, no final xor.
#[derive(Clone, Debug)]
pub struct Crc(CRCu16);

impl Crc {
    /// A checksum of nothing yet.
    pub fn new() -> Self {
        Self(CRCu16::crc16mcrf4cc())
    }

    /// The checksum of `bytes`.
    pub fn of(bytes: &[u8]) -> u16 {
        let mut crc = Self::new();
        crc.update(bytes);
        crc.value()
    }

    /// Adds `bytes`.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The checksum of everything added so far.
    pub fn value(&self) -> u16 {
        self.0.get_crc()
    }

    /// Adds one byte to the finished checksum `crc`: how CRC_EXTRA closes a frame's checksum.
    pub fn step(crc: u16, byte: u8) -> u16 {
        (crc >> 8) ^ TABLE[usize::from(low(crc) ^ byte)]
    }
}

impl Default for Crc {
    fn default() -> Self {
        Self::new()
    }
}

/// The CRC_EXTRA that turns `crc` (header and payload) into `received`, if one of the 256 does.
///
/// A random frame has one with probability 1/256.
pub fn implied_extra(crc: u16, received: u16) -> Option<u8> {
    // The high byte of a table entry names its index, and `crc >> 8` leaves the high byte alone.
    let index = INDEX_BY_HIGH_BYTE[usize::from(received >> 8)];
    let matches = TABLE[usize::from(index)] ^ (crc >> 8) == received;
    matches.then_some(index ^ low(crc))
}

const fn low(crc: u16) -> u8 {
    (crc & 0xff) as u8
}

/// What one byte does to a checksum, by its exclusive-or with the checksum's low byte.
static TABLE: [u16; 256] = table();

/// The index of the one entry of [`TABLE`] with a given high byte.
static INDEX_BY_HIGH_BYTE: [u8; 256] = index_by_high_byte();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        let mut crc = index as u16;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x8408 } else { crc >> 1 };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}

const fn index_by_high_byte() -> [u8; 256] {
    let table = table();
    let mut indices = [0; 256];
    let mut index = 0;
    while index < 256 {
        indices[(table[index] >> 8) as usize] = index as u8;
        index += 1;
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rule_15_the_check_value_of_the_digits_is_0x6f91() {
        assert_eq!(Crc::of(b"123456789"), 0x6f91);
    }

    #[test]
    fn a_step_is_what_the_library_computes() {
        for byte in 0..=255 {
            let mut crc = Crc::new();
            crc.update(b"HEARTBEAT ");
            let before = crc.value();
            crc.update(&[byte]);
            assert_eq!(Crc::step(before, byte), crc.value());
        }
    }

    /// What looking back from a checksum rests on.
    #[test]
    fn every_table_entry_has_a_high_byte_of_its_own() {
        let (table, indices) = (table(), index_by_high_byte());
        assert_eq!((table, indices), (TABLE, INDEX_BY_HIGH_BYTE), "as compiled");
        for (index, entry) in table.iter().enumerate() {
            assert_eq!(usize::from(indices[usize::from(entry >> 8)]), index);
        }
    }

    #[test]
    fn rule_23_the_last_step_is_one_to_one() {
        for crc in (0..=u16::MAX).step_by(257) {
            let mut explained = 0;
            for received in 0..=u16::MAX {
                if let Some(extra) = implied_extra(crc, received) {
                    assert_eq!(Crc::step(crc, extra), received);
                    explained += 1;
                }
            }
            assert_eq!(explained, 256, "each of 256 extras leads to a checksum of its own");
        }
    }
}
