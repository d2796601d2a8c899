//! Routers joined in loops, without groups: no storm, and they heal when a cable is cut.
//!
//! `tests/protocol/loops.rs` has the same with the clock in its hand; these are real programs.

use std::time::{Duration, Instant};

use crate::flight::{Rates, fly};
use crate::harness::*;
use crate::net::say;
use crate::relay::Relay;
use crate::report::Report;

const RATES: Rates = Rates { directed: 20, telemetry: 50 };

/// How many directed frames each way must arrive in each part of a story: longer than the time for
/// which a router keeps a source off a link, so that links are tried again.
const PART: usize = 160;

/// How often a frame may go over each cable, on average: once each way, and sometimes again when a
/// link is tried again.
const ROUNDS: usize = 3;

/// How long a source is kept off a link on which it was heard, and some time for a busy machine.
const HEALED: Duration = Duration::from_secs(5 + 4);

/// Routers, and the cables between them. The vehicle is at the first, the station at the last.
struct Mesh {
    routers: Vec<Router>,
    cables: Vec<Relay>,
}

impl Mesh {
    /// So many routers, joined in pairs; a later one calls an earlier one.
    fn new(routers: usize, joined: &[(usize, usize)]) -> Self {
        let mut mesh = Self { routers: Vec::new(), cables: Vec::new() };
        for router in 0..routers {
            let mut arguments = vec!["-v".to_owned(), "tcpin:127.0.0.1:0?name=here".to_owned()];
            for (number, (listens, calls)) in joined.iter().enumerate() {
                let name = format!("cable-{number}");
                if *listens == router {
                    arguments.push(format!("udpin:127.0.0.1:0?name={name}"));
                } else if *calls == router {
                    let target = mesh.routers[*listens].address(&name);
                    let relay = Relay::start(target.ip(), target);
                    arguments.push(format!("udpout:{}?name={name}", relay.address()));
                    mesh.cables.push(relay);
                }
            }
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            mesh.routers.push(Router::start(&arguments));
        }
        mesh
    }

    fn carried(&self) -> usize {
        self.cables.iter().map(Relay::carried).sum()
    }

    /// Traffic both ways, before and after the first cable is cut.
    fn check(mut self, name: &str) {
        let mut vehicle = self.routers[0].tcp("here", VEHICLE);
        let last = self.routers.last().expect("a router");
        let mut station = last.tcp("here", GCS);
        vehicle.meet(&mut station);
        station.meet(&mut vehicle);
        let before = self.carried();
        let whole = fly(&mut vehicle, &mut station, RATES, |progress| progress.wait_for(PART));
        let carried = self.carried() - before;
        let input: usize = whole.iter().map(Report::sent).sum();
        let cables = self.cables.len();
        say(&format!("{name}: {input} frames went {carried} times over {cables} cables"));
        assert!(carried <= ROUNDS * cables * input, "a storm: {carried} for {input}");
        let mut cut = Instant::now();
        let healed = fly(&mut vehicle, &mut station, RATES, |progress| {
            progress.wait_for(20);
            cut = Instant::now();
            self.cables[0].set_cut(true);
            progress.wait_for(PART);
        });
        for report in &whole {
            say(&format!("{name}, whole: {report}"));
            assert_eq!(report.lost(), [], "lost in {name}");
        }
        for report in &healed {
            say(&format!("{name}, cut: {report}"));
            assert!(report.longest_gap() < HEALED, "{:?} without", report.longest_gap());
        }
        for router in &self.routers {
            assert!(router.log.len() < 200, "{} lines", router.log.len());
        }
        self.cables.clear();
    }
}

#[test]
fn two_routers_joined_by_two_links_make_no_storm_and_heal() {
    Mesh::new(2, &[(0, 1), (0, 1)]).check("two cables");
}

#[test]
fn three_routers_in_a_ring_make_no_storm_and_heal() {
    Mesh::new(3, &[(0, 2), (0, 1), (1, 2)]).check("ring of three");
}
