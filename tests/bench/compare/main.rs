//! Routers and blind forwarders under the same load, in one run on one machine: one table.
//!
//! ```text
//! cargo bench --bench compare
//! cargo bench --bench compare -- --router 'mavlink-router=mavlink-routerd -c {conf}' --scenarios BD
//! ```
//!
//! Without `--router`, this program runs beside two forwarders that never look at the bytes they
//! move and so show what the kernel asks for: `blind single` makes one call per datagram, `blind
//! batch` moves what is there with `recvmmsg`, `sendmmsg` and `writev`. Figures of different runs
//! must not be compared; the ratios within one run may.

#![allow(clippy::unwrap_used)]

mod blind;
mod highest;
mod idle;
mod layout;
mod load;
mod measure;
mod router;
mod scenario;
mod sinks;
mod table;

use std::time::Duration;

use clap::Parser;

use blind::Blind;
use measure::Sample;
use router::Candidate;
use scenario::{SCENARIOS, Scenario};
use table::Table;

/// Routers side by side under the same load.
#[derive(Parser)]
#[command(name = "compare")]
struct Arguments {
    /// A router to measure beside this program: `NAME=COMMAND`, in which `{conf}` is a configuration
    /// file as mavlink-router reads it, `{endpoints}` a list of endpoints as mavswitch reads them,
    /// `{mavp2p}` one as mavp2p reads them
    #[arg(long = "router", value_name = "NAME=COMMAND")]
    routers: Vec<Candidate>,
    /// Which scenarios, by letter
    #[arg(long, default_value = "ABCDEFGHI")]
    scenarios: String,
    /// How long each is measured, in seconds
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// How many rounds; the table shows medians and the spread
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Frames a second, instead of those of the scenario
    #[arg(long)]
    rate: Option<u32>,
    /// `cargo bench` says this.
    #[arg(long, hide = true)]
    bench: bool,
    /// Not a benchmark: be one of the forwarders.
    #[command(subcommand)]
    forward: Option<Blind>,
}

fn main() {
    let arguments = Arguments::parse();
    if let Some(blind) = arguments.forward {
        return blind.run();
    }
    // `cargo test --all-targets` runs this too, and wants no figures.
    if !arguments.bench {
        return;
    }
    let candidates: Vec<_> =
        Candidate::built_in().into_iter().chain(arguments.routers.clone()).collect();
    let time = Duration::from_secs_f64(arguments.seconds);
    let compare = |scenario: Scenario| {
        let able: Vec<_> = candidates.iter().filter(|at| scenario.suits(at)).cloned().collect();
        let samples =
            in_rounds(&able, arguments.rounds, |router| measure::measure(router, &scenario, time));
        println!("\n{scenario}\n\n{}", Table::of(&able, &samples));
    };
    for scenario in SCENARIOS.iter().filter(|at| arguments.scenarios.contains(at.letter)) {
        compare(Scenario { rate: arguments.rate.unwrap_or(scenario.rate), ..*scenario });
    }
    if arguments.scenarios.contains('H') {
        let routers: Vec<_> = candidates.iter().filter(|at| at.is_router()).cloned().collect();
        println!("\nH. Nothing to do\n\n{}", idle::table(&routers, arguments.rounds));
    }
    if arguments.scenarios.contains('I') {
        let scenario = highest::scenario(time);
        println!("\nThe highest rate without loss: {} frames/s", scenario.rate);
        compare(scenario);
    }
}

/// Every candidate once a round, so that what disturbs the machine disturbs all of them; the samples
/// of the n-th candidate are the n-th list.
fn in_rounds(
    candidates: &[Candidate],
    rounds: usize,
    mut measure: impl FnMut(&Candidate) -> Sample,
) -> Vec<Vec<Sample>> {
    let mut samples = vec![Vec::new(); candidates.len()];
    for _ in 0..rounds {
        for (candidate, samples) in candidates.iter().zip(&mut samples) {
            samples.push(measure(candidate));
        }
    }
    samples
}
