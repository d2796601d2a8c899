//! One vehicle: what it is, where it is, and what it has to say.

use std::collections::VecDeque;

use super::flight::{Circle, Habit, Motion, Place, VehicleKind};
use super::messages::{self, Heartbeat};
use super::mission::Mission;
use super::parameters::Parameters;
use super::requests::Request;
use super::streams::{Schedule, Stream};
use crate::mavlink::{Component, Payload};
use crate::routing::Time;

/// How many answers may wait; what comes on top gets none, as on a link that is too slow.
const MAX_REPLIES: usize = 32;

// MAV_MODE_FLAG.
const CUSTOM_MODE: u8 = 1;
const ARMED: u8 = 128;
/// Stabilized, guided and automatic.
const AUTO: u8 = 16 | 8 | 4;

/// A simulated vehicle.
#[derive(Clone, Debug)]
pub(super) struct Vehicle {
    id: Component,
    kind: VehicleKind,
    habit: Habit,
    seq: u8,
    /// Without [`ARMED`].
    base_mode: u8,
    custom_mode: u32,
    is_armed: bool,
    is_moving: bool,
    circle: Circle,
    /// The time for which `circle` holds.
    moved: Time,
    parameters: Parameters,
    mission: Mission,
    schedule: Schedule,
    replies: VecDeque<Payload>,
}

impl Vehicle {
    /// The vehicle with this number, counted from 0; its motion is told at `rate` Hz.
    pub(super) fn new(system: u8, number: usize, kind: VehicleKind, rate: u16, now: Time) -> Self {
        let habit = kind.habit();
        let home = Place::home(number, habit.radius);
        Self {
            id: Component::new(system, Component::AUTOPILOT),
            kind,
            habit,
            seq: 0,
            base_mode: AUTO,
            custom_mode: 0,
            is_armed: true,
            is_moving: true,
            // Not all at the same point of their circles.
            circle: Circle { home, bearing: number as f64 % std::f64::consts::TAU },
            moved: now,
            parameters: Parameters::new(system, habit),
            mission: Mission::around(home, habit.radius, habit.altitude),
            schedule: Schedule::new(rate, number, now),
            replies: VecDeque::new(),
        }
    }

    pub(super) fn system(&self) -> u8 {
        self.id.system
    }

    pub(super) fn kind(&self) -> VehicleKind {
        self.kind
    }

    pub(super) fn home(&self) -> Place {
        self.circle.home
    }

    pub(super) fn schedule_mut(&mut self) -> &mut Schedule {
        &mut self.schedule
    }

    /// Answers what is asked of this component.
    pub(super) fn handle(&mut self, from: Component, request: &Request, now: Time) {
        match *request {
            Request::SetMode { base, custom } => self.set_mode(base, custom),
            Request::ParamList => self.parameters.ask_all(),
            Request::ParamRead { index, name } => self.parameters.ask(index, &name),
            Request::ParamSet { name, value } => {
                self.move_on(now);
                self.parameters.set(&name, value);
            }
            Request::Command(command) => {
                self.move_on(now);
                self.handle_command(from, &command, now);
            }
            _ => self.handle_mission(from, request, now),
        }
    }

    fn handle_mission(&mut self, from: Component, request: &Request, now: Time) {
        let mission = &mut self.mission;
        let reply = match *request {
            Request::MissionList { kind } => mission.list(from, kind),
            Request::MissionPart { kind, seq } => mission.item(from, kind, seq),
            Request::MissionClear { kind } => mission.clear(from, kind),
            Request::MissionSetCurrent { seq } => mission.set_current(seq),
            Request::MissionCount { kind, count } => mission.begin(from, kind, count, now),
            Request::MissionUpload { kind, seq, item } => {
                mission.receive(from, kind, seq, item, now)
            }
            Request::MissionAck { result } => return mission.handle_ack(from, result),
            _ => return,
        };
        self.reply(reply);
    }

    /// Has something said as soon as its turn comes.
    pub(super) fn reply(&mut self, payload: Payload) {
        if self.replies.len() < MAX_REPLIES {
            self.replies.push_back(payload);
        }
    }

    /// The same, but before all else.
    pub(super) fn reply_first(&mut self, payload: Payload) {
        if self.replies.len() < MAX_REPLIES {
            self.replies.push_front(payload);
        }
    }

    /// Arms for 1 and disarms for 0; says whether it was one of these. Who disarms is down.
    pub(super) fn arm(&mut self, param: f32) -> bool {
        if param == 1.0 {
            self.is_armed = true;
            // On wheels and on the water there is nothing to wait for.
            self.is_moving |= !self.kind.flies();
        } else if param == 0.0 {
            self.land();
        } else {
            return false;
        }
        true
    }

    /// Goes up and round, if it is armed; says whether it is.
    pub(super) fn take_off(&mut self) -> bool {
        self.is_moving = self.is_armed;
        self.is_armed
    }

    /// Comes down where it is, and disarms.
    pub(super) fn land(&mut self) {
        (self.is_armed, self.is_moving) = (false, false);
    }

    /// Has this mode from now on. It flies as before.
    pub(super) fn set_mode(&mut self, base: u8, custom: u32) {
        self.base_mode = base & !ARMED;
        self.custom_mode = if base & CUSTOM_MODE != 0 { custom } else { 0 };
    }

    /// When it next has something to say of its own accord.
    pub(super) fn next_due(&self) -> Option<Time> {
        if !self.replies.is_empty() {
            return Some(Time::ZERO);
        }
        self.schedule.next_due().into_iter().chain(self.mission.deadline()).min()
    }

    /// Appends the next frame that is due; says whether there was one.
    pub(super) fn poll(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        let answer = self.replies.pop_front().or_else(|| self.mission.handle_timeout(now));
        let next = answer.or_else(|| {
            let stream = self.schedule.poll(now)?;
            Some(self.message(stream, now))
        });
        let Some(payload) = next else { return false };
        self.say(&payload, out);
        true
    }

    /// Appends the next parameter that somebody waits for; says whether there was one.
    pub(super) fn poll_parameter(&mut self, out: &mut Vec<u8>) -> bool {
        let Some(payload) = self.parameters.poll() else { return false };
        self.say(&payload, out);
        true
    }

    pub(super) fn has_untold_parameters(&self) -> bool {
        self.parameters.has_untold()
    }

    fn say(&mut self, payload: &Payload, out: &mut Vec<u8>) {
        payload.encode(self.id, self.seq, out);
        self.seq = self.seq.wrapping_add(1);
    }

    /// What a message of its own accord says at `now`.
    pub(super) fn message(&mut self, stream: Stream, now: Time) -> Payload {
        self.move_on(now);
        let (micros, millis) = (now.as_micros(), (now.as_micros() / 1_000) as u32);
        match stream {
            Stream::Heartbeat => messages::heartbeat(self.heartbeat()),
            Stream::SysStatus => messages::sys_status(self.parameters.millivolts(), 87),
            Stream::ExtendedSysState => messages::extended_sys_state(self.landed_state()),
            Stream::GpsRawInt => {
                messages::gps_raw_int(micros, &self.motion(), self.parameters.satellites())
            }
            Stream::Attitude => messages::attitude(millis, &self.motion()),
            Stream::GlobalPositionInt => messages::global_position_int(millis, &self.motion()),
            Stream::VfrHud => messages::vfr_hud(&self.motion()),
        }
    }

    fn heartbeat(&self) -> Heartbeat {
        let armed = if self.is_armed { ARMED } else { 0 };
        Heartbeat {
            kind: self.habit.mav_type,
            base_mode: self.base_mode | armed,
            custom_mode: self.custom_mode,
            // MAV_STATE_ACTIVE or MAV_STATE_STANDBY.
            state: if self.is_armed { 4 } else { 3 },
        }
    }

    /// MAV_LANDED_STATE: on the ground, or in the air.
    fn landed_state(&self) -> u8 {
        if self.is_moving && self.kind.flies() { 2 } else { 1 }
    }

    fn motion(&self) -> Motion {
        let (speed, altitude) = if self.is_moving {
            (self.parameters.speed(), self.parameters.altitude())
        } else {
            (0.0, 0.0)
        };
        self.circle.motion(self.parameters.radius(), speed, altitude, self.kind.flies())
    }

    /// Goes on along the circle until `now`.
    fn move_on(&mut self, now: Time) {
        if self.is_moving {
            let passed = now.since(self.moved);
            self.circle.advance(self.parameters.radius(), self.parameters.speed(), passed);
        }
        self.moved = now;
    }
}
