//! Routers, cables, components, and a clock that jumps from one event to the next.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};
use std::time::Duration;

use mavswitch::mavlink::{Component, Input, Version};
use mavswitch::routing::{LinkId, LinkOptions, MAX_HEARD, Router, RouterOptions, Time};

use crate::frames::{Random, Receiver, frame};
use crate::shadow::Watched;

/// One end of a cable, or the link of a component: which router, and which link of it.
type End = (usize, LinkId);

/// Two routers, and the ends of the cable between them while it is plugged in.
struct Cable {
    routers: [usize; 2],
    ends: Option<[End; 2]>,
    /// In milliseconds.
    delay: u64,
    loss_percent: usize,
    doubled_percent: usize,
}

/// Somebody who speaks, and where.
struct Speaker {
    me: Component,
    at: End,
    seq: u8,
}

pub(crate) struct World {
    random: Random,
    now: Time,
    routers: Vec<Watched>,
    cables: Vec<Cable>,
    speakers: Vec<Speaker>,
    /// What is on its way, by the time of its arrival and then in the order of sending.
    on_the_way: BinaryHeap<Reverse<OnTheWay>>,
    receiver: Receiver,
    /// What came out, how often, and where.
    arrived: HashMap<(Vec<u8>, Component), usize>,
    pub(crate) tally: Tally,
}

/// How much happened.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Tally {
    pub(crate) sent: u64,
    pub(crate) carried: u64,
}

/// When a frame arrives, in which order of those that arrive then, and where.
type OnTheWay = (Time, u64, End, Vec<u8>);

/// What must arrive: the frame, and with whom.
type Expected = Vec<(Vec<u8>, Vec<Component>)>;

/// Everybody speaks so often.
const PERIOD: Duration = Duration::from_millis(200);

/// In periods: how long things go wrong; how long a source is kept off links at most, and some more,
/// as the delays add up; and how long all must go well.
const ROUGH: u32 = 40;
const SETTLING: u32 = 30;
const QUIET: u32 = 8;

impl World {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let now = Time::from_millis(1_000_000);
        let count = 1 + random.below(5);
        let router = |_| Watched::new(Router::new(RouterOptions::default()));
        let mut world = Self {
            routers: (0..count).map(router).collect(),
            cables: Vec::new(),
            speakers: Vec::new(),
            on_the_way: BinaryHeap::new(),
            receiver: Receiver::new(),
            arrived: HashMap::new(),
            tally: Tally::default(),
            random,
            now,
        };
        (1..count).for_each(|router| world.lay_cable(router));
        for _ in 0..world.random.below(5) * usize::from(count > 1) {
            let router = 1 + world.random.below(count - 1);
            world.lay_cable(router);
        }
        for number in 0..2 + world.random.below(4) as u8 {
            let me = Component::new(1 + number / 2, 1 + number % 2);
            let at = world.random.below(count);
            let at = world.open(at);
            world.speakers.push(Speaker { me, at, seq: number });
        }
        world
    }

    /// From a router to one before it: with one such cable each, all are joined.
    fn lay_cable(&mut self, router: usize) {
        let other = self.random.below(router);
        let cable = Cable {
            routers: [router, other],
            ends: None,
            delay: 1 + self.random.below(40) as u64,
            loss_percent: self.random.below(30),
            doubled_percent: self.random.below(10),
        };
        self.cables.push(cable);
        self.plug(self.cables.len() - 1);
    }

    fn open(&mut self, router: usize) -> End {
        let watched = &mut self.routers[router];
        let link = watched.router.add_link(LinkOptions::default(), self.now).unwrap();
        watched.open(link);
        (router, link)
    }

    /// What is on its way there is lost: the link's number may be given to another one.
    fn close(&mut self, end: End) {
        self.routers[end.0].close(end.1);
        self.on_the_way.retain(|Reverse((_, _, to, _))| *to != end);
    }

    fn plug(&mut self, cable: usize) {
        if self.cables[cable].ends.is_none() {
            let ends = self.cables[cable].routers.map(|router| self.open(router));
            self.cables[cable].ends = Some(ends);
        }
    }

    fn unplug(&mut self, cable: usize) {
        let ends = self.cables[cable].ends.take();
        ends.into_iter().flatten().for_each(|end| self.close(end));
    }

    /// Things go wrong; then all is well again, and must be.
    pub(crate) fn run(mut self) -> Tally {
        for _ in 0..ROUGH {
            self.mishap();
            self.speak();
        }
        (0..self.cables.len()).for_each(|cable| self.plug(cable));
        for cable in &mut self.cables {
            (cable.loss_percent, cable.doubled_percent) = (0, 0);
        }
        (0..SETTLING).for_each(|_| drop(self.speak()));
        let expected: Expected = (0..QUIET).flat_map(|_| self.speak()).collect();
        // Each router on the way may hold it back for a period.
        (0..=self.routers.len()).for_each(|_| self.pass(PERIOD));
        self.check_arrivals(&expected);
        self.check_bounds();
        self.tally
    }

    /// Something happens to a cable or a component, now and then.
    fn mishap(&mut self) {
        let cable = self.random.below(self.cables.len().max(1));
        match self.random.below(8) {
            0 if !self.cables.is_empty() => self.unplug(cable),
            1 | 2 if !self.cables.is_empty() => self.plug(cable),
            3 => {
                let who = self.random.below(self.speakers.len());
                self.close(self.speakers[who].at);
                let at = self.random.below(self.routers.len());
                self.speakers[who].at = self.open(at);
            }
            _ => {}
        }
    }

    /// Everybody says something, and a period passes; what was said, and who must hear it.
    fn speak(&mut self) -> Expected {
        let mut said = Vec::new();
        for who in 0..self.speakers.len() {
            let whom = self.random.below(self.speakers.len() + 2);
            let whom = self.speakers.get(whom).map(|speaker| speaker.me);
            self.tally.sent += 1;
            let number = self.tally.sent as u32;
            let speaker = &mut self.speakers[who];
            speaker.seq = speaker.seq.wrapping_add(1);
            let (me, at) = (speaker.me, speaker.at);
            let bytes = message(me, speaker.seq, whom, number);
            self.on_the_way.push(Reverse((self.now, u64::from(number), at, bytes.clone())));
            let others = self.speakers.iter().filter(|other| other.at != at);
            let hears = |other: &&Speaker| whom.is_none_or(|whom| whom == other.me);
            said.push((bytes, others.filter(hears).map(|other| other.me).collect()));
        }
        self.pass(PERIOD);
        said
    }

    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(Reverse((due, _, _, _))) = self.on_the_way.peek()
            && *due < end
        {
            let Reverse((due, _, (router, link), bytes)) = self.on_the_way.pop().unwrap();
            self.now = self.now.max(due);
            let (watched, now) = (&mut self.routers[router], self.now);
            self.receiver.each(&bytes, Input::Paused, |frame| watched.handle(link, frame, now));
            // Sometimes several frames wait before any leaves.
            if self.random.below(3) > 0 {
                self.flush(router);
            }
        }
        (0..self.routers.len()).for_each(|router| self.flush(router));
        self.now = end;
    }

    fn flush(&mut self, router: usize) {
        let dirty: Vec<LinkId> = self.routers[router].router.take_dirty().iter().collect();
        for link in dirty {
            for bytes in self.routers[router].flush(link) {
                self.carry((router, link), bytes);
            }
        }
    }

    /// A frame leaves a router: to whoever is at that link, or over the cable.
    fn carry(&mut self, from: End, bytes: Vec<u8>) {
        if let Some(speaker) = self.speakers.iter().find(|speaker| speaker.at == from) {
            *self.arrived.entry((bytes, speaker.me)).or_default() += 1;
            return;
        }
        self.tally.carried += 1;
        let is_here = |cable: &&Cable| cable.ends.is_some_and(|ends| ends.contains(&from));
        let cable = self.cables.iter().find(is_here).expect("a cable at every other link");
        let to = cable.ends.unwrap().into_iter().find(|end| *end != from).unwrap();
        let due = self.now + Duration::from_millis(cable.delay);
        let chance = self.random.below(100);
        let copies = match chance {
            _ if chance < cable.loss_percent => 0,
            _ if chance >= 100 - cable.doubled_percent => 2,
            _ => 1,
        };
        for copy in 0..copies {
            // In the order of sending, as nothing overtakes on a cable; the doubled one at once.
            let order = self.tally.carried * 2 + copy + (1 << 40);
            self.on_the_way.push(Reverse((due, order, to, bytes.clone())));
        }
    }

    /// All that was said arrived once with everybody who should hear it, and with nobody else.
    fn check_arrivals(&self, expected: &Expected) {
        for (bytes, hearers) in expected {
            let mut heard = BTreeMap::new();
            for speaker in &self.speakers {
                let count = self.arrived.get(&(bytes.clone(), speaker.me));
                heard.extend(count.map(|count| (speaker.me, *count)));
            }
            let wanted: BTreeMap<_, _> = hearers.iter().map(|who| (*who, 1)).collect();
            assert_eq!(heard, wanted, "who heard it how often, and who should, all being well");
        }
    }

    /// Nothing grows: everybody is known at most once for each link there is.
    fn check_bounds(&self) {
        for watched in &self.routers {
            let components = watched.router.table().components();
            let links = watched.router.links().len();
            assert!(components.len() <= self.speakers.len(), "only those who spoke are known");
            assert!(components.iter().all(|known| known.heard.len() <= links));
            assert!(components.len() * links <= MAX_HEARD);
        }
    }
}

/// To one, or to everybody: ATTITUDE or COMMAND_LONG, no two alike.
fn message(me: Component, seq: u8, whom: Option<Component>, number: u32) -> Vec<u8> {
    let mut payload = [1; 33];
    payload[..4].copy_from_slice(&number.to_le_bytes());
    let Some(whom) = whom else {
        return frame(Version::V2, seq, me, (30, 39), &payload[..28]);
    };
    payload[30..32].copy_from_slice(&[whom.system, whom.component]);
    frame(Version::V1, seq, me, (76, 152), &payload)
}
