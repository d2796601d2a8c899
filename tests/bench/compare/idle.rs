//! What a router costs that has nothing to do, and what each connection adds.

use std::net::{TcpStream, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

use mavswitch::mavlink::Component;

use super::layout::Layout;
use super::load::{heartbeat, say};
use super::measure::{free_tcp, free_udp};
use super::router::Candidate;
use super::table::{Table, median};

/// How many connections are added.
const CLIENTS: u8 = 100;

/// How long nothing happens.
const REST: Duration = Duration::from_secs(3);

const HEAD: &str = "\
| | ready after | memory at rest | memory per TCP link | wake-ups/s | CPU at rest |
|---|---|---|---|---|---|";

/// All routers, once a round each.
pub(crate) fn table(routers: &[Candidate], rounds: usize) -> Table {
    let rows = routers.iter().map(|router| {
        let samples: Vec<[f64; 5]> = (0..rounds).map(|_| measure(router)).collect();
        let of = |at: usize| median(samples.iter().map(|sample| sample[at]));
        format!(
            "| {} | {:.1} ms | {:.1} MiB | {:.1} KiB | {:.1} | {:.3} % |",
            router.name,
            of(0),
            of(1),
            of(2),
            of(3),
            of(4)
        )
    });
    Table::with_head(HEAD, rows.collect())
}

/// Milliseconds until it listens, MiB, KiB a link, wake-ups a second, percent of a processor.
fn measure(router: &Candidate) -> [f64; 5] {
    let ground = UdpSocket::bind("127.0.0.1:0").expect("a UDP socket");
    let server = free_tcp();
    let layout = Layout {
        udp_server: Some(free_udp()),
        udp_client: Some(ground.local_addr().expect("a bound socket")),
        tcp_server: Some(server),
        ..Layout::default()
    };
    let begin = Instant::now();
    let running = router.start(&layout);
    while TcpStream::connect(server).is_err() {
        assert!(begin.elapsed() < Duration::from_secs(20), "{} does not listen", router.name);
        thread::sleep(Duration::from_micros(200));
    }
    let ready = begin.elapsed().as_secs_f64() * 1e3;
    thread::sleep(REST);
    let (resting, before) = (running.resident_kib() as f64, running.usage());
    thread::sleep(REST);
    let after = running.usage();
    let clients = (0..CLIENTS).map(|n| {
        let client = TcpStream::connect(server).expect("a connection");
        say(&client, &heartbeat(Component::new(n + 1, 1)));
        client
    });
    let clients: Vec<_> = clients.collect();
    thread::sleep(Duration::from_secs(1));
    let added = running.resident_kib() as f64 - resting;
    drop(clients);
    let rest = REST.as_secs_f64();
    [
        ready,
        resting / 1024.0,
        added / f64::from(CLIENTS),
        (after.switches - before.switches) as f64 / rest,
        (after.cpu - before.cpu).as_secs_f64() / rest * 100.0,
    ]
}
