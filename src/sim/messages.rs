//! What a vehicle says: one function a message. The offsets are those of the published definitions,
//! fields sorted by size, extensions behind them.

use super::flight::Motion;
use super::mission::{Item, MissionType};
use crate::mavlink::{Component, Layout, Payload};

/// MAV_AUTOPILOT_GENERIC. Who claims to be ArduPilot or PX4 is expected to have their parameters:
/// QGroundControl tells at length of each that is missing.
const GENERIC: u8 = 0;

/// What HEARTBEAT tells of a vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heartbeat {
    /// MAV_TYPE.
    pub(super) kind: u8,
    /// MAV_MODE_FLAG.
    pub(super) base_mode: u8,
    pub(super) custom_mode: u32,
    /// MAV_STATE.
    pub(super) state: u8,
}

pub(super) fn heartbeat(it: Heartbeat) -> Payload {
    Payload::new(Layout::new(0, 50), 9)
        .with(0, it.custom_mode.to_le_bytes())
        .with(4, [it.kind, GENERIC, it.base_mode, it.state, 3])
}

/// SYS_STATUS: everything a healthy vehicle has, and its battery in millivolts and per cent.
pub(super) fn sys_status(millivolts: u16, remaining: i8) -> Payload {
    // Gyroscope, accelerometer, magnetometer, barometer, GPS; rates, attitude, yaw, altitude and
    // position under control; motors, AHRS, battery.
    const SENSORS: u32 = 0x0220_fc2f;
    Payload::new(Layout::new(1, 124), 43)
        .with(0, SENSORS.to_le_bytes())
        .with(4, SENSORS.to_le_bytes())
        .with(8, SENSORS.to_le_bytes())
        .with(12, 180_u16.to_le_bytes())
        .with(14, millivolts.to_le_bytes())
        .with(16, 1_250_i16.to_le_bytes())
        .with(30, remaining.to_le_bytes())
}

pub(super) fn attitude(boot_ms: u32, it: &Motion) -> Payload {
    Payload::new(Layout::new(30, 39), 28)
        .with(0, boot_ms.to_le_bytes())
        .with(4, it.roll.to_le_bytes())
        .with(8, it.pitch.to_le_bytes())
        .with(12, it.yaw.to_le_bytes())
        .with(24, it.yaw_rate.to_le_bytes())
}

pub(super) fn global_position_int(boot_ms: u32, it: &Motion) -> Payload {
    Payload::new(Layout::new(33, 104), 28)
        .with(0, boot_ms.to_le_bytes())
        .with(4, it.lat.to_le_bytes())
        .with(8, it.lon.to_le_bytes())
        .with(12, it.alt_mm.to_le_bytes())
        .with(16, it.relative_alt_mm.to_le_bytes())
        .with(20, it.north_cm_s.to_le_bytes())
        .with(22, it.east_cm_s.to_le_bytes())
        .with(26, it.heading_cdeg.to_le_bytes())
}

/// GPS_RAW_INT with a fix by so many satellites; without any, it has none.
pub(super) fn gps_raw_int(boot_us: u64, it: &Motion, satellites: u8) -> Payload {
    // GPS_FIX_TYPE_3D_FIX, or GPS_FIX_TYPE_NO_FIX.
    let fix = if satellites >= 4 { 3 } else { 1 };
    Payload::new(Layout::new(24, 24), 52)
        .with(0, boot_us.to_le_bytes())
        .with(8, it.lat.to_le_bytes())
        .with(12, it.lon.to_le_bytes())
        .with(16, it.alt_mm.to_le_bytes())
        .with(20, 90_u16.to_le_bytes())
        .with(22, 140_u16.to_le_bytes())
        .with(24, it.speed_cm_s.to_le_bytes())
        .with(26, it.heading_cdeg.to_le_bytes())
        .with(28, [fix, satellites])
}

pub(super) fn vfr_hud(it: &Motion) -> Payload {
    let heading = it.heading_cdeg / 100;
    Payload::new(Layout::new(74, 20), 20)
        .with(0, it.speed.to_le_bytes())
        .with(4, it.speed.to_le_bytes())
        .with(8, (it.alt_mm as f32 / 1_000.0).to_le_bytes())
        .with(16, heading.to_le_bytes())
        .with(18, it.throttle.to_le_bytes())
}

/// EXTENDED_SYS_STATE: on the ground, or in the air.
pub(super) fn extended_sys_state(landed_state: u8) -> Payload {
    Payload::new(Layout::new(245, 130), 2).with(1, [landed_state])
}

/// PARAM_VALUE: a name of up to 16 bytes, and its value as MAV_PARAM_TYPE_REAL32.
pub(super) fn param_value(name: &str, value: f32, index: u16, count: u16) -> Payload {
    const REAL32: u8 = 9;
    let mut id = [0; 16];
    let len = name.len().min(id.len());
    id[..len].copy_from_slice(&name.as_bytes()[..len]);
    Payload::new(Layout::new(22, 220), 25)
        .with(0, value.to_le_bytes())
        .with(4, count.to_le_bytes())
        .with(6, index.to_le_bytes())
        .with(8, id)
        .with(24, [REAL32])
}

/// COMMAND_ACK: a MAV_RESULT for whoever gave the command.
pub(super) fn command_ack(command: u16, result: u8, to: Component) -> Payload {
    Payload::new(Layout::new(77, 143), 10)
        .with(0, command.to_le_bytes())
        .with(2, [result])
        .with(8, [to.system, to.component])
}

pub(super) fn autopilot_version(capabilities: u64, uid: u64) -> Payload {
    let number = |text: &str| text.parse().unwrap_or(0);
    let patch = number(env!("CARGO_PKG_VERSION_PATCH"));
    let minor = number(env!("CARGO_PKG_VERSION_MINOR"));
    let version = [0, patch, minor, number(env!("CARGO_PKG_VERSION_MAJOR"))];
    Payload::new(Layout::new(148, 178), 78)
        .with(0, capabilities.to_le_bytes())
        .with(8, uid.to_le_bytes())
        .with(16, version)
}

/// HOME_POSITION: latitude, longitude in 1e-7 degrees, altitude in millimetres.
pub(super) fn home_position((lat, lon, alt_mm): (i32, i32, i32), boot_us: u64) -> Payload {
    Payload::new(Layout::new(242, 104), 60)
        .with(0, lat.to_le_bytes())
        .with(4, lon.to_le_bytes())
        .with(8, alt_mm.to_le_bytes())
        // The attitude there: level, facing north.
        .with(24, 1_f32.to_le_bytes())
        .with(52, boot_us.to_le_bytes())
}

/// MESSAGE_INTERVAL in microseconds; -1: not sent, 0: not known here.
pub(super) fn message_interval(id: u16, interval_us: i32) -> Payload {
    Payload::new(Layout::new(244, 95), 6)
        .with(0, interval_us.to_le_bytes())
        .with(4, id.to_le_bytes())
}

pub(super) fn mission_count(to: Component, kind: MissionType, count: u16) -> Payload {
    Payload::new(Layout::new(44, 221), 5)
        .with(0, count.to_le_bytes())
        .with(2, [to.system, to.component, kind.0])
}

pub(super) fn mission_request_int(to: Component, kind: MissionType, seq: u16) -> Payload {
    Payload::new(Layout::new(51, 196), 5)
        .with(0, seq.to_le_bytes())
        .with(2, [to.system, to.component, kind.0])
}

pub(super) fn mission_item_int(to: Component, seq: u16, is_current: bool, it: &Item) -> Payload {
    let mut payload = Payload::new(Layout::new(73, 38), 38);
    for (at, param) in it.params.iter().enumerate() {
        payload = payload.with(at * 4, param.to_le_bytes());
    }
    payload
        .with(16, it.x.to_le_bytes())
        .with(20, it.y.to_le_bytes())
        .with(24, it.z.to_le_bytes())
        .with(28, seq.to_le_bytes())
        .with(30, it.command.to_le_bytes())
        .with(32, [to.system, to.component, it.frame, u8::from(is_current), it.autocontinue])
}

/// MISSION_ACK: a MAV_MISSION_RESULT.
pub(super) fn mission_ack(to: Component, kind: MissionType, result: u8) -> Payload {
    Payload::new(Layout::new(47, 153), 4).with(0, [to.system, to.component, result, kind.0])
}

pub(super) fn mission_current(seq: u16) -> Payload {
    Payload::new(Layout::new(42, 28), 2).with(0, seq.to_le_bytes())
}
