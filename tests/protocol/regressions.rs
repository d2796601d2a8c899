//! What went wrong once, found by a review: each the smallest input that showed it.

use crate::frames::{Random, frame};
use crate::network::*;
use mavswitch::mavlink::{Component, MessageId, Version};
use mavswitch::routing::{
    Capacity, DropReason, FilterLists, GroupId, LinkId, LinkOptions, MAX_HEARD, Membership,
    RateCap, RouterOptions,
};
use std::time::Duration;

fn member(member: u16, rank: u8, best_only: bool) -> LinkOptions {
    let membership = Membership { group: GroupId(0), member, rank, best_only };
    LinkOptions {
        membership: Some(membership),
        dedup: Some(Duration::from_millis(500)),
        ..LinkOptions::default()
    }
}

fn numbered(seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, VEHICLE, (30, 39), &[seq; 28])
}

/// A station, a preferred radio and a modem; the better of the two is used.
fn best_of_two(ranks: [u8; 2]) -> (Network, [LinkId; 3]) {
    let mut network = Network::new(RouterOptions::default());
    let radio = network.link_with(member(1, ranks[0], true));
    let modem = network.link_with(member(2, ranks[1], true));
    let station = network.link();
    (network, [radio, modem, station])
}

/// A radio at 57,600 baud, and a vehicle.
fn slow_line() -> (Network, LinkId, LinkId) {
    let mut network = Network::new(RouterOptions::default());
    let queue_time = Duration::from_millis(250);
    let capacity = Capacity::Paced { rate: 5_760, queue_time };
    let radio = network.link_with(LinkOptions { capacity, ..LinkOptions::default() });
    let vehicle = network.link();
    (network, radio, vehicle)
}

/// The queue is made for the first baud rate; at a later, faster one the limits for routine frames
/// pass its end, and a frame goes in by half.
#[test]
fn a_faster_baud_rate_tears_no_frame() {
    let (mut network, radio, vehicle) = slow_line();
    network.router.port_mut(radio).unwrap().set_line_rate(92_160, network.now);
    for _ in 0..100 {
        network.receive(vehicle, &heartbeat(VEHICLE));
    }
    let now = network.now;
    let port = network.router.port_mut(radio).unwrap();
    let mut sent = 0;
    while port.backlog() > 0 {
        let sendable = port.sendable(now + Duration::from_millis(sent as u64));
        port.consume(sendable);
        sent += sendable.max(1);
    }
    let len = heartbeat(VEHICLE).len();
    assert_eq!(sent % len, 0, "{sent} bytes of frames of {len}: the last one is torn");
}

/// And whoever walks over the half frame walks over the end: the program is gone.
#[test]
fn a_faster_baud_rate_ends_no_program() {
    let (mut network, radio, vehicle) = slow_line();
    network.router.port_mut(radio).unwrap().set_line_rate(92_160, network.now);
    let mut random = Random::new(7);
    for turn in 0..10_000 {
        for _ in 0..random.below(12) {
            let payload = vec![0xff; random.below(250) + 1];
            let bytes = frame(Version::V2, turn as u8, VEHICLE, (30, 39), &payload);
            network.receive(vehicle, &bytes);
        }
        network.pass_ms(random.below(20) as u64);
        let now = network.now;
        let port = network.router.port_mut(radio).unwrap();
        let sendable = port.sendable(now);
        port.consume(sendable);
    }
}

/// And has no more room than the slow one had.
#[test]
fn a_faster_baud_rate_has_a_longer_queue() {
    let (mut network, radio, vehicle) = slow_line();
    network.hears(radio, &heartbeat(STATION));
    network.router.port_mut(radio).unwrap().set_line_rate(92_160, network.now);
    for _ in 0..1_000 {
        network.receive(vehicle, &command(VEHICLE, STATION));
    }
    let waiting = network.router.port(radio).unwrap().backlog();
    assert!(waiting > 92_160 / 4 * 9 / 10 - 280, "{waiting} bytes are all that may wait");
}

/// The table of `dedup` has one place for each hash, and any other frame takes it.
#[test]
fn a_copy_is_known_among_a_thousand_others() {
    let mut network = Network::new(RouterOptions::default());
    let [radio, modem] = [1, 2].map(|number| network.link_with(member(number, 0, false)));
    let station = network.link();
    let frames: Vec<Vec<u8>> = (0..1_000_u32)
        .map(|number| frame(Version::V2, number as u8, VEHICLE, (0, 50), &number.to_le_bytes()))
        .collect();
    for link in [radio, modem] {
        for bytes in &frames {
            network.receive(link, bytes);
            network.delivered();
        }
    }
    let delivered = network.counters(station).frames_out;
    assert_eq!(delivered, 1_000, "{} were delivered twice", delivered - 1_000);
}

/// Both ends use the best path only, so nothing comes over the other one; then the best one dies.
#[test]
fn a_silent_path_is_left_though_nothing_came_over_the_other() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    for seq in 0..50 {
        network.pass_ms(100);
        network.hears(radio, &numbered(seq));
    }
    network.pass_ms(3_000);
    let hears = network.hears(station, &command(STATION, VEHICLE));
    assert!(hears.contains(&modem), "only {hears:?}, of which nothing was heard for 3 s");
}

/// A path over which a frame came a moment ago is better than one over which nothing comes, however
/// many frames it loses.
#[test]
fn a_lossy_path_is_better_than_a_dead_one() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    network.hears(radio, &numbered(0));
    for count in 0..100_u8 {
        network.pass_ms(100);
        network.hears(modem, &numbered(count.wrapping_mul(5)));
    }
    let hears = network.hears(station, &command(STATION, VEHICLE));
    assert!(hears.contains(&modem), "only {hears:?}, of which nothing was heard for 10 s");
}

/// Of two equal paths that are both lossy, or only seem to be, one is kept for a while.
#[test]
fn two_paths_that_are_not_good_are_not_taken_by_turns() {
    let (mut network, [radio, modem, station]) = best_of_two([0, 0]);
    let (mut switches, mut last) = (0, Vec::new());
    for count in 0..200_u8 {
        network.pass_ms(100);
        let link = if count % 2 == 0 { radio } else { modem };
        network.hears(link, &numbered(count.wrapping_mul(5)));
        let hears = network.hears(station, &command(STATION, VEHICLE));
        switches += usize::from(hears != last);
        last = hears;
    }
    assert!(switches <= 20_000 / 3_000 + 1, "{switches} switches in 20 s");
}

/// What the other end sent over the other path meanwhile was not lost on this one (rule 52).
#[test]
fn a_path_that_is_used_again_is_not_lossy() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    let mut fly = |link: LinkId, count: u8, from: u8| {
        for seq in 0..count {
            network.pass_ms(100);
            network.hears(link, &numbered(from.wrapping_add(seq)));
        }
        network.router.port(link).unwrap().quality().loss
    };
    fly(radio, 50, 0);
    fly(modem, 100, 50);
    let loss = fly(radio, 3, 150);
    assert!(loss < 102, "{loss} of 1,024 lost, though no frame was");
    assert!(network.hears(station, &heartbeat(STATION)).contains(&radio));
}

/// A group shares what was heard: a source that was just heard on one link of it is not sent to
/// another one (rule 49).
#[test]
fn a_source_heard_in_a_group_is_not_sent_back_into_it() {
    let mut network = Network::new(RouterOptions::default());
    let [radio, modem] = [1, 2].map(|number| network.link_with(member(number, 0, false)));
    let cable = network.link();
    let station = network.link();
    network.hears(radio, &numbered(0));
    let hears = network.hears(cable, &numbered(1));
    assert_eq!(hears, [station], "{modem} leads where {radio} leads");
}

/// A download fills the queue to the last byte, and the heartbeats beside it are all refused.
#[test]
fn heartbeats_pass_beside_a_download() {
    let (mut network, radio, vehicle) = slow_line();
    network.hears(radio, &heartbeat(STATION));
    let mut payload = [0x55; 250];
    payload[..3].copy_from_slice(&[0, STATION.system, STATION.component]);
    let mut heartbeats = 0;
    for turn in 0..6_000_u32 {
        network.pass_ms(10);
        // Twice what the line carries, as bursts of FILE_TRANSFER_PROTOCOL come.
        if turn % 2 == 0 {
            let seq = (turn / 2) as u8;
            network.receive(vehicle, &frame(Version::V2, seq, VEHICLE, (110, 84), &payload));
        }
        if turn % 100 == 1 {
            let before = network.counters(radio).frames_out;
            network.receive(vehicle, &heartbeat(VEHICLE));
            heartbeats += network.counters(radio).frames_out - before;
        }
        let now = network.now;
        let port = network.router.port_mut(radio).unwrap();
        let sendable = port.sendable(now);
        port.consume(sendable);
    }
    assert!(heartbeats >= 57, "{heartbeats} of 60 heartbeats got into the queue");
}

/// A cap lets a message through once a second; the one it lets through should not be wasted.
#[test]
fn a_capped_message_that_the_queue_refused_may_be_sent_next() {
    let mut network = Network::new(RouterOptions::default());
    let cap = RateCap { id: MessageId(30), interval: Duration::from_secs(1) };
    let capacity = Capacity::Bytes(0);
    let radio = network.link_with(LinkOptions { capacity, caps: vec![cap], ..Default::default() });
    let vehicle = network.link();
    while network.counters(radio)[DropReason::QueueFull] == 0 {
        network.receive(vehicle, &heartbeat(VEHICLE));
        network.receive(vehicle, &frame(Version::V2, 0, CAMERA, (33, 104), &[7; 28]));
    }
    network.receive(vehicle, &numbered(1));
    network.sent(radio);
    network.pass_ms(20);
    network.receive(vehicle, &numbered(2));
    assert_eq!(network.sent(radio), numbered(2));
}

/// Rule 44 speaks of the source, not of the link: it started again, and came back by another way.
#[test]
fn a_restart_shows_on_another_link_as_well() {
    let (mut network, [serial, radio, station]) = Network::with_links();
    network.hears(serial, &system_time(VEHICLE, 1_000_000));
    network.pass(20);
    network.hears(radio, &system_time(VEHICLE, 5_000));
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

/// What a filter keeps out was heard all the same: by it a path is known to be alive, and a baud
/// rate to be right.
#[test]
fn a_link_of_which_all_is_filtered_was_heard() {
    let mut network = Network::new(RouterOptions::default());
    let allow_messages = vec![MessageId(77)];
    let filter_in = FilterLists { allow_messages, ..FilterLists::default() };
    let serial = network.link_with(LinkOptions { filter_in, ..LinkOptions::default() });
    network.receive(serial, &heartbeat(VEHICLE));
    assert!(network.router.port(serial).unwrap().quality().last_heard.is_some());
}

/// Four thousand sources that are made up, each on sixty-four links: what is kept is bounded.
#[test]
fn a_flood_of_sources_on_many_links_is_bounded() {
    let mut network = Network::new(RouterOptions::default());
    let links: Vec<LinkId> = (0..64).map(|_| network.link()).collect();
    for link in &links {
        for source in 0..4_096_u16 {
            let source = Component::new((source / 64 + 1) as u8, (source % 64 + 1) as u8);
            network.receive(*link, &heartbeat(source));
        }
        network.delivered();
    }
    let known = network.router.table().components();
    let entries: usize = known.iter().map(|known| known.heard.capacity()).sum();
    let bytes = entries * size_of::<mavswitch::routing::Heard>();
    assert!(bytes < 4 << 20, "{entries} entries of {} KiB", bytes >> 10);
}

/// One heartbeat of ten is lost on the preferred path, and nothing else is said: that is no reason
/// to pay for the other one.
#[test]
fn one_lost_heartbeat_moves_nothing() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    let mut moved = 0;
    for second in 0..60_u8 {
        let links = [modem, radio];
        for link in if second % 10 == 9 { &links[..1] } else { &links[..] } {
            network.receive(*link, &frame(Version::V2, second, VEHICLE, (0, 50), &[second; 9]));
        }
        for _ in 0..10 {
            network.pass_ms(100);
            network.delivered();
            let hears = network.hears(station, &command(STATION, VEHICLE));
            moved += usize::from(hears == [modem]);
        }
    }
    assert_eq!(moved, 0, "tenths of a second on the modem");
}

/// A sender that counts nothing, as home-made ones do, says the same ten times a second over both
/// paths of a group. Each time is news.
#[test]
fn who_repeats_itself_over_two_paths_is_heard_each_time() {
    let mut network = Network::new(RouterOptions::default());
    let [radio, modem] = [1, 2].map(|member| {
        let membership = Membership { group: GroupId(0), member, rank: 0, best_only: false };
        network.link_with(LinkOptions {
            membership: Some(membership),
            dedup: Some(Duration::from_millis(500)),
            ..LinkOptions::default()
        })
    });
    let vehicle = network.link();
    for _ in 0..100 {
        network.now = network.now + Duration::from_millis(100);
        network.receive(radio, &heartbeat(STATION));
        network.receive(modem, &heartbeat(STATION));
        network.delivered();
    }
    assert_eq!(network.counters(vehicle).frames_out, 100, "in ten seconds");
}

/// A flood has filled the table and is over; then the vehicle comes by another link than before.
#[test]
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
