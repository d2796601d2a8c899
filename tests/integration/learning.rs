//! How the router comes to know where a component is, and how it forgets (rules 8, 24, 35, 44).

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// Another system that lives at a link of somebody else.
const HIDDEN: Component = Component::new(5, 1);

#[test]
fn rule_35_a_component_is_known_by_its_first_frame_of_any_kind() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp_silent("tcp", VEHICLE);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
}

#[test]
fn with_learn_heartbeat_a_component_is_known_by_its_heartbeat_alone() {
    let router = Router::start(&["--learn", "heartbeat", TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(attitude(HIDDEN, 1));
    gcs.expect(attitude(HIDDEN, 1));
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect_nothing_from(&mut gcs);
    vehicle.send(heartbeat(HIDDEN));
    gcs.expect(heartbeat(HIDDEN));
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect(command_long(GCS, HIDDEN));
}

#[test]
fn with_learn_all_a_component_is_known_by_any_frame() {
    let router = Router::start(&["--learn", "all", TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(attitude(HIDDEN, 1));
    gcs.expect(attitude(HIDDEN, 1));
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect(command_long(GCS, HIDDEN));
}

#[test]
fn rule_8_a_source_with_a_zero_in_its_id_is_forwarded_and_not_learned() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for nobody in [Component::new(0, 1), Component::new(9, 0), Component::new(0, 0)] {
        vehicle.send(heartbeat(nobody));
        gcs.expect(heartbeat(nobody));
    }
    for target in [Component::new(9, 0), Component::new(9, 1)] {
        gcs.send(command_long(GCS, target));
    }
    vehicle.expect_nothing_from(&mut gcs);
    assert!(!router.log.has(&["component 0/"]) && !router.log.has(&["component 9/"]));
}

#[test]
fn rule_44_a_route_goes_when_its_link_closes() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut camera = router.tcp("tcp", CAMERA);
    let vehicle = router.tcp("tcp", VEHICLE);
    gcs.send(command_long(GCS, VEHICLE));
    camera.expect_nothing_from(&mut gcs);
    drop(vehicle);
    router.wait_until_lost(VEHICLE);
    // Nobody knows the autopilot now, so its system is asked instead.
    gcs.send(command_long(GCS, VEHICLE));
    camera.expect(command_long(GCS, VEHICLE));
    drop(camera);
    router.wait_until_lost(CAMERA);
    let mut other = router.tcp("tcp", OTHER);
    gcs.send(command_long(GCS, VEHICLE));
    other.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_44_a_new_connection_does_not_inherit_the_routes_of_an_old_one() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    for _ in 0..5 {
        let mut vehicle = router.tcp_silent("tcp", VEHICLE);
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect_nothing_from(&mut gcs);
        let seen_before = router.log.len();
        vehicle.send(heartbeat(VEHICLE));
        gcs.expect(heartbeat(VEHICLE));
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect(command_long(GCS, VEHICLE));
        drop(vehicle);
        router.log.wait_from(seen_before, &["component 1/1 lost"]);
    }
}

#[test]
fn rule_44_a_route_that_is_not_used_goes_after_its_age() {
    let router = Router::start(&["--route-age", "1", TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.wait_until_lost(VEHICLE);
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect_nothing_from(&mut gcs);
    vehicle.send(heartbeat(VEHICLE));
    gcs.expect(heartbeat(VEHICLE));
}

#[test]
fn rule_44_after_a_reboot_a_vehicle_is_only_where_it_was_heard_since() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("tcp", VEHICLE).deaf_to_own_id();
    let mut by_cable = router.tcp("tcp", VEHICLE).deaf_to_own_id();
    by_radio.send(system_time(VEHICLE, 500_000));
    gcs.expect(system_time(VEHICLE, 500_000));
    by_cable.send(system_time(VEHICLE, 500_100));
    gcs.expect(system_time(VEHICLE, 500_100));
    gcs.send(command_long(GCS, VEHICLE));
    by_radio.expect(command_long(GCS, VEHICLE));
    by_cable.expect(command_long(GCS, VEHICLE));
    by_cable.send(system_time(VEHICLE, 900));
    gcs.expect(system_time(VEHICLE, 900));
    gcs.send(command_long(GCS, VEHICLE));
    by_cable.expect(command_long(GCS, VEHICLE));
    by_radio.expect_nothing_from(&mut gcs);
}

#[test]
fn a_ground_station_that_comes_back_from_another_port_is_answered_at_once() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    drop(router.udp("udp", GCS));
    let mut restarted = router.udp("udp", GCS);
    vehicle.send(command_ack(VEHICLE, GCS));
    restarted.expect(command_ack(VEHICLE, GCS));
}
