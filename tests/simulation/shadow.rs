//! What must be true of one router, whatever comes: the rules, kept with plain sets and lists.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use mavswitch::mavlink::{CheckedFrame, Component, Header};
use mavswitch::routing::{DropReason, LinkCounters, LinkId, LinkOptions, Router, Time};

use crate::copies::{Copies, Way};
use crate::kinds::{carried_at_most, permits, room, widen};

/// A router, and what is remembered of it.
pub(crate) struct Watched {
    pub(crate) router: Router,
    number: usize,
    lines: Vec<Line>,
    copies: Copies,
}

/// A link.
struct Line {
    link: LinkId,
    options: LinkOptions,
    way: Way,
    opened: Time,
    /// Who was heard here since it is open (rule 35).
    heard: Vec<Heard>,
    /// What waits, in the order in which it must leave (rule 42), and how many bytes that is.
    waiting: VecDeque<Parcel>,
    backlog: usize,
    /// How many bytes have left.
    carried: usize,
}

/// A frame, and the routers that have passed it on.
pub(crate) type Parcel = (Vec<u8>, Vec<usize>);

/// A frame comes in over a link.
pub(crate) struct Arrival<'a> {
    pub(crate) link: LinkId,
    pub(crate) frame: &'a CheckedFrame<'a>,
    /// The routers that have passed it on.
    pub(crate) trail: &'a [usize],
    pub(crate) now: Time,
}

struct Heard {
    who: Component,
    /// Whether frames for it are sent there.
    is_route: bool,
    /// When its last broadcast came; and the same, if no frame came since that had come elsewhere.
    broadcast: Option<Time>,
    first: Option<Time>,
}

/// For so long a broadcast does not go to a link that brought one of the same source (rule 49).
const LOOP: Duration = Duration::from_secs(5);

/// So often a frame may be passed on by the same router where it was held back on the way.
const LAPS: usize = 6;

/// What became of a frame on a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Outcome {
    Sent,
    Refused(DropReason),
}

impl Watched {
    pub(crate) fn new(router: Router, number: usize) -> Self {
        Self { router, number, lines: Vec::new(), copies: Copies::new() }
    }

    /// A new link.
    pub(crate) fn open(&mut self, options: LinkOptions, now: Time) -> LinkId {
        let link = self.router.add_link(options.clone(), now).unwrap();
        let way = self.copies.open(&options, now);
        assert!(self.lines.iter().all(|line| line.link != link), "{link} is given twice");
        let (heard, waiting) = (Vec::new(), VecDeque::new());
        let (opened, backlog, carried) = (now, 0, 0);
        self.lines.push(Line { link, options, way, opened, heard, waiting, backlog, carried });
        link
    }

    pub(crate) fn close(&mut self, link: LinkId, now: Time) {
        self.router.remove_link(link);
        self.copies.close(self.line(link).way, now);
        self.lines.retain(|line| line.link != link);
    }

    /// From now on there is room for everything on each link.
    pub(crate) fn widen(&mut self, now: Time) {
        for line in &mut self.lines {
            widen(&mut line.options);
            self.router.set_link_options(line.link, line.options.clone(), now);
        }
    }

    fn line(&self, link: LinkId) -> &Line {
        self.lines.iter().find(|line| line.link == link).unwrap()
    }

    fn line_mut(&mut self, link: LinkId) -> &mut Line {
        self.lines.iter_mut().find(|line| line.link == link).unwrap()
    }

    /// A frame comes in; checks where it goes, and that all of it is counted.
    pub(crate) fn handle(&mut self, arrival: &Arrival<'_>) {
        let Arrival { link, frame, trail, now } = *arrival;
        let before = self.counters();
        self.router.handle(link, frame, now);
        let after = self.counters();
        let counted = outcomes(link, &before, &after);

        if !permits(&self.line(link).options.filter_in, &frame.header) {
            let refused = [(link, Outcome::Refused(DropReason::FilteredIn))];
            assert_eq!(counted, refused, "a list keeps it out");
            return;
        }
        let is_copy = counted == [(link, Outcome::Refused(DropReason::Duplicate))];
        let way = self.line(link).way;
        let came_elsewhere = self.copies.came_elsewhere(way, frame.bytes);
        self.copies.check(way, frame, !is_copy, now);
        self.learn(arrival, is_copy, came_elsewhere);
        if !is_copy {
            self.check_destinations(arrival, counted);
            let laps = trail.iter().filter(|router| **router == self.number).count();
            assert!(laps < LAPS, "rule 49: passed on after {laps} laps, {trail:?}");
        }
    }

    /// Rule 35: who speaks is there; rule 50: not if it is a copy where the user wants none, but for
    /// groups, which are one way.
    fn learn(&mut self, arrival: &Arrival<'_>, is_copy: bool, came_elsewhere: bool) {
        let Arrival { link, frame, now, .. } = *arrival;
        let line = self.line_mut(link);
        let wants_none = line.options.dedup.is_some() && line.options.membership.is_none();
        let who = frame.header.source;
        if line.heard(who).is_none() {
            line.heard.push(Heard { who, is_route: false, broadcast: None, first: None });
        }
        let heard = line.heard.iter_mut().find(|heard| heard.who == who).unwrap();
        heard.is_route |= !(is_copy && wants_none);
        if frame.target.system == 0 {
            (heard.broadcast, heard.first) = (Some(now), Some(now));
        }
        if came_elsewhere {
            heard.first = None;
        }
    }

    /// Rules 33, 34 and 36-39: to everybody, or to where the target was heard, and never back. Each
    /// link that it is meant for gets it once, or says why not; the others do not.
    fn check_destinations(&mut self, arrival: &Arrival<'_>, mut counted: Vec<(LinkId, Outcome)>) {
        let Arrival { link, frame, trail, now } = *arrival;
        let is_broadcast = frame.target.system == 0;
        let mut take = |id, outcome| {
            let place = counted.iter().position(|it| *it == (id, outcome));
            place.map(|place| counted.swap_remove(place)).is_some()
        };
        let mut meant = self.meant_for(frame.target);
        meant.retain(|id| !self.is_same_way(link, *id));
        if meant.is_empty() && !is_broadcast {
            let is_told = take(link, Outcome::Refused(DropReason::NoRoute));
            assert!(is_told, "nobody is there, and nothing was counted");
        }
        let (mut muted, mut explained) = (Vec::new(), Vec::new());
        for id in meant {
            let (must_be, may_be) = self.loops(id, frame.header.source, now);
            let outcome = self.outcome(id, &frame.header, frame.bytes.len());
            if is_broadcast && must_be || !take(id, outcome) {
                assert!(is_broadcast && may_be, "{id}, for {}: not {outcome:?}", frame.target);
                muted.push(id);
            } else if outcome == Outcome::Sent {
                let parcel = (frame.bytes.to_vec(), [trail, &[self.number]].concat());
                let line = self.line_mut(id);
                line.backlog += parcel.0.len();
                line.waiting.push_back(parcel);
            }
        }
        for id in muted {
            let is_loop = |(other, outcome): &(LinkId, Outcome)| {
                *outcome == Outcome::Refused(DropReason::Loop) && self.is_same_way(*other, id)
            };
            explained.extend(counted.extract_if(.., |it| is_loop(it)));
            assert!(explained.iter().any(is_loop), "{id} is left out, and nothing was counted");
        }
        assert_eq!(counted, [], "from {link}, for {}: what should not be", frame.target);
    }

    /// Rules 33 and 36-38, lists and loops aside.
    fn meant_for(&self, target: Component) -> Vec<LinkId> {
        let of_system = || self.links_with(|who| who.system == target.system);
        if target.system == 0 {
            return self.lines.iter().map(|line| line.link).collect();
        }
        let exact = self.links_with(|who| *who == target);
        if exact.is_empty() { of_system() } else { exact }
    }

    /// The links that lead to somebody, and those that lead the same way.
    fn links_with(&self, is_meant: impl Fn(&Component) -> bool) -> Vec<LinkId> {
        let leads = |line: &&Line| line.heard.iter().any(|it| it.is_route && is_meant(&it.who));
        let found: Vec<&Line> = self.lines.iter().filter(leads).collect();
        let leads_there = |line: &&Line| found.iter().any(|it| it.is_beside(line));
        self.lines.iter().filter(leads_there).map(|line| line.link).collect()
    }

    /// Rule 49: whether a broadcast must be kept off a link, and whether it may be: its source was
    /// just heard there, or by the same way.
    fn loops(&self, id: LinkId, source: Component, now: Time) -> (bool, bool) {
        let own = self.line(id);
        let lines = || self.lines.iter().filter(|line| line.is_beside(own));
        let heard = || lines().filter_map(|line| line.heard(source));
        let is_recent = |at: Option<Time>| at.is_some_and(|at| now.since(at) < LOOP);
        let must_be = heard().any(|heard| is_recent(heard.first));
        (must_be, heard().any(|heard| is_recent(heard.broadcast)))
    }

    /// Rule 43: what becomes of a frame that is meant for a link.
    fn outcome(&self, id: LinkId, header: &Header, len: usize) -> Outcome {
        let line = self.line(id);
        if !permits(&line.options.filter_out, header) {
            Outcome::Refused(DropReason::FilteredOut)
        } else if line.backlog + len > room(line.options.capacity, header.id) {
            Outcome::Refused(DropReason::QueueFull)
        } else {
            Outcome::Sent
        }
    }

    /// Whether two links are one, or of one group: they lead the same way.
    fn is_same_way(&self, one: LinkId, other: LinkId) -> bool {
        self.line(one).is_beside(self.line(other))
    }

    fn counters(&self) -> Vec<(LinkId, LinkCounters)> {
        let links = self.router.links();
        links.iter().map(|link| (link, *self.router.counters(link).unwrap())).collect()
    }

    /// What waits for a link leaves, as far as its pace allows.
    pub(crate) fn flush(&mut self, link: LinkId, now: Time) -> Vec<Parcel> {
        let port = self.router.port_mut(link).unwrap();
        let count = port.sendable(now);
        let (first, second) = port.head(count);
        let bytes = [first, second].concat();
        port.consume(count);
        let line = self.line_mut(link);
        line.backlog -= count;
        let (mut parcels, mut left) = (Vec::new(), &bytes[..]);
        while !left.is_empty() {
            let parcel = line.waiting.pop_front().expect("nothing leaves that did not come");
            left = left.strip_prefix(&parcel.0[..]).expect("rule 42: whole, and in order");
            parcels.push(parcel);
        }
        line.carried += count;
        let most = carried_at_most(line.options.capacity, now.since(line.opened));
        assert!(line.carried <= most, "{} bytes left, and its pace is {most}", line.carried);
        assert!(most < usize::MAX || line.waiting.is_empty(), "what was taken leaves");
        parcels
    }

    /// The links for which something waits.
    pub(crate) fn with_frames(&self) -> Vec<LinkId> {
        let waiting = self.lines.iter().filter(|line| line.backlog > 0);
        waiting.map(|line| line.link).collect()
    }

    /// Routes are only where somebody was heard, and wherever somebody was; what waits is what was
    /// taken and has not left.
    pub(crate) fn check_tables(&self) {
        let known = self.router.table().components().iter();
        let known = known.flat_map(|known| {
            let routes = known.heard.iter().filter(|heard| heard.is_route);
            routes.map(|heard| (heard.link.index(), known.component))
        });
        let heard = self.lines.iter().flat_map(|line| {
            let routes = line.heard.iter().filter(|heard| heard.is_route);
            routes.map(|heard| (line.link.index(), heard.who))
        });
        let (known, heard): (BTreeSet<_>, BTreeSet<_>) = (known.collect(), heard.collect());
        assert_eq!(known, heard, "rule 35: who was heard where");
        for line in &self.lines {
            let backlog = self.router.port(line.link).unwrap().backlog();
            assert_eq!(backlog, line.backlog, "what waits for {}", line.link);
        }
    }
}

impl Line {
    fn heard(&self, who: Component) -> Option<&Heard> {
        self.heard.iter().find(|heard| heard.who == who)
    }

    /// Whether two links are one, or of one group.
    fn is_beside(&self, other: &Self) -> bool {
        let group = |line: &Self| line.options.membership.map(|membership| membership.group);
        self.link == other.link || group(self).is_some() && group(self) == group(other)
    }
}

/// What was counted on which link, once for each time, but that the frame came, once, over one.
fn outcomes(
    link: LinkId,
    before: &[(LinkId, LinkCounters)],
    after: &[(LinkId, LinkCounters)],
) -> Vec<(LinkId, Outcome)> {
    let mut outcomes = Vec::new();
    for ((id, before), (_, after)) in before.iter().zip(after).filter(|(one, two)| one != two) {
        assert!(*id == link || before.frames_in == after.frames_in, "it came over {link}");
        let sent = after.frames_out - before.frames_out;
        outcomes.extend((0..sent).map(|_| (*id, Outcome::Sent)));
        for reason in DropReason::ALL {
            let refused = after[reason] - before[reason];
            outcomes.extend((0..refused).map(|_| (*id, Outcome::Refused(reason))));
        }
    }
    outcomes
}
