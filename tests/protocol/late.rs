//! The same frame seconds later by another link that is no group with the first: a cable that held it
//! back, or somebody who has the right to say it again.

use crate::frames::frame;
use crate::network::*;
use mavswitch::mavlink::Version;
use mavswitch::routing::DropReason;

/// One heartbeat is like the other, but for its number.
fn beat(seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, VEHICLE, (0, 50), &[0, 0, 0, 0, 2, 3, 81, 3, 3])
}

/// Unlike all others, whatever its number.
fn telemetry(seq: u8, number: u32) -> Vec<u8> {
    let mut payload = [7; 28];
    payload[..4].copy_from_slice(&number.to_le_bytes());
    frame(Version::V2, seq, VEHICLE, (30, 39), &payload)
}

/// The vehicle is on the near cable at once, and on the far one three seconds later, with ten frames
/// a second, over two turns of its numbers.
#[test]
fn a_cable_that_is_always_late_tells_nothing_twice() {
    let (mut network, [near, far, station]) = Network::with_links();
    for number in 0..600 {
        network.pass_ms(100);
        assert!(network.hears(near, &telemetry(number as u8, number)).contains(&station));
        let Some(late) = number.checked_sub(30) else { continue };
        let hears = network.hears(far, &telemetry(late as u8, late));
        assert_eq!(hears, [], "frame {late} is told again");
    }
}

/// Now and then the far cable is the first, and then it holds frames back again.
#[test]
fn a_cable_that_was_the_first_is_late_all_the_same() {
    let (mut network, [near, far, station]) = Network::with_links();
    for number in 0..100 {
        network.pass_ms(100);
        let bytes = telemetry(number as u8, number);
        let links = if number < 50 { [far, near] } else { [near, near] };
        links.iter().for_each(|link| network.receive(*link, &bytes));
    }
    network.delivered();
    let told = (50..70).filter(|number| {
        let hears = network.hears(far, &telemetry(*number as u8, *number));
        hears.contains(&station)
    });
    assert!(told.count() <= 1, "the first one continues what came before");
}

/// An autopilot with a radio at each of two ports counts each by itself. Each heartbeat at the second
/// is the same to the last byte as one at the first, five seconds ago.
#[test]
fn a_second_channel_that_counts_alike_loses_no_heartbeat() {
    let (mut network, [one, two, station]) = Network::with_links();
    let mut number = 0;
    for second in 0..60_u8 {
        for part in 0..25 {
            network.pass_ms(40);
            let seqs = [25, 20].map(|from| (second.wrapping_mul(25)).wrapping_add(part + from));
            let seqs = [seqs[0], seqs[1].wrapping_sub(120)];
            for (link, seq) in [one, two].into_iter().zip(seqs) {
                number += 1;
                let bytes = if part == 0 { beat(seq) } else { telemetry(seq, number) };
                assert!(network.hears(link, &bytes).contains(&station), "{second}: {link} {seq}");
            }
        }
    }
    assert_eq!(network.counters(two)[DropReason::Duplicate], 0);
}

/// Who says nothing but heartbeats over two channels looks like a cable that is late. What is said over
/// the second one comes as soon as the first is silent.
#[test]
fn a_second_channel_is_heard_when_the_first_is_silent() {
    let (mut network, [one, two, station]) = Network::with_links();
    let mut silent = 0;
    for second in 0..60_u8 {
        network.pass_ms(1_000);
        if second < 30 {
            assert!(network.hears(one, &beat(second)).contains(&station));
        }
        let hears = network.hears(two, &beat(second.wrapping_sub(10)));
        silent = if second < 30 || hears.contains(&station) { 0 } else { silent + 1 };
        assert!(silent <= 2, "silent for {silent} s at {second}");
    }
}

/// An autopilot that starts again, at another cable, with the heartbeats of before between what is new.
#[test]
fn who_starts_again_elsewhere_is_heard() {
    let (mut network, [here, there, station]) = Network::with_links();
    let mut number = 0;
    for link in [here, there, there, here, there] {
        let heard = (0..80).filter(|seq| {
            network.pass_ms(50);
            number += 1;
            let bytes = if seq % 4 == 0 { beat(*seq) } else { telemetry(*seq, number) };
            network.hears(link, &bytes).contains(&station)
        });
        assert!(heard.count() >= 79, "all but the first heartbeat");
    }
}

/// Of somebody who has gone the last frame comes by a slow ring, lap by lap: that it has the number of
/// the last one here is no wonder.
#[test]
fn the_last_frame_of_somebody_does_not_go_round_slowly() {
    let (mut network, [here, ring, station]) = Network::with_links();
    for seq in 0..20 {
        network.pass_ms(100);
        assert!(network.hears(here, &telemetry(seq, u32::from(seq))).contains(&station));
    }
    let told = (0..9).filter(|_| {
        network.pass_ms(3_000);
        network.hears(ring, &telemetry(19, 19)).contains(&station)
    });
    assert!(told.count() <= 1, "once, for it may be news, and then no more");
}

/// A script says hello, gives one command and ends; run again, it comes from another UDP port, while
/// the links of its former runs are not closed yet.
#[test]
fn a_script_is_heard_each_time_it_is_run() {
    let (mut network, [vehicle]) = Network::with_links();
    network.hears(vehicle, &heartbeat(VEHICLE));
    for run in 0..10 {
        network.pass_ms(4_000);
        let script = network.link();
        assert!(network.hears(script, &heartbeat(STATION)).contains(&vehicle), "run {run}");
        assert_eq!(network.hears(script, &command(STATION, VEHICLE)), [vehicle], "run {run}");
    }
}

/// Two programs with the same id and the same words, and both go on: no command of the second one is
/// lost for having been given by the first.
#[test]
fn a_command_of_a_second_program_with_the_same_id_is_carried_out() {
    let (mut network, [vehicle, one, two]) = Network::with_links();
    network.hears(vehicle, &heartbeat(VEHICLE));
    let hello = |seq| frame(Version::V2, seq, STATION, (0, 50), &[6, 8, 0, 0, 0, 3]);
    let order = |seq| {
        let mut payload = [1; 33];
        payload[30..32].copy_from_slice(&[VEHICLE.system, VEHICLE.component]);
        frame(Version::V2, seq, STATION, (76, 152), &payload)
    };
    for second in 0..60_u8 {
        network.pass_ms(1_000);
        let before = second.checked_sub(20);
        for (link, seq) in [(one, Some(second)), (two, before)] {
            let Some(seq) = seq else { continue };
            network.hears(link, &hello(seq.wrapping_mul(2)));
            let hears = network.hears(link, &order(seq.wrapping_mul(2) + 1));
            assert_eq!(hears, [vehicle], "second {second}, {link}");
        }
    }
}
