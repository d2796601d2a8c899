//! Who must hear whom when all is well: the lists on the way, and what routes they let be learned.

use mavswitch::mavlink::{Component, Header, MessageId, Version};
use mavswitch::routing::LinkOptions;

use crate::kinds::permits;
use crate::world::{ATTITUDE, Cable, HEARTBEAT, Speaker};

/// Whether somebody hears a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Hears {
    /// Once.
    Must,
    /// Once or not at all: it depends on which of several ways is the first, or on what was said.
    May,
    /// Once or more: copies are late.
    Often,
    /// As it happens.
    Whatever,
    Never,
}

/// A network in which nothing is wrong.
pub(crate) struct Reach<'a> {
    pub(crate) cables: &'a [Cable],
    pub(crate) speakers: &'a [Speaker],
}

impl Reach<'_> {
    /// Who hears what `who` says, to one or to everybody.
    pub(crate) fn hearers(
        &self,
        who: usize,
        id: u32,
        whom: Option<Component>,
    ) -> Vec<(Component, Hears)> {
        let others = (0..self.speakers.len()).filter(|other| *other != who);
        others.map(|other| (self.speakers[other].me, self.hears(who, other, id, whom))).collect()
    }

    fn hears(&self, who: usize, other: usize, id: u32, whom: Option<Component>) -> Hears {
        let me = self.speakers[other].me;
        let is_free = self.passes(who, other, id);
        let Some(whom) = whom else { return is_free };
        let target = self.speakers.iter().position(|speaker| speaker.me == whom);
        let knows = |router| target.is_some_and(|target| self.is_known(target, router));
        let last = self.cables.iter().map(|cable| cable.routers[0]).max().unwrap_or(0);
        let all_know = || (0..=last).all(knows);
        match is_free {
            Hears::Never => Hears::Never,
            is_free if me == whom && knows(self.speakers[who].at.0) => is_free,
            _ if me == whom => Hears::May,
            // Where the target was once, it may be unknown now: rule 38 takes its system for it.
            _ if me.system == whom.system && !all_know() => Hears::May,
            _ => Hears::Never,
        }
    }

    /// Whether every router on the way to one knows where somebody is: one of the messages that go to
    /// all passes all of them.
    fn is_known(&self, target: usize, router: usize) -> bool {
        let Speaker { me, options, .. } = &self.speakers[target];
        let passes = |id| {
            let header = header(*me, id);
            permits(&options.filter_in, &header) && self.way(target, router, header) == Hears::Must
        };
        [HEARTBEAT, ATTITUDE].into_iter().any(passes)
    }

    /// Whether the lists let a message of one pass to another.
    fn passes(&self, who: usize, other: usize, id: u32) -> Hears {
        let (from, to) = (&self.speakers[who], &self.speakers[other]);
        let header = header(from.me, id);
        let is_kept =
            !permits(&from.options.filter_in, &header) || !permits(&to.options.filter_out, &header);
        if is_kept { Hears::Never } else { self.way(who, to.at.0, header) }
    }

    /// Whether the cables let a message of somebody pass to a router. Where several ways lead there
    /// and lists are on them, nobody can say.
    fn way(&self, who: usize, to: usize, header: Header) -> Hears {
        let mut from = self.speakers[who].at.0;
        if !self.cables.iter().any(has_lists) {
            return Hears::Must;
        }
        let ways = self.cables.iter().filter(|cable| !is_second(cable)).count();
        let last = self.cables.iter().map(|cable| cable.routers[0]).max();
        if Some(ways) > last {
            return if from == to { Hears::Must } else { Hears::May };
        }
        // A tree: each router has one cable to a router before it, or two of one group.
        let (mut to, mut is_free) = (to, true);
        while from != to {
            // Of two that differ, the one with the higher number is the farther from the root.
            let (is_up, lower) = (from > to, from.max(to));
            let cable = self.cables.iter().find(|cable| cable.routers[0] == lower).unwrap();
            let [own, other] = &cable.options;
            let (sender, receiver) = if is_up { (own, other) } else { (other, own) };
            is_free &= permits(&sender.filter_out, &header);
            is_free &= permits(&receiver.filter_in, &header);
            if is_up { from = cable.routers[1] } else { to = cable.routers[1] }
        }
        if is_free { Hears::Must } else { Hears::Never }
    }
}

fn is_second(cable: &Cable) -> bool {
    cable.options[0].membership.is_some_and(|membership| membership.member > 0)
}

fn has_lists(cable: &Cable) -> bool {
    let none = LinkOptions::default();
    cable
        .options
        .iter()
        .any(|end| end.filter_in != none.filter_in || end.filter_out != none.filter_out)
}

/// What lists go by.
fn header(source: Component, id: u32) -> Header {
    let id = MessageId(id);
    Header { version: Version::V2, len: 0, signed: false, seq: 0, source, id }
}

impl Hears {
    /// The same where some ways are so long that what comes by them is late.
    pub(crate) fn or_more(self) -> Self {
        match self {
            Self::Must | Self::Often => Self::Often,
            Self::May | Self::Whatever => Self::Whatever,
            Self::Never => Self::Never,
        }
    }

    /// Whether hearing it so often is as it should be.
    pub(crate) fn agrees(self, count: usize) -> bool {
        match self {
            Self::Must => count == 1,
            Self::May => count <= 1,
            Self::Often => count >= 1,
            Self::Whatever => true,
            Self::Never => count == 0,
        }
    }
}
