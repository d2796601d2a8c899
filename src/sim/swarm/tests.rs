//! A ground station asks, and vehicles answer: in a time of the test's own.

use std::time::Duration;

use super::*;
use crate::mavlink::{Fields, FrameSpec, MessageId, Version, encode};

const GCS: Component = Component::new(255, 190);
const VEHICLE: Component = Component::new(1, 1);

/// Vehicles, and a ground station that hears all of them.
struct Air {
    swarm: Swarm,
    now: Time,
}

impl Air {
    fn new(options: SwarmOptions) -> Self {
        Self { swarm: Swarm::new(options, Time::ZERO), now: Time::ZERO }
    }

    /// The ground station says something.
    fn ask(&mut self, id: u32, crc_extra: u8, payload: &[u8]) {
        self.ask_as(GCS, id, crc_extra, payload);
    }

    fn ask_as(&mut self, source: Component, id: u32, crc_extra: u8, payload: &[u8]) {
        let mut frame = Vec::new();
        let spec = FrameSpec {
            version: Version::V2,
            seq: 0,
            source,
            id: MessageId(id),
            crc_extra,
            payload,
            signature: None,
        };
        encode(&spec, &mut frame);
        self.swarm.handle_frame(&Frame::parse(&frame).unwrap(), self.now);
    }

    /// What is said now.
    fn hear(&mut self) -> Vec<Vec<u8>> {
        let mut heard = Vec::new();
        loop {
            let mut out = Vec::new();
            let has_said = self.swarm.poll_transmit(self.now, &mut out)
                || self.swarm.bulk(self.now).is_some() && self.swarm.poll_bulk(self.now, &mut out);
            if !has_said {
                return heard;
            }
            heard.push(out);
        }
    }

    /// Frames of one message that come within so many milliseconds; each is said when it is due.
    fn hear_for(&mut self, millis: u64, id: u32) -> Vec<Vec<u8>> {
        let end = self.now + Duration::from_millis(millis);
        let mut heard = self.hear();
        while let Some(at) = self.swarm.poll_timeout().filter(|at| *at < end) {
            assert!(at > self.now, "it says at once what it has to say");
            self.now = at;
            heard.extend(self.hear());
        }
        self.now = end;
        heard.retain(|frame| id_of(frame) == id);
        heard
    }

    /// COMMAND_LONG to a system, with its first two parameters; the answers to it.
    fn command(&mut self, system: u8, number: u16, params: [f32; 2]) -> Vec<Vec<u8>> {
        let mut payload = [0; 33];
        payload[..4].copy_from_slice(&params[0].to_le_bytes());
        payload[4..8].copy_from_slice(&params[1].to_le_bytes());
        payload[28..30].copy_from_slice(&number.to_le_bytes());
        payload[30..32].copy_from_slice(&[system, 1]);
        self.ask(76, 152, &payload);
        let mut heard = self.hear();
        // Not what it says of its own accord.
        heard.retain(|frame| [77, 148, 244].contains(&id_of(frame)));
        heard
    }

    /// The MAV_RESULT of a command to the first vehicle.
    fn result(&mut self, number: u16, params: [f32; 2]) -> u8 {
        let answers = self.command(1, number, params);
        let ack = answers.iter().find(|frame| id_of(frame) == 77).unwrap();
        assert_eq!(field(ack, |it| (it.u16(0), it.component(8))), (number, GCS));
        field(ack, |it| it.u8(2))
    }

    fn is_armed(&mut self) -> bool {
        let heartbeats = self.hear_for(1_100, 0);
        field(&heartbeats[0], |it| it.u8(6)) & 128 != 0
    }
}

fn id_of(frame: &[u8]) -> u32 {
    Frame::parse(frame).unwrap().header().id.0
}

fn field<T>(frame: &[u8], read: impl Fn(Fields<'_>) -> T) -> T {
    read(Fields(&Frame::parse(frame).unwrap()))
}

fn one() -> Air {
    let mut air = Air::new(SwarmOptions { rate: 10, ..SwarmOptions::default() });
    air.hear_for(2_000, 0);
    air
}

#[test]
fn each_vehicle_tells_of_itself_and_no_number_is_missing() {
    let mut air = Air::new(SwarmOptions { count: 3, rate: 10, ..SwarmOptions::default() });
    let mut next = [0_u8; 3];
    let mut heartbeats = [0; 3];
    for _ in 0..1_000 {
        for frame in air.hear() {
            let header = Frame::parse(&frame).unwrap().header();
            let number = usize::from(header.source.system) - 1;
            assert_eq!(header.seq, next[number]);
            next[number] = header.seq.wrapping_add(1);
            heartbeats[number] += usize::from(header.id == MessageId::HEARTBEAT);
        }
        air.now = air.now + Duration::from_millis(10);
    }
    assert_eq!(heartbeats, [10; 3]);
}

#[test]
fn it_flies_a_circle_of_its_radius_at_its_speed() {
    let mut air = one();
    let fixes = air.hear_for(40_000, 33);
    assert_eq!(fixes.len(), 400);
    let places: Vec<(f64, f64)> = fixes
        .iter()
        .map(|fix| {
            let (lat, lon) = field(fix, |it| (it.i32(4), it.i32(8)));
            let north = (f64::from(lat) / 1e7 - 47.397_742) * 111_319.49;
            let degree = 111_319.49 * 47.397_742_f64.to_radians().cos();
            let east = (f64::from(lon) / 1e7 - 8.545_594) * degree;
            (north, east)
        })
        .collect();
    assert!(places.iter().all(|(north, east)| (north.hypot(*east) - 50.0).abs() < 0.1));
    for (pair, fix) in places.windows(2).zip(&fixes) {
        let (north, east) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        assert!((north.hypot(east) - 0.8).abs() < 0.1, "8 m/s are 0.8 m in 100 ms");
        let heading = f64::from(field(fix, |it| it.u16(26))) / 100.0;
        let course = east.atan2(north).to_degrees().rem_euclid(360.0);
        let off = (course - heading).rem_euclid(360.0);
        assert!(!(5.0..=355.0).contains(&off), "{course} {heading}");
    }
    assert_eq!(field(&fixes[0], |it| (it.i32(12), it.i32(16))), (518_000, 30_000));
}

#[test]
fn every_parameter_of_every_vehicle_comes_once_and_one_that_is_set_is_kept() {
    let mut air = Air::new(SwarmOptions { count: 250, ..SwarmOptions::default() });
    air.ask(21, 159, &[0, 0]);
    let told = air.hear_for(1, 22);
    assert_eq!(told.len(), 250 * 12);
    let mut set = [0; 23];
    set[..4].copy_from_slice(&77_f32.to_le_bytes());
    set[4..6].copy_from_slice(&[3, 1]);
    set[6..13].copy_from_slice(b"SIM_ALT");
    air.ask(23, 168, &set);
    let mut read = [0; 20];
    read[..4].copy_from_slice(&[0xff, 0xff, 3, 1]);
    read[4..11].copy_from_slice(b"SIM_ALT");
    let told = air.hear_for(1, 22);
    assert_eq!(told.len(), 1);
    air.ask(20, 214, &read);
    for told in told.into_iter().chain(air.hear_for(1, 22)) {
        assert_eq!(field(&told, |it| (it.f32(0), it.u16(4), it.u16(6))), (77.0, 12, 3));
    }
    let height = |frame: &Vec<u8>| {
        let system = Frame::parse(frame).unwrap().header().source.system;
        (system, field(frame, |it| it.i32(16)))
    };
    let fixes: Vec<(u8, i32)> = air.hear_for(500, 33).iter().map(height).collect();
    assert!(fixes.contains(&(3, 77_000)) && fixes.contains(&(4, 30_000)));
}

#[test]
fn it_arms_takes_off_and_lands() {
    let mut air = one();
    assert!(air.is_armed());
    assert_eq!(air.result(21, [0.0; 2]), 0, "land");
    assert!(!air.is_armed());
    assert_eq!(air.result(22, [0.0; 2]), 2, "nobody takes off who is not armed");
    let landed = air.hear_for(1_000, 33);
    assert!(landed.iter().all(|fix| field(fix, |it| (it.i32(16), it.i16(20))) == (0, 0)));
    assert_eq!(air.result(400, [1.0, 0.0]), 0, "arm");
    assert_eq!(air.result(400, [7.0, 0.0]), 2);
    assert_eq!(air.result(22, [0.0; 2]), 0, "take off");
    assert!(air.is_armed());
    let flying = air.hear_for(1_000, 33);
    assert_eq!(field(&flying[0], |it| it.i32(16)), 30_000);
}

#[test]
fn a_message_is_sent_on_request_and_as_often_as_is_asked_for() {
    let mut air = one();
    let answers = air.command(1, 512, [148.0, 0.0]);
    assert_eq!(answers.iter().map(|it| id_of(it)).collect::<Vec<_>>(), [77, 148]);
    assert_eq!(field(&answers[1], |it| it.u64(0)) & 4, 4, "missions have whole numbers");
    assert_eq!(air.result(520, [1.0, 0.0]), 0);
    assert_eq!(air.result(512, [9_999.0, 0.0]), 3);
    assert_eq!(air.result(31_010, [0.0; 2]), 3, "what nobody knows is unsupported");
    assert_eq!(air.result(511, [30.0, 50_000.0]), 0);
    assert_eq!(air.hear_for(10_001, 30).len(), 200);
    assert_eq!(air.result(511, [30.0, 1.0]), 2, "a million a second is too much to ask");
    let answers = air.command(1, 510, [30.0, 0.0]);
    let interval = answers.iter().find(|it| id_of(it) == 244).unwrap();
    assert_eq!(field(interval, |it| (it.i32(0), it.u16(4))), (50_000, 30));
}

#[test]
fn a_mode_that_is_set_is_told() {
    let mut air = one();
    air.ask(11, 89, &[4, 0, 0, 0, 1, 1]);
    let heartbeat = &air.hear_for(1_100, 0)[0];
    assert_eq!(field(heartbeat, |it| (it.u32(0), it.u8(6))), (4, 129));
    assert_eq!(air.result(176, [1.0, 6.0]), 0);
    assert_eq!(field(&air.hear_for(1_100, 0)[0], |it| it.u32(0)), 6);
}

/// MISSION_ITEM_INT with a latitude that tells them apart.
fn item(seq: u16) -> [u8; 38] {
    let mut payload = [0; 38];
    payload[16..20].copy_from_slice(&(47 * 10_000_000 + i32::from(seq)).to_le_bytes());
    payload[28..30].copy_from_slice(&seq.to_le_bytes());
    payload[30..37].copy_from_slice(&[16, 0, 1, 1, 3, 0, 1]);
    payload
}

/// The only answer there is.
fn answer(air: &mut Air, id: u32) -> Vec<u8> {
    let heard = air.hear_for(1, id);
    assert_eq!(heard.len(), 1, "of message {id}");
    heard[0].clone()
}

#[test]
fn a_mission_that_was_uploaded_is_downloaded() {
    let mut air = one();
    air.ask(44, 221, &[3, 0, 1, 1, 0]);
    for seq in 0..3 {
        let request = answer(&mut air, 51);
        assert_eq!(field(&request, |it| (it.u16(0), it.component(2))), (seq, GCS));
        air.ask(73, 38, &item(seq));
    }
    assert_eq!(field(&answer(&mut air, 47), |it| (it.component(0), it.u8(2))), (GCS, 0));
    air.ask(43, 132, &[1, 1, 0]);
    assert_eq!(field(&answer(&mut air, 44), |it| it.u16(0)), 3);
    for seq in 0..3 {
        // Once each in the new way and in the old.
        air.ask(51, 196, &[seq, 0, 1, 1, 0]);
        air.ask(40, 230, &[seq, 0, 1, 1, 0]);
        for told in air.hear_for(1, 73) {
            assert_eq!(field(&told, |it| it.i32(16)), 470_000_000 + i32::from(seq));
        }
    }
    air.ask(45, 232, &[1, 1, 255]);
    assert_eq!(field(&answer(&mut air, 47), |it| it.u8(2)), 0);
    for kind in 0..3 {
        air.ask(43, 132, &[1, 1, kind]);
        assert_eq!(field(&answer(&mut air, 44), |it| (it.u16(0), it.u8(4))), (0, kind));
    }
}

#[test]
fn an_upload_that_stops_is_asked_for_and_given_up() {
    let mut air = one();
    air.ask(44, 221, &[2, 0, 1, 1, 0]);
    air.ask(73, 38, &item(1));
    let requests = air.hear_for(20_000, 51);
    assert_eq!(requests.len(), 2 + 4, "the first item, and it again: {requests:?}");
    assert!(requests.iter().all(|it| field(it, |it| it.u16(0)) == 0));
    air.ask(73, 38, &item(0));
    assert_eq!(field(&answer(&mut air, 47), |it| it.u8(2)), 1, "there is no upload any more");
    for (count, kind, result) in [(200, 0, 4), (2, 1, 3), (2, 2, 3)] {
        air.ask(44, 221, &[count, 0, 1, 1, kind]);
        assert_eq!(field(&answer(&mut air, 47), |it| (it.u8(2), it.u8(3))), (result, kind));
    }
}

#[test]
fn times_and_pings_are_answered_and_answers_are_not() {
    let mut air = one();
    let mut question = [0; 16];
    question[8..].copy_from_slice(&123_i64.to_le_bytes());
    air.ask(111, 34, &question);
    let told = answer(&mut air, 111);
    let now = air.now.as_micros() as i64 * 1_000;
    assert_eq!(field(&told, |it| (it.i64(8), it.component(16))), (123, GCS));
    assert!(field(&told, |it| it.i64(0)) <= now);
    question[0] = 1;
    air.ask(111, 34, &question);
    air.ask(4, 237, &[9, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0]);
    air.ask(4, 237, &[9, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 1, 1]);
    assert_eq!(field(&answer(&mut air, 4), |it| (it.u64(0), it.u32(8))), (9, 5));
    assert!(air.hear_for(1, 111).is_empty());
}

#[test]
fn a_ping_from_nobody_gets_no_answer_that_would_be_a_question_to_all() {
    let mut air = one();
    let ping = [9, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0];
    air.ask_as(Component::new(0, 190), 4, 237, &ping);
    assert!(air.hear_for(1, 4).is_empty());
    air.ask_as(Component::new(255, 0), 4, 237, &ping);
    assert_eq!(air.hear_for(1, 4).len(), 1);
}

#[test]
fn who_is_not_meant_says_nothing() {
    let mut air = one();
    for target in [[2, 0], [1, 154], [255, 190]] {
        air.ask(21, 159, &target);
    }
    // Another message that once had this number.
    air.ask(21, 160, &[1, 1]);
    assert!(air.hear_for(1, 22).is_empty());
    assert_eq!(air.swarm.vehicles[0].system(), VEHICLE.system);
}

#[test]
fn a_flood_of_questions_makes_nothing_grow() {
    let mut air = one();
    for _ in 0..10_000 {
        air.ask(43, 132, &[1, 1, 0]);
    }
    assert_eq!(air.hear_for(1, 44).len(), 32);
}

#[test]
fn there_are_no_more_vehicles_than_system_ids() {
    let mut options = SwarmOptions { count: 6, system: 250, ..SwarmOptions::default() };
    assert!(options.has_ids());
    options.count = 7;
    assert!(!options.has_ids());
    assert_eq!(Swarm::new(options, Time::ZERO).vehicles.len(), 6);
    assert_eq!(options.to_string(), "7 simulated vehicles (copter), systems 250 to 255");
}
