//! Signed frames where nobody here has the key, and the link ids of what is signed here.

use crate::frames::signed;
use crate::network::*;
use crate::signing::{NOW, beside, each, gated, key, sign, signed_by, verify};
use mavswitch::mavlink::{Component, Key, Streams};
use mavswitch::routing::{DropReason, GateOptions, LinkId, OldFrames};
use std::collections::HashSet;

const OWN: Component = Component::new(1, 191);

/// COMMAND_LONG, signed.
fn signed_command(from: Component, to: Component) -> Vec<u8> {
    let mut payload = [0; 33];
    (payload[30], payload[31], payload[32]) = (to.system, to.component, 1);
    signed(0, from, (76, 152), &payload)
}

#[test]
fn rule_53_signed_frames_are_routed_unverified_and_unaltered() {
    let (mut network, [radio, station, other]) = Network::with_links();
    // Nobody here has a key, and the signatures are none.
    let telemetry = signed(3, VEHICLE, (30, 39), &[7; 28]);
    network.receive(radio, &telemetry);
    assert_eq!(network.sent(station), telemetry, "byte for byte");
    assert_eq!(network.sent(other), telemetry);
    // They teach routes and find their way like any other.
    network.receive(station, &signed(0, STATION, (0, 50), &[6, 8, 0, 0, 0, 3]));
    network.delivered();
    let command = signed_command(STATION, VEHICLE);
    network.receive(station, &command);
    assert_eq!((network.sent(radio), network.sent(other)), (command, vec![]));
    network.delivered();
    // The same once more to whoever had it would be a replay there: it is a copy, and dropped.
    assert_eq!(network.hears(other, &telemetry), []);
    assert_eq!(network.counters(other)[DropReason::Duplicate], 1);
}

#[test]
fn rule_55_who_cannot_verify_gets_no_signed_frame_unless_it_was_verified_on_its_way_in() {
    let (mut network, gateway, open) = beside(verify(false));
    let own = network.link_with(gated(GateOptions { needs_belief: true, ..Default::default() }));
    let other = network.link();
    network.receive(own, &heartbeat(OWN));
    network.receive(other, &attitude(OWN, 1));
    network.delivered();
    let heard = |network: &Network, link| network.counters(link).frames_out;
    let before = heard(&network, other);
    let to_own = |seq: u8| {
        let mut payload = [0; 33];
        (payload[30], payload[31], payload[32]) = (OWN.system, OWN.component, 1);
        crate::frames::frame(mavswitch::mavlink::Version::V2, seq, STATION, (76, 152), &payload)
    };
    let strange = signed_by(&Key::from_passphrase("another"), 1, NOW, &to_own(1));
    assert_eq!(network.hears(open, &strange), [own, other]);
    assert_eq!(heard(&network, own), 0, "it cannot tell who that is from");
    assert_eq!(network.counters(own)[DropReason::FilteredOut], 1);
    assert_eq!(heard(&network, other), before + 1, "but a router forwards it");
    // Without a signature it is like any other.
    network.receive(open, &to_own(2));
    assert_eq!(heard(&network, own), 1);
    // Whom the gate has believed, the component may believe.
    let good = signed_by(&key(), 1, NOW, &to_own(3));
    network.receive(gateway, &good);
    assert_eq!(heard(&network, own), 2);
    // That was said of one frame, and not of the next.
    let strange = signed_by(&Key::from_passphrase("another"), 1, NOW, &to_own(4));
    network.receive(open, &strange);
    assert_eq!(heard(&network, own), 2);
}

/// The link id in the signature of what leaves over a link, and the frame.
fn link_id(network: &mut Network, link: LinkId) -> (u8, Vec<u8>) {
    let sent = network.sent(link);
    (sent[sent.len() - 13], sent)
}

#[test]
fn rule_59_each_link_signs_with_a_link_id_of_its_own() {
    let (mut network, radio, vehicle) = beside(sign(OldFrames::Upgrade));
    let lte = network.link_with(gated(sign(OldFrames::Upgrade)));
    for seq in 0..10 {
        network.receive(vehicle, &attitude(VEHICLE, seq));
        let [(one, at_radio), (other, at_lte)] = [radio, lte].map(|it| link_id(&mut network, it));
        assert_eq!((one, other), (255, 253), "the number of the link, counted from the top");
        // Whoever hears both has a stream for each: neither is a replay of the other.
        let mut streams = Streams::default();
        for bytes in [at_radio, at_lte] {
            each(&bytes, |frame| assert!(streams.accept(frame, &key(), NOW).is_ok()));
        }
    }
}

#[test]
fn rule_59_of_256_links_the_last_signs_as_the_first_does() {
    let (mut network, first, vehicle) = beside(sign(OldFrames::Pass));
    let more: Vec<_> = (2..256).map(|_| network.link_with(gated(sign(OldFrames::Pass)))).collect();
    network.receive(vehicle, &attitude(VEHICLE, 1));
    let links = [first].into_iter().chain(more);
    let ids: Vec<u8> = links.map(|link| link_id(&mut network, link).0).collect();
    let (last, others) = ids.split_last().unwrap();
    assert_eq!(others.iter().collect::<HashSet<_>>().len(), 254, "the vehicle's link has another");
    assert_eq!((ids[0], *last), (255, 255));
    assert!(!ids.contains(&0), "vehicles number their own from the bottom");
}
