//! The parameters of a vehicle: a dozen numbers, some of which change how it moves.

use super::flight::Habit;
use super::messages;
use crate::mavlink::Payload;

/// How many there are.
pub(super) const COUNT: usize = 12;

/// One row of the table.
struct Row {
    name: &'static str,
    default: f32,
    /// What it may be set to; to nothing, if both are the same.
    range: (f32, f32),
}

const fn row(name: &'static str, default: f32, min: f32, max: f32) -> Row {
    Row { name, default, range: (min, max) }
}

/// In the order of their indices; the first four have their defaults from the vehicle.
const ROWS: [Row; COUNT] = [
    row("SYSID_THISMAV", 0.0, 0.0, 0.0),
    row("SIM_RADIUS", 0.0, 1.0, 10_000.0),
    row("SIM_SPEED", 0.0, 0.0, 100.0),
    row("SIM_ALT", 0.0, 0.0, 5_000.0),
    row("SIM_GPS_SATS", 14.0, 0.0, 40.0),
    row("SIM_BATT_VOLT", 15.8, 0.0, 60.0),
    row("BATT_CAPACITY", 5_200.0, 0.0, 1_000_000.0),
    row("WP_RADIUS", 2.0, 0.1, 1_000.0),
    row("RTL_ALT", 15.0, 0.0, 5_000.0),
    row("FENCE_ENABLE", 0.0, 0.0, 1.0),
    row("FENCE_RADIUS", 300.0, 1.0, 100_000.0),
    row("FENCE_ALT_MAX", 120.0, 1.0, 10_000.0),
];

const RADIUS: usize = 1;
const SPEED: usize = 2;
const ALTITUDE: usize = 3;
const SATELLITES: usize = 4;
const VOLTS: usize = 5;

/// The values of one vehicle, and which of them are yet to be told.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    values: [f32; COUNT],
    /// One bit each: however often they are asked for, they are told once.
    untold: u16,
}

impl Parameters {
    pub(super) fn new(system: u8, habit: Habit) -> Self {
        let mut values = std::array::from_fn(|at| ROWS[at].default);
        values[0] = f32::from(system);
        values[RADIUS] = habit.radius;
        values[SPEED] = habit.speed;
        values[ALTITUDE] = habit.altitude;
        Self { values, untold: 0 }
    }

    /// Metres, at least 1.
    pub(super) fn radius(&self) -> f32 {
        self.values[RADIUS]
    }

    /// Metres a second.
    pub(super) fn speed(&self) -> f32 {
        self.values[SPEED]
    }

    /// Metres.
    pub(super) fn altitude(&self) -> f32 {
        self.values[ALTITUDE]
    }

    pub(super) fn satellites(&self) -> u8 {
        self.values[SATELLITES] as u8
    }

    pub(super) fn millivolts(&self) -> u16 {
        (self.values[VOLTS] * 1_000.0) as u16
    }

    /// All are to be told.
    pub(super) fn ask_all(&mut self) {
        self.untold = (1 << COUNT) - 1;
    }

    /// One is to be told: by its index, or by name if that is negative.
    pub(super) fn ask(&mut self, index: i16, name: &[u8]) {
        let at = usize::try_from(index).ok().or_else(|| find(name));
        if let Some(at) = at.filter(|at| *at < COUNT) {
            self.untold |= 1 << at;
        }
    }

    /// Sets one, if the value is in its range, and has it told in any case: what is told is what
    /// holds.
    pub(super) fn set(&mut self, name: &[u8], value: f32) {
        let Some(at) = find(name) else { return };
        let (min, max) = ROWS[at].range;
        if min < max && (min..=max).contains(&value) {
            self.values[at] = value;
        }
        self.untold |= 1 << at;
    }

    pub(super) fn has_untold(&self) -> bool {
        self.untold != 0
    }

    /// The next one to be told.
    pub(super) fn poll(&mut self) -> Option<Payload> {
        // Below COUNT, or 16 if there is none.
        let at = self.untold.trailing_zeros() as usize;
        let row = ROWS.get(at)?;
        self.untold &= self.untold - 1;
        Some(messages::param_value(row.name, self.values[at], at as u16, COUNT as u16))
    }
}

/// Names end with their field of 16 bytes, or with a zero.
fn find(name: &[u8]) -> Option<usize> {
    let end = name.iter().position(|byte| *byte == 0).unwrap_or(name.len());
    ROWS.iter().position(|row| row.name.as_bytes() == &name[..end])
}

// They are told by bits of a number.
const _: () = assert!(COUNT < 16);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::VehicleKind;

    #[test]
    fn what_is_set_is_kept_and_what_is_out_of_range_is_not() {
        let mut parameters = Parameters::new(7, VehicleKind::Copter.habit());
        parameters.set(b"SIM_ALT\0rubbish", 80.0);
        parameters.set(b"SIM_RADIUS", f32::NAN);
        parameters.set(b"SYSID_THISMAV", 9.0);
        parameters.set(b"NO_SUCH", 1.0);
        assert_eq!((parameters.altitude(), parameters.radius()), (80.0, 50.0));
        assert_eq!(parameters.values[0], 7.0);
        assert_eq!(parameters.untold, 0b1011, "all that exist are told");
    }

    #[test]
    fn each_is_told_once_however_often_it_is_asked_for() {
        let mut parameters = Parameters::new(1, VehicleKind::Boat.habit());
        parameters.ask_all();
        parameters.ask_all();
        assert_eq!(std::iter::from_fn(|| parameters.poll()).count(), COUNT);
        for index in [-1, 12, i16::MAX] {
            parameters.ask(index, b"");
        }
        assert!(!parameters.has_untold());
    }

    #[test]
    fn names_fit_in_their_field() {
        assert!(ROWS.iter().all(|row| row.name.len() <= 16 && row.name.is_ascii()));
    }
}
