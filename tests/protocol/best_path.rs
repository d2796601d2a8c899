//! Over which path of a group frames go, when only the best is used: `path=best`.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::{Component, Version};
use mavswitch::routing::{GroupId, LinkId, LinkOptions, Membership, RouterOptions};
use std::time::Duration;

fn numbered(seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, VEHICLE, (30, 39), &[seq; 28])
}

/// A station, a preferred radio and a modem; the better of the two is used.
fn best_of_two(ranks: [u8; 2]) -> (Network, [LinkId; 3]) {
    let mut network = Network::new(RouterOptions::default());
    let mut path = |member: u16| {
        let rank = ranks[usize::from(member)];
        let membership = Some(Membership { group: GroupId(0), member, rank, best_only: true });
        let dedup = Some(Duration::from_millis(500));
        network.link_with(LinkOptions { membership, dedup, ..LinkOptions::default() })
    };
    let (radio, modem) = (path(0), path(1));
    let station = network.link();
    (network, [radio, modem, station])
}

/// The radio was away, and is back; all but the heartbeats still goes over the modem, so between two
/// heartbeats on the radio many numbers are missing. None of those frames was lost.
#[test]
fn a_preferred_path_that_carries_heartbeats_is_taken_again() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    let mut seq = 0_u8;
    let mut fly = |network: &mut Network, seconds: u64, busy, other: Option<_>| {
        for tenth in 0..seconds * 50 {
            network.now = network.now + Duration::from_millis(20);
            seq = seq.wrapping_add(1);
            if tenth % 50 == 0 {
                let bytes = frame(Version::V2, seq, VEHICLE, (0, 50), &[seq; 9]);
                other.into_iter().for_each(|link| network.receive(link, &bytes));
                network.receive(busy, &bytes);
                network.receive(station, &heartbeat(STATION));
            } else {
                network.receive(busy, &attitude(VEHICLE, seq));
            }
            network.delivered();
        }
        network.hears(station, &command(STATION, VEHICLE))
    };
    assert_eq!(fly(&mut network, 10, radio, Some(modem)), [radio]);
    assert_eq!(fly(&mut network, 10, modem, None), [modem]);
    assert_eq!(fly(&mut network, 5, modem, Some(radio)), [radio], "5 s after it is back");
}

/// So it is after a spell of rain, in which the radio lost two of three frames and was left. The
/// modem carries all since, and the radio's heartbeats tell when it is dry again.
#[test]
fn a_preferred_path_that_was_lossy_is_taken_again_when_it_is_not() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    let (mut seq, mut time_on_modem) = (0_u8, 0);
    for tick in 0..200 * 20_u32 {
        network.pass_ms(50);
        seq = seq.wrapping_add(1);
        let is_raining = (200..1_200).contains(&tick);
        let is_lost = is_raining && tick % 3 != 0;
        let is_on_radio = network.hears(station, &command(STATION, VEHICLE)) == [radio];
        let bytes = frame(Version::V2, seq, VEHICLE, (30, 39), &tick.to_le_bytes());
        if tick % 20 == 0 {
            let bytes = frame(Version::V2, seq, VEHICLE, (0, 50), &tick.to_le_bytes());
            network.receive(modem, &bytes);
            if !(is_raining && tick % 60 != 0) {
                network.receive(radio, &bytes);
            }
        } else if !is_on_radio {
            network.receive(modem, &bytes);
        } else if !is_lost {
            network.receive(radio, &bytes);
        }
        network.delivered();
        time_on_modem += u32::from(!is_on_radio);
        let is_settled = (260..1_200).contains(&tick) || tick > 1_200 + 60 * 20;
        assert!(!is_settled || is_on_radio != is_raining, "at {} s", tick / 20);
    }
    assert!((1_000..2_000).contains(&time_on_modem), "{time_on_modem} of 1,000 ticks of rain");
}

/// The radio's cable is in, and its far end is gone: all it says is how it is itself.
#[test]
fn a_radio_that_tells_of_itself_is_not_heard_from_afar() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    for tick in 0..100 {
        network.pass_ms(100);
        let status = [0, 0, 0, 0, 9, 9, 100, 9, 9];
        network
            .receive(radio, &frame(Version::V1, tick, Component::new(51, 68), (109, 185), &status));
        network.receive(modem, &numbered(tick));
        if tick < 50 {
            network.receive(radio, &numbered(tick));
        }
        network.hears(station, &heartbeat(STATION));
    }
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [modem]);
}

/// The preferred path falls silent. Before that is sure, frames go over both; when it is, over the
/// other one alone.
#[test]
fn a_path_that_may_be_gone_is_not_relied_on() {
    let (mut network, [radio, modem, station]) = best_of_two([1, 0]);
    for tick in 0..40 {
        network.pass_ms(100);
        network.receive(radio, &numbered(tick));
        network.receive(modem, &numbered(tick));
        network.delivered();
    }
    let mut lost = 0;
    for tick in 40..80 {
        network.pass_ms(100);
        network.receive(modem, &numbered(tick));
        network.delivered();
        let hears = network.hears(station, &command(STATION, VEHICLE));
        lost += u32::from(!hears.contains(&modem));
        assert!(tick < 66 || hears == [modem], "{hears:?} after {} ms", (tick - 39) * 100);
    }
    assert!(lost <= 12, "for {} ms commands went nowhere", lost * 100);
}
