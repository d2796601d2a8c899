//! The same frame again: by another link, round a ring, from a sender that counts nothing, late.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::{Component, Version};
use mavswitch::routing::{DropReason, GroupId, LinkId, LinkOptions, Membership, RouterOptions};
use std::time::Duration;

/// A radio and a modem of one group, and a station.
fn two_paths(dedup: Option<Duration>) -> (Network, [LinkId; 3]) {
    let mut network = Network::new(RouterOptions::default());
    let [radio, modem] = [1, 2].map(|member| {
        let membership = Membership { group: GroupId(0), member, rank: 0, best_only: false };
        let membership = Some(membership);
        network.link_with(LinkOptions { membership, dedup, ..LinkOptions::default() })
    });
    let station = network.link();
    (network, [radio, modem, station])
}

const DEDUP: Option<Duration> = Some(Duration::from_millis(500));

/// Number `number` of the vehicle's frames, unlike all others.
fn numbered(number: u32) -> Vec<u8> {
    frame(Version::V2, number as u8, VEHICLE, (0, 50), &number.to_le_bytes())
}

#[test]
fn rule_49_what_comes_by_a_second_link_as_well_is_delivered_once() {
    let (mut network, [left, right, station]) = Network::with_links();
    assert_eq!(network.hears(left, &attitude(VEHICLE, 0)), [right, station]);
    network.pass_ms(1_900);
    assert_eq!(network.hears(right, &attitude(VEHICLE, 0)), [], "it may have gone round");
    assert_eq!(network.counters(right)[DropReason::Duplicate], 1);
    let hears = network.hears(station, &command(STATION, VEHICLE));
    assert_eq!(hears, [left, right], "either link leads to it all the same");
}

/// Python programs on pymavlink's lowest level often leave the sequence number at 0.
#[test]
fn who_counts_nothing_is_heard_each_time_over_one_link() {
    let (mut network, [vehicle, station, _other]) = Network::with_links();
    for _ in 0..1_000 {
        network.pass_ms(20);
        network.hears(vehicle, &heartbeat(VEHICLE));
    }
    assert_eq!(network.counters(station).frames_out, 1_000);
    assert_eq!(network.counters(vehicle)[DropReason::Duplicate], 0);
}

/// Its frames come over two links that are no group: once for each time that it speaks.
#[test]
fn who_counts_nothing_is_heard_each_time_over_two_links() {
    let (mut network, [radio, modem, station]) = Network::with_links();
    for _ in 0..1_000 {
        network.pass_ms(20);
        network.hears(radio, &heartbeat(VEHICLE));
        network.hears(modem, &heartbeat(VEHICLE));
    }
    assert_eq!(network.counters(station).frames_out, 1_000);
    for _ in 0..250 {
        network.pass_ms(20);
        network.hears(modem, &heartbeat(VEHICLE));
    }
    // The modem takes the radio's place once after 2 s, for this may have gone round, and after 4 s.
    let after = network.counters(station).frames_out - 1_000;
    assert!((51..=53).contains(&after), "{after}: the radio is gone, and forgotten");
}

/// A script that asks one thing and ends, run again at once: the same bytes over a new connection.
#[test]
fn a_program_that_connects_anew_is_heard_again() {
    let (mut network, [vehicle]) = Network::with_links();
    network.hears(vehicle, &heartbeat(VEHICLE));
    for run in 0..5 {
        let script = network.link();
        assert_eq!(network.hears(script, &heartbeat(STATION)), [vehicle], "run {run}");
        assert_eq!(network.hears(script, &command(STATION, VEHICLE)), [vehicle], "run {run}");
        network.router.remove_link(script);
        network.pass_ms(200);
    }
}

/// Who groups two links has said that they are one way: nobody wants everything twice.
#[test]
fn links_of_a_group_deliver_once_also_where_nothing_is_said_of_dedup() {
    let (mut network, [radio, modem, station]) = two_paths(None);
    for number in 0..100 {
        network.pass_ms(20);
        let [first, second] = if number % 3 == 0 { [radio, modem] } else { [modem, radio] };
        assert_eq!(network.hears(first, &numbered(number)), [station]);
        network.pass_ms(400);
        assert_eq!(network.hears(second, &numbered(number)), [], "the longer way");
        assert_eq!(network.hears(second, &numbered(number)), []);
    }
    for _ in 0..100 {
        network.pass_ms(20);
        assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station], "it counts nothing");
        assert_eq!(network.hears(modem, &heartbeat(VEHICLE)), []);
    }
}

/// A sender that counts nothing says the same once a second, and each link loses every other one.
#[test]
fn who_counts_nothing_is_heard_over_whichever_link_of_a_group() {
    let (mut network, [radio, modem, station]) = two_paths(None);
    for _ in 0..20 {
        for link in [radio, modem] {
            network.pass_ms(1_000);
            assert_eq!(network.hears(link, &heartbeat(VEHICLE)), [station]);
        }
    }
}

/// A script is run again over a new connection to a server that is one of a group.
#[test]
fn a_program_that_connects_anew_to_a_group_is_heard_again() {
    let (mut network, [radio, _, station]) = two_paths(None);
    network.hears(station, &heartbeat(STATION));
    assert_eq!(network.hears(radio, &command(VEHICLE, STATION)), [station]);
    let membership = network.router.port(radio).unwrap().options().membership;
    network.router.remove_link(radio);
    let again = network.link_with(LinkOptions { membership, ..LinkOptions::default() });
    assert_eq!(network.hears(again, &command(VEHICLE, STATION)), [station]);
}

/// The modem has no coverage for a while, and then brings all that it held back. The radio has
/// brought it long ago.
#[test]
fn what_a_path_held_back_is_not_delivered_again() {
    for (rate, held) in [(1, 20), (4, 20), (50, 10), (100, 29)] {
        let (mut network, [radio, modem, station]) = two_paths(DEDUP);
        let mut waiting = Vec::new();
        for number in 0..rate * held {
            network.pass_ms(1_000 / u64::from(rate));
            network.hears(radio, &numbered(number));
            waiting.push(numbered(number));
        }
        let delivered = network.counters(station).frames_out;
        waiting.iter().for_each(|bytes| drop(network.hears(modem, bytes)));
        let again = network.counters(station).frames_out - delivered;
        // Of 256 numbers, those just ahead of the newest may be of new frames with the same bytes.
        let most = u64::from(rate * held / 256 + 1) * 17;
        assert!(again <= if rate == 1 { 0 } else { most }, "{again} of {} again", waiting.len());
    }
}

/// A command that comes late must not be carried out again.
#[test]
fn a_command_that_a_path_held_back_is_not_delivered_again() {
    let (mut network, [radio, modem, station]) = two_paths(DEDUP);
    network.hears(station, &heartbeat(STATION));
    let mut payload = [0; 33];
    payload[30..].copy_from_slice(&[STATION.system, STATION.component, 1]);
    let takeoff = frame(Version::V2, 7, VEHICLE, (76, 152), &payload);
    assert_eq!(network.hears(radio, &takeoff), [station]);
    for number in 8..28 {
        network.pass_ms(1_000);
        network.hears(radio, &numbered(number));
    }
    assert_eq!(network.hears(modem, &takeoff), [], "20 s later");
    assert_eq!(network.counters(modem)[DropReason::Duplicate], 1);
}

/// The modem takes longer than `dedup` says, and nothing was said since: the command is not carried
/// out twice for that.
#[test]
fn the_last_word_of_who_counts_is_not_delivered_again_over_the_longer_way() {
    for dedup in [None, DEDUP] {
        let (mut network, [radio, modem, station]) = two_paths(dedup);
        network.hears(station, &heartbeat(STATION));
        for seq in 0..4 {
            let mut payload = [0; 33];
            payload[30..].copy_from_slice(&[STATION.system, STATION.component, 1]);
            let takeoff = frame(Version::V2, seq, VEHICLE, (76, 152), &payload);
            network.pass_ms(1_000);
            assert_eq!(network.hears(radio, &takeoff), [station]);
            network.pass_ms(800);
            let again = network.hears(modem, &takeoff);
            // The first word says nothing of whether it counts.
            assert!(seq == 0 || again.is_empty(), "number {seq}");
        }
    }
}

/// The vehicle starts again and counts from 0, with the same heartbeats as before.
#[test]
fn who_starts_again_is_not_silenced() {
    let say = |seq| frame(Version::V2, seq, VEHICLE, (0, 50), &[0, 0, 0, 0, 2, 3, 81, 3, 3]);
    let (mut network, [radio, modem, station]) = two_paths(DEDUP);
    let mut fly = |seqs: std::ops::Range<u8>, links: &[LinkId]| {
        let before = network.counters(station).frames_out;
        for seq in seqs {
            network.pass_ms(250);
            links.iter().for_each(|link| drop(network.hears(*link, &say(seq))));
        }
        network.counters(station).frames_out - before
    };
    assert_eq!(fly(0..40, &[radio, modem]), 40);
    assert_eq!(fly(0..20, &[radio, modem]), 20, "started again");
    assert_eq!(fly(0..10, &[radio]), 10, "and again, on the radio alone");
    assert_eq!(fly(10..60, &[modem]), 50, "and then on the modem alone");
    assert!(fly(0..60, &[modem]) >= 52, "where it starts again once more");
}

/// Two frames of different sources are never copies of each other, nor are two that differ in the
/// sequence number alone.
#[test]
fn rule_49_all_bytes_count() {
    let (mut network, [left, right, station]) = Network::with_links();
    network.hears(left, &attitude(VEHICLE, 0));
    assert_eq!(network.hears(right, &attitude(VEHICLE, 1)), [station]);
    assert_eq!(network.hears(right, &attitude(CAMERA, 0)), [left, station]);
    assert_eq!(network.hears(right, &attitude(Component::new(2, 1), 0)), [left, station]);
}

/// Each cable brings back what the other one took: the vehicle is heard on both, and must not be cut
/// off from them for that.
#[test]
fn rule_49_echoes_on_every_cable_cut_nobody_off() {
    let (mut network, [vehicle, one, two]) = Network::with_links();
    for seq in 0..100 {
        network.pass_ms(20);
        assert_eq!(network.hears(vehicle, &attitude(VEHICLE, seq)), [one, two]);
        assert_eq!(network.hears(one, &attitude(VEHICLE, seq)), []);
        assert_eq!(network.hears(two, &attitude(VEHICLE, seq)), []);
    }
}

/// One frame of the vehicle came round by the cable that leads to the station.
#[test]
fn a_directed_frame_goes_to_its_target_though_its_source_is_heard_there() {
    let (mut network, [vehicle, cable]) = Network::with_links();
    network.hears(cable, &heartbeat(STATION));
    network.hears(cable, &attitude(VEHICLE, 0));
    assert_eq!(network.hears(vehicle, &command(VEHICLE, STATION)), [cable]);
}
