//! A network of several routers in a time of its own: cables that delay, lose, double, close and open
//! again, and components that move. Beside it a shadow that knows the rules, and not the code.
//!
//! Every seed is a network and a story. One that fails is named; it is run again by
//!
//!     SIMULATION_SEED=17 cargo test --test simulation
//!
//! and `SIMULATION_SEEDS=20000` runs more of them than usual.

#![allow(clippy::unwrap_used)]

#[path = "../protocol/frames.rs"]
#[allow(dead_code)]
mod frames;
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
