//! Which component was heard on which link, and when: learned from traffic, forgotten with time.
//!
//! A flat index by (system, component) leads to a component in one step, however many links and
//! components there are. The number of components is bounded.

use std::time::Duration;

use super::link_set::LinkId;
use super::path_loss::Speech;
use super::sequence::Sequence;
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component};

/// How many components are known at one time. Real systems have a few dozen.
pub const MAX_COMPONENTS: usize = 4_096;

/// How many pairs of component and link are known at one time.
pub const MAX_HEARD: usize = 16_384;

/// A component silent for this long may be forgotten for a new one when the table is full.
const REPLACEABLE_AFTER: Duration = Duration::from_secs(10);

/// A component on a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Heard {
    /// Where it was heard.
    pub link: LinkId,
    /// When it was last heard there.
    pub last: Time,
    /// Whether frames for it are sent there.
    pub is_route: bool,
    /// What its sequence numbers there tell.
    pub sequence: Sequence,
    /// Its last SYSTEM_TIME.time_boot_ms there, by which a reboot shows (rule 44).
    pub boot_ms: Option<u32>,
    /// When its last broadcast came there, if no frame came there since that came elsewhere before.
    pub(super) first: Option<Time>,
    /// Whether the last frame that came there had come elsewhere before.
    pub(super) is_echo: bool,
    /// What else it says there.
    pub(super) speech: Speech,
}

/// A component and the links it was heard on.
#[derive(Clone, Debug)]
pub struct KnownComponent {
    /// Which.
    pub component: Component,
    /// What it last said of itself.
    pub heartbeat: Option<Heartbeat>,
    /// Where. Invariant: not empty, and each link once.
    pub heard: Vec<Heard>,
}

/// What a HEARTBEAT says of who sends it, in its own numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Heartbeat {
    /// MAV_TYPE.
    pub kind: u8,
    /// MAV_AUTOPILOT.
    pub autopilot: u8,
    /// MAV_MODE_FLAG.
    pub base_mode: u8,
    /// MAV_STATE.
    pub state: u8,
}

impl Heartbeat {
    /// MAV_AUTOPILOT_ARDUPILOTMEGA.
    pub const ARDUPILOT: u8 = 3;
    /// MAV_AUTOPILOT_INVALID: no flight controller, such as a ground station or a camera.
    pub const NO_AUTOPILOT: u8 = 8;
    /// MAV_MODE_FLAG_SAFETY_ARMED, of `base_mode`.
    pub const ARMED: u8 = 0x80;

    /// What stands in the payload of a HEARTBEAT, behind four bytes of `custom_mode`.
    pub fn read(frame: &CheckedFrame<'_>) -> Self {
        let [kind, autopilot, base_mode, state] = [4, 5, 6, 7].map(|at| frame.payload_byte(at));
        Self { kind, autopilot, base_mode, state }
    }

    /// Whether the motors may turn. Says nothing of who has no autopilot.
    pub fn is_armed(self) -> bool {
        self.base_mode & Self::ARMED != 0
    }

    /// Whether a flight controller says it, and not a ground station or a camera.
    pub fn has_autopilot(self) -> bool {
        self.autopilot != Self::NO_AUTOPILOT
    }
}

/// The table.
#[derive(Debug)]
pub struct RouteTable {
    /// By [`Component::index`]: one more than the number in `known`, or 0.
    index: Vec<u16>,
    known: Vec<KnownComponent>,
    /// By system: its numbers in `known`.
    systems: Vec<Vec<u16>>,
    /// How many pairs of component and link there are. Invariant: at most [`MAX_HEARD`].
    heard: usize,
    /// When the table was last searched for components to replace.
    searched: Option<Time>,
}

impl RouteTable {
    /// A table that knows nobody.
    pub fn new() -> Self {
        Self {
            index: vec![0; 1 << 16],
            known: Vec::new(),
            systems: vec![Vec::new(); 256],
            heard: 0,
            searched: None,
        }
    }

    /// What is known of a component.
    #[inline]
    pub fn find(&self, component: Component) -> Option<&KnownComponent> {
        let number = usize::from(self.index[component.index()]).checked_sub(1)?;
        Some(&self.known[number])
    }

    /// The same, to be changed; `heard` must not become empty.
    #[inline]
    pub(super) fn find_mut(&mut self, component: Component) -> Option<&mut KnownComponent> {
        let number = usize::from(self.index[component.index()]).checked_sub(1)?;
        Some(&mut self.known[number])
    }

    /// All that is known.
    pub fn components(&self) -> &[KnownComponent] {
        &self.known
    }

    /// What is known of the components of a system.
    pub fn system(&self, system: u8) -> impl Iterator<Item = &KnownComponent> {
        let numbers = &self.systems[usize::from(system)];
        numbers.iter().map(|number| &self.known[usize::from(*number)])
    }

    /// Adds a component that is heard now for the first time, or another link to a known one; says
    /// whether the component is new.
    ///
    /// # Errors
    ///
    /// If the table is full of what was heard of late.
    pub(super) fn add(
        &mut self,
        component: Component,
        heard: Heard,
        lost: impl FnMut(Component),
    ) -> Result<bool, TableFull> {
        if !self.has_room_for(component) {
            self.make_room(heard.last, lost);
        }
        if !self.has_room_for(component) {
            return Err(TableFull);
        }
        self.heard += 1;
        if let Some(known) = self.find_mut(component) {
            known.heard.push(heard);
            return Ok(false);
        }
        let number = self.known.len() as u16;
        self.known.push(KnownComponent { component, heartbeat: None, heard: vec![heard] });
        self.index[component.index()] = number + 1;
        self.systems[usize::from(component.system)].push(number);
        Ok(true)
    }

    fn has_room_for(&self, component: Component) -> bool {
        let is_known = self.find(component).is_some();
        self.heard < MAX_HEARD && (is_known || self.known.len() < MAX_COMPONENTS)
    }

    /// Forgets what was heard wherever `is_over`; `lost` is told of components that are left
    /// without a link.
    pub(super) fn forget(
        &mut self,
        is_over: impl Fn(&Heard) -> bool,
        mut lost: impl FnMut(Component),
    ) {
        let mut number = 0;
        while number < self.known.len() {
            let known = &mut self.known[number];
            let before = known.heard.len();
            known.heard.retain(|heard| !is_over(heard));
            self.heard -= before - known.heard.len();
            if known.heard.is_empty() {
                lost(known.component);
                self.remove(number);
            } else {
                number += 1;
            }
        }
    }

    /// At most once a second: the search is long, and a flood of made-up sources would repeat it
    /// at every frame.
    fn make_room(&mut self, now: Time, lost: impl FnMut(Component)) {
        let is_due = |last: Time| now.since(last) >= Duration::from_secs(1);
        if self.searched.is_none_or(is_due) {
            self.searched = Some(now);
            self.forget(|heard| now.since(heard.last) >= REPLACEABLE_AFTER, lost);
        }
    }

    /// Takes out a component; the last one moves to its number.
    fn remove(&mut self, number: usize) {
        let gone = self.known.swap_remove(number).component;
        self.index[gone.index()] = 0;
        self.systems[usize::from(gone.system)].retain(|other| usize::from(*other) != number);
        if let Some(moved) = self.known.get(number) {
            let from = self.known.len() as u16;
            self.index[moved.component.index()] = number as u16 + 1;
            let system = &mut self.systems[usize::from(moved.component.system)];
            system.iter_mut().filter(|n| **n == from).for_each(|n| *n = number as u16);
        }
    }
}

impl Default for RouteTable {
    fn default() -> Self {
        Self::new()
    }
}

impl KnownComponent {
    /// The links that frames for this component are sent on, of those heard since `oldest`.
    #[inline]
    pub fn routes(&self, oldest: Time) -> impl Iterator<Item = LinkId> {
        let is_fresh = move |heard: &&Heard| heard.is_route && heard.last >= oldest;
        self.heard.iter().filter(is_fresh).map(|heard| heard.link)
    }

    /// What was heard of it on a link.
    #[inline]
    pub fn on(&self, link: LinkId) -> Option<&Heard> {
        self.heard.iter().find(|heard| heard.link == link)
    }

    #[inline]
    pub(super) fn on_mut(&mut self, link: LinkId) -> Option<&mut Heard> {
        self.heard.iter_mut().find(|heard| heard.link == link)
    }
}

/// There is no room for another component, or for another link of one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct TableFull;
