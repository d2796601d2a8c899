//! Everything at once, for as long as you like, and what must stay as it was: resident memory, open
//! descriptors, the age of frames on arrival. On links that are well, no directed frame is lost.
//!
//!     tests/soak/run 10m
//!
//! `cargo test --test soak` does it for a few seconds, to see that it goes. Leaks are judged by what
//! the program holds when all trouble is over; the age of frames by that of the first third of the
//! run and by a forwarder that never looks at what it forwards, which the same machine slows down.

#![allow(clippy::unwrap_used)]

mod guests;
#[path = "../integration/harness/mod.rs"]
#[allow(dead_code, unused_imports)]
mod harness;
mod latency;
mod mirror;
mod party;
mod scene;
mod trouble;
mod watch;

use std::thread;
use std::time::{Duration, Instant};

use harness::*;
use party::{Ledger, Party};
use scene::Scene;
use watch::Watch;

/// A run when nothing is said.
const SHORT: Duration = Duration::from_secs(10);

/// How far the run is.
pub(crate) struct Clock {
    begin: Instant,
    total: Duration,
}

impl Clock {
    pub(crate) fn is_over(&self) -> bool {
        self.begin.elapsed() >= self.total
    }

    /// Which third of the run this is: 0 to 2.
    pub(crate) fn third(&self) -> usize {
        let part = self.begin.elapsed().as_secs_f64() / self.total.as_secs_f64();
        [1.0 / 3.0, 2.0 / 3.0].into_iter().filter(|end| part >= *end).count()
    }

    /// Nanoseconds since the run began.
    pub(crate) fn now(&self) -> u64 {
        self.begin.elapsed().as_nanos().try_into().unwrap()
    }
}

/// `90s`, `10m`, `24h`.
fn duration(text: &str) -> Duration {
    let (number, unit) = text.split_at(text.len() - 1);
    let seconds = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3_600,
        _ => panic!("{text}: a number with s, m or h is expected"),
    };
    Duration::from_secs(seconds * number.parse::<u64>().expect("a whole number"))
}

#[test]
fn everything_at_once_leaves_memory_descriptors_and_latency_as_they_were() {
    let total = std::env::var("SOAK").map_or(SHORT, |text| duration(&text));
    let scene = Scene::set();
    let vehicle = Party::new(scene.router.tcp("tcp", VEHICLE), VEHICLE, [GCS, GCS_2]);
    let other = Party::new(scene.router.udp("udp", OTHER), OTHER, [GCS, GCS_2]);
    let gcs = Party::new(scene.router.udp("udp", GCS), GCS, [VEHICLE, OTHER]);
    let gcs_2 = Party::new(scene.router.tcp("tcp", GCS_2), GCS_2, [VEHICLE, OTHER]);
    let mut watch = Watch::begin(&scene.router);
    let (clock, ledger) = (&Clock { begin: Instant::now(), total }, &Ledger::default());
    thread::scope(|scope| {
        let scene = &scene;
        for other in trouble::ALL.into_iter().chain(guests::ALL) {
            scope.spawn(move || other(scene, clock));
        }
        let parties = [
            scope.spawn(move || vehicle.live(clock, ledger)),
            scope.spawn(move || other.live(clock, ledger)),
            scope.spawn(move || gcs.live(clock, ledger)),
            scope.spawn(move || gcs_2.live(clock, ledger)),
        ];
        let mirror = scope.spawn(move || mirror::measure(clock));
        watch.until_over(&scene.router, clock);
        let accounts: Vec<_> = parties.into_iter().map(|party| party.join().unwrap()).collect();
        party::judge(&accounts, &mirror.join().unwrap(), scene.dropped_on_the_way_in());
    });
    scene.clear_up();
    watch.judge(&scene.router);
    scene.end();
}
