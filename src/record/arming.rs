//! Which vehicles are armed, as the heartbeats of their autopilots have it.

use std::time::Duration;

use crate::mavlink::{CheckedFrame, Component, MessageId};
use crate::routing::Time;

/// Where in a HEARTBEAT the autopilot and the base mode stand.
const AUTOPILOT: u8 = 5;
const BASE_MODE: u8 = 6;

/// MAV_AUTOPILOT_GENERIC, which is also what a companion computer says that says nothing.
const GENERIC: u8 = 0;

/// MAV_AUTOPILOT_INVALID: no flight controller, such as a ground station or a camera.
const NO_AUTOPILOT: u8 = 8;

/// MAV_COMP_ID_AUTOPILOT1.
const MAIN: u8 = 1;

/// MAV_MODE_FLAG_SAFETY_ARMED.
const ARMED: u8 = 0x80;

/// A vehicle that has said nothing for so long is not armed any more: it is out of reach or has no
/// power, and its log need not last for ever.
const FORGET: Duration = Duration::from_secs(60);

/// Which vehicles are armed.
#[derive(Debug)]
pub(super) struct Arming {
    /// A bit for each system.
    armed: [u64; 4],
    /// The component that speaks for each system: one alone, so that no companion contradicts its
    /// autopilot; 0: none was heard.
    voices: [u8; 256],
    /// When each voice was heard last.
    heard: [Time; 256],
}

impl Arming {
    pub(super) fn new() -> Self {
        Self { armed: [0; 4], voices: [0; 256], heard: [Time::ZERO; 256] }
    }

    /// Takes what a frame says about it: only heartbeats of autopilots do.
    pub(super) fn handle(&mut self, frame: &CheckedFrame<'_>, now: Time) {
        let Component { system, component } = frame.header.source;
        if frame.header.id != MessageId::HEARTBEAT || !is_autopilot(component, frame) {
            return;
        }
        let voice = &mut self.voices[usize::from(system)];
        if component == MAIN || *voice == 0 {
            *voice = component;
        }
        if *voice != component {
            return;
        }
        self.heard[usize::from(system)] = now;
        let (word, bit) = place(system);
        if frame.payload_byte(BASE_MODE) & ARMED == 0 {
            self.armed[word] &= !bit;
        } else {
            self.armed[word] |= bit;
        }
    }

    /// Forgets vehicles that have not been heard for a minute.
    pub(super) fn forget(&mut self, now: Time) {
        if !self.is_any() {
            return;
        }
        for system in 0..=u8::MAX {
            let (word, bit) = place(system);
            if now.since(self.heard[usize::from(system)]) >= FORGET {
                self.armed[word] &= !bit;
            }
        }
    }

    /// Whether any vehicle is armed.
    pub(super) fn is_any(&self) -> bool {
        self.armed != [0; 4]
    }
}

/// The main component may be a generic autopilot; what else says so is mostly something that has
/// left the field empty.
fn is_autopilot(component: u8, heartbeat: &CheckedFrame<'_>) -> bool {
    match heartbeat.payload_byte(AUTOPILOT) {
        NO_AUTOPILOT => false,
        GENERIC => component == MAIN,
        _ => true,
    }
}

fn place(system: u8) -> (usize, u64) {
    (usize::from(system / 64), 1 << (system % 64))
}
