//! Filters and sniffers: what the user lets in and out, and who gets everything.

use crate::network::*;
use mavswitch::mavlink::{Component, MessageId};
use mavswitch::routing::{DropReason, FilterLists, LinkId, LinkOptions, RouterOptions};

const ATTITUDE: MessageId = MessageId(30);

fn filtered(network: &mut Network, filter_in: FilterLists, filter_out: FilterLists) -> LinkId {
    network.link_with(LinkOptions { filter_in, filter_out, ..LinkOptions::default() })
}

#[test]
fn what_is_blocked_out_is_not_sent_there() {
    let mut network = Network::new(RouterOptions::default());
    let block = FilterLists { block_messages: vec![ATTITUDE], ..FilterLists::default() };
    let thin = filtered(&mut network, FilterLists::default(), block);
    let (radio, station) = (network.link(), network.link());
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [thin, station]);
    network.receive(radio, &attitude(VEHICLE, 1));
    assert!(network.sent(thin).is_empty());
    assert_eq!(network.sent(station), attitude(VEHICLE, 1));
    assert_eq!(network.counters(thin)[DropReason::FilteredOut], 1);
}

#[test]
fn what_is_filtered_in_teaches_nothing() {
    let mut network = Network::new(RouterOptions::default());
    let only_station = FilterLists { allow_systems: vec![255], ..FilterLists::default() };
    let open = filtered(&mut network, only_station, FilterLists::default());
    let station = network.link();
    assert_eq!(network.hears(open, &heartbeat(VEHICLE)), []);
    assert_eq!(network.counters(open)[DropReason::FilteredIn], 1);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
    let other_station = Component::new(255, 191);
    assert_eq!(network.hears(open, &heartbeat(other_station)), [station]);
}

#[test]
fn rule_51_a_filter_makes_no_loss() {
    let mut network = Network::new(RouterOptions::default());
    let block = FilterLists { block_messages: vec![ATTITUDE], ..FilterLists::default() };
    let radio = filtered(&mut network, block, FilterLists::default());
    network.hears(radio, &heartbeat(VEHICLE));
    for seq in 1..=40 {
        network.hears(radio, &attitude(VEHICLE, seq));
    }
    network.hears(radio, &system_time(VEHICLE, 1));
    let known = network.router.table().find(VEHICLE).unwrap();
    assert_eq!(known.on(radio).unwrap().sequence.lost, 0);
}

#[test]
fn a_sniffer_gets_what_is_for_others() {
    let mut network = Network::new(RouterOptions::default());
    let sniffer = network.link_with(LinkOptions { is_sniffer: true, ..LinkOptions::default() });
    let (radio, station, other) = (network.link(), network.link(), network.link());
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [sniffer, radio]);
    let nowhere = command(STATION, Component::new(9, 9));
    assert_eq!(network.hears(station, &nowhere), [sniffer]);
    assert_eq!(network.counters(station)[DropReason::NoRoute], 1, "nobody it was for got it");
    assert_eq!(network.hears(sniffer, &command(CAMERA, VEHICLE)), [radio]);
    network.router.remove_link(sniffer);
    assert_eq!(network.hears(other, &nowhere), []);
}

#[test]
fn a_sniffer_is_found_by_its_system_id() {
    let options = RouterOptions { sniffer: Some(250), ..RouterOptions::default() };
    let mut network = Network::new(options);
    let (radio, station, tool) = (network.link(), network.link(), network.link());
    network.hears(radio, &heartbeat(VEHICLE));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    network.hears(tool, &heartbeat(Component::new(250, 1)));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, tool]);
}
