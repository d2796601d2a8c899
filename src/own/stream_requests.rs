//! Which vehicles are asked for their telemetry, and when.
//!
//! ArduPilot sends little but HEARTBEAT until somebody asks for streams by REQUEST_DATA_STREAM. A
//! vehicle is asked when it is heard for the first time on a link, when it comes back or has started
//! again, and every 30 s, for whoever else has asked meanwhile.

use std::time::Duration;

use super::Place;
use crate::mavlink::{Component, Layout, MessageId, Payload};
use crate::routing::{Heartbeat, Time};

/// How often a vehicle is asked in any case.
const PERIOD: Duration = Duration::from_secs(30);

/// How many vehicles are asked in one second: the others have their turn in the next.
const A_SECOND: usize = 16;

/// MAV_DATA_STREAM: raw sensors, extended status, RC channels, position, extra 1 to 3. The rest is
/// of no use to ground stations.
const STREAMS: [u8; 7] = [1, 2, 3, 6, 10, 11, 12];

/// A vehicle on a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Vehicle {
    /// Where.
    pub place: Place,
    /// Who.
    pub component: Component,
    /// Its last SYSTEM_TIME.time_boot_ms there, if it has said so: a smaller one is a new start
    /// (rule 44).
    pub boot_ms: Option<u32>,
}

impl Vehicle {
    /// For how long one may be silent and still be there: one that comes back is asked again.
    pub const SILENCE: Duration = Duration::from_secs(3);

    /// Whether a component that says this of itself is a vehicle that has to be asked: ArduPilot, and
    /// neither gimbal nor camera nor anything else that it may have on board.
    pub fn has_to_be_asked(heartbeat: &Heartbeat) -> bool {
        // MAV_TYPE: ground station, onboard controller; gimbal to servo, but for the parafoil and the
        // dodecarotor; Open Drone ID; battery to winch; illuminator; gripper and radio.
        let is_part = matches!(heartbeat.kind, 6 | 18 | 26 | 27 | 30..=34 | 36..=42 | 44 | 48 | 49);
        heartbeat.autopilot == Heartbeat::ARDUPILOT && !is_part
    }
}

/// The vehicles that were asked.
#[derive(Default, Debug)]
pub(super) struct StreamRequests {
    asked: Vec<Asked>,
    /// How many were asked in this second.
    count: usize,
}

#[derive(Debug)]
struct Asked {
    vehicle: Vehicle,
    rate: u8,
    at: Time,
    /// Whether it is there in this second.
    is_there: bool,
}

impl StreamRequests {
    pub(super) fn begin_second(&mut self) {
        self.count = 0;
        self.asked.iter_mut().for_each(|asked| asked.is_there = false);
    }

    /// A vehicle is there: whether it is to be asked now.
    pub(super) fn is_due(&mut self, vehicle: &Vehicle, rate: u8, now: Time) -> bool {
        let key = |it: &Vehicle| (it.place, it.component);
        let known = self.asked.iter_mut().find(|asked| key(&asked.vehicle) == key(vehicle));
        let has_turn = self.count < A_SECOND;
        let new = Asked { vehicle: *vehicle, rate, at: now, is_there: true };
        let is_due = match known {
            None if has_turn => {
                self.asked.push(new);
                true
            }
            None => false,
            Some(known) if known.is_due(vehicle, rate, now) && has_turn => {
                *known = new;
                true
            }
            Some(known) => {
                known.is_there = true;
                // As long as it has no turn, it is to be seen that it started again.
                known.vehicle.boot_ms = known.vehicle.boot_ms.max(vehicle.boot_ms);
                false
            }
        };
        self.count += usize::from(is_due);
        is_due
    }

    /// Forgets those that are not there any more.
    pub(super) fn end_second(&mut self) {
        self.asked.retain(|asked| asked.is_there);
    }
}

impl Asked {
    fn is_due(&self, vehicle: &Vehicle, rate: u8, now: Time) -> bool {
        let has_restarted = match (vehicle.boot_ms, self.vehicle.boot_ms) {
            (Some(boot_ms), Some(before)) => boot_ms < before,
            _ => false,
        };
        has_restarted || self.rate != rate || now.since(self.at) >= PERIOD
    }
}

/// REQUEST_DATA_STREAM for each of the streams.
pub(super) fn requests(to: Component, rate: u8) -> impl Iterator<Item = Payload> {
    const START: u8 = 1;
    const LAYOUT: Layout = Layout { id: MessageId::REQUEST_DATA_STREAM, crc_extra: 148 };
    STREAMS.into_iter().map(move |stream| {
        Payload::new(LAYOUT, 6)
            .with(0, u16::from(rate).to_le_bytes())
            .with(2, [to.system, to.component, stream, START])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::routing::LinkId;

    fn vehicle(system: u8, boot_ms: Option<u32>) -> Vehicle {
        let place = Place { link: LinkId::new(0).unwrap(), since: Time::ZERO };
        Vehicle { place, component: Component::new(system, 1), boot_ms }
    }

    /// The seconds in which a vehicle is asked that is there with this time since boot.
    fn asked(boot_ms: &[Option<Option<u32>>]) -> Vec<usize> {
        let mut requests = StreamRequests::default();
        let mut seconds = Vec::new();
        for (n, boot_ms) in boot_ms.iter().enumerate() {
            let now = Time::from_millis(n as u64 * 1_000);
            requests.begin_second();
            if let Some(boot_ms) = boot_ms
                && requests.is_due(&vehicle(1, *boot_ms), 4, now)
            {
                seconds.push(n);
            }
            requests.end_second();
        }
        seconds
    }

    #[test]
    fn a_vehicle_is_asked_at_once_and_every_30_s() {
        assert_eq!(asked(&[Some(None); 65]), [0, 30, 60]);
    }

    #[test]
    fn one_that_started_again_or_came_back_is_asked_again() {
        let rising = |n: u32| Some(Some(n * 1_000));
        assert_eq!(asked(&[rising(7), rising(8), rising(9), rising(0), rising(1)]), [0, 3]);
        assert_eq!(asked(&[Some(None), Some(None), None, Some(None), Some(None)]), [0, 3]);
    }

    #[test]
    fn another_rate_is_asked_for_at_once() {
        let mut requests = StreamRequests::default();
        requests.begin_second();
        let due = [4, 4, 5].map(|rate| requests.is_due(&vehicle(1, None), rate, Time::ZERO));
        assert_eq!(due, [true, false, true]);
    }

    #[test]
    fn of_a_swarm_some_are_asked_each_second_until_all_were() {
        let mut requests = StreamRequests::default();
        let counts = (0..4).map(|n| {
            requests.begin_second();
            let now = Time::from_millis(n * 1_000);
            let count = (1..=40).filter(|id| requests.is_due(&vehicle(*id, None), 4, now)).count();
            requests.end_second();
            count
        });
        assert_eq!(counts.collect::<Vec<_>>(), [16, 16, 8, 0]);
    }

    #[test]
    fn ardupilot_is_asked_and_neither_px4_nor_what_is_no_vehicle() {
        let asked = |kind, autopilot| {
            let heartbeat = Heartbeat { kind, autopilot, base_mode: 0, state: 4 };
            Vehicle::has_to_be_asked(&heartbeat)
        };
        // Copter, plane, rover, submarine, tracker, gyrodyne; PX4, nobody's.
        for kind in [2, 1, 10, 12, 5, 28, 29, 35, 43, 46, 47] {
            assert!(asked(kind, 3) && !asked(kind, 12) && !asked(kind, 8), "{kind}");
        }
        // Gimbal, camera, ground station, onboard controller, ADS-B, gripper, radio.
        for kind in [26, 30, 6, 18, 27, 48, 49] {
            assert!(!asked(kind, 3), "{kind}");
        }
    }
}
