//! What a vehicle is asked: frames made into values, or not understood.

use super::mission::{Item, MissionType};
use crate::mavlink::{Component, Fields, Frame, Layout};

/// A request, and whom it is for: system 0 is everybody, component 0 all of a system (rule 36).
#[derive(Clone, Copy, Debug)]
pub(super) struct Addressed {
    pub(super) target: Component,
    pub(super) request: Request,
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Request {
    SetMode { base: u8, custom: u32 },
    ParamRead { index: i16, name: [u8; 16] },
    ParamList,
    ParamSet { name: [u8; 16], value: f32 },
    MissionUpload { kind: MissionType, seq: u16, item: Item },
    MissionPart { kind: MissionType, seq: u16 },
    MissionSetCurrent { seq: u16 },
    MissionList { kind: MissionType },
    MissionCount { kind: MissionType, count: u16 },
    MissionClear { kind: MissionType },
    MissionAck { result: u8 },
    Command(Command),
}

/// COMMAND_LONG or COMMAND_INT, as far as anything here wants to know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Command {
    /// MAV_CMD.
    pub(super) number: u16,
    pub(super) param1: f32,
    pub(super) param2: f32,
}

/// Whom a message is for stands at this offset; there is one, as the definitions below have it.
const MESSAGES: [(Layout, u8); 15] = [
    (Layout::new(11, 89), 4),
    (Layout::new(20, 214), 2),
    (Layout::new(21, 159), 0),
    (Layout::new(23, 168), 4),
    (Layout::new(39, 254), 32),
    (Layout::new(40, 230), 2),
    (Layout::new(41, 28), 2),
    (Layout::new(43, 132), 0),
    (Layout::new(44, 221), 2),
    (Layout::new(45, 232), 0),
    (Layout::new(47, 153), 0),
    (Layout::new(51, 196), 2),
    (Layout::new(73, 38), 32),
    (Layout::new(75, 158), 30),
    (Layout::new(76, 152), 30),
];

/// What a frame asks for; `None` if it asks for nothing, or for nothing known here.
pub(super) fn parse(frame: &Frame<'_>) -> Option<Addressed> {
    let id = frame.header().id;
    let (layout, target) = MESSAGES.iter().find(|(layout, _)| layout.id == id)?;
    if !layout.is_of(frame) {
        return None;
    }
    let fields = Fields(frame);
    let mut target = fields.component(*target);
    let request = match id.0 {
        11 => {
            // It names a system only; what stands behind that is another field.
            target.component = 0;
            Request::SetMode { base: fields.u8(5), custom: fields.u32(0) }
        }
        20 => Request::ParamRead { index: fields.i16(0), name: fields.bytes(4) },
        21 => Request::ParamList,
        23 => Request::ParamSet { name: fields.bytes(6), value: fields.f32(0) },
        75 | 76 => Request::Command(command(fields)),
        _ => mission(id.0, fields)?,
    };
    Some(Addressed { target, request })
}

fn mission(id: u32, fields: Fields<'_>) -> Option<Request> {
    let kind = |offset| MissionType(fields.u8(offset));
    Some(match id {
        39 | 73 => Request::MissionUpload {
            kind: kind(37),
            seq: fields.u16(28),
            item: item(fields, id == 39),
        },
        40 | 51 => Request::MissionPart { kind: kind(4), seq: fields.u16(0) },
        41 => Request::MissionSetCurrent { seq: fields.u16(0) },
        43 => Request::MissionList { kind: kind(2) },
        44 => Request::MissionCount { kind: kind(4), count: fields.u16(0) },
        45 => Request::MissionClear { kind: kind(2) },
        47 => Request::MissionAck { result: fields.u8(2) },
        _ => return None,
    })
}

/// The fields that COMMAND_LONG and COMMAND_INT have at the same places.
fn command(fields: Fields<'_>) -> Command {
    Command { number: fields.u16(28), param1: fields.f32(0), param2: fields.f32(4) }
}

/// `is_float`: latitude and longitude are degrees, as MISSION_ITEM has them.
fn item(fields: Fields<'_>, is_float: bool) -> Item {
    let degrees = |offset| (f64::from(fields.f32(offset)) * 1e7) as i32;
    let (x, y) =
        if is_float { (degrees(16), degrees(20)) } else { (fields.i32(16), fields.i32(20)) };
    Item {
        params: std::array::from_fn(|at| fields.f32(at as u8 * 4)),
        x,
        y,
        z: fields.f32(24),
        command: fields.u16(30),
        frame: fields.u8(34),
        autocontinue: fields.u8(36),
    }
}

/// The ids that are looked at, with their CRC_EXTRA: for the fuzzer.
pub(super) fn understood() -> impl Iterator<Item = Layout> {
    MESSAGES.into_iter().map(|(layout, _)| layout)
}
