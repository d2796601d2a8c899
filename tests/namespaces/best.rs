//! One group of two paths, the better of which is used: the other costs next to nothing while it is.
//!
//! Heartbeats go over both, for each side measures a path by what it hears there.

use std::time::{Duration, Instant};

use crate::flight::{Progress, Rates, fly};
use crate::harness::eventually;
use crate::net::say;
use crate::paths::{End, Field, Pair, Path};

const RATES: Rates = Rates { directed: 20, telemetry: 50 };

/// How many directed frames each way must arrive in each part of a story.
const PART: usize = 60;

/// 1.2 s and a little are wanted; a busy machine gets some more.
const FAILOVER: Duration = Duration::from_secs(4);

fn options(path: Path) -> String {
    let prefer = if path == Path::One { 10 } else { 0 };
    format!("group=air&dedup=500ms&path=best&prefer={prefer}")
}

fn start(field: &Field) -> Pair {
    let ground = field.start_ground(options);
    let addresses = Path::BOTH.map(|path| {
        let port = ground.address(path.name()).port();
        field.ground_address(path, port)
    });
    field.start_air(ground, addresses, options)
}

/// How many packets the ends of a path have sent into it.
fn sent_into(field: &Field, path: Path) -> u64 {
    [End::Air, End::Ground].map(|end| field.traffic(path, end).sent).iter().sum()
}

/// What two sides that say who they are once a second say in this time, at most.
fn heartbeats_in(time: Duration) -> u64 {
    2 * (time.as_secs() + 2)
}

/// Waits until a path carries nothing but heartbeats while commands and telemetry flow.
fn wait_until_idle(field: &Field, path: Path, progress: &Progress) {
    eventually(&format!("{path:?} idles"), || {
        let (start, before) = (Instant::now(), sent_into(field, path));
        progress.wait_for(10);
        sent_into(field, path) - before <= heartbeats_in(start.elapsed())
    });
}

#[test]
fn while_the_preferred_path_is_good_the_other_carries_heartbeats_and_no_more() {
    let Some(field) = Field::new() else { return };
    let mut pair = start(&field);
    let (mut carried, mut time) = ([0, 0], Duration::ZERO);
    let reports = fly(&mut pair.vehicle, &mut pair.station, RATES, |progress| {
        wait_until_idle(&field, Path::Two, progress);
        let (start, before) = (Instant::now(), Path::BOTH.map(|path| sent_into(&field, path)));
        progress.wait_for(PART);
        let after = Path::BOTH.map(|path| sent_into(&field, path));
        (carried, time) = ([after[0] - before[0], after[1] - before[1]], start.elapsed());
    });
    let [one, two] = carried;
    say(&format!("{one} packets on the preferred path, {two} on the other"));
    assert!(one >= 2 * PART as u64, "only {one} on the preferred path");
    assert!(two <= heartbeats_in(time), "{two} on the other path in {time:.1?}");
    for report in &reports {
        assert_eq!(report.lost(), [0_u32; 0], "lost");
        assert_eq!(report.copies(), [], "delivered again");
    }
}

#[test]
fn after_a_cut_the_other_path_is_taken() {
    let Some(field) = Field::new() else { return };
    let mut pair = start(&field);
    let outages = cut_the_preferred_path(&field, &mut pair, End::Air, |_| {});
    assert!(outages.iter().all(|outage| *outage < FAILOVER), "{outages:?} without anything");
}

#[test]
fn a_cut_at_the_far_end_is_noticed_as_well() {
    let Some(field) = Field::new() else { return };
    let mut pair = start(&field);
    let outages = cut_the_preferred_path(&field, &mut pair, End::Ground, |_| {});
    assert!(outages.iter().all(|outage| *outage < FAILOVER), "{outages:?} without anything");
}

#[test]
fn the_preferred_path_is_taken_again_when_it_is_back() {
    let Some(field) = Field::new() else { return };
    let mut pair = start(&field);
    cut_the_preferred_path(&field, &mut pair, End::Air, |progress| {
        field.restore(Path::One, End::Air);
        wait_until_idle(&field, Path::Two, progress);
        progress.wait_for(PART);
    });
}

/// Cuts the preferred path at one end while commands and telemetry flow; says for how long nothing
/// of each stream arrived.
fn cut_the_preferred_path(
    field: &Field,
    pair: &mut Pair,
    end: End,
    what_then: impl FnOnce(&Progress),
) -> [Duration; 3] {
    let reports = fly(&mut pair.vehicle, &mut pair.station, RATES, |progress| {
        wait_until_idle(field, Path::Two, progress);
        field.cut(Path::One, end);
        progress.wait_for(PART);
        what_then(progress);
    });
    reports.map(|report| {
        say(&report.to_string());
        report.longest_gap()
    })
}
