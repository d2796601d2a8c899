//! Routers joined in loops, without groups: no storm, and they heal when a cable is cut.
//!
//! `tests/protocol/loops.rs` has the same with the clock in its hand; these are real programs.

use std::time::Duration;

use crate::flight::{Progress, Rates, fly};
use crate::harness::*;
use crate::net::say;
use crate::relay::Relay;
use crate::report::Report;

const RATES: Rates = Rates { directed: 20, telemetry: 50 };

/// How many directed frames each way must arrive in each part of a story: longer than the time for
/// which a router keeps a source off a link, so that links are tried again.
const PART: usize = 160;

/// How often a frame may go over each cable: once each way.
const ROUNDS: usize = 2;

/// How long a source is kept off a link on which it was heard, and some time for a busy machine.
const HEALED: Duration = Duration::from_secs(5 + 4);

/// Routers, and the cables between them. The vehicle is at the first, the station at the last.
struct Mesh {
    routers: Vec<Router>,
    cables: Vec<Relay>,
}

impl Mesh {
    /// So many routers, joined in pairs; of each pair the second calls the first. The cables are in
    /// the order of those who call.
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

    /// How often a frame has gone over a cable so far.
    fn carried(&self) -> usize {
        self.cables.iter().map(Relay::carried).sum()
    }

    fn vehicle(&self) -> Peer<TcpWire> {
        self.routers[0].tcp("here", VEHICLE)
    }

    fn station(&self) -> Peer<TcpWire> {
        self.routers.last().expect("a router").tcp("here", GCS)
    }

    /// Traffic both ways, and no storm; says what became of it.
    fn fly(
        &self,
        vehicle: &mut Peer<TcpWire>,
        station: &mut Peer<TcpWire>,
        story: impl FnOnce(&Progress),
    ) -> [Report; 3] {
        let before = self.carried();
        let reports = fly(vehicle, station, RATES, story);
        let carried = self.carried() - before;
        let input: usize = reports.iter().map(Report::sent).sum();
        let cables = self.cables.len();
        say(&format!("{input} frames went {carried} times over {cables} cables"));
        for report in &reports {
            say(&report.to_string());
        }
        assert!(carried <= ROUNDS * cables * input, "a storm: {carried} for {input}");
        for router in &self.routers {
            assert!(router.log.len() < 200, "{} lines", router.log.len());
        }
        reports
    }

    /// Traffic both ways, before and after the first cable is cut.
    fn check(&self) {
        let (mut vehicle, mut station) = (self.vehicle(), self.station());
        vehicle.meet(&mut station);
        station.meet(&mut vehicle);
        let whole = self.fly(&mut vehicle, &mut station, |progress| progress.wait_for(PART));
        for report in &whole {
            assert_eq!(report.lost(), [0_u32; 0], "lost");
            assert_eq!(report.copies(), [], "delivered again");
        }
        let healed = self.fly(&mut vehicle, &mut station, |progress| {
            progress.wait_for(20);
            self.cables[0].set_cut(true);
            progress.wait_for(PART);
        });
        for report in &healed {
            assert!(report.longest_gap() < HEALED, "{:?} without", report.longest_gap());
        }
    }

    /// The same when the first cable loses the first frames from the vehicle.
    fn check_after_loss(&self) {
        let mut station = self.station();
        // Both cables are known from now on.
        station.send_mark();
        self.routers[0].wait_until_seen(GCS);
        self.cables[0].set_one_way(true);
        let mut vehicle = self.vehicle();
        vehicle.meet(&mut station);
        self.cables[0].set_one_way(false);
        self.fly(&mut vehicle, &mut station, |progress| progress.wait_for(20));
    }
}

/// Two routers, joined by three cables.
const THRICE: &[(usize, usize)] = &[(0, 1); 3];

/// Two routers, joined by two cables.
const TWICE: &[(usize, usize)] = &[(0, 1), (0, 1)];

/// Three routers; the first cable is the short way.
const RING: &[(usize, usize)] = &[(0, 2), (0, 1), (1, 2)];

#[test]
fn two_routers_joined_by_two_links_make_no_storm_and_heal() {
    Mesh::new(2, TWICE).check();
}

#[test]
fn three_routers_in_a_ring_make_no_storm_and_heal() {
    Mesh::new(3, RING).check();
}

#[test]
fn a_loss_between_two_routers_starts_no_storm() {
    Mesh::new(2, TWICE).check_after_loss();
}

#[test]
fn a_loss_in_a_ring_starts_no_storm() {
    Mesh::new(3, RING).check_after_loss();
}

#[test]
fn three_cables_that_lose_frames_make_no_storm() {
    let mesh = Mesh::new(2, THRICE);
    let (mut vehicle, mut station) = (mesh.vehicle(), mesh.station());
    vehicle.meet(&mut station);
    station.meet(&mut vehicle);
    mesh.fly(&mut vehicle, &mut station, |progress| {
        mesh.cables.iter().for_each(|cable| cable.set_weather(25, Duration::ZERO));
        progress.wait_for(PART);
        mesh.cables.iter().for_each(|cable| cable.set_weather(0, Duration::ZERO));
        progress.wait_for(20);
    });
}
