//! What became of a stream: lost, delivered twice, overtaken.

use std::collections::HashMap;
use std::fmt;
use std::time::{Duration, Instant};

use crate::flight::Stream;

/// What became of a stream.
pub(crate) struct Report {
    stream: Stream,
    /// By number: when it was sent.
    sent: Vec<Instant>,
    /// In the order of arrival: what, and when.
    arrived: Vec<(u32, Instant)>,
    /// By number: when it arrived first.
    first: HashMap<u32, Instant>,
}

impl Report {
    pub(crate) fn new(stream: Stream, sent: Vec<Instant>, arrived: Vec<(u32, Instant)>) -> Self {
        let mut first = HashMap::new();
        for (number, at) in &arrived {
            first.entry(*number).or_insert(*at);
        }
        Self { stream, sent, arrived, first }
    }

    /// How many were sent.
    pub(crate) fn sent(&self) -> usize {
        self.sent.len()
    }

    /// The numbers that never arrived.
    pub(crate) fn lost(&self) -> Vec<u32> {
        let numbers = self.sent.iter().zip(0..).map(|(_, number)| number);
        numbers.filter(|number| !self.first.contains_key(number)).collect()
    }

    /// What arrived again, and how long after the first time.
    pub(crate) fn copies(&self) -> Vec<(u32, Duration)> {
        let mut seen = HashMap::new();
        let again = |(number, at): &(u32, Instant)| {
            let first = *seen.entry(*number).or_insert(*at);
            (first != *at).then(|| (*number, at.duration_since(first)))
        };
        self.arrived.iter().filter_map(again).collect()
    }

    /// The numbers that arrived after a higher one, and when they were sent.
    pub(crate) fn overtaken(&self) -> Vec<(u32, Instant)> {
        let mut highest = 0;
        let is_late = |(number, _): &&(u32, Instant)| {
            highest = highest.max(*number);
            *number < highest
        };
        let late = self.arrived.iter().filter(is_late);
        late.map(|(number, _)| (*number, self.sent[*number as usize])).collect()
    }

    /// The longest time without one, between two that arrived.
    pub(crate) fn longest_gap(&self) -> Duration {
        let gap = |pair: &[(u32, Instant)]| pair[1].1.duration_since(pair[0].1);
        self.arrived.windows(2).map(gap).max().unwrap_or_default()
    }

    /// What part of what was sent was lost.
    pub(crate) fn loss(&self) -> f64 {
        self.lost().len() as f64 / self.sent.len().max(1) as f64
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let delay = |(number, at): (&u32, &Instant)| at.duration_since(self.sent[*number as usize]);
        let mut delays: Vec<Duration> = self.first.iter().map(delay).collect();
        delays.sort_unstable();
        let part = |percent| delays.get(delays.len() * percent / 100).copied().unwrap_or_default();
        write!(
            f,
            "{:?}: {} sent, {} lost, {} delivered again, {} overtaken, \
             delay median {:.1?}, 99 % {:.1?}, longest gap {:.2?}",
            self.stream,
            self.sent(),
            self.lost().len(),
            self.copies().len(),
            self.overtaken().len(),
            part(50),
            part(99),
            self.longest_gap(),
        )
    }
}
