//! Frames that are made anew on their way: other system ids, another version of MAVLink.

use std::sync::Arc;

use crate::frames::{Random, Receiver, frame, signed, telemetry};
use crate::network::*;
use mavswitch::mavlink::{
    Component, Dialect, FrameBuffer, Input, MessageId, Recipes, SystemMap, Version,
};
use mavswitch::routing::{DropReason, GateOptions, LinkId, LinkOptions, RateCap, RouterOptions};

fn recipes() -> Option<Arc<Recipes>> {
    Some(Arc::new(Recipes::new(&Dialect::builtin())))
}

fn remap(pairs: &[(u8, u8)]) -> GateOptions {
    let remap = SystemMap::new(pairs).map(Arc::new);
    GateOptions { remap, recipes: recipes(), ..GateOptions::default() }
}

fn version(version: Version, passes_unconverted: bool) -> GateOptions {
    let version = Some(version);
    GateOptions { version, passes_unconverted, recipes: recipes(), ..GateOptions::default() }
}

/// A link with such a gate, and an open one.
fn beside(gate: GateOptions) -> (Network, LinkId, LinkId) {
    let mut network = Network::new(RouterOptions::default());
    let gated = network.link_with(LinkOptions { gate, ..LinkOptions::default() });
    let open = network.link();
    (network, gated, open)
}

fn sent(network: &mut Network, from: LinkId, to: LinkId, bytes: &[u8]) -> Vec<u8> {
    network.receive(from, bytes);
    let sent = network.sent(to);
    network.delivered();
    sent
}

#[test]
fn two_vehicles_with_one_id_are_flown_side_by_side() {
    let mut network = Network::new(RouterOptions::default());
    let one = network.link();
    let gate = remap(&[(1, 7)]);
    let two = network.link_with(LinkOptions { gate, ..LinkOptions::default() });
    let station = network.link();
    let seven = Component::new(7, 1);
    sent(&mut network, station, one, &heartbeat(STATION));
    assert_eq!(sent(&mut network, one, station, &attitude(VEHICLE, 1)), attitude(VEHICLE, 1));
    assert_eq!(sent(&mut network, two, station, &attitude(VEHICLE, 2)), attitude(seven, 2));
    // Each is sent what is for it, and knows itself in it.
    assert_eq!(
        sent(&mut network, station, one, &command(STATION, VEHICLE)),
        command(STATION, VEHICLE)
    );
    assert_eq!(
        sent(&mut network, station, two, &command(STATION, seven)),
        command(STATION, VEHICLE)
    );
    // Of each other they hear as of somebody else.
    assert_eq!(sent(&mut network, one, two, &heartbeat(VEHICLE)), heartbeat(seven));
}

#[test]
fn what_is_recorded_and_counted_has_the_id_that_it_has_here() {
    let (mut network, gated, _) = beside(remap(&[(1, 7)]));
    let seven = Component::new(7, 1);
    Receiver::new().each(&attitude(VEHICLE, 1), Input::Paused, |frame| {
        assert!(network.router.handle(gated, frame, network.now));
        let mut buffers = <[FrameBuffer; 2]>::default();
        let taken = network.router.as_taken(gated, frame, &mut buffers);
        assert_eq!((taken.bytes, taken.header.source), (&attitude(seven, 1)[..], seven));
    });
    assert!(network.router.tallies().all(|tally| tally.source == seven));
    assert_eq!(network.router.tallies().count(), 1);
}

#[test]
fn a_cap_holds_for_frames_that_leave_with_other_ids() {
    let mut network = Network::new(RouterOptions::default());
    let interval = std::time::Duration::from_millis(500);
    let caps = vec![RateCap { id: MessageId(30), interval }];
    let gate = remap(&[(1, 7)]);
    let capped = network.link_with(LinkOptions { gate, caps, ..LinkOptions::default() });
    let vehicle = network.link();
    for number in 0..10 {
        network.receive(vehicle, &attitude(VEHICLE, number));
    }
    assert_eq!(network.sent(capped), attitude(Component::new(7, 1), 0));
    assert_eq!(network.counters(capped)[DropReason::RateCap], 9);
}

#[test]
fn an_id_here_is_another_one_on_the_wire() {
    let (network, gated, open) = beside(remap(&[(1, 7)]));
    let seven = Component::new(7, 1);
    assert_eq!(network.router.on_the_wire(gated, seven), VEHICLE);
    assert_eq!(network.router.on_the_wire(gated, VEHICLE), seven);
    assert_eq!(network.router.on_the_wire(open, seven), seven);
    assert!(!network.router.asks_for_signatures(gated));
}

#[test]
fn signed_frames_are_not_given_other_ids() {
    let (mut network, gated, open) = beside(remap(&[(1, 7)]));
    assert_eq!(network.hears(gated, &signed(0, VEHICLE, (30, 39), &[7; 28])), []);
    assert_eq!(network.counters(gated)[DropReason::Signed], 1);
    let other = signed(0, STATION, (30, 39), &[7; 28]);
    assert_eq!(sent(&mut network, gated, open, &other), other, "nothing to change in it");
}

#[test]
fn ids_there_and_back_are_the_same_frames() {
    let map = SystemMap::new(&[(1, 7), (2, 200)]).unwrap();
    let recipes = recipes().unwrap();
    let mut changed = 0;
    for bytes in telemetry(3_000, &mut Random::new(5)) {
        Receiver::new().each(&bytes, Input::Paused, |frame| {
            let (mut there, mut back) = <(FrameBuffer, FrameBuffer)>::default();
            let Some(new) = there.remap(frame, &map, recipes.target_at(frame)) else {
                return assert!(frame.header.signed);
            };
            assert_eq!(new.bytes != frame.bytes, map.concerns(frame));
            changed += usize::from(map.concerns(frame));
            // It is whole, and reads as it was told.
            let read = Receiver::new().receive(new.bytes, Input::Paused);
            assert_eq!((read[0].header, read[0].target), (new.header, new.target));
            let old = back.remap(&new, &map, recipes.target_at(&new)).unwrap();
            assert_eq!(old, *frame);
        });
    }
    assert!(changed > 500, "only {changed}");
}

#[test]
fn rule_61_an_old_ground_station_gets_what_can_be_had_in_its_version() {
    let (mut network, old, vehicle) = beside(version(Version::V1, false));
    sent(&mut network, old, vehicle, &heartbeat(STATION));
    let short = frame(Version::V2, 3, VEHICLE, (30, 39), &[7; 5]);
    let mut payload = [0; 28];
    payload[..5].fill(7);
    let long = frame(Version::V1, 3, VEHICLE, (30, 39), &payload);
    assert_eq!(sent(&mut network, vehicle, old, &short), long);
    assert_eq!(sent(&mut network, vehicle, old, &long), long);
    // OPEN_DRONE_ID_BASIC_ID has an id above 255; of the other nobody knows the length.
    let dialect = Dialect::builtin();
    let unknown = (1..=255).find(|id| dialect.by_id(MessageId(*id)).is_none()).unwrap();
    for (id, extra) in [(12_900, 114), (unknown, 77)] {
        let before = network.counters(old)[DropReason::NotConverted];
        let new = frame(Version::V2, 0, VEHICLE, (id, extra), &[0, 0, 1]);
        assert!(sent(&mut network, vehicle, old, &new).is_empty());
        assert_eq!(network.counters(old)[DropReason::NotConverted], before + 1, "{id}");
    }
}

#[test]
fn what_cannot_be_converted_passes_if_the_user_says_so() {
    let (mut network, old, vehicle) = beside(version(Version::V1, true));
    let new = frame(Version::V2, 0, VEHICLE, (12_900, 114), &[0, 0, 1]);
    assert_eq!(sent(&mut network, vehicle, old, &new), new);
}

#[test]
fn rule_61_a_new_ground_station_gets_mavlink_2() {
    let (mut network, new, vehicle) = beside(version(Version::V2, false));
    let old = frame(Version::V1, 3, VEHICLE, (30, 39), &[7; 28]);
    assert_eq!(
        sent(&mut network, vehicle, new, &old),
        frame(Version::V2, 3, VEHICLE, (30, 39), &[7; 28])
    );
}
