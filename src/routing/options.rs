//! What the user decides about routing, and what the router has to tell.

use std::time::Duration;

use super::counters::DropReason;
use super::filter::FilterLists;
use super::gate_options::GateOptions;
use super::group::{GroupId, Membership};
use super::link_set::LinkId;
use super::rate_limit::RateCap;
use super::time::Time;
use crate::mavlink::Component;

/// How long a source's broadcasts stay off a link that brought one itself (rule 49).
pub const LOOP_WINDOW: Duration = Duration::from_secs(5);

/// Which frames teach routes.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum Learn {
    /// Every frame that passed a full check (rule 35).
    #[default]
    All,
    /// HEARTBEAT only.
    Heartbeat,
}

/// What the user decides about routing as a whole.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RouterOptions {
    /// Which frames teach routes.
    pub learn: Learn,
    /// A frame for an unknown component of a known system goes nowhere, instead of to all links
    /// of the system (rule 38).
    pub strict: bool,
    /// A route that was not heard for so long is forgotten; `None`: only with its link (rule 44).
    pub route_age: Option<Duration>,
    /// Links on which this system was heard are sent everything, whoever it is for.
    pub sniffer: Option<u8>,
}

impl RouterOptions {
    /// Routes that were last heard before are too old.
    pub(super) fn oldest_route(&self, now: Time) -> Time {
        self.route_age.map_or(Time::ZERO, |age| now - age)
    }
}

impl Default for RouterOptions {
    fn default() -> Self {
        Self {
            learn: Learn::All,
            strict: false,
            route_age: Some(Duration::from_secs(300)),
            sniffer: None,
        }
    }
}

/// What the router must know of a link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LinkOptions {
    /// How much may wait for it, and at which pace it leaves.
    pub capacity: Capacity,
    /// Whether SETUP_SIGNING may come and go here; both links must allow it (rule 47).
    pub forward_setup_signing: bool,
    /// What is taken from here; the rest teaches nothing either.
    pub filter_in: FilterLists,
    /// What is sent here.
    pub filter_out: FilterLists,
    /// Whether everything is sent here, whoever it is for.
    pub is_sniffer: bool,
    /// Messages that are sent here less often than they come.
    pub caps: Vec<RateCap>,
    /// Its place among links that lead the same way.
    pub membership: Option<Membership>,
    /// What comes from here is dropped if it came over another link of the group within this time;
    /// 1 s at most (rule 49). `None`: [`GROUP_WINDOW`](super::GROUP_WINDOW).
    pub dedup: Option<Duration>,
    /// Whether whoever is there passes on nobody's frames, as a part of this program does: nothing
    /// that comes from there has gone round (rule 49).
    pub repeats_nobody: bool,
    /// What is asked of the frames that come and go.
    pub gate: GateOptions,
}

/// How much may wait for a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Capacity {
    /// So many bytes; they leave as fast as the system takes them.
    Bytes(usize),
    /// What a line carries in a time.
    Paced {
        /// Bytes a second.
        rate: u32,
        /// How long a frame may wait.
        queue_time: Duration,
    },
}

impl Default for LinkOptions {
    fn default() -> Self {
        Self {
            capacity: Capacity::Bytes(DEFAULT_QUEUE),
            forward_setup_signing: false,
            filter_in: FilterLists::default(),
            filter_out: FilterLists::default(),
            is_sniffer: false,
            caps: Vec::new(),
            membership: None,
            dedup: None,
            repeats_nobody: false,
            gate: GateOptions::default(),
        }
    }
}

/// How much may wait for a link without a pace, in bytes; the system's own buffers come on top.
const DEFAULT_QUEUE: usize = 32 * 1_024;

/// Something happened that a person wants to be told.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RouterEvent {
    /// A component was heard for the first time.
    ComponentSeen(Component, LinkId),
    /// A component is known on no link any more.
    ComponentLost(Component),
    /// A component started again (rule 44).
    ComponentRestarted(Component, LinkId),
    /// Frames come from a source that can never be found again, for one of its ids is 0 (rule 8).
    /// Told once a link.
    InvalidSource(Component, LinkId),
    /// Frames of a component on a link are refused, for the lack of a right signature or for what it
    /// says. Told once a minute at most.
    Refused(Component, LinkId, DropReason),
    /// The first found nobody at the second.
    NoRoute(Component, Component),
    /// A group sends over this member from now on; over all of them, if none is good.
    PathChosen(GroupId, Option<u16>),
}
