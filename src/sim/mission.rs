//! The mission protocol: what is stored, and the transfer that is under way.
//!
//! Missions are kept; fences and rally points are none, and are not taken.

use std::time::Duration;

use super::flight::Place;
use super::messages;
use crate::mavlink::{Component, Payload};
use crate::routing::Time;

/// MAV_MISSION_TYPE.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct MissionType(pub(super) u8);

impl MissionType {
    pub(super) const MISSION: Self = Self(0);
    const ALL: Self = Self(255);
}

/// One mission item, as MISSION_ITEM_INT has it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Item {
    pub(super) params: [f32; 4],
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) z: f32,
    pub(super) command: u16,
    pub(super) frame: u8,
    pub(super) autocontinue: u8,
}

/// The longest mission.
pub(super) const LONGEST: u16 = 128;

/// How long an item is waited for before it is asked for again, and how often that is done.
const PATIENCE: Duration = Duration::from_secs(1);
const TRIES: u8 = 5;

// MAV_MISSION_RESULT.
const ACCEPTED: u8 = 0;
const ERROR: u8 = 1;
const UNSUPPORTED: u8 = 3;
const NO_SPACE: u8 = 4;
const INVALID_SEQUENCE: u8 = 13;
const OPERATION_CANCELLED: u8 = 15;

/// The mission of one vehicle.
#[derive(Clone, Debug)]
pub(super) struct Mission {
    items: Vec<Item>,
    current: u16,
    upload: Option<Upload>,
}

/// A mission on its way to the vehicle.
#[derive(Clone, Debug)]
struct Upload {
    from: Component,
    count: u16,
    /// What has come so far: at most [`LONGEST`].
    items: Vec<Item>,
    /// When the next item is asked for again.
    deadline: Time,
    tries: u8,
}

impl Mission {
    /// Four waypoints on the circle of the vehicle.
    pub(super) fn around(home: Place, radius: f32, altitude: f32) -> Self {
        let waypoint = |quarter: u8| {
            let bearing = f64::from(quarter) * std::f64::consts::FRAC_PI_2;
            let (x, y, _) = home.at(radius, bearing).scaled();
            // MAV_CMD_NAV_WAYPOINT, MAV_FRAME_GLOBAL_RELATIVE_ALT.
            Item { params: [0.0; 4], x, y, z: altitude, command: 16, frame: 3, autocontinue: 1 }
        };
        Self { items: (0..4).map(waypoint).collect(), current: 0, upload: None }
    }

    /// MISSION_REQUEST_LIST.
    pub(super) fn list(&self, from: Component, kind: MissionType) -> Payload {
        let count = if kind == MissionType::MISSION { self.items.len() } else { 0 };
        // At most LONGEST.
        messages::mission_count(from, kind, count as u16)
    }

    /// MISSION_REQUEST_INT, or MISSION_REQUEST, which is to be answered alike.
    pub(super) fn item(&self, from: Component, kind: MissionType, seq: u16) -> Payload {
        match self.items.get(usize::from(seq)) {
            Some(item) if kind == MissionType::MISSION => {
                messages::mission_item_int(from, seq, seq == self.current, item)
            }
            _ => messages::mission_ack(from, kind, INVALID_SEQUENCE),
        }
    }

    /// MISSION_CLEAR_ALL.
    pub(super) fn clear(&mut self, from: Component, kind: MissionType) -> Payload {
        if matches!(kind, MissionType::MISSION | MissionType::ALL) {
            self.items.clear();
            (self.current, self.upload) = (0, None);
        }
        messages::mission_ack(from, kind, ACCEPTED)
    }

    /// MISSION_SET_CURRENT; whoever asks is told what holds.
    pub(super) fn set_current(&mut self, seq: u16) -> Payload {
        if usize::from(seq) < self.items.len() {
            self.current = seq;
        }
        messages::mission_current(self.current)
    }

    /// MISSION_COUNT: somebody begins to upload. Whoever comes later takes the place.
    pub(super) fn begin(
        &mut self,
        from: Component,
        kind: MissionType,
        count: u16,
        now: Time,
    ) -> Payload {
        let refusal = match count {
            _ if kind != MissionType::MISSION => UNSUPPORTED,
            0 => return self.clear(from, kind),
            _ if count > LONGEST => NO_SPACE,
            _ => ACCEPTED,
        };
        if refusal != ACCEPTED {
            return messages::mission_ack(from, kind, refusal);
        }
        let deadline = now + PATIENCE;
        self.upload = Some(Upload { from, count, items: Vec::new(), deadline, tries: 0 });
        messages::mission_request_int(from, kind, 0)
    }

    /// MISSION_ITEM_INT or MISSION_ITEM: the next one is asked for, or the whole is taken over.
    pub(super) fn receive(
        &mut self,
        from: Component,
        kind: MissionType,
        seq: u16,
        item: Item,
        now: Time,
    ) -> Payload {
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.from == from) else {
            return messages::mission_ack(from, kind, ERROR);
        };
        // One that comes twice, or too early, has the right one asked for once more.
        if usize::from(seq) == upload.items.len() {
            upload.items.push(item);
            (upload.deadline, upload.tries) = (now + PATIENCE, 0);
        }
        // At most `count`.
        let next = upload.items.len() as u16;
        if next < upload.count {
            return messages::mission_request_int(from, kind, next);
        }
        self.items = std::mem::take(&mut upload.items);
        (self.current, self.upload) = (0, None);
        messages::mission_ack(from, kind, ACCEPTED)
    }

    /// MISSION_ACK: who uploads has given it up, if it is not the end of a download.
    pub(super) fn handle_ack(&mut self, from: Component, result: u8) {
        if result != ACCEPTED && self.upload.as_ref().is_some_and(|upload| upload.from == from) {
            self.upload = None;
        }
    }

    /// When an item is asked for again.
    pub(super) fn deadline(&self) -> Option<Time> {
        self.upload.as_ref().map(|upload| upload.deadline)
    }

    /// Asks for an item again that did not come, and in the end no more.
    pub(super) fn handle_timeout(&mut self, now: Time) -> Option<Payload> {
        let upload = self.upload.as_mut().filter(|upload| upload.deadline <= now)?;
        let (from, kind) = (upload.from, MissionType::MISSION);
        upload.tries += 1;
        upload.deadline = now + PATIENCE;
        if upload.tries < TRIES {
            let next = upload.items.len() as u16;
            return Some(messages::mission_request_int(from, kind, next));
        }
        self.upload = None;
        Some(messages::mission_ack(from, kind, OPERATION_CANCELLED))
    }
}
