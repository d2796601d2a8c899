//! One group of two paths, all of them used: what is lost on one comes over the other, once.

use std::time::{Duration, Instant};

use crate::flight::{Rates, fly};
use crate::harness::eventually;
use crate::net::say;
use crate::paths::{End, Field, Pair, Path, Weather};
use crate::report::Report;

const GROUP: &str = "group=air&dedup=500ms";
/// The window of `dedup`, and less by what the clocks of two programs may differ.
const REMEMBERED: Duration = Duration::from_millis(450);

/// How long before and after a path comes back a frame may be overtaken: it went over the other
/// path alone, and a router that had no time to read finds both full. On a quiet machine this is
/// the difference between the delays of the two.
const AROUND: Duration = Duration::from_secs(2);

/// How many directed frames each way must arrive in each part of a story.
const PART: usize = 40;

#[test]
fn cutting_either_path_loses_nothing_and_doubles_nothing() {
    let Some(field) = Field::new() else { return };
    let ground = field.start_ground(|_| GROUP.to_owned());
    let addresses = Path::BOTH.map(|path| {
        let port = ground.address(path.name()).port();
        field.ground_address(path, port)
    });
    let mut pair = field.start_air(ground, addresses, |_| GROUP.to_owned());
    pair.wait_for_both_paths();
    let mut back = Vec::new();
    let rates = Rates { directed: 20, telemetry: 50 };
    let reports = fly(&mut pair.vehicle, &mut pair.station, rates, |progress| {
        progress.wait_for(PART);
        for (path, end) in [(Path::One, End::Air), (Path::Two, End::Ground)] {
            field.cut(path, end);
            progress.wait_for(PART);
            back.push(Instant::now() - AROUND..Instant::now() + AROUND);
            field.restore(path, end);
            field.wait_until_carrying(path);
            back.push(Instant::now() - AROUND..Instant::now() + AROUND);
            progress.wait_for(PART);
        }
    });
    for report in &reports {
        say(&report.to_string());
        assert_eq!(report.lost(), [0_u32; 0], "lost");
        assert_no_copies(report);
        for (number, sent) in report.overtaken() {
            let is_at_return = back.iter().any(|time| time.contains(&sent));
            assert!(is_at_return, "number {number} was overtaken though no path came back");
        }
    }
}

#[test]
fn loss_on_both_paths_is_the_product_of_the_losses() {
    let Some(field) = Field::new() else { return };
    let ground = field.start_ground(|_| GROUP.to_owned());
    let weather =
        |loss_percent, delay_ms| Weather { loss_percent, delay: Duration::from_millis(delay_ms) };
    let rains =
        [(Path::One, weather(5, 30)), (Path::Two, weather(2, 60))].map(|(path, weather)| {
            let port = ground.address(path.name()).port();
            field.rain(path, weather, port)
        });
    let addresses = rains.each_ref().map(|rain| rain.address);
    let mut pair = field.start_air(ground, addresses, |_| GROUP.to_owned());
    pair.wait_for_both_paths();
    let rates = Rates { directed: 250, telemetry: 0 };
    let reports = fly(&mut pair.vehicle, &mut pair.station, rates, |progress| {
        progress.wait_for(2_000);
    });
    let directed = &reports[..2];
    for report in directed {
        say(&format!("{report} ({:.2} %)", report.loss() * 100.0));
        assert_no_copies(report);
    }
    // 0.1 % is expected; the better path alone would lose 2 %.
    let sent: usize = directed.iter().map(Report::sent).sum();
    let lost: usize = directed.iter().map(|report| report.lost().len()).sum();
    assert!(lost * 100 < sent, "{lost} of {sent} lost: more than 1 %");
}

#[test]
fn what_a_path_held_back_is_not_delivered_again() {
    let Some(field) = Field::new() else { return };
    let ground = field.start_ground(|_| GROUP.to_owned());
    let ports = Path::BOTH.map(|path| ground.address(path.name()).port());
    let modem = field.relay(Path::One, ports[0]);
    let addresses = [modem.address(), field.ground_address(Path::Two, ports[1])];
    let mut pair = field.start_air(ground, addresses, |_| GROUP.to_owned());
    pair.wait_for_both_paths();
    let rates = Rates { directed: 20, telemetry: 50 };
    let mut held = Duration::ZERO;
    let reports = fly(&mut pair.vehicle, &mut pair.station, rates, |progress| {
        progress.wait_for(PART);
        modem.set_holding(true);
        let start = Instant::now();
        progress.wait_for(PART / 2);
        held = start.elapsed();
        modem.set_holding(false);
        progress.wait_for(PART);
    });
    for report in &reports {
        say(&report.to_string());
        assert_eq!(report.lost(), [0_u32; 0], "lost");
        // After 256 frames of one source the numbers begin again: on a machine so slow that the path
        // held back as many, some copies can be taken for new frames.
        if held < Duration::from_secs(3) {
            assert_eq!(report.copies(), [], "delivered again, so long after the first time");
        }
    }
}

/// Nothing was delivered again within the time for which frames are remembered. A machine that
/// stops for longer, or a path that holds frames back for longer, can bring the rest about.
#[track_caller]
fn assert_no_copies(report: &Report) {
    let copies = report.copies();
    let (within, later): (Vec<_>, Vec<_>) =
        copies.into_iter().partition(|(_, after)| *after < REMEMBERED);
    assert_eq!(within, [], "delivered again, so long after the first time");
    if !later.is_empty() {
        say(&format!("delivered again, so long after the first time: {later:?}"));
    }
}

impl Pair {
    /// Lets the vehicle speak until the ground router knows a peer on either path: a device that
    /// was just set up may lose what is sent first.
    fn wait_for_both_paths(&mut self) {
        for path in Path::BOTH {
            eventually(&format!("{path:?} brings a peer to the ground"), || {
                self.vehicle.send_mark();
                self.ground.log.has(&[&format!("{}: link #", path.name()), " up"])
            });
        }
    }
}
