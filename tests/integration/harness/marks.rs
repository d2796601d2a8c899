//! Marks: heartbeats that belong to the harness and count for nothing in a test.
//!
//! A mark follows the frames under test on the same way. Who receives it knows that whatever was
//! sent before has arrived or never will: so a test can wait for "nothing" without sleeping.

use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use mavswitch::mavlink::Component;

use super::again::part;
use super::frames::{Draft, HEARTBEAT};

/// A vehicle type that nobody has.
const MARK_TYPE: u8 = 0xaa;
/// Where a MAVLink 2 heartbeat carries its type.
const TYPE_AT: usize = 10 + 4;

/// A new mark from `source`, and its number.
pub(crate) fn mark(source: Component) -> (u32, Vec<u8>) {
    static COUNT: AtomicU32 = AtomicU32::new(1);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    // Some peers are processes of their own: what they count is not what others count.
    let number = match part() {
        Some(_) => 1 << 31 | (process::id() & 0x7fff) << 16 | count & 0xffff,
        None => count & !(1 << 31),
    };
    let [a, b, c, d] = number.to_le_bytes();
    let payload = [a, b, c, d, MARK_TYPE, 8, 0, 4, 3];
    let seq = a;
    (number, Draft::new(source, HEARTBEAT, payload).seq(seq).build())
}

/// The number of the mark, if `frame` is one.
pub(crate) fn number_of(frame: &[u8]) -> Option<u32> {
    let is_mark = frame.starts_with(&[0xfd, 9, 0])
        && frame[7..10] == [0, 0, 0]
        && frame[TYPE_AT] == MARK_TYPE;
    is_mark.then(|| u32::from_le_bytes([frame[10], frame[11], frame[12], frame[13]]))
}
