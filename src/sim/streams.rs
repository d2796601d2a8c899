//! The messages that a vehicle sends of its own accord, and how often.

use std::time::Duration;

use crate::routing::Time;

/// One of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stream {
    Heartbeat,
    SysStatus,
    ExtendedSysState,
    GpsRawInt,
    Attitude,
    GlobalPositionInt,
    VfrHud,
}

const COUNT: usize = 7;

impl Stream {
    const ALL: [Self; COUNT] = [
        Self::Heartbeat,
        Self::SysStatus,
        Self::ExtendedSysState,
        Self::GpsRawInt,
        Self::Attitude,
        Self::GlobalPositionInt,
        Self::VfrHud,
    ];

    /// The stream of the message with this id.
    pub(super) fn of(id: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|stream| stream.id() == id)
    }

    fn id(self) -> u32 {
        match self {
            Self::Heartbeat => 0,
            Self::SysStatus => 1,
            Self::ExtendedSysState => 245,
            Self::GpsRawInt => 24,
            Self::Attitude => 30,
            Self::GlobalPositionInt => 33,
            Self::VfrHud => 74,
        }
    }

    /// How often it is sent if nobody asked for anything else, where motion is told at `rate` Hz.
    fn interval(self, rate: u16) -> Duration {
        let second = Duration::from_secs(1);
        match self {
            Self::Heartbeat | Self::SysStatus | Self::ExtendedSysState => second,
            Self::GpsRawInt => second / u32::from(rate.clamp(1, 2)),
            Self::Attitude | Self::GlobalPositionInt | Self::VfrHud => {
                second / u32::from(rate.max(1))
            }
        }
    }
}

/// The shortest interval that somebody may ask for.
const SHORTEST: Duration = Duration::from_millis(10);
/// The longest.
const LONGEST: Duration = Duration::from_secs(60);

/// When each of them is sent next.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    rate: u16,
    /// In the order of [`Stream::ALL`]; no interval: not sent.
    entries: [(Option<Duration>, Time); COUNT],
}

/// A part of its interval by which a vehicle is behind the first: so that those of a swarm do not
/// all speak at once, but so many of them together that each wake-up is worth it.
const PHASES: u32 = 8;

impl Schedule {
    /// All begin at `now`, but for this phase.
    pub(super) fn new(rate: u16, phase: usize, now: Time) -> Self {
        // Below PHASES.
        let phase = (phase % PHASES as usize) as u32;
        let entry = |stream: Stream| {
            let interval = stream.interval(rate);
            (Some(interval), now + interval * phase / PHASES)
        };
        Self { rate, entries: Stream::ALL.map(entry) }
    }

    /// When the next one is due.
    pub(super) fn next_due(&self) -> Option<Time> {
        let sent = self.entries.iter().filter(|(interval, _)| interval.is_some());
        sent.map(|(_, due)| *due).min()
    }

    /// A message that is due, if there is one. What was missed is not made up for.
    pub(super) fn poll(&mut self, now: Time) -> Option<Stream> {
        let due = |entry: &(Option<Duration>, Time)| entry.0.is_some() && entry.1 <= now;
        let at = self.entries.iter().position(due)?;
        let (interval, next) = &mut self.entries[at];
        let interval = (*interval)?;
        *next = *next + interval;
        if *next <= now {
            *next = now + interval;
        }
        Some(Stream::ALL[at])
    }

    /// How often a message is sent; `None`: not at all.
    pub(super) fn interval(&self, stream: Stream) -> Option<Duration> {
        self.entries[place(stream)].0
    }

    /// SET_MESSAGE_INTERVAL: so many microseconds, 0 for what is usual, below 0 for never. Says
    /// whether that can be.
    pub(super) fn set(&mut self, stream: Stream, interval_us: f32, now: Time) -> bool {
        let interval = if interval_us == 0.0 {
            Some(stream.interval(self.rate))
        } else if interval_us < 0.0 {
            // Who is silent is not there.
            if stream == Stream::Heartbeat {
                return false;
            }
            None
        } else {
            let interval = Duration::from_micros(interval_us as u64);
            if !(SHORTEST..=LONGEST).contains(&interval) {
                return false;
            }
            Some(interval)
        };
        self.entries[place(stream)] = (interval, interval.map_or(now, |interval| now + interval));
        true
    }
}

/// The place of a stream in [`Stream::ALL`].
fn place(stream: Stream) -> usize {
    stream as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_message_comes_as_often_as_it_should() {
        let mut schedule = Schedule::new(10, 3, Time::ZERO);
        let mut counts = [0; COUNT];
        for millis in 0..10_000 {
            while let Some(stream) = schedule.poll(Time::from_millis(millis)) {
                counts[place(stream)] += 1;
            }
        }
        assert_eq!(counts, [10, 10, 10, 20, 100, 100, 100]);
        assert!(Stream::ALL.iter().enumerate().all(|(at, stream)| place(*stream) == at));
    }

    #[test]
    fn what_was_missed_is_not_made_up_for() {
        let mut schedule = Schedule::new(10, 0, Time::ZERO);
        let late = Time::from_millis(60_000);
        assert_eq!(std::iter::from_fn(|| schedule.poll(late)).count(), COUNT);
    }

    #[test]
    fn an_interval_can_be_asked_for() {
        let mut schedule = Schedule::new(4, 0, Time::ZERO);
        for (interval, is_taken) in [(1e4, true), (9e3, false), (-1.0, true), (f32::NAN, false)] {
            assert_eq!(schedule.set(Stream::Attitude, interval, Time::ZERO), is_taken);
        }
        assert_eq!(schedule.interval(Stream::Attitude), None);
        assert!(schedule.set(Stream::Attitude, 0.0, Time::ZERO));
        assert_eq!(schedule.interval(Stream::Attitude), Some(Duration::from_millis(250)));
        assert!(!schedule.set(Stream::Heartbeat, -1.0, Time::ZERO), "it never falls silent");
    }
}
