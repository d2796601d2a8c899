//! Options that change while frames flow: what waits, what was counted and what is known stays.

use std::time::Duration;

use crate::network::*;
use mavswitch::mavlink::MessageId;
use mavswitch::routing::{
    Capacity, DropReason, FilterLists, GroupId, LinkId, LinkOptions, Membership, RateCap,
    RouterEvent, RouterOptions,
};

const ATTITUDE: MessageId = MessageId(30);

/// Changes a link from whatever it was.
fn change(network: &mut Network, link: LinkId, options: LinkOptions) {
    network.router.set_link_options(link, options, network.now);
}

fn paced(rate: u32) -> LinkOptions {
    let capacity = Capacity::Paced { rate, queue_time: Duration::from_secs(1) };
    LinkOptions { capacity, ..LinkOptions::default() }
}

#[test]
fn what_waits_leaves_in_its_order_also_where_less_may_wait_now() {
    let (mut network, [radio, station]) = Network::with_links();
    let frames: Vec<Vec<u8>> = (0..200).map(|seq| attitude(VEHICLE, seq)).collect();
    frames.iter().for_each(|frame| network.receive(radio, frame));
    let capacity = Capacity::Bytes(1_000);
    change(&mut network, station, LinkOptions { capacity, ..LinkOptions::default() });
    network.receive(radio, &attitude(VEHICLE, 200));
    assert_eq!(network.counters(station)[DropReason::QueueFull], 1);
    assert_eq!(network.counters(station).frames_out, 200);
    assert_eq!(network.sent(station), frames.concat());
    // More may wait again.
    change(&mut network, station, LinkOptions::default());
    frames.iter().for_each(|frame| network.receive(radio, frame));
    assert_eq!(network.sent(station), frames.concat());
}

#[test]
fn a_pace_comes_goes_and_changes_with_what_waits() {
    let (mut network, [radio, station]) = Network::with_links();
    (0..10).for_each(|seq| network.receive(radio, &attitude(VEHICLE, seq)));
    let all = network.router.port(station).unwrap().backlog();
    network.router.take_dirty();
    change(&mut network, station, paced(1_000));
    // It is to be sent at once, whoever else got something or not.
    assert!(network.router.take_dirty().contains(station));
    let now = network.now;
    let port = network.router.port_mut(station).unwrap();
    assert!(port.sendable(now) < all);
    assert!(port.ready_at(now).is_some());
    change(&mut network, station, paced(9_000));
    assert_eq!(network.router.port(station).unwrap().rate(), Some(9_000));
    change(&mut network, station, LinkOptions::default());
    let port = network.router.port_mut(station).unwrap();
    assert_eq!((port.rate(), port.sendable(now), port.ready_at(now)), (None, all, None));
}

#[test]
fn another_queue_time_leaves_the_pace_that_a_radio_asked_for() {
    let mut network = Network::new(RouterOptions::default());
    let radio = network.link_with(paced(10_000));
    let full = crate::frames::frame(
        mavswitch::mavlink::Version::V2,
        0,
        mavswitch::mavlink::Component::new(51, 68),
        (109, 185),
        &[0, 0, 0, 0, 0, 0, 10, 0, 0],
    );
    network.receive(radio, &full);
    let slowed = network.router.port(radio).unwrap().rate();
    assert!(slowed < Some(10_000));
    let capacity = Capacity::Paced { rate: 10_000, queue_time: Duration::from_secs(2) };
    change(&mut network, radio, LinkOptions { capacity, ..LinkOptions::default() });
    assert_eq!(network.router.port(radio).unwrap().rate(), slowed);
}

#[test]
fn filters_and_sniffers_change_and_routes_stay() {
    let (mut network, [radio, station, other]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    let filter_out = FilterLists { block_messages: vec![ATTITUDE], ..FilterLists::default() };
    change(&mut network, station, LinkOptions { filter_out, ..LinkOptions::default() });
    change(&mut network, other, LinkOptions { is_sniffer: true, ..LinkOptions::default() });
    network.router.take_dirty();
    network.receive(radio, &attitude(VEHICLE, 1));
    assert!(network.sent(station).is_empty());
    network.delivered();
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, other]);
    change(&mut network, other, LinkOptions::default());
    network.router.take_dirty();
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn a_cap_that_changes_counts_from_the_last_frame() {
    let (mut network, [radio, station]) = Network::with_links();
    let capped = |seconds: u64| {
        let cap = RateCap { id: ATTITUDE, interval: Duration::from_secs(seconds) };
        LinkOptions { caps: vec![cap], ..LinkOptions::default() }
    };
    change(&mut network, station, capped(100));
    let passes = |network: &mut Network, seq| {
        network.receive(radio, &attitude(VEHICLE, seq));
        !network.sent(station).is_empty()
    };
    assert!(passes(&mut network, 0));
    network.pass(5);
    assert!(!passes(&mut network, 1));
    change(&mut network, station, capped(10));
    assert!(!passes(&mut network, 2));
    network.pass(5);
    assert!(passes(&mut network, 3));
    change(&mut network, station, LinkOptions::default());
    assert!(passes(&mut network, 4));
}

#[test]
fn links_join_and_leave_groups() {
    let (mut network, [radio, modem, station]) = Network::with_links();
    let in_group = |number: u8, member: u16, rank: u8| {
        let group = GroupId(number);
        let membership = Some(Membership { group, member, rank, best_only: false });
        LinkOptions { membership, ..LinkOptions::default() }
    };
    change(&mut network, radio, in_group(0, 1, 1));
    change(&mut network, modem, in_group(0, 2, 0));
    network.router.set_groups(&[Some(false)]);
    network.router.take_dirty();
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station]);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
    // Over the best of them, which is the one that was heard.
    network.router.set_groups(&[Some(true)]);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    network.router.set_groups(&[Some(false)]);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio, modem]);
    // Each for itself again.
    change(&mut network, modem, LinkOptions::default());
    network.router.take_dirty();
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [modem, station]);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn a_group_that_gets_the_number_of_another_knows_nothing_of_its_paths() {
    let (mut network, [radio, station]) = Network::with_links();
    let membership = Some(Membership { group: GroupId(0), member: 1, rank: 0, best_only: true });
    let options = LinkOptions { membership, ..LinkOptions::default() };
    change(&mut network, radio, options.clone());
    network.router.set_groups(&[Some(true)]);
    let chosen = |network: &mut Network| {
        network.receive(radio, &heartbeat(VEHICLE));
        network.receive(station, &command(STATION, VEHICLE));
        let events = std::iter::from_fn(|| network.router.poll_event());
        events.filter(|event| matches!(event, RouterEvent::PathChosen(..))).collect::<Vec<_>>()
    };
    let path = RouterEvent::PathChosen(GroupId(0), Some(1));
    assert_eq!(chosen(&mut network), [path]);
    assert_eq!(chosen(&mut network), []);
    change(&mut network, radio, LinkOptions::default());
    network.router.set_groups(&[]);
    change(&mut network, radio, options);
    network.router.set_groups(&[Some(true)]);
    assert_eq!(chosen(&mut network), [path]);
}

#[test]
fn links_of_a_group_that_is_gone_are_members_of_the_next_one_only_if_they_join() {
    let (mut network, [radio, modem, station]) = Network::with_links();
    let member = |member: u16| {
        let membership = Membership { group: GroupId(0), member, rank: 0, best_only: false };
        LinkOptions { membership: Some(membership), ..LinkOptions::default() }
    };
    for link in [radio, modem] {
        change(&mut network, link, member(link.index() as u16));
    }
    network.router.set_groups(&[Some(false)]);
    network.router.take_dirty();
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station]);
    // It goes, and another one gets its number and its members.
    network.router.set_groups(&[None]);
    network.router.set_groups(&[Some(false)]);
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [modem, station]);
    for link in [radio, modem] {
        change(&mut network, link, member(link.index() as u16));
    }
    network.router.take_dirty();
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), [station]);
}

#[test]
fn rule_44_another_age_holds_for_routes_that_are_there() {
    let (mut network, [radio, station]) = Network::with_links();
    network.hears(radio, &heartbeat(VEHICLE));
    network.pass(20);
    let with = |seconds: Option<u64>| {
        let route_age = seconds.map(Duration::from_secs);
        RouterOptions { route_age, ..RouterOptions::default() }
    };
    let set = |network: &mut Network, seconds| {
        network.router.set_options(with(seconds), network.now);
        // The loop calls it when it is due, and must not be asked to again at once.
        let is_due = network.router.poll_timeout().is_some_and(|at| at <= network.now);
        if is_due {
            network.router.handle_timeout(network.now);
        }
        let next = network.router.poll_timeout();
        assert!(next.is_none_or(|at| at > network.now), "{next:?}");
    };
    set(&mut network, None);
    network.pass(1_000);
    set(&mut network, None);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    set(&mut network, Some(2_000));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
    set(&mut network, Some(10));
    assert!(network.router.table().find(VEHICLE).is_none());
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);
}

#[test]
fn a_link_that_is_not_there_is_left_alone() {
    let (mut network, [radio, station]) = Network::with_links();
    network.router.remove_link(station);
    change(&mut network, station, LinkOptions { is_sniffer: true, ..LinkOptions::default() });
    assert!(network.router.take_dirty().is_empty());
    assert_eq!(network.hears(radio, &heartbeat(VEHICLE)), []);
}
