//! Where a vehicle is: on a circle around a place of its own, or on the ground.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt;
use std::time::Duration;

/// What kind of vehicle it is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, Debug)]
pub enum VehicleKind {
    /// A quadrotor.
    #[default]
    Copter,
    /// A fixed wing.
    Plane,
    /// A ground rover.
    Rover,
    /// A surface boat.
    Boat,
}

/// How a kind of vehicle moves, unless its parameters say otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Habit {
    /// MAV_TYPE.
    pub(super) mav_type: u8,
    /// Metres.
    pub(super) radius: f32,
    /// Metres a second.
    pub(super) speed: f32,
    /// Metres above the ground.
    pub(super) altitude: f32,
}

impl VehicleKind {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Copter, Self::Plane, Self::Rover, Self::Boat];

    pub(super) fn habit(self) -> Habit {
        let habit = |mav_type, radius, speed, altitude| Habit { mav_type, radius, speed, altitude };
        match self {
            Self::Copter => habit(2, 50.0, 8.0, 30.0),
            Self::Plane => habit(1, 200.0, 22.0, 100.0),
            Self::Rover => habit(10, 20.0, 3.0, 0.0),
            Self::Boat => habit(11, 60.0, 4.0, 0.0),
        }
    }

    /// Whether it can leave the ground.
    pub(super) fn flies(self) -> bool {
        matches!(self, Self::Copter | Self::Plane)
    }
}

impl fmt::Display for VehicleKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Copter => "copter",
            Self::Plane => "plane",
            Self::Rover => "rover",
            Self::Boat => "boat",
        })
    }
}

/// A place on the earth, in degrees and metres above the sea.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) lat: f64,
    pub(super) lon: f64,
    pub(super) alt: f64,
}

/// Where the first vehicle is at home: a field near Zurich, where simulated vehicles often are.
const HOME: Place = Place { lat: 47.397_742, lon: 8.545_594, alt: 488.0 };

/// Metres in a degree of latitude.
const DEGREE: f64 = 111_319.49;

impl Place {
    /// The home of the vehicle with this number: they stand in rows of 16, so far apart that their
    /// circles do not meet.
    pub(super) fn home(number: usize, radius: f32) -> Self {
        let step = 2.5 * f64::from(radius);
        let (row, column) = (number / 16, number % 16);
        HOME.moved(-(row as f64) * step, column as f64 * step)
    }

    /// So many metres to the north and to the east.
    fn moved(self, north: f64, east: f64) -> Self {
        let lat = self.lat + north / DEGREE;
        let lon = self.lon + east / (DEGREE * self.lat.to_radians().cos());
        Self { lat, lon, ..self }
    }

    /// The point of a circle around here at this bearing.
    pub(super) fn at(self, radius: f32, bearing: f64) -> Self {
        let radius = f64::from(radius);
        self.moved(radius * bearing.cos(), radius * bearing.sin())
    }

    /// Latitude and longitude in 1e-7 degrees, altitude in millimetres, as MAVLink has them.
    pub(super) fn scaled(self) -> (i32, i32, i32) {
        let scale = |value: f64, by: f64| (value * by).round() as i32;
        (scale(self.lat, 1e7), scale(self.lon, 1e7), scale(self.alt, 1e3))
    }
}

/// Where a vehicle is and how it moves, in the units of the messages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Radians.
    pub(super) roll: f32,
    pub(super) pitch: f32,
    pub(super) yaw: f32,
    /// Radians a second.
    pub(super) yaw_rate: f32,
    /// 1e-7 degrees.
    pub(super) lat: i32,
    pub(super) lon: i32,
    /// Above the sea.
    pub(super) alt_mm: i32,
    pub(super) relative_alt_mm: i32,
    pub(super) north_cm_s: i16,
    pub(super) east_cm_s: i16,
    pub(super) speed_cm_s: u16,
    /// 0..36,000.
    pub(super) heading_cdeg: u16,
    /// Metres a second.
    pub(super) speed: f32,
    /// Per cent.
    pub(super) throttle: u16,
}

/// The circle that a vehicle is on, clockwise seen from above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    pub(super) home: Place,
    /// Where on it the vehicle is, seen from the middle: radians from north, 0..TAU.
    pub(super) bearing: f64,
}

/// Standard gravity.
const G: f32 = 9.806_65;

impl Circle {
    /// Time passes for who is under way at this speed.
    pub(super) fn advance(&mut self, radius: f32, speed: f32, passed: Duration) {
        let angle = f64::from(speed / radius) * passed.as_secs_f64();
        self.bearing = (self.bearing + angle).rem_euclid(TAU);
    }

    /// How somebody moves who goes round at `speed`, or stands at 0.
    pub(super) fn motion(&self, radius: f32, speed: f32, altitude: f32, flies: bool) -> Motion {
        let (lat, lon, ground_mm) = self.home.at(radius, self.bearing).scaled();
        let course = (self.bearing + FRAC_PI_2).rem_euclid(TAU);
        let relative_alt_mm = (altitude * 1_000.0) as i32;
        let along = |part: f64| (f64::from(speed) * 100.0 * part).round() as i16;
        Motion {
            roll: if flies { (speed * speed / (radius * G)).atan() } else { 0.0 },
            pitch: 0.0,
            yaw: (if course > TAU / 2.0 { course - TAU } else { course }) as f32,
            yaw_rate: speed / radius,
            lat,
            lon,
            alt_mm: ground_mm + relative_alt_mm,
            relative_alt_mm,
            north_cm_s: along(course.cos()),
            east_cm_s: along(course.sin()),
            speed_cm_s: (speed * 100.0) as u16,
            heading_cdeg: ((course.to_degrees() * 100.0) as u16).min(35_999),
            speed,
            throttle: if speed > 0.0 { 45 } else { 0 },
        }
    }
}
