//! Keeps what a peer can trigger from filling the log.

use std::fmt;
use std::time::Duration;

use tracing::Level;

use crate::routing::Time;

/// Lets a burst of lines through, then one every [`LogLimit::INTERVAL`], and counts the rest.
#[derive(Clone, Debug)]
pub(super) struct LogLimit {
    /// How many lines may come at once.
    tokens: u32,
    refilled: Time,
    suppressed: u64,
}

impl LogLimit {
    /// Lines that may come at once.
    const BURST: u32 = 20;
    /// Time for one more.
    const INTERVAL: Duration = Duration::from_secs(6);

    pub(super) fn new(now: Time) -> Self {
        Self { tokens: Self::BURST, refilled: now, suppressed: 0 }
    }

    /// When a line may be written at the latest.
    pub(super) fn next(&self) -> Time {
        self.refilled + Self::INTERVAL
    }

    /// Whether a line may be written now; if so, how many were left out since the last one.
    pub(super) fn permit(&mut self, now: Time) -> Option<u64> {
        let elapsed = now.since(self.refilled).as_micros() / Self::INTERVAL.as_micros();
        let new = u32::try_from(elapsed).unwrap_or(Self::BURST);
        if new > 0 {
            self.tokens = self.tokens.saturating_add(new).min(Self::BURST);
            self.refilled = now;
        }
        if self.tokens == 0 {
            self.suppressed += 1;
            return None;
        }
        self.tokens -= 1;
        Some(std::mem::take(&mut self.suppressed))
    }
}

/// What a line is about: one that a peer can bring about at will takes no place of another.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Topic {
    /// How the endpoint itself is getting on; the last line is never left out.
    State,
    /// Peers of a server that come and go.
    Peer,
    /// Peers that are refused.
    Refusal,
    /// What a link has carried.
    Detail,
}

/// What an endpoint may still write to the log.
#[derive(Debug)]
pub(super) struct Log {
    limits: [LogLimit; 4],
    /// The last word on its state, if it was left out so far.
    pub(super) unsaid: Option<(Level, String)>,
}

impl Log {
    pub(super) fn new(now: Time) -> Self {
        Self { limits: std::array::from_fn(|_| LogLimit::new(now)), unsaid: None }
    }

    pub(super) fn of(&mut self, topic: Topic) -> &mut LogLimit {
        &mut self.limits[topic as usize]
    }
}

/// How many lines were left out before this one, if any.
pub(super) struct LeftOut(pub(super) u64);

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => Ok(()),
            count => write!(f, " (and {count} lines left out before this one)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_then_one_line_each_interval_tells_what_was_left_out() {
        let mut limit = LogLimit::new(Time::ZERO);
        let burst = (0..100).filter(|_| limit.permit(Time::ZERO).is_some()).count();
        assert_eq!(burst, 20);
        let later = Time::ZERO + LogLimit::INTERVAL;
        assert_eq!(limit.permit(later), Some(80));
        assert_eq!(limit.permit(later), None);
    }
}
