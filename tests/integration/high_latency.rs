//! A link by satellite, where each byte is dear.

use crate::harness::*;

const HIGH_LATENCY2: Message = Message { id: 235, extra: 179, len: 42 };

#[test]
fn rule_45_heartbeats_are_kept_off_a_link_that_carries_all_else() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=fc",
        "tcpin:127.0.0.1:0?name=satellite&heartbeats=false",
        "tcpin:127.0.0.1:0?name=lan",
    ]);
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut station = router.tcp("satellite", GCS);
    let mut near = router.tcp("lan", GCS_2);
    let report = Draft::new(VEHICLE, HIGH_LATENCY2, [9; 42]).build();
    let ack = command_ack(VEHICLE, GCS);
    vehicle.send_each(&[heartbeat(VEHICLE), attitude(VEHICLE, 1), report.clone(), ack.clone()]);
    station.expect_each(&[attitude(VEHICLE, 1), report.clone(), ack]);
    near.expect_each(&[heartbeat(VEHICLE), attitude(VEHICLE, 1), report]);
    vehicle.send_each(&[heartbeat(CAMERA), attitude(VEHICLE, 2)]);
    station.expect(attitude(VEHICLE, 2));
    near.expect_each(&[heartbeat(CAMERA), attitude(VEHICLE, 2)]);
    // What comes from there is another matter: the vehicle knows by it that somebody is there.
    station.send(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
    station.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
}
