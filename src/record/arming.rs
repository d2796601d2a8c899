//! Which vehicles are armed, as the heartbeats of their autopilots have it.

use std::time::Duration;

use crate::mavlink::{CheckedFrame, Component, MessageId};
use crate::routing::{Heartbeat, Time};

/// MAV_AUTOPILOT_GENERIC, which is also what a companion computer says that says nothing.
const GENERIC: u8 = 0;

/// A vehicle that has said nothing for so long is not armed any more: it is out of reach or has no
/// power, and its log need not last for ever.
const FORGET: Duration = Duration::from_secs(60);

/// How often vehicles are looked for that have said nothing for so long.
const LOOK: Duration = Duration::from_secs(1);

/// Which vehicles are armed.
#[derive(Debug)]
pub(super) struct Arming {
    /// By system.
    voices: [Voice; 256],
    /// Whether one of them is armed.
    is_any: bool,
    /// When it is looked next for vehicles to forget.
    look_at: Time,
}

/// Who speaks for a system: one component alone, so that no companion contradicts its autopilot.
#[derive(Clone, Copy, Debug)]
struct Voice {
    /// 0: none was heard.
    component: u8,
    is_armed: bool,
    heard: Time,
}

impl Voice {
    const NONE: Self = Self { component: 0, is_armed: false, heard: Time::ZERO };

    fn is_forgotten(&self, now: Time) -> bool {
        now.since(self.heard) >= FORGET
    }
}

impl Arming {
    pub(super) fn new() -> Self {
        Self { voices: [Voice::NONE; 256], is_any: false, look_at: Time::ZERO }
    }

    /// Takes what a frame says about it: only heartbeats of autopilots do.
    pub(super) fn handle(&mut self, frame: &CheckedFrame<'_>, now: Time) {
        let Component { system, component } = frame.header.source;
        if frame.header.id != MessageId::HEARTBEAT {
            return;
        }
        let heartbeat = Heartbeat::read(frame);
        if !is_autopilot(component, heartbeat) {
            return;
        }
        let voice = &mut self.voices[usize::from(system)];
        if component == Component::AUTOPILOT || voice.component == 0 || voice.is_forgotten(now) {
            voice.component = component;
        }
        if voice.component != component {
            return;
        }
        voice.heard = now;
        let is_armed = heartbeat.is_armed();
        if std::mem::replace(&mut voice.is_armed, is_armed) != is_armed {
            self.look();
        }
    }

    /// Forgets vehicles that have not been heard for a minute; looks for them once a second.
    pub(super) fn forget(&mut self, now: Time) {
        if now < self.look_at {
            return;
        }
        self.look_at = now + LOOK;
        for voice in self.voices.iter_mut().filter(|voice| voice.is_forgotten(now)) {
            *voice = Voice::NONE;
        }
        self.look();
    }

    fn look(&mut self) {
        self.is_any = self.voices.iter().any(|voice| voice.is_armed);
    }

    /// Whether any vehicle is armed.
    pub(super) fn is_any(&self) -> bool {
        self.is_any
    }
}

/// The main component may be a generic autopilot; what else says so is mostly something that has
/// left the field empty.
fn is_autopilot(component: u8, heartbeat: Heartbeat) -> bool {
    heartbeat.has_autopilot()
        && (heartbeat.autopilot != GENERIC || component == Component::AUTOPILOT)
}
