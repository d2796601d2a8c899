//! Routers, cables, components, and a clock that jumps from one event to the next.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use foldhash::{HashMap, HashMapExt};
use mavswitch::mavlink::{Component, Input, Version};
use mavswitch::routing::{LinkId, LinkOptions, MAX_HEARD, Router, RouterOptions, Time};

use crate::frames::{Random, Receiver, frame};
use crate::kinds::{Kinds, widen};
use crate::reach::Reach;
use crate::shadow::{Arrival, Parcel, Watched};

/// One end of a cable, or the link of a component: which router, and which link of it.
type End = (usize, LinkId);

/// Two routers, and the ends of the cable between them while it is plugged in.
pub(crate) struct Cable {
    /// The second one is before the first.
    pub(crate) routers: [usize; 2],
    ends: Option<[End; 2]>,
    /// How either end is treated.
    pub(crate) options: [LinkOptions; 2],
    /// In milliseconds.
    delay: u64,
    /// Until then nothing arrives: what is sent waits, as in a modem without coverage.
    stuck_until: Time,
    loss_percent: usize,
    doubled_percent: usize,
}

/// Somebody who speaks, and where.
pub(crate) struct Speaker {
    pub(crate) me: Component,
    pub(crate) at: End,
    pub(crate) options: LinkOptions,
    seq: u8,
}

pub(crate) struct World {
    random: Random,
    kinds: Kinds,
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

/// When a frame arrives, in which order of those that arrive then, where, and what has passed it on.
type OnTheWay = (Time, u64, End, Parcel);

/// What somebody said, and to whom, if not to everybody.
struct Said {
    who: usize,
    id: u32,
    whom: Option<Component>,
    bytes: Vec<u8>,
}

/// To everybody, to everybody, to one.
pub(crate) const HEARTBEAT: u32 = 0;
pub(crate) const ATTITUDE: u32 = 30;
pub(crate) const COMMAND: u32 = 76;

/// Everybody speaks so often.
const PERIOD: Duration = Duration::from_millis(200);

/// In periods: how long things go wrong; how long a source is kept off links at most, and some more,
/// as the delays add up; and how long all must go well.
const ROUGH: u32 = 40;
const SETTLING: u32 = 30;
const QUIET: u32 = 8;

/// How long a cable holds frames back at most, in periods.
const LATE: u32 = 30;

/// So long does what is on its way take at most to arrive and to end, where cables stay late.
const REST: u32 = 100;

/// What a cable takes at most, in milliseconds, but where cables are late.
pub(crate) const LONG: u64 = 40;

/// More on its way than this at one time is a storm.
const STORM: usize = 20_000;

impl World {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let now = Time::from_millis(1_000_000);
        let count = 1 + random.below(5);
        let router = |number| Watched::new(Router::new(RouterOptions::default()), number);
        let mut world = Self {
            kinds: Kinds::of(&mut random),
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
            let options = world.kinds.of_speaker(&mut world.random);
            let at = world.open(at, &options);
            world.speakers.push(Speaker { me, at, options, seq: number });
        }
        world
    }

    /// From a router to one before it: with one such cable each, all are joined. Sometimes a second
    /// one lies beside it, and both are one group.
    fn lay_cable(&mut self, router: usize) {
        let other = self.random.below(router);
        for options in self.kinds.of_cables(&mut self.random, self.cables.len()) {
            let cable = Cable {
                routers: [router, other],
                ends: None,
                options,
                delay: self.kinds.delay(&mut self.random),
                stuck_until: self.now,
                loss_percent: self.random.below(30),
                doubled_percent: self.random.below(10),
            };
            self.cables.push(cable);
            self.plug(self.cables.len() - 1);
        }
    }

    fn open(&mut self, router: usize, options: &LinkOptions) -> End {
        (router, self.routers[router].open(options.clone(), self.now))
    }

    /// What is on its way there is lost: the link's number may be given to another one.
    fn close(&mut self, end: End) {
        self.routers[end.0].close(end.1, self.now);
        self.on_the_way.retain(|Reverse((_, _, to, _))| *to != end);
    }

    fn plug(&mut self, cable: usize) {
        if self.cables[cable].ends.is_none() {
            let [one, other] = self.cables[cable].routers;
            let [own, far] = self.cables[cable].options.clone();
            self.cables[cable].ends = Some([self.open(one, &own), self.open(other, &far)]);
        }
    }

    fn unplug(&mut self, cable: usize) {
        let ends = self.cables[cable].ends.take();
        ends.into_iter().flatten().for_each(|end| self.close(end));
    }

    /// Things go wrong; then all is well again, and must be; and then nobody speaks any more.
    pub(crate) fn run(mut self) -> Tally {
        for _ in 0..ROUGH {
            self.mishap();
            self.speak();
        }
        self.mend();
        let late = match self.kinds {
            Kinds { stays_late: true, .. } => REST,
            Kinds { late: true, .. } => LATE,
            _ => 0,
        };
        (0..SETTLING + late).for_each(|_| drop(self.speak()));
        let said: Vec<Said> = (0..QUIET).flat_map(|_| self.speak()).collect();
        // Each router on the way may hold it back for a period.
        (0..=self.routers.len()).for_each(|_| self.pass(PERIOD));
        if self.kinds.stays_late {
            (0..REST).for_each(|_| self.pass(PERIOD));
        }
        self.check_arrivals(&said);
        self.check_bounds();
        assert!(self.on_the_way.is_empty(), "rule 49: {} go round", self.on_the_way.len());
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
                let options = self.speakers[who].options.clone();
                self.speakers[who].at = self.open(at, &options);
            }
            4 | 5 if self.kinds.late && !self.cables.is_empty() => {
                let periods = 1 + self.random.below(LATE as usize - 1) as u32;
                self.cables[cable].stuck_until = self.now + PERIOD * periods;
            }
            _ => {}
        }
    }

    /// All cables are plugged in and have room, and nothing is lost or doubled from now on.
    fn mend(&mut self) {
        (0..self.cables.len()).for_each(|cable| self.plug(cable));
        for cable in &mut self.cables {
            (cable.loss_percent, cable.doubled_percent) = (0, 0);
            cable.options.iter_mut().for_each(widen);
            if !self.kinds.stays_late && cable.delay > LONG {
                cable.stuck_until = self.now + Duration::from_millis(cable.delay);
                cable.delay = LONG;
            }
        }
        self.routers.iter_mut().for_each(|watched| watched.widen(self.now));
    }

    /// Everybody says something, and a period passes.
    fn speak(&mut self) -> Vec<Said> {
        let mut said = Vec::new();
        for who in 0..self.speakers.len() {
            let whom = self.random.below(self.speakers.len() + 3);
            let id = match whom.checked_sub(self.speakers.len()) {
                None => COMMAND,
                Some(0) => HEARTBEAT,
                Some(_) => ATTITUDE,
            };
            let whom = self.speakers.get(whom).map(|speaker| speaker.me);
            self.tally.sent += 1;
            let number = self.tally.sent as u32;
            let speaker = &mut self.speakers[who];
            speaker.seq = speaker.seq.wrapping_add(1);
            let at = speaker.at;
            let bytes = message(speaker.me, speaker.seq, id, whom, number);
            let parcel = (bytes.clone(), Vec::new());
            self.on_the_way.push(Reverse((self.now, u64::from(number), at, parcel)));
            said.push(Said { who, id, whom, bytes });
        }
        self.pass(PERIOD);
        said
    }

    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(Reverse((due, _, _, _))) = self.on_the_way.peek()
            && *due < end
        {
            let Reverse((due, _, (router, link), parcel)) = self.on_the_way.pop().unwrap();
            self.now = self.now.max(due);
            let (watched, now) = (&mut self.routers[router], self.now);
            let (bytes, trail) = (&parcel.0, &parcel.1[..]);
            self.receiver.each(bytes, Input::Paused, |frame| {
                watched.handle(&Arrival { link, frame, trail, now });
            });
            // Sometimes several frames wait before any leaves.
            if self.random.below(3) > 0 {
                self.flush(router);
            }
            assert!(self.on_the_way.len() < STORM, "rule 49: a storm");
        }
        (0..self.routers.len()).for_each(|router| self.flush(router));
        self.routers.iter().for_each(Watched::check_tables);
        self.now = end;
    }

    fn flush(&mut self, router: usize) {
        self.routers[router].router.take_dirty();
        for link in self.routers[router].with_frames() {
            for parcel in self.routers[router].flush(link, self.now) {
                self.carry((router, link), parcel);
            }
        }
    }

    /// A frame leaves a router: to whoever is at that link, or over the cable.
    fn carry(&mut self, from: End, parcel: Parcel) {
        if let Some(speaker) = self.speakers.iter().find(|speaker| speaker.at == from) {
            *self.arrived.entry((parcel.0, speaker.me)).or_default() += 1;
            return;
        }
        self.tally.carried += 1;
        let is_here = |cable: &&Cable| cable.ends.is_some_and(|ends| ends.contains(&from));
        let cable = self.cables.iter().find(is_here).expect("a cable at every other link");
        let to = cable.ends.unwrap().into_iter().find(|end| *end != from).unwrap();
        let due = (self.now + Duration::from_millis(cable.delay)).max(cable.stuck_until);
        let chance = self.random.below(100);
        let copies = match chance {
            _ if chance < cable.loss_percent => 0,
            _ if chance >= 100 - cable.doubled_percent => 2,
            _ => 1,
        };
        for copy in 0..copies {
            // In the order of sending, as nothing overtakes on a cable; the doubled one at once.
            let order = self.tally.carried * 2 + copy + (1 << 40);
            self.on_the_way.push(Reverse((due, order, to, parcel.clone())));
        }
    }

    /// All that was said arrived once with everybody who should hear it, and with nobody else; or
    /// more than once, where some ways are so long that what comes by them is late.
    fn check_arrivals(&self, said: &[Said]) {
        let reach = Reach { cables: &self.cables, speakers: &self.speakers };
        for Said { who, id, whom, bytes } in said {
            for (other, hears) in reach.hearers(*who, *id, *whom) {
                let hears = if self.kinds.stays_late { hears.or_more() } else { hears };
                let count = self.arrived.get(&(bytes.clone(), other)).copied().unwrap_or(0);
                assert!(hears.agrees(count), "{other} heard it {count} times, and {hears:?}");
            }
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

/// HEARTBEAT or ATTITUDE to everybody, or COMMAND_LONG to one; no two alike.
fn message(me: Component, seq: u8, id: u32, whom: Option<Component>, number: u32) -> Vec<u8> {
    let mut payload = [1; 33];
    payload[..4].copy_from_slice(&number.to_le_bytes());
    let whom = whom.unwrap_or(Component::new(0, 0));
    payload[30..32].copy_from_slice(&[whom.system, whom.component]);
    match id {
        COMMAND => frame(Version::V1, seq, me, (id, 152), &payload),
        HEARTBEAT => frame(Version::V2, seq, me, (id, 50), &payload[..9]),
        _ => frame(Version::V2, seq, me, (id, 39), &payload[..28]),
    }
}
