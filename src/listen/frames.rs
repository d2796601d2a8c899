//! Frames on the control socket: what a listener is told of each.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Frames that passed, oldest first.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Frames {
    /// How many that passed before these are not shown, as there was no room for them. Those that
    /// found no room before anybody looked at them count whether they were wanted or not.
    #[serde(default)]
    pub missed: u64,
    /// Those that are.
    pub frames: Vec<SeenFrame>,
}

/// A frame that passed.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct SeenFrame {
    /// When it was read: microseconds since 1970, UTC.
    pub time_us: u64,
    /// The endpoint it came from, and the number of the link.
    pub endpoint: String,
    /// The link's number.
    pub link: u16,
    /// The endpoints it was sent on to; one that has several links is there as often.
    pub to: Vec<String>,
    /// Where it was to go and did not, and why: `queue_full`. The first few.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub refused: BTreeMap<String, String>,
    /// Why it went nowhere at all: `no_route`, `duplicate`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dropped: Option<String>,
    /// Whether its checksum could be checked in full.
    pub verified: bool,
    /// Its bytes as they arrived, in hexadecimal digits.
    pub bytes: String,
}

/// Bytes as hexadecimal digits.
pub fn to_hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digit = |value: u8| char::from(DIGITS[usize::from(value & 15)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(*byte)]).collect()
}

/// The bytes that hexadecimal digits stand for; `None` if they are none.
pub fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let pair = |pair: &[u8]| match *pair {
        [high, low] => u8::try_from(digit(high)? << 4 | digit(low)?).ok(),
        _ => None,
    };
    text.as_bytes().chunks(2).map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_from_their_digits() {
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(to_hex(&bytes[250..]), "fafbfcfdfeff");
        assert_eq!(from_hex(&to_hex(&bytes)), Some(bytes));
        for wrong in ["f", "fg", "0é", "é0"] {
            assert_eq!(from_hex(wrong), None, "{wrong}");
        }
    }
}
