//! Which frames may be passed on that came before, and which may be refused for that (rule 49).
//!
//! The rules ask that nothing goes round and that what is meant gets through; the windows are those
//! that the README promises.

use std::time::Duration;

use foldhash::{HashMap, HashMapExt};
use mavswitch::mavlink::{CheckedFrame, Component, Header};
use mavswitch::routing::{GroupId, LinkOptions, Time};

/// A link for as long as it lives, by the number that it has here and never shares.
pub(crate) type Way = usize;

/// What came by which way, at one router.
pub(crate) struct Copies {
    ways: Vec<WayState>,
    frames: HashMap<Vec<u8>, Vec<Arrival>>,
    /// The last number of each source by each way, and whether there was another one.
    numbers: HashMap<(Way, Component), (u8, bool)>,
}

struct WayState {
    group: Option<GroupId>,
    dedup: Option<Duration>,
    opened: Time,
    closed: Option<Time>,
}

#[derive(Clone, Copy)]
struct Arrival {
    way: Way,
    at: Time,
    is_passed: bool,
}

/// What comes by another way within this time went round.
const RING: Duration = Duration::from_secs(2);

/// What comes by another way later than this is new.
const FORGOTTEN: Duration = Duration::from_secs(30);

/// So much longer one link of a group may take than another.
const IN_GROUP: Duration = Duration::from_millis(500);

impl Copies {
    pub(crate) fn new() -> Self {
        Self { ways: Vec::new(), frames: HashMap::new(), numbers: HashMap::new() }
    }

    pub(crate) fn open(&mut self, options: &LinkOptions, now: Time) -> Way {
        let group = options.membership.map(|membership| membership.group);
        self.ways.push(WayState { group, dedup: options.dedup, opened: now, closed: None });
        self.ways.len() - 1
    }

    pub(crate) fn close(&mut self, way: Way, now: Time) {
        self.ways[way].closed = Some(now);
    }

    /// Whether the frame came by another way before, as far as that matters.
    pub(crate) fn came_elsewhere(&self, way: Way, bytes: &[u8]) -> bool {
        let arrivals = self.frames.get(bytes);
        arrivals.is_some_and(|arrivals| arrivals.iter().any(|arrival| arrival.way != way))
    }

    /// A frame came, and was passed on or refused as a copy.
    pub(crate) fn check(&mut self, way: Way, frame: &CheckedFrame<'_>, is_passed: bool, now: Time) {
        let before = self.frames.get(frame.bytes).map_or(&[][..], Vec::as_slice);
        let Header { source, seq, .. } = frame.header;
        match is_passed {
            // Who counts nothing may be saying the same again.
            true if !self.counts(source, seq) => {}
            true => self.check_passed(way, before, now),
            false => check_refused(way, before),
        }
        let arrival = Arrival { way, at: now, is_passed };
        self.frames.entry(frame.bytes.to_vec()).or_default().push(arrival);
        let (number, counts) = self.numbers.entry((way, source)).or_insert((seq, false));
        *counts |= *number != seq;
        *number = seq;
    }

    /// Whether a source was heard with another number over any link that is open.
    fn counts(&self, source: Component, seq: u8) -> bool {
        let is_open = |way: Way| self.ways[way].closed.is_none();
        let mut numbers =
            self.numbers.iter().filter(|((way, who), _)| *who == source && is_open(*way));
        numbers.any(|(_, (number, counts))| *counts || *number != seq)
    }

    /// What comes again is news over the same link, or over one beside it after a while. Over another
    /// one it is a copy, as long as the first one is open and was in use a moment ago; and what is
    /// taken for news all the same, as it is late, is so once.
    fn check_passed(&self, way: Way, before: &[Arrival], now: Time) {
        let passed = || before.iter().filter(|arrival| arrival.is_passed);
        let Some(last) = passed().next_back() else { return };
        let is_elsewhere = |arrival: &&Arrival| !self.is_beside(arrival.way, before[0].way);
        let was_displaced = passed().any(|arrival| is_elsewhere(&arrival));
        if way == last.way && !was_displaced {
            return;
        }
        let is_open = self.ways[last.way].closed.is_none();
        let age = now.since(last.at);
        let window = self.window(way, last.way);
        assert!(!is_open || age >= window, "rule 49: {age:?} after it came by another way");
        if self.is_beside(way, before[0].way) && !was_displaced {
            return;
        }
        let is_late = |arrival: &&Arrival| now.since(arrival.at) < FORGOTTEN;
        let again = passed().skip_while(|arrival| !is_elsewhere(arrival)).filter(is_late).count();
        let changes = self.changes_since(before[0].at);
        assert!(
            again <= changes + 1,
            "rule 49: passed on {again} times as late, and {changes} changes"
        );
    }

    /// Whether two links are one, or of one group.
    fn is_beside(&self, one: Way, other: Way) -> bool {
        let group = |way: Way| self.ways[way].group;
        one == other || group(one).is_some() && group(one) == group(other)
    }

    fn window(&self, way: Way, first: Way) -> Duration {
        let dedup = self.ways[way].dedup;
        if self.is_beside(way, first) { dedup.unwrap_or(IN_GROUP) } else { RING }
    }

    /// How many links came and went since.
    fn changes_since(&self, since: Time) -> usize {
        let is_new = |way: &WayState| usize::from(way.opened >= since);
        let is_gone = |way: &WayState| usize::from(way.closed.is_some_and(|at| at >= since));
        self.ways.iter().map(|way| is_new(way) + is_gone(way)).sum()
    }
}

/// Only what came by another way is a copy: what its own link says again is news each time.
fn check_refused(way: Way, before: &[Arrival]) {
    let mut passed = before.iter().filter(|arrival| arrival.is_passed);
    let came_elsewhere = passed.any(|arrival| arrival.way != way);
    assert!(came_elsewhere, "rule 49: refused as a copy, and it came nowhere else");
}
