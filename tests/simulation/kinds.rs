//! What a link may be: of a group, without copies, with lists of what passes, narrow, slow.

use std::time::Duration;

use mavswitch::mavlink::{Header, MessageId};
use mavswitch::routing::{Capacity, FilterLists, GroupId, LinkOptions, Membership};

use crate::frames::Random;
use crate::world::{ATTITUDE, COMMAND, HEARTBEAT, LONG};

/// What there is in a network besides cables that lose, double, delay and end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kinds {
    /// Pairs of cables that lead the same way.
    pub(crate) groups: bool,
    /// Lists of messages, systems and components, in and out.
    pub(crate) lists: bool,
    /// Short queues, and lines with a pace.
    pub(crate) slow: bool,
    /// Cables that hold frames back for seconds.
    pub(crate) late: bool,
    /// Of these, some always do, and to the end.
    pub(crate) stays_late: bool,
    /// `dedup`, in groups and without.
    pub(crate) dedup: bool,
}

impl Kinds {
    /// Each of them in every other network.
    pub(crate) fn of(random: &mut Random) -> Self {
        let [groups, lists, slow, late, dedup, stays] = [(); 6].map(|()| random.below(2) == 0);
        Self { groups, lists, slow, late, stays_late: late && stays, dedup }
    }

    /// What a cable takes, in milliseconds.
    pub(crate) fn delay(self, random: &mut Random) -> u64 {
        let short = 1 + random.below(LONG as usize) as u64;
        let is_long = self.late && random.below(4) == 0;
        if is_long { 500 + random.below(3_000) as u64 } else { short }
    }

    /// The one link of who speaks.
    pub(crate) fn of_speaker(self, random: &mut Random) -> LinkOptions {
        let mut options = LinkOptions { capacity: self.capacity(random), ..LinkOptions::default() };
        self.draw_list(random, &mut options);
        options
    }

    /// Both ends of a cable; or of two that are one group at either end, and have the same lists.
    pub(crate) fn of_cables(self, random: &mut Random, number: usize) -> Vec<[LinkOptions; 2]> {
        let is_pair = self.groups && random.below(5) > 2;
        let mut ends = [LinkOptions::default(), LinkOptions::default()];
        for end in &mut ends {
            let window = [1, 200, 500, 1_000][random.below(4)];
            let has_dedup = self.dedup && random.below(2) == 0;
            end.dedup = has_dedup.then(|| Duration::from_millis(window));
        }
        let chosen = random.below(2);
        self.draw_list(random, &mut ends[chosen]);
        let group = GroupId(u8::try_from(number).unwrap());
        let cable = |member| {
            let place = Membership { group, member, rank: 0, best_only: false };
            ends.clone().map(|end| LinkOptions {
                capacity: self.capacity(random),
                membership: is_pair.then_some(place),
                ..end
            })
        };
        (0..1 + u16::from(is_pair)).map(cable).collect()
    }

    /// Room for everything, for a few frames, or for what a line carries in a while.
    fn capacity(self, random: &mut Random) -> Capacity {
        match random.below(5) {
            0 if self.slow => Capacity::Bytes(200 + random.below(1_000)),
            1 if self.slow => Capacity::Paced {
                rate: [240, 960, 5_760][random.below(3)],
                queue_time: Duration::from_millis(250 + random.below(2_000) as u64),
            },
            _ => LinkOptions::default().capacity,
        }
    }

    /// One time in three, some are kept from coming in, or from going out.
    fn draw_list(self, random: &mut Random, options: &mut LinkOptions) {
        if !self.lists || random.below(3) > 0 {
            return;
        }
        let message = MessageId([HEARTBEAT, ATTITUDE, COMMAND][random.below(3)]);
        let (system, component) = (1 + random.below(3) as u8, 1 + random.below(2) as u8);
        let none = FilterLists::default();
        let list = match random.below(6) {
            0 => FilterLists { allow_messages: vec![message], ..none },
            1 | 2 => FilterLists { block_messages: vec![message], ..none },
            3 => FilterLists { block_systems: vec![system], ..none },
            4 => FilterLists { allow_systems: vec![system], ..none },
            _ => FilterLists { block_components: vec![component], ..none },
        };
        match random.below(2) {
            0 => options.filter_in = list,
            _ => options.filter_out = list,
        }
    }
}

/// Whether a frame is on every list of what is allowed, and on none of what is not; a list that is
/// empty allows all.
pub(crate) fn permits(lists: &FilterLists, header: &Header) -> bool {
    let Header { id, source, .. } = header;
    let allows = |is_empty: bool, is_on: bool| is_empty || is_on;
    allows(lists.allow_messages.is_empty(), lists.allow_messages.contains(id))
        && allows(lists.allow_systems.is_empty(), lists.allow_systems.contains(&source.system))
        && !lists.block_messages.contains(id)
        && !lists.block_systems.contains(&source.system)
        && !lists.block_components.contains(&source.component)
}

/// Room for everything, and no pace.
pub(crate) fn widen(options: &mut LinkOptions) {
    options.capacity = LinkOptions::default().capacity;
}

/// How much may wait before a frame of this sort is refused: in all as many bytes as the user says or
/// as the line carries in its time, but room for three of the longest frames; of that broadcast
/// telemetry may fill 60 %, what is directed 90 %, and heartbeats the whole.
pub(crate) fn room(capacity: Capacity, id: MessageId) -> usize {
    let total = match capacity {
        Capacity::Bytes(bytes) => bytes,
        Capacity::Paced { rate, queue_time } => {
            rate as usize * queue_time.as_millis() as usize / 1_000
        }
    };
    let total = total.max(840);
    match id.0 {
        HEARTBEAT => total,
        COMMAND => total * 9 / 10,
        _ => total * 6 / 10,
    }
}

/// How many bytes a line may have carried at most: what its pace allows, saved for 50 ms, and one
/// frame that began in time.
pub(crate) fn carried_at_most(capacity: Capacity, open: Duration) -> usize {
    match capacity {
        Capacity::Bytes(_) => usize::MAX,
        Capacity::Paced { rate, .. } => {
            (open.as_millis() as usize + 50) * rate as usize / 1_000 + 280
        }
    }
}
