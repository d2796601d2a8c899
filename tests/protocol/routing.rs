//! Who sends what, and who must hear it: the routing rules, one by one.

use crate::frames::{Receiver, frame};
use crate::network::*;
use mavswitch::mavlink::{Component, Dialect, Target, Version};
use mavswitch::routing::{Capacity, DropReason, Learn, LinkOptions, RouterEvent, RouterOptions};

#[test]
fn rule_33_a_broadcast_goes_to_every_link_but_its_own() {
    let (mut network, [radio, station, camera]) = Network::with_links();
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station, camera]);
    let to_everybody = command(STATION, Component::new(0, 5));
    assert_eq!(network.hears(station, &to_everybody), [radio, camera]);
}

#[test]
fn rules_35_and_37_a_directed_frame_goes_where_its_target_was_heard() {
    let (mut network, [radio, station, _idle]) = Network::with_links();
    network.hears(radio, &attitude(VEHICLE, 0));
    network.hears(station, &heartbeat(STATION));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    assert_eq!(network.hears(radio, &command(VEHICLE, STATION)), [station]);
}

#[test]
fn rule_36_component_0_is_every_link_of_the_system() {
    let (mut network, [radio, camera, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.hears(camera, &heartbeat(CAMERA));
    let to_system = command(STATION, Component::new(1, 0));
    assert_eq!(network.hears(station, &to_system), [radio, camera]);
    let set_mode = frame(Version::V2, 0, STATION, (11, 89), &[4, 0, 0, 0, 1, 81]);
    assert_eq!(network.hears(station, &set_mode), [radio, camera]);
}

#[test]
fn rule_37_a_component_on_two_links_is_sent_to_on_both() {
    let (mut network, [radio, modem, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.hears(modem, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
}

#[test]
fn rule_38_an_unknown_component_is_looked_for_on_the_links_of_its_system() {
    let (mut network, [radio, camera, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.hears(camera, &heartbeat(CAMERA));
    let unknown = command(STATION, Component::new(1, 190));
    assert_eq!(network.hears(station, &unknown), [radio, camera]);
    assert_eq!(network.hears(station, &command(STATION, CAMERA)), [camera], "the exact pair");
}

#[test]
fn rule_38_strict_sends_nothing_to_an_unknown_component() {
    let mut network = Network::new(RouterOptions { strict: true, ..RouterOptions::default() });
    let (radio, station) = (network.link(), network.link());
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, CAMERA)), []);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    assert_eq!(network.hears(station, &command(STATION, Component::new(1, 0))), [radio]);
}

#[test]
fn rule_38_a_frame_for_an_unknown_system_goes_nowhere_and_is_counted() {
    let (mut network, [_radio, station]) = Network::with_links();
    assert_eq!(network.hears(station, &command(STATION, Component::new(9, 1))), []);
    assert_eq!(network.counters(station)[DropReason::NoRoute], 1);
}

#[test]
fn rule_39_a_frame_whose_target_is_on_its_own_link_is_dropped() {
    let (mut network, [radio, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.hears(station, &heartbeat(STATION));
    assert_eq!(network.hears(radio, &command(CAMERA, VEHICLE)), []);
}

#[test]
fn rule_8_a_source_of_zero_is_forwarded_and_not_learned() {
    for source in [Component::new(0, 1), Component::new(1, 0)] {
        let (mut network, [radio, station]) = Network::with_links();
        assert_eq!(network.hears(radio, &attitude(source, 0)), [station]);
        network.hears(radio, &attitude(source, 1));
        assert_eq!(network.counters(radio).invalid_sources, 2);
        let told = network.router.poll_event();
        assert_eq!(told, Some(RouterEvent::InvalidSource(source, radio)), "once");
        assert_eq!(network.router.poll_event(), None);
        assert!(network.router.table().components().is_empty());
    }
}

#[test]
fn rule_22_an_unknown_message_is_a_broadcast() {
    let (mut network, [radio, station]) = Network::with_links();
    let unknown = frame(Version::V2, 0, VEHICLE, (54_321, 77), &[1, 1, 1]);
    assert_eq!(network.hears(radio, &unknown), [station]);
}

#[test]
fn rule_24_only_a_full_check_teaches_a_route() {
    let (mut network, [radio, station]) = Network::with_links();
    let unknown = frame(Version::V2, 0, VEHICLE, (54_321, 77), &[1, 1, 1]);
    let mut receiver = Receiver::new();
    network.receive_by(&mut receiver, radio, &unknown);
    assert!(network.router.table().find(VEHICLE).is_none());
    network.receive_by(&mut receiver, radio, &unknown);
    assert!(network.router.table().find(VEHICLE).is_some(), "the second one confirms it");
    network.delivered();
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn rule_26_a_strange_definition_passes_once_it_was_seen_twice() {
    let (mut network, [radio, station]) = Network::with_links();
    let strange = frame(Version::V2, 0, VEHICLE, (0, 51), &[1, 1, 1]);
    let mut receiver = Receiver::new();
    network.receive_by(&mut receiver, radio, &strange);
    assert_eq!(network.delivered(), []);
    network.receive_by(&mut receiver, radio, &strange);
    assert_eq!(network.delivered(), [station]);
}

#[test]
fn rule_44_a_route_goes_with_its_link() {
    let (mut network, [radio, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.router.remove_link(radio);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
    let again = network.link();
    assert_eq!(again, radio, "the number is given again");
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
}

#[test]
fn rule_44_a_route_ages() {
    let (mut network, [radio, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.pass(300);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    network.pass(1);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
}

#[test]
fn rule_44_aged_components_are_forgotten_and_told_of() {
    let (mut network, [radio, _station]) = Network::with_links();
    assert_eq!(network.router.poll_timeout(), None);
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.router.poll_event(), Some(RouterEvent::ComponentSeen(VEHICLE, radio)));
    network.pass(200);
    network.hears(radio, &heartbeat(VEHICLE));
    network.pass(200);
    network.router.handle_timeout(network.now);
    assert_eq!(network.router.poll_event(), None, "heard 200 s ago");
    let next = network.router.poll_timeout().unwrap();
    assert_eq!(next.since(network.now).as_secs(), 100);
    network.pass(101);
    network.router.handle_timeout(network.now);
    assert_eq!(network.router.poll_event(), Some(RouterEvent::ComponentLost(VEHICLE)));
    assert_eq!(network.router.poll_timeout(), None);
}

#[test]
fn rule_44_a_restart_clears_the_routes_over_other_links() {
    let (mut network, [radio, modem, station]) = Network::with_links();
    network.hears(radio, &system_time(VEHICLE, 50_000));
    network.hears(modem, &system_time(VEHICLE, 50_000));
    network.hears(radio, &system_time(VEHICLE, 60_000));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
    network.hears(radio, &system_time(VEHICLE, 900));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn rule_47_setup_signing_is_dropped_unless_both_links_allow_it() {
    let mut network = Network::new(RouterOptions::default());
    let mut link = |forward_setup_signing| {
        network.link_with(LinkOptions { forward_setup_signing, ..LinkOptions::default() })
    };
    let (wired, other_wired, radio) = (link(true), link(true), link(false));
    network.hears(wired, &heartbeat(VEHICLE));
    assert_eq!(network.hears(radio, &setup_signing(0, STATION, VEHICLE)), []);
    assert_eq!(network.counters(radio)[DropReason::SetupSigning], 1);
    assert_eq!(network.hears(other_wired, &setup_signing(1, STATION, VEHICLE)), [wired]);
    let to_everybody = setup_signing(2, VEHICLE, Component::new(0, 0));
    assert_eq!(network.hears(wired, &to_everybody), [other_wired]);
}

#[test]
fn rule_49_a_source_is_not_sent_to_a_link_where_it_was_just_heard() {
    let (mut network, [left, right, station]) = Network::with_links();
    network.hears(left, &attitude(VEHICLE, 0));
    assert_eq!(network.hears(right, &attitude(VEHICLE, 1)), [station], "the loop is cut");
    assert_eq!(network.counters(left)[DropReason::Loop], 1);
    network.pass(5);
    assert_eq!(network.hears(right, &attitude(VEHICLE, 2)), [left, station], "heard long ago");
}

#[test]
fn rule_51_loss_is_counted_per_source_and_link() {
    let (mut network, [radio, modem]) = Network::with_links();
    for seq in [0, 1, 4, 5] {
        network.hears(radio, &attitude(VEHICLE, seq));
        network.hears(radio, &attitude(CAMERA, seq / 4));
        network.hears(modem, &attitude(VEHICLE, seq * 2));
    }
    let lost = |component, link| {
        let known = network.router.table().find(component).unwrap();
        known.on(link).unwrap().sequence.lost
    };
    assert_eq!(lost(VEHICLE, radio), 2);
    assert_eq!(lost(CAMERA, radio), 0);
    assert_eq!(lost(VEHICLE, modem), 1 + 5 + 1);
}

#[test]
fn learning_can_be_left_to_heartbeats() {
    let options = RouterOptions { learn: Learn::Heartbeat, ..RouterOptions::default() };
    let mut network = Network::new(options);
    let (radio, station) = (network.link(), network.link());
    network.hears(radio, &attitude(VEHICLE, 0));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn rule_43_a_full_queue_refuses_whole_frames_and_keeps_room_for_what_matters_more() {
    let mut network = Network::new(RouterOptions::default());
    let capacity = Capacity::Bytes(1_000);
    let slow = network.link_with(LinkOptions { capacity, ..LinkOptions::default() });
    let radio = network.link();
    network.receive(slow, &heartbeat(STATION));
    for seq in 0..20 {
        network.receive(radio, &attitude(VEHICLE, seq));
    }
    network.receive(radio, &heartbeat(VEHICLE));
    for _ in 0..9 {
        network.receive(radio, &command(VEHICLE, STATION));
    }
    network.receive(radio, &heartbeat(CAMERA));
    assert_eq!(network.counters(slow)[DropReason::QueueFull], 5 + 3);
    let mut expected: Vec<Vec<u8>> = (0..15).map(|seq| attitude(VEHICLE, seq)).collect();
    expected.push(heartbeat(VEHICLE));
    expected.extend(vec![command(VEHICLE, STATION); 6]);
    expected.push(heartbeat(CAMERA));
    assert_eq!(network.sent(slow), expected.concat(), "first in, first out");
}

#[test]
fn a_queue_that_fills_asks_to_be_sent_before_the_turn_is_over() {
    let mut network = Network::new(RouterOptions::default());
    let capacity = Capacity::Bytes(1_000);
    let station = network.link_with(LinkOptions { capacity, ..LinkOptions::default() });
    let vehicle = network.link();
    network.receive(vehicle, &heartbeat(VEHICLE));
    assert!(!network.router.has_filling());
    let mut seq = 0;
    while !network.router.has_filling() {
        seq += 1;
        network.receive(vehicle, &attitude(VEHICLE, seq));
    }
    assert_eq!(network.router.take_filling().iter().collect::<Vec<_>>(), [station]);
    assert!(!network.router.has_filling() && network.router.take_filling().is_empty());
    assert_eq!(network.counters(station).dropped(), 0, "in time, before anything is refused");
}

#[test]
fn the_table_of_components_is_bounded_and_keeps_those_that_speak() {
    let (mut network, [radio, station]) = Network::with_links();
    let flood = |network: &mut Network| {
        for number in 0..65_000_u16 {
            let [system, component] = number.to_be_bytes();
            if system != 0 && system != 1 && component != 0 {
                network.receive(station, &attitude(Component::new(system, component), 0));
            }
        }
    };
    network.receive(radio, &heartbeat(VEHICLE));
    flood(&mut network);
    assert_eq!(network.router.table().components().len(), 4_096);
    network.pass(9);
    network.receive(radio, &heartbeat(VEHICLE));
    network.pass(2);
    network.receive(radio, &heartbeat(CAMERA));
    assert!(network.router.table().find(CAMERA).is_some(), "it takes the place of a silent one");
    assert!(network.router.table().find(VEHICLE).is_some());
}

#[test]
fn a_frame_of_every_published_message_finds_its_target_alone() {
    for definition in Dialect::builtin().definitions() {
        let (mut network, [vehicle, station, other]) = Network::with_links();
        network.hears(vehicle, &heartbeat(VEHICLE));
        network.hears(other, &heartbeat(Component::new(77, 77)));
        let mut payload = vec![1; usize::from(definition.max_len).min(255)];
        let key = (definition.id.0, definition.crc_extra);
        if definition.id.0 == 256 {
            continue; // SETUP_SIGNING is not forwarded at all
        }
        let whole = frame(Version::V2, 0, STATION, key, &payload);
        let expected: &[_] =
            if definition.target == Target::None { &[vehicle, other] } else { &[vehicle] };
        assert_eq!(network.hears(station, &whole), expected, "{definition:?}");
        if let Target::System(at) | Target::SystemComponent(at, _) = definition.target {
            payload.truncate(usize::from(at));
            let cut = frame(Version::V2, 0, STATION, key, &payload);
            assert_eq!(network.hears(station, &cut), [vehicle, other], "{definition:?}");
        }
    }
}
