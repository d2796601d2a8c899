//! Inputs that were found to go wrong in a review, each as a test that fails until it is mended.
//!
//! `cargo test --test protocol -- --ignored defects` shows which are left. A test that passes loses
//! its `ignore` and moves to `regressions`.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::{Component, MessageId, Version};
use mavswitch::routing::{Capacity, GroupId, LinkOptions, MAX_HEARD, Membership, RouterOptions};
use std::time::Duration;

/// A flood has filled the table and is over; then the vehicle comes by another link than before.
#[test]
#[ignore = "room is made for new components, and not for known ones on new links"]
fn after_a_flood_a_component_is_found_on_another_link() {
    let mut network = Network::new(RouterOptions::default());
    let links: Vec<_> = (0..8).map(|_| network.link()).collect();
    let (before, after, station) = (links[0], links[1], links[2]);
    network.hears(before, &heartbeat(VEHICLE));
    for number in 0..MAX_HEARD / 5 {
        let [system, component] = [10 + number / 200, 1 + number % 200].map(|id| id as u8);
        for link in &links[2..] {
            network.receive(*link, &heartbeat(Component::new(system, component)));
        }
        network.delivered();
    }
    for _ in 0..20 {
        network.pass(1);
        network.hears(after, &heartbeat(VEHICLE));
    }
    let hears = network.hears(station, &command(STATION, VEHICLE));
    assert!(hears.contains(&after), "only {hears:?}");
}

/// A radio whose RADIO_STATUS nobody shall see still says how much it takes.
#[test]
#[ignore = "what is filtered slows no link down"]
fn a_radio_is_listened_to_though_its_status_is_filtered() {
    let mut network = Network::new(RouterOptions::default());
    let mut options = LinkOptions {
        capacity: Capacity::Paced { rate: 5_760, queue_time: Duration::from_millis(250) },
        ..LinkOptions::default()
    };
    options.filter_in.block_messages = vec![MessageId::RADIO_STATUS];
    let radio = network.link_with(options);
    let source = Component::new(51, 68);
    network
        .receive(radio, &frame(Version::V1, 0, source, (109, 185), &[0, 0, 0, 0, 9, 9, 10, 9, 9]));
    assert!(network.router.port(radio).unwrap().rate().unwrap() < 5_760);
}

/// The radio was away, and is back; all but the heartbeats still goes over the modem, so between two
/// heartbeats on the radio many numbers are missing. None of those frames was lost.
#[test]
#[ignore = "gaps of the sequence count as loss also where only heartbeats are sent"]
fn a_preferred_path_that_carries_heartbeats_is_taken_again() {
    let mut network = Network::new(RouterOptions::default());
    let [radio, modem] = [1, 2].map(|member| {
        let rank = 2 - member as u8;
        let membership = Membership { group: GroupId(0), member, rank, best_only: true };
        let dedup = Some(Duration::from_millis(500));
        network.link_with(LinkOptions {
            membership: Some(membership),
            dedup,
            ..LinkOptions::default()
        })
    });
    let station = network.link();
    let mut seq = 0_u8;
    let mut fly = |network: &mut Network, seconds: u64, busy, other: Option<_>| {
        for tenth in 0..seconds * 50 {
            network.now = network.now + Duration::from_millis(20);
            seq = seq.wrapping_add(1);
            if tenth % 50 == 0 {
                let bytes = frame(Version::V2, seq, VEHICLE, (0, 50), &[seq; 9]);
                other.into_iter().for_each(|link| network.receive(link, &bytes));
                network.receive(busy, &bytes);
            } else {
                network.receive(busy, &attitude(VEHICLE, seq));
            }
            network.delivered();
        }
        network.hears(station, &command(STATION, VEHICLE))
    };
    assert_eq!(fly(&mut network, 10, radio, Some(modem)), [radio]);
    assert_eq!(fly(&mut network, 10, modem, None), [modem]);
    assert_eq!(fly(&mut network, 20, modem, Some(radio)), [radio], "20 s after it is back");
}
