//! Redundant links: nothing within a group, routes shared, the best path, copies dropped.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::{Component, Version};
use mavswitch::routing::{
    DropReason, GroupId, LinkId, LinkOptions, Membership, RouterEvent, RouterOptions, Time,
};
use std::time::Duration;

const RADIO: u16 = 1;
const MODEM: u16 = 2;

fn member(network: &mut Network, member: u16, rank: u8, best_only: bool, dedup: bool) -> LinkId {
    let membership = Membership { group: GroupId(0), member, rank, best_only };
    network.link_with(LinkOptions {
        membership: Some(membership),
        dedup: dedup.then_some(Duration::from_millis(500)),
        ..LinkOptions::default()
    })
}

/// A ground station, and a radio and a modem that lead to the same vehicle.
fn two_paths(best_only: bool) -> (Network, [LinkId; 3]) {
    let mut network = Network::new(RouterOptions::default());
    let radio = member(&mut network, RADIO, 1, best_only, true);
    let modem = member(&mut network, MODEM, 0, best_only, true);
    let station = network.link();
    (network, [radio, modem, station])
}

/// The vehicle sends the same frame over these links.
fn telemetry(network: &mut Network, seq: u8, links: &[LinkId]) -> Vec<LinkId> {
    let bytes = frame(Version::V2, seq, VEHICLE, (30, 39), &[seq; 28]);
    links.iter().for_each(|link| network.receive(*link, &bytes));
    network.delivered()
}

#[test]
fn nothing_is_forwarded_within_a_group() {
    let (mut network, [radio, modem, station]) = two_paths(false);
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station]);
    assert_eq!(network.hears(station, &heartbeat(STATION)), [radio, modem]);
}

#[test]
fn a_route_learned_on_one_link_of_a_group_holds_for_all() {
    let (mut network, [radio, modem, station]) = two_paths(false);
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
}

#[test]
fn rule_49_the_second_copy_is_dropped_and_counted() {
    let (mut network, [radio, modem, station]) = two_paths(false);
    assert_eq!(telemetry(&mut network, 1, &[radio, modem]), [station]);
    assert_eq!(network.counters(modem)[DropReason::Duplicate], 1);
    assert_eq!(network.counters(station).frames_out, 1);
}

#[test]
fn rule_50_a_copy_changes_no_route_and_no_loss() {
    let mut network = Network::new(RouterOptions::default());
    let dedup = Some(Duration::from_millis(500));
    let mut link = || network.link_with(LinkOptions { dedup, ..LinkOptions::default() });
    let (radio, modem, station) = (link(), link(), link());
    for seq in 0..10 {
        telemetry(&mut network, seq, &[radio, modem]);
    }
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    let known = network.router.table().find(VEHICLE).unwrap();
    assert_eq!(known.heard.iter().map(|heard| heard.sequence.lost).sum::<u64>(), 0);
}

#[test]
fn a_source_that_moves_from_one_link_to_the_other_loses_no_frame() {
    let (mut network, [radio, modem, station]) = two_paths(false);
    for seq in 0..10 {
        assert_eq!(telemetry(&mut network, seq, &[radio, modem]), [station]);
    }
    for seq in 10..20 {
        assert_eq!(telemetry(&mut network, seq, &[modem]), [station]);
    }
    network.router.remove_link(radio);
    assert_eq!(telemetry(&mut network, 20, &[modem]), [station]);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
    assert_eq!(network.counters(station).frames_out, 21);
}

/// Time passes in steps of 100 ms; at each, the vehicle is heard on these links.
fn fly(network: &mut Network, seconds: u64, links: &[LinkId], seq: &mut u8) {
    for _ in 0..seconds * 10 {
        network.now = network.now + Duration::from_millis(100);
        *seq = seq.wrapping_add(1);
        telemetry(network, *seq, links);
    }
}

#[test]
fn the_best_path_is_the_preferred_one_while_it_is_good() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq = 0;
    fly(&mut network, 5, &[radio, modem], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    assert_eq!(network.hears(station, &attitude(STATION, 1)), [radio], "the modem idles");
    let both = network.hears(station, &heartbeat(STATION));
    assert_eq!(both, [radio, modem], "but for what keeps it known");
}

#[test]
fn a_silent_path_is_left_at_once_and_taken_again_after_a_while() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq = 0;
    fly(&mut network, 5, &[radio, modem], &mut seq);
    fly(&mut network, 3, &[modem], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
    fly(&mut network, 1, &[radio, modem], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem], "not so fast");
    for _ in 0..100 {
        network.now = network.now + Duration::from_millis(100);
        seq += 1;
        telemetry(&mut network, seq, &[radio, modem]);
        network.hears(station, &heartbeat(STATION));
    }
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn while_no_path_is_good_all_are_sent_to() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq = 0;
    assert_eq!(network.hears(station, &attitude(STATION, 1)), [radio, modem], "none was heard");
    fly(&mut network, 5, &[radio], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    network.pass(3);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
    fly(&mut network, 1, &[modem], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
}

#[test]
fn a_change_of_path_is_told() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq = 0;
    fly(&mut network, 5, &[radio, modem], &mut seq);
    network.hears(station, &command(STATION, VEHICLE));
    network.router.remove_link(radio);
    network.hears(station, &command(STATION, VEHICLE));
    let events = std::iter::from_fn(|| network.router.poll_event());
    let paths = events.filter_map(|event| match event {
        RouterEvent::PathChosen(_, member) => Some(member),
        _ => None,
    });
    assert_eq!(paths.collect::<Vec<_>>(), [Some(RADIO), Some(MODEM)]);
}

#[test]
fn a_closed_path_is_left_at_once() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq = 0;
    fly(&mut network, 5, &[radio, modem], &mut seq);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    network.router.remove_link(radio);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
}

#[test]
fn a_lossy_path_gives_way_to_a_clean_one() {
    let (mut network, [radio, modem, station]) = two_paths(true);
    let mut seq: u8 = 0;
    for _ in 0..400 {
        network.now = network.now + Duration::from_millis(50);
        seq = seq.wrapping_add(1);
        let links = [radio, modem];
        // Every third frame comes through on the radio.
        telemetry(&mut network, seq, if seq.is_multiple_of(3) { &links } else { &links[1..] });
        network.hears(station, &heartbeat(STATION));
    }
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
}

#[test]
fn two_stations_behind_one_endpoint_of_a_group_each_get_their_own() {
    let mut network = Network::new(RouterOptions::default());
    let first = member(&mut network, RADIO, 0, false, false);
    let second = member(&mut network, RADIO, 0, false, false);
    let vehicle = network.link();
    let other_station = Component::new(254, 190);
    network.hears(first, &heartbeat(STATION));
    network.hears(second, &heartbeat(other_station));
    assert_eq!(network.hears(vehicle, &command(VEHICLE, STATION)), [first]);
    assert_eq!(network.hears(vehicle, &command(VEHICLE, other_station)), [second]);
    assert_eq!(network.now.since(Time::ZERO).as_secs(), 1_000);
}
