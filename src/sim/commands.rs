//! What a vehicle does when it is commanded, and what it answers.

use super::messages;
use super::requests::Command;
use super::streams::Stream;
use super::vehicle::Vehicle;
use crate::mavlink::{Component, Payload};
use crate::routing::Time;

/// MAV_RESULT.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Outcome {
    Accepted = 0,
    Denied = 2,
    Unsupported = 3,
}

// MAV_CMD.
const NAV_RETURN_TO_LAUNCH: u16 = 20;
const NAV_LAND: u16 = 21;
const NAV_TAKEOFF: u16 = 22;
const DO_SET_MODE: u16 = 176;
const COMPONENT_ARM_DISARM: u16 = 400;
const GET_HOME_POSITION: u16 = 410;
const GET_MESSAGE_INTERVAL: u16 = 510;
const SET_MESSAGE_INTERVAL: u16 = 511;
const REQUEST_MESSAGE: u16 = 512;
const REQUEST_AUTOPILOT_CAPABILITIES: u16 = 520;

// Messages that are sent on request only.
const AUTOPILOT_VERSION: u32 = 148;
const HOME_POSITION: u32 = 242;

/// MAV_PROTOCOL_CAPABILITY: parameters as floats in their own bytes, missions and commands with
/// integer positions, MAVLink 2.
const CAPABILITIES: u64 = 2 | 4 | 8 | 8_192 | 131_072;

impl Vehicle {
    /// Obeys, or does not, and says so.
    pub(super) fn handle_command(&mut self, from: Component, command: &Command, now: Time) {
        let outcome = self.obey(command, now);
        let ack = messages::command_ack(command.number, outcome as u8, from);
        // The acknowledgement goes before what was asked for.
        self.reply_first(ack);
    }

    fn obey(&mut self, command: &Command, now: Time) -> Outcome {
        let Command { number, param1, param2 } = *command;
        match number {
            COMPONENT_ARM_DISARM => accept_if(self.arm(param1)),
            NAV_TAKEOFF if self.kind().flies() => accept_if(self.take_off()),
            NAV_LAND | NAV_RETURN_TO_LAUNCH if self.kind().flies() => {
                self.land();
                Outcome::Accepted
            }
            DO_SET_MODE => {
                self.set_mode(param1 as u8, param2 as u32);
                Outcome::Accepted
            }
            GET_HOME_POSITION => self.send(HOME_POSITION, now),
            REQUEST_MESSAGE => self.send(param1 as u32, now),
            REQUEST_AUTOPILOT_CAPABILITIES if param1 == 1.0 => self.send(AUTOPILOT_VERSION, now),
            SET_MESSAGE_INTERVAL => match Stream::of(param1 as u32) {
                Some(stream) => accept_if(self.schedule_mut().set(stream, param2, now)),
                None => Outcome::Unsupported,
            },
            GET_MESSAGE_INTERVAL => self.tell_interval(param1 as u32),
            _ => Outcome::Unsupported,
        }
    }

    /// Sends a message once, if it is one that this vehicle has.
    fn send(&mut self, id: u32, now: Time) -> Outcome {
        let payload = match (id, Stream::of(id)) {
            (AUTOPILOT_VERSION, _) => {
                messages::autopilot_version(CAPABILITIES, u64::from(self.system()))
            }
            (HOME_POSITION, _) => messages::home_position(self.home().scaled(), now.as_micros()),
            (_, Some(stream)) => self.message(stream, now),
            (_, None) => return Outcome::Unsupported,
        };
        self.reply(payload);
        Outcome::Accepted
    }

    fn tell_interval(&mut self, id: u32) -> Outcome {
        let Some(stream) = Stream::of(id) else { return Outcome::Unsupported };
        let interval = self.schedule_mut().interval(stream);
        // At most a minute.
        let micros = interval.map_or(-1, |interval| interval.as_micros() as i32);
        self.reply(interval_of(id, micros));
        Outcome::Accepted
    }
}

/// The ids of all that is sent fit in the field.
fn interval_of(id: u32, micros: i32) -> Payload {
    messages::message_interval(id as u16, micros)
}

fn accept_if(is_done: bool) -> Outcome {
    if is_done { Outcome::Accepted } else { Outcome::Denied }
}
