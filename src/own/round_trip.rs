//! How long a question takes to whoever is on a link, and its answer back.
//!
//! A link is asked by TIMESYNC, which most of today's components answer, and by PING in turns with it
//! as long as nobody answers. Where nobody ever does, it is asked less and less often. An answer is
//! known by the number that it brings back, whoever sends it.

use std::collections::BTreeMap;
use std::time::Duration;

use super::Place;
use crate::routing::{LinkId, Time};

/// How often whoever answers is asked, in seconds.
const PERIOD: u32 = 2;

/// After so many questions without an answer nothing is known any more.
const GIVE_UP: u32 = 5;

/// As a power of two: how many seconds at most pass between two questions that nobody answers.
const LONGEST: u32 = 6;

/// How many questions of a link may be open: an answer by satellite comes after the next question.
const OPEN: usize = 4;

/// How long it took.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RoundTrip {
    /// The last time.
    pub last: Duration,
    /// Of late: each time counts an eighth.
    pub smoothed: Duration,
}

/// What is asked, and by which number its answer is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Question {
    Timesync { ts1: i64 },
    Ping { seq: u32 },
}

/// What an answer brings back.
pub(super) type Answer = Question;

/// All links that are asked.
#[derive(Default, Debug)]
pub(super) struct RoundTrips {
    trips: BTreeMap<LinkId, Trip>,
    /// The last numbers that were used: each is used once.
    ts1: i64,
    seq: u32,
}

#[derive(Debug)]
struct Trip {
    since: Time,
    is_ping: bool,
    /// The newest first.
    open: [Option<(Question, Time)>; OPEN],
    /// How many questions in a row were not answered before the next one.
    misses: u32,
    /// How many seconds are left until the next question.
    pause: u32,
    result: Option<RoundTrip>,
}

impl RoundTrips {
    /// Called once a second: what to ask a link now, if anything.
    pub(super) fn ask(&mut self, place: Place, now: Time) -> Option<Question> {
        let trip = self.trips.entry(place.link).or_insert_with(|| Trip::new(place.since));
        if trip.since != place.since {
            *trip = Trip::new(place.since);
        }
        if trip.pause > 1 {
            trip.pause -= 1;
            return None;
        }
        if trip.open[0].is_some() {
            trip.handle_miss();
        }
        trip.pause = trip.period();
        let question = if trip.is_ping {
            self.seq = self.seq.wrapping_add(1);
            Question::Ping { seq: self.seq }
        } else {
            self.ts1 = now.as_nanos().max(self.ts1 + 1);
            Question::Timesync { ts1: self.ts1 }
        };
        trip.open.rotate_right(1);
        trip.open[0] = Some((question, now));
        Some(question)
    }

    /// Somebody answers.
    pub(super) fn handle(&mut self, answer: Answer, now: Time) {
        for trip in self.trips.values_mut() {
            let is_its = |open: &&mut Option<(Question, Time)>| {
                open.is_some_and(|(question, _)| question == answer)
            };
            if let Some((_, asked)) = trip.open.iter_mut().find(is_its).and_then(Option::take) {
                trip.is_ping = matches!(answer, Question::Ping { .. });
                return trip.handle_answer(now.since(asked));
            }
        }
    }

    /// Forgets all other links.
    pub(super) fn retain(&mut self, is_there: impl Fn(Place) -> bool) {
        self.trips.retain(|link, trip| is_there(Place { link: *link, since: trip.since }));
    }

    /// What is known of a link.
    pub(super) fn get(&self, place: Place) -> Option<RoundTrip> {
        let trip = self.trips.get(&place.link).filter(|trip| trip.since == place.since);
        trip.and_then(|trip| trip.result)
    }
}

impl Trip {
    fn new(since: Time) -> Self {
        Self { since, is_ping: false, open: [None; OPEN], misses: 0, pause: 0, result: None }
    }

    fn handle_miss(&mut self) {
        self.misses = self.misses.saturating_add(1);
        self.is_ping = !self.is_ping;
        if self.misses >= GIVE_UP {
            self.result = None;
        }
    }

    fn handle_answer(&mut self, took: Duration) {
        self.misses = 0;
        let smoothed = self.result.map_or(took, |before| (before.smoothed * 7 + took) / 8);
        self.result = Some(RoundTrip { last: took, smoothed });
    }

    /// How many seconds pass until the next question.
    fn period(&self) -> u32 {
        match self.result {
            Some(_) => PERIOD,
            // Twice for each way of asking.
            None => 1 << (self.misses / 2).min(LONGEST),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(number: usize) -> Place {
        Place { link: LinkId::new(number).unwrap(), since: Time::ZERO }
    }

    fn second(n: u64) -> Time {
        Time::from_millis(n * 1_000)
    }

    #[test]
    fn an_answer_counts_for_the_link_that_was_asked() {
        let mut trips = RoundTrips::default();
        let (a, b) = (place(0), place(1));
        let question = trips.ask(a, second(1)).unwrap();
        let other = trips.ask(b, second(1)).unwrap();
        assert_ne!(question, other);
        trips.handle(other, Time::from_millis(1_040));
        trips.handle(other, Time::from_millis(1_900));
        let took = Duration::from_millis(40);
        assert_eq!(trips.get(b), Some(RoundTrip { last: took, smoothed: took }));
        assert_eq!(trips.get(a), None);
    }

    #[test]
    fn each_time_counts_an_eighth() {
        let mut trips = RoundTrips::default();
        for (n, took) in [(2, 80), (4, 160)] {
            let question = trips.ask(place(0), second(n)).unwrap();
            trips.handle(question, second(n) + Duration::from_millis(took));
            let waits = trips.ask(place(0), second(n + 1));
            assert_eq!(waits.is_none(), n > 2, "once somebody answers, every other second");
            if let Some(question) = waits {
                trips.handle(question, second(n + 1) + Duration::from_millis(80));
                assert!(trips.ask(place(0), second(n + 1)).is_none());
            }
        }
        let result = trips.get(place(0)).unwrap();
        assert_eq!(result.last, Duration::from_millis(160));
        assert_eq!(result.smoothed, Duration::from_millis(90));
    }

    #[test]
    fn where_nobody_answers_both_ways_are_tried_less_and_less_often() {
        let mut trips = RoundTrips::default();
        let asked = (0..600).filter_map(|n| Some((n, trips.ask(place(0), second(n))?)));
        let asked: Vec<_> = asked.collect();
        let when: Vec<_> = asked.iter().map(|(n, _)| *n).collect();
        assert_eq!(when[..8], [0, 1, 2, 4, 6, 10, 14, 22]);
        assert!(when.windows(2).skip(12).all(|it| it[1] - it[0] == 64), "{when:?}");
        let are_pings: Vec<_> =
            asked[..4].iter().map(|(_, it)| matches!(it, Question::Ping { .. })).collect();
        assert_eq!(are_pings, [false, true, false, true]);
    }

    #[test]
    fn an_answer_that_comes_after_the_next_question_counts() {
        let mut trips = RoundTrips::default();
        let first = trips.ask(place(0), second(0)).unwrap();
        let next = trips.ask(place(0), second(1)).unwrap();
        trips.handle(first, Time::from_millis(1_500));
        assert_eq!(trips.get(place(0)).unwrap().last, Duration::from_millis(1_500));
        trips.handle(next, Time::from_millis(2_500));
        assert_eq!(trips.get(place(0)).unwrap().last, Duration::from_millis(1_500));
    }

    #[test]
    fn who_falls_silent_is_nowhere() {
        let mut trips = RoundTrips::default();
        let question = trips.ask(place(0), second(0)).unwrap();
        trips.handle(question, second(0));
        assert!(trips.get(place(0)).is_some());
        for n in 1..40 {
            trips.ask(place(0), second(n));
        }
        assert_eq!(trips.get(place(0)), None);
    }

    #[test]
    fn another_link_with_the_same_number_begins_anew() {
        let mut trips = RoundTrips::default();
        let question = trips.ask(place(0), second(0)).unwrap();
        trips.handle(question, second(0));
        let later = Place { since: second(5), ..place(0) };
        assert_eq!(trips.get(later), None);
        assert!(trips.ask(later, second(6)).is_some());
        assert_eq!(trips.get(place(0)), None);
        trips.retain(|_| false);
        assert!(trips.trips.is_empty());
    }
}
