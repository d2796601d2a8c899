//! A network of several routers in a time of its own, and beside it a shadow that knows the rules, and
//! not the code.
//!
//! Modelled: cables that delay, lose, double, close and open again, in trees and rings; components that
//! move; and, each in some of the networks, pairs of cables that are one group, `dedup` in groups and
//! without, lists of messages, systems and components at either end, short queues and lines with a pace,
//! cables that hold frames back for seconds, now and then or always.
//!
//! Checked of every frame at every router: never back, nor to a link of the same group; once to each
//! link that it is meant for, or refused there and counted for the right reason, a full queue included;
//! nothing but copies refused as copies, and none passed on within the windows that the README names;
//! whole, in order, and no faster than the pace. Every 200 ms: routes where the model has them, and
//! nowhere else. At the end, all being well for a while: all is heard once by whoever should, by nobody
//! else, and what is on its way ends. Where cables stay late, it is heard once or more. In rings with
//! lists on cables, at most once: nobody can say which way is the first.
//!
//! Not modelled, but tested elsewhere: `path=best`, sniffers, caps on messages, signing and other gates,
//! losses by sequence number, routes that age or end by a reboot, unknown messages, senders that count
//! nothing, and options that change while frames flow, but for room and pace.
//!
//! Every seed is a network and a story. One that fails is named; it is run again by
//!
//!     SIMULATION_SEED=17 cargo test --test simulation
//!
//! and `SIMULATION_SEEDS=20000` runs more of them than usual.

#![allow(clippy::unwrap_used)]

mod copies;
#[path = "../protocol/frames.rs"]
#[allow(dead_code)]
mod frames;
mod kinds;
mod reach;
mod shadow;
mod world;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use world::World;

/// How many seeds every change is tried with.
const SEEDS: u64 = 1_000;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().expect("a whole number"))
}

#[test]
fn the_rules_hold_in_any_network_whatever_happens() {
    let seeds = match number("SIMULATION_SEED") {
        Some(seed) => seed..seed + 1,
        None => 0..number("SIMULATION_SEEDS").unwrap_or(SEEDS),
    };
    let (mut sent, mut carried) = (0, 0);
    for seed in seeds {
        let run = || World::new(seed).run();
        let tally = catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
            println!("that was SIMULATION_SEED={seed}");
            resume_unwind(panic)
        });
        sent += tally.sent;
        carried += tally.carried;
    }
    println!("{sent} frames were sent, and carried {carried} times over cables");
}
