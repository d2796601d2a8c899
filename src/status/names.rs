//! What the numbers of a HEARTBEAT mean, in words: MAV_TYPE, MAV_AUTOPILOT and MAV_STATE.

use super::{ArmedState, Vehicle};
use crate::routing::Heartbeat;

/// MAV_TYPE, from 0 on.
const KINDS: [&str; 50] = [
    "generic",
    "fixed wing",
    "quadrotor",
    "coaxial",
    "helicopter",
    "antenna tracker",
    "ground station",
    "airship",
    "balloon",
    "rocket",
    "rover",
    "boat",
    "submarine",
    "hexarotor",
    "octorotor",
    "tricopter",
    "flapping wing",
    "kite",
    "onboard controller",
    "VTOL duo tailsitter",
    "VTOL quad tailsitter",
    "VTOL tiltrotor",
    "VTOL fixed rotor",
    "VTOL tailsitter",
    "VTOL tiltwing",
    "VTOL",
    "gimbal",
    "ADS-B",
    "parafoil",
    "dodecarotor",
    "camera",
    "charging station",
    "FLARM",
    "servo",
    "Open Drone ID",
    "decarotor",
    "battery",
    "parachute",
    "log",
    "OSD",
    "IMU",
    "GPS",
    "winch",
    "multirotor",
    "illuminator",
    "spacecraft",
    "ground quadruped",
    "VTOL gyrodyne",
    "gripper",
    "radio",
];

/// MAV_AUTOPILOT, from 0 on.
const AUTOPILOTS: [&str; 21] = [
    "generic",
    "reserved",
    "SLUGS",
    "ArduPilot",
    "OpenPilot",
    "generic (waypoints only)",
    "generic (waypoints, simple navigation)",
    "generic (full missions)",
    "none",
    "PPZ",
    "UDB",
    "FlexiPilot",
    "PX4",
    "SMACCMPilot",
    "AutoQuad",
    "Armazila",
    "Aerob",
    "ASLUAV",
    "SmartAP",
    "AirRails",
    "ReflexFC",
];

/// MAV_STATE, from 0 on.
const STATES: [&str; 9] = [
    "uninitialized",
    "booting",
    "calibrating",
    "standby",
    "active",
    "critical",
    "emergency",
    "powering off",
    "terminating flight",
];

impl From<Heartbeat> for Vehicle {
    fn from(heartbeat: Heartbeat) -> Self {
        let Heartbeat { kind, autopilot, state, .. } = heartbeat;
        Self {
            kind: name(&KINDS, kind, "type"),
            autopilot: name(&AUTOPILOTS, autopilot, "autopilot"),
            armed: match heartbeat.is_armed() {
                _ if !heartbeat.has_autopilot() => ArmedState::None,
                false => ArmedState::Disarmed,
                true => ArmedState::Armed,
            },
            state: name(&STATES, state, "state"),
        }
    }
}

/// A number that has no name yet is told with what it is.
fn name(names: &[&str], number: u8, what: &str) -> String {
    let name = names.get(usize::from(number));
    name.map_or_else(|| format!("{what} {number}"), |name| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vehicle(kind: u8, autopilot: u8, base_mode: u8, state: u8) -> Vehicle {
        Heartbeat { kind, autopilot, base_mode, state }.into()
    }

    #[test]
    fn a_heartbeat_is_told_in_words() {
        let copter = vehicle(2, 3, 0x81, 4);
        assert_eq!((copter.kind.as_str(), copter.autopilot.as_str()), ("quadrotor", "ArduPilot"));
        assert_eq!((copter.armed, copter.state.as_str()), (ArmedState::Armed, "active"));
        let plane = vehicle(1, 12, 0x51, 3);
        assert_eq!((plane.kind.as_str(), plane.autopilot.as_str()), ("fixed wing", "PX4"));
        assert_eq!((plane.armed, plane.state.as_str()), (ArmedState::Disarmed, "standby"));
        let station = vehicle(6, 8, 0xc0, 4);
        assert_eq!((station.kind.as_str(), station.armed), ("ground station", ArmedState::None));
        assert_eq!(vehicle(45, 20, 0, 8).kind, "spacecraft");
        assert_eq!(vehicle(49, 20, 0, 8).kind, "radio");
        assert_eq!(vehicle(200, 99, 0, 77).autopilot, "autopilot 99");
    }
}
