//! Which vehicles are armed, as the heartbeats of their autopilots have it.

use crate::mavlink::{CheckedFrame, MessageId};

/// Where in a HEARTBEAT the autopilot and the base mode stand.
const AUTOPILOT: u8 = 5;
const BASE_MODE: u8 = 6;

/// MAV_AUTOPILOT_INVALID: no flight controller, such as a ground station or a camera.
const NO_AUTOPILOT: u8 = 8;

/// MAV_MODE_FLAG_SAFETY_ARMED.
const ARMED: u8 = 0x80;

/// Which vehicles are armed.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) struct Arming {
    /// A bit for each system.
    armed: [u64; 4],
}

impl Arming {
    /// Takes what a frame says about it: only heartbeats of autopilots do.
    pub(super) fn handle(&mut self, frame: &CheckedFrame<'_>) {
        if frame.header.id != MessageId::HEARTBEAT || frame.payload_byte(AUTOPILOT) == NO_AUTOPILOT
        {
            return;
        }
        let system = frame.header.source.system;
        let (word, bit) = (usize::from(system / 64), 1 << (system % 64));
        if frame.payload_byte(BASE_MODE) & ARMED == 0 {
            self.armed[word] &= !bit;
        } else {
            self.armed[word] |= bit;
        }
    }

    /// Whether any vehicle is armed.
    pub(super) fn is_any(&self) -> bool {
        self.armed != [0; 4]
    }
}
