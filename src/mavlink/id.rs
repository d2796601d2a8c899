//! The identifiers that MAVLink carries: components and messages.

use std::fmt;

/// A component: a (system id, component id) pair, printed `1/190`.
///
/// As a source, both ids are 1..=255 (rule 8); as a target, 0 means "all".
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Component {
    /// System id: a vehicle, a ground station.
    pub system: u8,
    /// Component id within the system: 1 is an autopilot, 190 a ground station's own.
    pub component: u8,
}

impl Component {
    /// MAV_COMP_ID_AUTOPILOT1: the component id of a vehicle's autopilot.
    pub const AUTOPILOT: u8 = 1;
    /// MAV_COMP_ID_ONBOARD_COMPUTER (rule 68): the component id of a computer beside it.
    pub const ONBOARD_COMPUTER: u8 = 191;

    /// The pair `system/component`.
    pub const fn new(system: u8, component: u8) -> Self {
        Self { system, component }
    }

    /// Whether this pair may be the source of a frame: neither id is 0 (rule 8).
    pub const fn is_valid_source(self) -> bool {
        self.system != 0 && self.component != 0
    }

    /// A number of its own for each pair, below 65,536: for tables.
    pub const fn index(self) -> usize {
        (self.system as usize) << 8 | self.component as usize
    }
}

impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.system, self.component)
    }
}

/// A message id: 8 bits in MAVLink 1, 24 bits in MAVLink 2.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct MessageId(pub u32);

impl MessageId {
    /// HEARTBEAT: who is there.
    pub const HEARTBEAT: Self = Self(0);
    /// SYSTEM_TIME: carries the time since boot, by which a reboot shows.
    pub const SYSTEM_TIME: Self = Self(2);
    /// MISSION_ACK: the end of a mission transfer.
    pub const MISSION_ACK: Self = Self(47);
    /// REQUEST_DATA_STREAM: asks ArduPilot for its telemetry (rule 48).
    pub const REQUEST_DATA_STREAM: Self = Self(66);
    /// COMMAND_ACK: the answer to a command; without target fields from old senders.
    pub const COMMAND_ACK: Self = Self(77);
    /// RADIO_STATUS: a radio's report, injected on its own link (rule 46).
    pub const RADIO_STATUS: Self = Self(109);
    /// RADIO: the older report of SiK radios (rule 46).
    pub const RADIO: Self = Self(166);
    /// SETUP_SIGNING: carries a secret key and is not forwarded (rule 47).
    pub const SETUP_SIGNING: Self = Self(256);
}

impl fmt::Display for MessageId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_is_printed_as_a_pair() {
        assert_eq!(Component::new(1, 190).to_string(), "1/190");
    }

    #[test]
    fn zero_is_no_source() {
        assert!(Component::new(1, 1).is_valid_source());
        assert!(!Component::new(0, 1).is_valid_source());
        assert!(!Component::new(1, 0).is_valid_source());
    }
}
