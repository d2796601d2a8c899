//! Bad input of any kind: whatever comes, the router goes on, stays small and keeps serving others.

use std::io::{Read, Write};
use std::net::TcpStream;

use mavswitch::control::Client;
use rustix::process::{Pid, Resource, getrlimit, prlimit};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// A router with two well-behaved peers, and what it used before it was abused.
struct Scene {
    router: Router,
    gcs: Peer<TcpWire>,
    vehicle: Peer<UdpWire>,
    memory_kib: usize,
    descriptors: usize,
}

impl Scene {
    fn set(more: &[&str]) -> Self {
        let router = Router::start(&[&[TCP, UDP], more].concat());
        let mut gcs = router.tcp("tcp", GCS);
        let mut vehicle = router.udp("udp", VEHICLE);
        router.assert_serves(&mut gcs, &mut vehicle);
        let process = router.process();
        let (memory_kib, descriptors) = (process.resident_kib(), process.descriptors());
        Self { router, gcs, vehicle, memory_kib, descriptors }
    }

    /// Both are still served.
    fn serves(&mut self) {
        self.router.assert_serves(&mut self.gcs, &mut self.vehicle);
    }

    /// All is as before.
    fn has_recovered(mut self) {
        self.serves();
        self.router.wait_for_descriptors(self.descriptors);
        self.router.assert_grown_less_than(32, self.memory_kib);
        let lines = self.router.log.len();
        assert!(lines < 1000, "a log of {lines} lines");
    }
}

#[test]
fn random_bytes_over_tcp() {
    let mut scene = Scene::set(&[]);
    let mut noise = Noise::new(1);
    for _ in 0..8 {
        let mut stranger = scene.router.tcp_unnoticed("tcp", OTHER);
        for _ in 0..8 {
            stranger.send(noise.bytes(8192));
            scene.serves();
        }
    }
    scene.has_recovered();
}

#[test]
fn random_bytes_over_udp_from_strangers_and_from_an_admitted_peer() {
    let mut scene = Scene::set(&[]);
    let mut noise = Noise::new(2);
    let mut admitted = scene.router.udp("udp", OTHER);
    for _ in 0..20 {
        let mut stranger = Peer::new(UdpWire::to(scene.router.address("udp")), OTHER);
        for _ in 0..20 {
            let len = noise.below(1400);
            stranger.send(noise.bytes(len));
            admitted.send(noise.bytes(len));
        }
        scene.serves();
    }
    scene.has_recovered();
}

#[test]
fn random_bytes_over_a_serial_port() {
    let pty = Pty::new();
    let serial = format!("serial:{}:921600?name=fc", pty.device());
    let mut scene = Scene::set(&[&serial]);
    let mut noise = Noise::new(3);
    let mut radio = scene.router.serial("fc", pty, OTHER);
    for _ in 0..50 {
        radio.send(noise.bytes(4096));
        scene.serves();
    }
    scene.gcs.meet(&mut radio);
    scene.has_recovered();
}

#[test]
fn endless_start_bytes_over_tcp_and_udp() {
    let mut scene = Scene::set(&[]);
    for start in [0xfe, 0xfd] {
        let mut stranger = scene.router.tcp_unnoticed("tcp", OTHER);
        let mut datagrams = Peer::new(UdpWire::to(scene.router.address("udp")), OTHER);
        for _ in 0..20 {
            stranger.send([start; 4096]);
            datagrams.send([start; 1400]);
            scene.serves();
        }
        // Behind all of them, a good frame is still found.
        scene.gcs.meet(&mut stranger);
    }
    scene.has_recovered();
}

#[test]
fn endless_headers_without_frames_over_tcp() {
    let mut scene = Scene::set(&[]);
    let mut stranger = scene.router.tcp_unnoticed("tcp", OTHER);
    for _ in 0..20 {
        stranger.send([0xfd, 255, 0, 0, 0, 1, 1, 0, 0, 0].repeat(400));
        scene.serves();
    }
    drop(stranger);
    scene.has_recovered();
}

#[test]
fn datagrams_as_long_as_they_get_and_as_short() {
    let mut scene = Scene::set(&[]);
    let mut noise = Noise::new(4);
    let mut stranger = Peer::new(UdpWire::to(scene.router.address("udp")), OTHER);
    for _ in 0..10 {
        stranger.send(noise.bytes(65_507));
        scene.serves();
        stranger.send([]);
        stranger.send([0xfd]);
        scene.serves();
    }
    scene.has_recovered();
}

#[test]
fn a_thousand_connections_that_close_at_once() {
    let mut scene = Scene::set(&[]);
    for n in 0..1000 {
        let client = scene.router.tcp_unnoticed("tcp", OTHER);
        if n % 2 == 0 {
            client.reset();
        }
        if n % 50 == 0 {
            scene.serves();
        }
    }
    scene.has_recovered();
}

#[test]
fn two_thousand_udp_sources() {
    let mut scene = Scene::set(&[]);
    let address = scene.router.address("udp");
    for n in 0..2000_u16 {
        let [high, low] = n.to_be_bytes();
        let source = Component::new(10 + high, 1 + low % 250);
        let local = format!("127.1.{high}.{low}:0").parse().unwrap();
        let socket = roomy_udp_socket(local);
        socket.send_to(&heartbeat(source), address).unwrap();
        if n % 20 == 0 {
            scene.serves();
        }
    }
    scene.has_recovered();
}

#[test]
fn connections_that_are_held_open_and_say_nothing() {
    let mut scene = Scene::set(&[]);
    let idle: Vec<_> = (0..200).map(|_| scene.router.tcp_unnoticed("tcp", OTHER)).collect();
    scene.serves();
    drop(idle);
    scene.has_recovered();
}

#[test]
fn who_calls_while_there_are_no_descriptors_is_served_when_there_are_some_again() {
    let router = Router::start(&[TCP, "--metrics=127.0.0.1:0"]);
    let page = router.metrics();
    let pid = Pid::from_raw(router.process().0 as i32);
    let before = getrlimit(Resource::Nofile);
    let mut none = before;
    none.current = Some(router.process().descriptors() as u64);
    prlimit(pid, Resource::Nofile, none).expect("a limit");
    let mut browser = TcpStream::connect(page).expect("a router that listens");
    browser.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    write!(browser, "GET /metrics HTTP/1.1\r\nHost: {page}\r\n\r\n").expect("room");
    let control = router.control();
    let caller = std::thread::spawn(move || {
        let mut client = Client::connect(Some(&control)).expect("a daemon");
        client.status().map(|it| it.endpoints.len())
    });
    // It tries again and again.
    let _peer = router.tcp_unnoticed("tcp", GCS);
    router.log.wait_for(&["tcp: cannot accept a connection: Too many open files"]);
    prlimit(pid, Resource::Nofile, before).expect("the old limit");
    let mut answer = [0; 15];
    browser.read_exact(&mut answer).expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 200 OK");
    assert_eq!(caller.join().expect("no panic").expect("an answer"), 1);
}
