//! A log that is played back says the same frames each time, and nobody else's.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::Version;
use mavswitch::routing::{DropReason, LinkId, LinkOptions};
use std::time::Duration;

fn replay(network: &mut Network) -> LinkId {
    network.link_with(LinkOptions { repeats_nobody: true, ..LinkOptions::default() })
}

/// One heartbeat is like the other, but for its number.
fn beat(seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, VEHICLE, (0, 50), &[0, 0, 0, 0, 2, 3, 81, 3, 3])
}

/// Twenty times as fast as it was, the numbers of an autopilot come round again within a second.
fn play_back(network: &mut Network, link: LinkId, station: LinkId, run: &str) {
    for number in 0..2_000_u32 {
        network.now = network.now + Duration::from_millis(2);
        let hears = network.hears(link, &beat(number as u8));
        assert_eq!(hears, [station], "{run}, frame {number}");
    }
}

#[test]
fn a_log_that_is_played_back_again_is_heard_to_the_last_frame() {
    let (mut network, [station]) = Network::with_links();
    for run in ["first", "second", "third"] {
        let log = replay(&mut network);
        play_back(&mut network, log, station, run);
        assert_eq!(network.counters(log)[DropReason::Duplicate], 0, "{run}");
        network.router.remove_link(log);
    }
}

#[test]
fn what_is_played_back_and_comes_round_a_ring_ends_there() {
    let (mut network, [station, ring]) = Network::with_links();
    let log = replay(&mut network);
    for seq in 0..=255 {
        assert!(network.hears(log, &beat(seq)).contains(&station));
        assert_eq!(network.hears(ring, &beat(seq)), []);
    }
    assert_eq!(network.counters(ring)[DropReason::Duplicate], 256);
}

/// The vehicle of the log is there while its log is played back: both are heard.
#[test]
fn a_log_of_what_was_just_heard_is_heard() {
    let (mut network, [vehicle, station]) = Network::with_links();
    let log = replay(&mut network);
    for seq in 0..100 {
        assert!(network.hears(vehicle, &beat(seq)).contains(&station));
    }
    for seq in 0..100 {
        assert!(network.hears(log, &beat(seq)).contains(&station), "{seq}");
    }
}

/// Two logs of one flight, as of two radios that heard the same: `dedup` makes one of them.
#[test]
fn of_two_logs_beside_each_other_dedup_takes_each_frame_once() {
    let (mut network, [station]) = Network::with_links();
    let dedup = Some(Duration::from_millis(500));
    let options = LinkOptions { repeats_nobody: true, dedup, ..LinkOptions::default() };
    let logs = [options.clone(), options].map(|options| network.link_with(options));
    for seq in 0..100 {
        assert!(network.hears(logs[0], &beat(seq)).contains(&station));
        assert_eq!(network.hears(logs[1], &beat(seq)), [], "{seq}");
    }
}
