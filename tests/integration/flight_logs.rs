//! Logs that vehicles make themselves, taken as mavlink-router takes them: one file for each vehicle.

use std::fs;

use rustix::process::Signal;

use crate::harness::*;

const HEARTBEAT: Message = Message { id: 0, extra: 50, len: 9 };
pub(super) const COMMAND_LONG: u32 = 76;
const BLOCK: Message = Message { id: 184, extra: 159, len: 206 };
pub(super) const BLOCK_STATUS: u32 = 185;
const LOGGING_DATA_ACKED: Message = Message { id: 267, extra: 35, len: 255 };
const LOGGING_ACK: u32 = 268;

/// MAV_CMD_LOGGING_START, and the number that stands for it with ArduPilot.
const START: u16 = 2510;
pub(super) const START_BLOCKS: u32 = 2_147_483_646;

/// MAV_CMD_LOGGING_STOP, and the number that stands for it with ArduPilot.
const STOP: u16 = 2511;
pub(super) const STOP_BLOCKS: u32 = 2_147_483_645;

/// The heartbeat of an armed PX4 (12) or ArduPilot (3).
fn armed(from: Component, autopilot: u8) -> Vec<u8> {
    Draft::new(from, HEARTBEAT, [0, 0, 0, 0, 2, autopilot, 0x80, 4, 3]).build()
}

/// The payload of the next frame with this id, whole, and who has sent it.
pub(super) fn next(peer: &mut Peer<TcpWire>, id: u32) -> (Component, Vec<u8>) {
    loop {
        let frame = peer.receive();
        if frame[7..10] == id.to_le_bytes()[..3] {
            let mut payload = frame[10..frame.len() - 2].to_vec();
            payload.resize(40, 0);
            return (source_of(&frame), payload);
        }
    }
}

/// A ULog of a header and one message.
pub(super) fn ulog() -> Vec<u8> {
    let mut log = vec![0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35, 1, 0, 0, 0, 0, 0, 0, 0, 0];
    log.extend([0x2c, 0x01, b'I']);
    log.extend((0..300_u16).map(|at| at as u8));
    log
}

/// Sends the pieces of a ULog, each until it is acknowledged, which it is at once.
pub(super) fn send_ulog(px4: &mut Peer<TcpWire>, logger: Component, log: &[u8]) {
    for (number, data) in (0_u16..).zip(log.chunks(249)) {
        let mut payload = number.to_le_bytes().to_vec();
        payload.extend([logger.system, logger.component, data.len() as u8, 0]);
        payload.extend(data);
        let piece = Draft::new(VEHICLE, LOGGING_DATA_ACKED, payload).build();
        // Twice, as when the acknowledgement was late.
        px4.send(&piece);
        px4.send(&piece);
        for _ in 0..2 {
            let (_, ack) = next(px4, LOGGING_ACK);
            assert_eq!(ack[..4], [number as u8, 0, VEHICLE.system, VEHICLE.component]);
        }
    }
}

pub(super) fn send_block(ardupilot: &mut Peer<TcpWire>, logger: Component, number: u32) {
    let mut payload = number.to_le_bytes().to_vec();
    payload.extend([logger.system, logger.component]);
    payload.extend([number as u8 + 1; 200]);
    ardupilot.send(Draft::new(OTHER, BLOCK, payload).build());
}

/// The number of a block, and whether it has arrived.
pub(super) fn next_status(ardupilot: &mut Peer<TcpWire>) -> (u32, bool) {
    let (_, status) = next(ardupilot, BLOCK_STATUS);
    (u32::from_le_bytes(status[..4].try_into().unwrap()), status[6] == 1)
}

/// Both are told that nobody will take their logs any more.
fn assert_asked_to_stop(px4: &mut Peer<TcpWire>, ardupilot: &mut Peer<TcpWire>) {
    let (_, command) = next(px4, COMMAND_LONG);
    assert_eq!(command[28..32], [STOP.to_le_bytes()[0], STOP.to_le_bytes()[1], 1, 1]);
    while next_status(ardupilot).0 != STOP_BLOCKS {}
}

#[test]
fn where_a_reload_ends_the_collection_vehicles_are_asked_to_stop() {
    let configuration = |which: &str| {
        let general = format!(
            "record = 'records'\nrecord_min_free = 0\nrecord_telemetry = false\n\
             flight_log = '{which}'\n"
        );
        general + &["one", "two"].map(|name| endpoint(name, "tcpin:127.0.0.1:0", "")).concat()
    };
    let scene = Scene::start(&configuration("auto"), &[]);
    let router = &scene.router;
    let mut px4 = router.tcp("one", VEHICLE);
    let mut ardupilot = router.tcp("two", OTHER);
    px4.send(armed(VEHICLE, 12));
    let (logger, _) = next(&mut px4, COMMAND_LONG);
    send_ulog(&mut px4, logger, &ulog());
    ardupilot.send(armed(OTHER, 3));
    assert_eq!(next_status(&mut ardupilot), (START_BLOCKS, true));
    scene.write(&configuration("off"));
    router.signal(Signal::HUP);
    router.log.wait_for(&["recording anew"]);
    assert_asked_to_stop(&mut px4, &mut ardupilot);
    router.assert_serves(&mut px4, &mut ardupilot);
    let records = scene.file.with_file_name("records");
    let file = fs::read_dir(records).unwrap().next().unwrap().unwrap().path();
    eventually("the log is whole", || fs::read(&file).unwrap() == ulog());
}

#[test]
fn a_px4_and_an_ardupilot_get_a_file_each_with_all_that_they_send() {
    let dir = TempDir::new();
    let records = dir.path("records");
    let flight_logs = ["--record-telemetry=false", "--record-when=armed", "--flight-log=auto"];
    let router = Router::start(&recording(&records, &flight_logs));
    let mut px4 = router.tcp("fc", VEHICLE);
    let mut ardupilot = router.tcp("gcs", OTHER);
    px4.send(armed(VEHICLE, 12));
    let (logger, command) = next(&mut px4, COMMAND_LONG);
    assert_eq!(logger, Component::new(1, 155));
    assert_eq!(command[28..32], [START.to_le_bytes()[0], START.to_le_bytes()[1], 1, 1]);
    ardupilot.send(armed(OTHER, 3));
    let (logger_2, status) = next(&mut ardupilot, BLOCK_STATUS);
    assert_eq!(logger_2, Component::new(2, 155));
    assert_eq!(status[..4], START_BLOCKS.to_le_bytes());
    send_ulog(&mut px4, logger, &ulog());
    for number in [0, 1, 4] {
        send_block(&mut ardupilot, logger_2, number);
    }
    let mut told = Vec::new();
    while told.len() < 5 {
        told.extend(Some(next_status(&mut ardupilot)).filter(|it| it.0 != START_BLOCKS));
    }
    told.sort_unstable();
    told.dedup();
    assert!(told.starts_with(&[(0, true), (1, true), (2, false), (3, false)]), "{told:?}");
    for number in [3, 2] {
        send_block(&mut ardupilot, logger_2, number);
        while next_status(&mut ardupilot) != (number, true) {}
    }
    router.signal(Signal::TERM);
    assert_asked_to_stop(&mut px4, &mut ardupilot);
    assert!(router.wait_for_end().0.success());
    let mut files: Vec<_> = fs::read_dir(&records).unwrap().map(|it| it.unwrap().path()).collect();
    files.sort_by_key(|path| path.extension().map(ToOwned::to_owned));
    assert_eq!(files.len(), 2, "{files:?}");
    let blocks: Vec<u8> = (1..=5).flat_map(|byte| [byte; 200]).collect();
    assert!(fs::read(&files[0]).unwrap() == blocks, "the blocks are not as they were sent");
    assert!(fs::read(&files[1]).unwrap() == ulog(), "the ULog is not as it was sent");
}
