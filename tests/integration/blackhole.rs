//! A host that answers nothing, and a name server that answers nothing: nobody else waits for them.
//!
//! Two routers, one with such endpoints and one without, take turns within one run; so whatever
//! else the machine does at that time happens to both.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use crate::harness::*;

const LINKS: [&str; 2] = ["tcpin:127.0.0.1:0?name=tcp", "udpin:127.0.0.1:0?name=udp"];

/// How many frames go there and back in a row.
const FRAMES: u32 = 250;
/// The rounds are spread over more time than a call or a question takes to be given up.
const PAUSE: Duration = Duration::from_millis(100);
/// How many times slower the router with the troubles may be.
const RATIO: f64 = 1.2;
/// A run that was judged too slow is repeated so often: a machine is never slower by chance only
/// where the router is.
const RUNS: usize = 3;
/// On a machine that keeps the test itself waiting for longer, figures say nothing of the router.
const QUIET: Duration = Duration::from_millis(1);
/// What holds on any machine that runs at all: for a frame, mostly, and for any.
const BOUND: Duration = Duration::from_millis(20);
const STALL: Duration = Duration::from_secs(2);

#[test]
fn who_never_answers_delays_nobody_else() {
    if !in_own_namespaces(who_never_answers_delays_nobody_else, &["mount", "nsenter"]) {
        return;
    }
    let _names = Names::none();
    // It hears every question and answers none.
    let _name_server = UdpSocket::bind("127.0.0.1:53").unwrap();
    let _far = FarNetwork::new();
    // Calls to this address leave, and arrive nowhere.
    sh("ip neighbour add 10.99.0.9 lladdr 02:00:00:00:00:09 dev near nud permanent");
    let troubles = [
        "tcpout:10.99.0.9:5760?name=hole",
        "tcpout:fc.example:5760?name=called",
        "udpout:gcs.example:14550?name=sent",
        "udpin:localhost.example:0?name=server",
    ];
    compare(&troubles, 50);
}

#[test]
fn a_server_that_takes_no_call_delays_nobody_else() {
    let (nowhere, _kept) = blackhole();
    compare(&[&format!("tcpout:{nowhere}?name=hole")], 35);
}

/// A router between a vehicle and a ground station.
struct Between {
    _router: Router,
    vehicle: Peer<TcpWire>,
    gcs: Peer<UdpWire>,
    /// The 99th percentile of each round.
    slowest: Vec<Duration>,
    all: Vec<Duration>,
}

impl Between {
    fn new(others: &[&str]) -> Self {
        let router = Router::launch(&[&LINKS, others].concat());
        let (vehicle, gcs) = (router.tcp("tcp", VEHICLE), router.udp("udp", GCS));
        Self { _router: router, vehicle, gcs, slowest: Vec::new(), all: Vec::new() }
    }

    /// Sends frames there and back, one at a time.
    fn round(&mut self) {
        let mut times = Vec::new();
        for n in 0..FRAMES {
            let (there, back) = (attitude(VEHICLE, n), command_long(GCS, VEHICLE));
            let start = Instant::now();
            self.vehicle.send(&there);
            self.gcs.expect(&there);
            times.push(start.elapsed());
            let start = Instant::now();
            self.gcs.send(&back);
            self.vehicle.expect(&back);
            times.push(start.elapsed());
        }
        self.slowest.push(quantile(&times, 0.99));
        self.all.extend(times);
    }

    /// The 99th percentile of an ordinary round: one that was disturbed is not it.
    fn p99(&self) -> f64 {
        millis(quantile(&self.slowest, 0.5))
    }
}

fn compare(troubles: &[&str], rounds: usize) {
    // A third one tells how much two that are alike differ by chance.
    let (mut plain, mut twin) = (Between::new(&[]), Between::new(&[]));
    let mut troubled = Between::new(troubles);
    for run in 1.. {
        let mut lateness = Lateness::default();
        for between in [&mut plain, &mut twin, &mut troubled] {
            between.slowest.clear();
        }
        for _ in 0..rounds {
            plain.round();
            troubled.round();
            twin.round();
            lateness.sleep(PAUSE);
        }
        let chance = (plain.p99() / twin.p99()).max(twin.p99() / plain.p99());
        let ratio = troubled.p99() / plain.p99().max(twin.p99());
        println!(
            "p99 {:.3} ms with {} endpoints that get no answer, {:.3} and {:.3} ms without: \
             {ratio:.2} times (by chance {chance:.2} times)",
            troubled.p99(),
            troubles.len(),
            plain.p99(),
            twin.p99(),
        );
        if ratio <= RATIO {
            break;
        }
        if chance > 1.1 || lateness.p99() > QUIET {
            println!("machine too busy, figures not judged: {:?} late by itself", lateness.p99());
            break;
        }
        assert!(run < RUNS, "{ratio:.2} times slower");
    }
    let usual = quantile(&troubled.all, 0.5);
    assert!(usual <= BOUND, "a frame usually takes {usual:?}");
    let worst = |between: &Between| quantile(&between.all, 1.0);
    let (worst, without) = (worst(&troubled), worst(&plain).max(worst(&twin)));
    println!("the slowest frame of all took {worst:?}, and {without:?} without");
    assert!(worst <= without + STALL, "a frame took {worst:?}, without troubles {without:?}");
}
