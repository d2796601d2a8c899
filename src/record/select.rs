//! Which records of a log are wanted: by time, and by message and source as the filters of
//! endpoints have it.

use std::str::FromStr;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::tlog::Record;
use crate::routing::{Filter, FilterLists};

/// A point in a log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Moment {
    /// So long after its first record.
    SinceStart(Duration),
    /// In microseconds since 1970.
    Wall(u64),
}

/// A text that names no point in a log.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "write a time from the start of the log, as 90, 1m30s or 2h, or a date and time in UTC, as \
     2026-11-22T10:30:00"
)]
pub struct BadMoment;

impl FromStr for Moment {
    type Err = BadMoment;

    /// `90` and `1.5` are seconds from the start, `1m30s` as well; `2026-11-22T10:30:00` is a time.
    fn from_str(text: &str) -> Result<Self, BadMoment> {
        if let Ok(seconds) = text.parse::<f64>() {
            let since = Duration::try_from_secs_f64(seconds).map_err(|_| BadMoment)?;
            return Ok(Self::SinceStart(since));
        }
        if let Ok(since) = humantime::parse_duration(text) {
            return Ok(Self::SinceStart(since));
        }
        let time = humantime::parse_rfc3339_weak(text).map_err(|_| BadMoment)?;
        micros_of(time).map(Self::Wall).ok_or(BadMoment)
    }
}

fn micros_of(time: SystemTime) -> Option<u64> {
    u64::try_from(time.duration_since(UNIX_EPOCH).ok()?.as_micros()).ok()
}

impl Moment {
    fn micros(self, start: u64) -> u64 {
        match self {
            Self::Wall(micros) => micros,
            Self::SinceStart(since) => {
                start.saturating_add(u64::try_from(since.as_micros()).unwrap_or(u64::MAX))
            }
        }
    }
}

/// Whether a part from one point to another has nothing in it, whatever the log; where one is a date
/// and the other is not, only the log tells.
fn is_empty_part(from: Option<Moment>, to: Option<Moment>) -> bool {
    match (from, to) {
        (Some(Moment::SinceStart(from)), Some(Moment::SinceStart(to))) => from >= to,
        (Some(Moment::Wall(from)), Some(Moment::Wall(to))) => from >= to,
        _ => false,
    }
}

/// Which records are wanted.
#[derive(Clone, Debug)]
pub struct Selection {
    from: Option<Moment>,
    to: Option<Moment>,
    filter: Filter,
    /// The time of the first record seen.
    start: Option<u64>,
}

impl Selection {
    /// From `from` on, up to but without `to`, and only what `lists` let pass. For one log. `None` if
    /// nothing is between them, whatever the log.
    pub fn new(from: Option<Moment>, to: Option<Moment>, lists: &FilterLists) -> Option<Self> {
        let filter = Filter::new(lists);
        (!is_empty_part(from, to)).then_some(Self { from, to, filter, start: None })
    }

    /// Whether a record is wanted; those of a log are asked for one after the other.
    pub fn takes(&mut self, record: &Record<'_>) -> bool {
        let start = *self.start.get_or_insert(record.micros);
        let is_late = self.from.is_none_or(|from| record.micros >= from.micros(start));
        let is_early = self.to.is_none_or(|to| record.micros < to.micros(start));
        is_late && is_early && self.filter.permits(&record.frame.header())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_seconds_durations_and_dates() {
        let since = |seconds| Ok(Moment::SinceStart(Duration::from_secs_f64(seconds)));
        assert_eq!("90".parse(), since(90.0));
        assert_eq!("1.5".parse(), since(1.5));
        assert_eq!("1m30s".parse(), since(90.0));
        assert_eq!("1970-01-01T00:01:00".parse(), Ok(Moment::Wall(60_000_000)));
        assert_eq!("1970-01-01T00:01:00.5Z".parse(), Ok(Moment::Wall(60_500_000)));
        for text in ["", "-1", "x", "1 fortnight", "nan", "1960-01-01T00:00:00"] {
            assert_eq!(text.parse::<Moment>(), Err(BadMoment), "{text}");
        }
    }
}
