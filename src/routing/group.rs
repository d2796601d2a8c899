//! Links that lead the same way: a radio and a modem to the same vehicle.
//!
//! Nothing is forwarded between them, and what was learned on one is known on all. A group sends
//! over every one of its members, or over the best. A member is an endpoint; its links are the
//! peers of that endpoint.

use std::time::Duration;

use super::link_set::{LinkId, LinkSet};
use super::time::Time;

/// The number of a group.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct GroupId(pub u8);

/// A link's place in a group.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Membership {
    /// Which group.
    pub group: GroupId,
    /// Which endpoint the link belongs to.
    pub member: u16,
    /// Of two good paths, the one with the higher rank is taken.
    pub rank: u8,
    /// Whether the group sends over its best member only.
    pub best_only: bool,
}

/// What is known of how good a link is.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Quality {
    /// When a verified frame last came.
    pub last_heard: Option<Time>,
    /// When one last came from beyond the link: not what a radio says of itself.
    pub last_carried: Option<Time>,
    /// Lost frames, in parts of 1,024, of late.
    pub loss: u32,
    /// How full the queue is, in parts of 1,024.
    pub backlog: u32,
}

/// The links of one group.
#[derive(Clone, Default, Debug)]
pub(super) struct Group {
    /// All of them.
    links: LinkSet,
    members: Vec<Member>,
    best_only: bool,
    /// The number of the best member, if one is good at all; and since when another one has looked
    /// better.
    best: Option<u16>,
    challenged: Option<(u16, Time)>,
    judged: Option<Time>,
    /// Whether the best member is silent while another one is not.
    is_in_doubt: bool,
    /// What [`Group::take_change`] last told.
    told: Option<u16>,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    number: u16,
    rank: u8,
    links: LinkSet,
}

/// While the best path is silent for so long and another one is not, frames go over both: a
/// heartbeat is late.
const DOUBTFUL: Duration = Duration::from_millis(1_200);

/// A path that was silent for so long is not good: one heartbeat may be lost, and another is late.
pub(super) const SILENT: Duration = Duration::from_millis(2_500);

/// How long another path must look better before it is taken, as long as the old one works.
const HYSTERESIS: Duration = Duration::from_secs(3);

/// How often the paths are judged.
const JUDGED_EVERY: Duration = Duration::from_millis(100);

/// More loss than this, in parts of 1,024, is not good.
const LOSSY: u32 = 154;

/// A fuller queue than this, in parts of 1,024, is not good.
const CONGESTED: u32 = 614;

impl Group {
    /// All links of the group.
    pub(super) fn links(&self) -> LinkSet {
        self.links
    }

    /// Adds a link.
    pub(super) fn add(&mut self, link: LinkId, membership: Membership) {
        self.links.insert(link);
        self.best_only |= membership.best_only;
        let number = membership.member;
        match self.members.iter_mut().find(|member| member.number == number) {
            Some(member) => {
                member.rank = membership.rank;
                member.links.insert(link);
            }
            None => self.members.push(Member {
                number,
                rank: membership.rank,
                links: LinkSet::of(link),
            }),
        }
    }

    /// Whether to send over the best member only.
    pub(super) fn set_best_only(&mut self, best_only: bool) {
        self.best_only = best_only;
    }

    /// Takes out a link; if it was the best path, another one is found at once.
    pub(super) fn remove(&mut self, link: LinkId) {
        self.links.remove(link);
        for member in &mut self.members {
            member.links.remove(link);
        }
        self.members.retain(|member| !member.links.is_empty());
        self.judged = None;
    }

    /// Where to send, if these links of the group lead to the target: to the links themselves, and
    /// to those of the other members; or to the best member only.
    ///
    /// While no member is good, or the best is in doubt, all that were heard of late are sent to, or
    /// else simply all: one of them may yet work in this direction. What `is_heartbeat` is sent to all
    /// as well, for each side measures by what it hears.
    pub(super) fn expand(
        &mut self,
        links: LinkSet,
        is_heartbeat: bool,
        now: Time,
        quality: impl Fn(LinkId) -> Quality,
    ) -> LinkSet {
        let through = |member: &Member| {
            let own = member.links & links;
            if own.is_empty() { member.links } else { own }
        };
        let all = |members: &[Member]| {
            members.iter().fold(LinkSet::EMPTY, |all, member| all | through(member))
        };
        if self.best_only {
            self.judge(now, &quality);
        }
        if !self.best_only || is_heartbeat {
            return all(&self.members);
        }
        let best = self.members.iter().find(|member| Some(member.number) == self.best);
        if let Some(best) = best
            && !self.is_in_doubt
        {
            return through(best);
        }
        let is_alive = |link: LinkId| quality(link).is_alive(now);
        let alive: LinkSet = all(&self.members).iter().filter(|link| is_alive(*link)).collect();
        if alive.is_empty() { all(&self.members) } else { alive }
    }

    /// The best member, if its path has changed since the last call; `None` in it: no path is good.
    pub(super) fn take_change(&mut self) -> Option<Option<u16>> {
        let has_changed = self.told != self.best;
        self.told = self.best;
        has_changed.then_some(self.best)
    }

    /// Finds the best member: at once if the old one fails, after a while if another is better.
    fn judge(&mut self, now: Time, quality: &impl Fn(LinkId) -> Quality) {
        if self.judged.is_some_and(|judged| now.since(judged) < JUDGED_EVERY) {
            return;
        }
        self.judged = Some(now);
        self.choose(now, quality);
        let is_heard = |member: &Member| {
            member.links.iter().any(|link| quality(link).is_heard_within(DOUBTFUL, now))
        };
        let is_best = |member: &&Member| Some(member.number) == self.best;
        let is_silent = self.members.iter().find(is_best).is_some_and(|best| !is_heard(best));
        self.is_in_doubt = is_silent && self.members.iter().any(is_heard);
    }

    fn choose(&mut self, now: Time, quality: &impl Fn(LinkId) -> Quality) {
        let scores = self.members.iter().map(|member| (member.score(now, quality), member.number));
        let good = scores.filter(|(score, _)| score.is_good);
        let first = good.clone().max_by_key(|(score, _)| *score);
        let current = good.clone().find(|(_, number)| Some(*number) == self.best);
        let Some((score, number)) = first else {
            (self.best, self.challenged) = (None, None);
            return;
        };
        if current.is_some_and(|(current, _)| current == score) {
            self.challenged = None;
            return;
        }
        let since = match self.challenged {
            Some((challenger, since)) if challenger == number => since,
            _ => now,
        };
        self.challenged = Some((number, since));
        if current.is_none() || now.since(since) >= HYSTERESIS {
            (self.best, self.challenged) = (Some(number), None);
        }
    }
}

/// How good a member is: compared field by field, the first one first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Score {
    is_good: bool,
    rank: u8,
    /// In steps, so that small changes make no difference.
    delivered: u32,
}

impl Member {
    /// That of the best of its links.
    fn score(&self, now: Time, quality: &impl Fn(LinkId) -> Quality) -> Score {
        let scores = self.links.iter().map(|link| score(quality(link), self.rank, now));
        let none = Score { is_good: false, rank: 0, delivered: 0 };
        scores.fold(none, Score::max)
    }
}

impl Quality {
    /// Whether something was heard of late.
    pub(super) fn is_alive(self, now: Time) -> bool {
        self.is_heard_within(SILENT, now)
    }

    fn is_heard_within(self, time: Duration, now: Time) -> bool {
        self.last_carried.is_some_and(|carried| now.since(carried) < time)
    }
}

fn score(quality: Quality, rank: u8, now: Time) -> Score {
    let is_good = quality.is_alive(now) && quality.loss <= LOSSY && quality.backlog <= CONGESTED;
    Score { is_good, rank, delivered: (1_024 - quality.loss.min(1_024)) / 128 }
}
