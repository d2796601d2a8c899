//! The highest rate at which the forwarder of batches loses nothing, and what the others lose then.

use std::time::Duration;

use super::measure::measure;
use super::router::Candidate;
use super::scenario::{HIGHEST, Scenario};

/// Each rate that is tried is so many quarters of the one before.
const QUARTERS: u32 = 5;

/// What the one thread that sends cannot exceed anyway.
const ENOUGH: u32 = 1_000_000;

/// Of how many tries at a rate none may lose a frame.
const TRIES: usize = 2;

/// The load of telemetry from UDP to UDP at that rate.
pub(crate) fn scenario(time: Duration) -> Scenario {
    let [_, floor, _] = Candidate::built_in();
    let loses_nothing =
        |scenario: &Scenario| (0..TRIES).all(|_| measure(&floor, scenario, time).loss <= 0.0);
    let faster = |slower: &Scenario| Scenario { rate: slower.rate / 4 * QUARTERS, ..*slower };
    let mut highest = HIGHEST;
    let mut next = faster(&highest);
    while next.rate <= ENOUGH && loses_nothing(&next) {
        (highest, next) = (next, faster(&next));
    }
    highest
}
