//! Many vehicles on one link, one system id each.

use std::fmt;

use super::flight::VehicleKind;
use super::requests::{self, Addressed};
use super::vehicle::Vehicle;
use crate::mavlink::{Component, Frame, Timing};
use crate::routing::{LocalPeer, Precedence, Time};

/// How many vehicles there may be: some system ids are left for ground stations.
pub const MAX_VEHICLES: u8 = 250;

/// How often motion may be told, in Hz.
pub const MAX_RATE: u16 = 100;

/// What to simulate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SwarmOptions {
    /// How many vehicles, 1..=[`MAX_VEHICLES`].
    pub count: u8,
    /// The system id of the first, 1..=255; the others follow, as far as there are ids.
    pub system: u8,
    /// Their kind.
    pub vehicle: VehicleKind,
    /// How often each tells how it moves, in Hz, 1..=[`MAX_RATE`].
    pub rate: u16,
}

impl Default for SwarmOptions {
    fn default() -> Self {
        Self { count: 1, system: 1, vehicle: VehicleKind::default(), rate: 4 }
    }
}

impl SwarmOptions {
    /// Whether there are system ids for so many.
    pub fn has_ids(&self) -> bool {
        u16::from(self.system) + u16::from(self.count) <= u16::from(u8::MAX) + 1
    }
}

/// `a simulated copter, system 1`; `3 simulated vehicles (copter), systems 1 to 3`
impl fmt::Display for SwarmOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, system, vehicle, .. } = self;
        match count {
            1 => write!(f, "a simulated {vehicle}, system {system}"),
            // Not more than there are ids.
            _ => {
                let last = system.saturating_add(count - 1);
                write!(f, "{count} simulated vehicles ({vehicle}), systems {system} to {last}")
            }
        }
    }
}

/// The vehicles.
#[derive(Debug)]
pub struct Swarm {
    /// In the order of their system ids, the first of which is that of the options.
    vehicles: Vec<Vehicle>,
    first: u8,
    /// Whose turn it is to speak, and to tell a parameter.
    speaker: usize,
    teller: usize,
}

impl Swarm {
    /// Vehicles that begin to move at `now`.
    pub fn new(options: SwarmOptions, now: Time) -> Self {
        let ids = options.system..=u8::MAX;
        let ids = ids.take(usize::from(options.count)).enumerate();
        let vehicle =
            |(number, system)| Vehicle::new(system, number, options.vehicle, options.rate, now);
        let vehicles = ids.map(vehicle).collect();
        Self { vehicles, first: options.system, speaker: 0, teller: 0 }
    }

    /// Those whom a target means: all for system 0.
    fn addressed(&mut self, target: Component) -> &mut [Vehicle] {
        // 0 and 1 are all components of a system, and its autopilot.
        if target.component > 1 {
            return &mut [];
        }
        match target.system {
            0 => &mut self.vehicles,
            system => {
                let number = usize::from(system).checked_sub(usize::from(self.first));
                let vehicle = number.and_then(|number| self.vehicles.get_mut(number));
                vehicle.map_or(&mut [], std::slice::from_mut)
            }
        }
    }
}

impl LocalPeer for Swarm {
    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time) {
        let from = frame.header().source;
        if let Some(timing) = Timing::read(frame) {
            if let Some(answer) = timing.answer(from, now.as_nanos()) {
                self.addressed(timing.target()).iter_mut().for_each(|it| it.reply(answer));
            }
            return;
        }
        let Some(Addressed { target, request }) = requests::parse(frame) else { return };
        for vehicle in self.addressed(target) {
            vehicle.handle(from, &request, now);
        }
    }

    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        for _ in 0..self.vehicles.len() {
            let vehicle = &mut self.vehicles[self.speaker];
            if vehicle.next_due().is_some_and(|due| due <= now) && vehicle.poll(now, out) {
                return true;
            }
            self.speaker = (self.speaker + 1) % self.vehicles.len();
        }
        false
    }

    /// Parameters can wait, up to the room that is kept for heartbeats and acknowledgements.
    fn bulk(&self, _now: Time) -> Option<Precedence> {
        let has_some = self.vehicles.iter().any(Vehicle::has_untold_parameters);
        has_some.then_some(Precedence::Immediate)
    }

    fn poll_bulk(&mut self, _now: Time, out: &mut Vec<u8>) -> bool {
        for _ in 0..self.vehicles.len() {
            self.teller = (self.teller + 1) % self.vehicles.len();
            if self.vehicles[self.teller].poll_parameter(out) {
                return true;
            }
        }
        false
    }

    fn poll_timeout(&self) -> Option<Time> {
        self.vehicles.iter().filter_map(Vehicle::next_due).min()
    }
}

#[cfg(test)]
mod tests;
