//! Who looks on at the router: copies of frames while somebody wants them, and what links counted.

use std::collections::HashSet;

use crate::network::*;
use mavswitch::mavlink::{Frame, MessageId};
use mavswitch::routing::{
    DropReason, FilterLists, LinkCounters, LinkId, LinkOptions, LocalPeer, Router, Sighting, Time,
};

/// What was seen, with its bytes.
fn seen(router: &Router) -> Vec<(Sighting, Vec<u8>)> {
    router.tap().sightings().map(|(sighting, bytes)| (*sighting, bytes.to_vec())).collect()
}

/// A link to which no ATTITUDE goes.
fn without_attitude(network: &mut Network) -> LinkId {
    let filter_out = FilterLists { block_messages: vec![MessageId(30)], ..Default::default() };
    network.link_with(LinkOptions { filter_out, ..LinkOptions::default() })
}

#[test]
fn who_looks_on_sees_each_frame_and_where_it_went_or_why_not() {
    let (mut network, [vehicle, station]) = Network::with_links();
    let picky = without_attitude(&mut network);
    network.router.set_tap(true);
    network.receive(vehicle, &attitude(VEHICLE, 1));
    network.receive(station, &command(STATION, VEHICLE));
    network.receive(station, &command(STATION, CAMERA));
    let nobody = mavswitch::mavlink::Component::new(9, 9);
    network.receive(station, &command(STATION, nobody));
    let seen = seen(&network.router);
    let bytes: Vec<_> = seen.iter().map(|(_, bytes)| bytes.clone()).collect();
    let sent = [
        attitude(VEHICLE, 1),
        command(STATION, VEHICLE),
        command(STATION, CAMERA),
        command(STATION, nobody),
    ];
    assert_eq!(bytes, sent, "whole, and in their order");

    let (first, directed, lost) = (&seen[0].0, &seen[1].0, &seen[3].0);
    assert_eq!((first.link, first.at, first.verified), (vehicle, network.now, true));
    assert_eq!(first.sent.iter().collect::<Vec<_>>(), [station]);
    let refused: Vec<_> = first.refused.iter().flatten().copied().collect();
    assert_eq!((refused, first.dropped), (vec![(picky, DropReason::FilteredOut)], None));
    assert_eq!(directed.sent.iter().collect::<Vec<_>>(), [vehicle]);
    assert_eq!((lost.dropped, lost.sent.is_empty()), (Some(DropReason::NoRoute), true));
}

#[test]
fn what_is_kept_out_and_what_is_a_copy_is_seen_as_such() {
    let (mut network, [vehicle, other]) = Network::with_links();
    let filter_in = FilterLists { block_messages: vec![MessageId(30)], ..Default::default() };
    let deaf = network.link_with(LinkOptions { filter_in, ..LinkOptions::default() });
    network.router.set_tap(true);
    network.receive(deaf, &attitude(STATION, 1));
    network.receive(vehicle, &attitude(VEHICLE, 1));
    network.receive(other, &attitude(VEHICLE, 1));
    let dropped: Vec<_> = seen(&network.router).iter().map(|(it, _)| it.dropped).collect();
    assert_eq!(dropped, [Some(DropReason::FilteredIn), None, Some(DropReason::Duplicate)]);
}

#[test]
fn rule_47_nobody_looks_on_when_a_key_passes() {
    let (mut network, [vehicle, station]) = Network::with_links();
    network.receive(vehicle, &heartbeat(VEHICLE));
    network.router.set_tap(true);
    network.receive(station, &setup_signing(0, STATION, VEHICLE));
    assert!(network.router.tap().is_empty());
    network.receive(station, &heartbeat(STATION));
    assert_eq!(seen(&network.router)[0].1, heartbeat(STATION));
}

#[test]
fn of_many_refusals_the_first_four_are_told() {
    let (mut network, [vehicle]) = Network::with_links();
    let picky: Vec<LinkId> = (0..6).map(|_| without_attitude(&mut network)).collect();
    network.router.set_tap(true);
    network.receive(vehicle, &attitude(VEHICLE, 1));
    let refused = seen(&network.router)[0].0.refused;
    let links: Vec<LinkId> = refused.iter().flatten().map(|(link, _)| *link).collect();
    assert_eq!(links, picky[..4]);
}

#[test]
fn an_onlooker_who_does_not_keep_up_misses_frames_and_holds_up_none() {
    let (mut network, [vehicle, station]) = Network::with_links();
    network.router.set_tap(true);
    network.router.set_tap(true);
    let mut taken = 0;
    for number in 0..1_500_u32 {
        network.receive(vehicle, &attitude(VEHICLE, number as u8));
        taken += usize::from(!network.sent(station).is_empty());
    }
    let (count, missed) = (seen(&network.router).len(), network.router.tap().missed());
    assert_eq!((taken, count as u64 + missed), (1_500, 1_500));
    assert_eq!(count, 1_024, "so many there is room for");

    network.router.clear_tap();
    assert!(network.router.tap().is_empty());
    let text =
        crate::frames::frame(mavswitch::mavlink::Version::V2, 0, VEHICLE, (131, 223), &[7; 255]);
    for _ in 0..1_000 {
        network.receive(vehicle, &text);
        network.sent(station);
    }
    let bytes: usize = seen(&network.router).iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(bytes <= 96 * 1_024 && bytes + text.len() > 96 * 1_024, "{bytes} bytes");
    assert!(network.router.tap().missed() > 0);
}

#[test]
fn when_nobody_looks_on_any_more_nothing_is_kept() {
    let (mut network, [vehicle, _]) = Network::with_links();
    network.receive(vehicle, &attitude(VEHICLE, 0));
    assert!(network.router.tap().is_empty(), "nobody has asked yet");
    network.router.set_tap(true);
    network.receive(vehicle, &attitude(VEHICLE, 1));
    assert!(network.router.tap().is_open() && !network.router.tap().is_empty());
    network.router.set_tap(false);
    network.receive(vehicle, &attitude(VEHICLE, 2));
    assert!(!network.router.tap().is_open() && network.router.tap().is_empty());
}

#[test]
fn each_reason_has_a_name_and_a_count_of_its_own() {
    let names: HashSet<&str> = DropReason::ALL.iter().map(|reason| reason.name()).collect();
    assert_eq!(names.len(), DropReason::ALL.len());
    let (mut one, mut two) = <(LinkCounters, LinkCounters)>::default();
    for (number, reason) in (1..).zip(DropReason::ALL) {
        one[reason] = number;
        two[reason] = 100;
    }
    (one.frames_in, one.bytes_in, one.frames_out, one.bytes_out) = (1, 2, 3, 4);
    (two.frames_in, two.bytes_in, two.frames_out, two.bytes_out) = (10, 20, 30, 40);
    (one.invalid_sources, one.unlearned, two.invalid_sources, two.unlearned) = (5, 6, 50, 60);
    let reasons = DropReason::ALL.len() as u64;
    assert_eq!(one.dropped(), reasons * (reasons + 1) / 2);
    let mut sum = one;
    sum += &two;
    let passed = (sum.frames_in, sum.bytes_in, sum.frames_out, sum.bytes_out);
    assert_eq!((passed, sum.invalid_sources, sum.unlearned), ((11, 22, 33, 44), 55, 66));
    assert_eq!(sum.dropped(), one.dropped() + 100 * reasons);
    assert!((1..).zip(DropReason::ALL).all(|(number, reason)| sum[reason] == number + 100));
}

/// A part of the program that only hears.
#[derive(Debug, Default)]
struct Ear(usize);

impl LocalPeer for Ear {
    fn handle_frame(&mut self, _: &Frame<'_>, _: Time) {
        self.0 += 1;
    }

    fn poll_transmit(&mut self, _: Time, _: &mut Vec<u8>) -> bool {
        false
    }

    fn poll_timeout(&self) -> Option<Time> {
        None
    }
}

#[test]
fn a_part_of_the_program_has_nothing_that_can_wait_and_no_end_unless_it_says_so() {
    let (mut ear, now, mut said) = (Ear::default(), Time::from_millis(1), Vec::new());
    let bytes = heartbeat(VEHICLE);
    ear.handle_frame(&Frame::parse(&bytes).unwrap(), now);
    assert_eq!((ear.0, ear.bulk(now), ear.ended()), (1, None, None));
    assert!(!ear.poll_bulk(now, &mut said) && said.is_empty());
}
