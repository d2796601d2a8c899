//! Simulated vehicles, as a ground station meets them.

use std::collections::BTreeSet;

use mavswitch::mavlink::{Frame, MessageId};

use crate::harness::*;

const PARAM_VALUE: MessageId = MessageId(22);

/// The next frame of a message, whoever sent it.
fn await_message(gcs: &mut Peer<impl Wire>, id: MessageId) -> Vec<u8> {
    loop {
        let frame = gcs.receive();
        if Frame::parse(&frame).unwrap().header().id == id {
            return frame;
        }
    }
}

/// Which parameter of which system it is.
fn parameter(frame: &[u8]) -> (u8, u8) {
    let frame = Frame::parse(frame).unwrap();
    (frame.header().source.system, frame.payload_byte(6))
}

#[test]
fn a_ground_station_finds_a_vehicle_without_hardware() {
    let router = Router::start(&["sim:?rate=20&system=7", "tcpin:127.0.0.1:0?name=tcp"]);
    router.log.wait_for(&["sim: link #0 up: a simulated copter, system 7"]);
    let vehicle = Component::new(7, 1);
    router.log.wait_for(&["component 7/1 seen on sim (#0)"]);
    let mut gcs = router.tcp("tcp", GCS);
    let heartbeat = await_message(&mut gcs, MessageId::HEARTBEAT);
    assert_eq!(source_of(&heartbeat), vehicle);
    // MAV_CMD_COMPONENT_ARM_DISARM to disarm.
    let mut disarm = [0; 33];
    disarm[28..32].copy_from_slice(&[0x90, 0x01, 7, 1]);
    gcs.send(Draft::new(GCS, COMMAND_LONG, disarm).build());
    let ack = await_message(&mut gcs, MessageId::COMMAND_ACK);
    let ack = Frame::parse(&ack).unwrap();
    assert_eq!([0, 1, 2, 8, 9].map(|at| ack.payload_byte(at)), [0x90, 0x01, 0, 255, 190]);
    gcs.send(Draft::new(GCS, PARAM_REQUEST_LIST, [7, 1]).build());
    let told: BTreeSet<_> =
        (0..12).map(|_| parameter(&await_message(&mut gcs, PARAM_VALUE))).collect();
    assert_eq!(told, (0..12).map(|index| (7, index)).collect());
}

#[test]
fn all_parameters_of_a_swarm_arrive_over_a_link_that_holds_few_of_them() {
    let router = Router::start(&[
        "sim:?count=12&rate=1",
        "tcpin:127.0.0.1:0?name=slow&bandwidth=15000&queue_time=40ms",
    ]);
    let mut gcs = router.tcp("slow", GCS);
    gcs.send(Draft::new(GCS, PARAM_REQUEST_LIST, [0, 0]).build());
    let mut told = BTreeSet::new();
    while told.len() < 12 * 12 {
        let is_new = told.insert(parameter(&await_message(&mut gcs, PARAM_VALUE)));
        assert!(is_new, "each comes once");
    }
}
