//! SIGHUP, and the request for the same: what is right takes effect and cuts off nobody who stays; what is wrong changes nothing.

use std::fs;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use mavswitch::control::{Answer, Client, Request};
use rustix::process::Signal;

use crate::harness::*;

impl Scene {
    /// Writes another configuration and waits until it holds; gives the lines of the log about it.
    #[track_caller]
    fn change(&self, text: &str) -> Vec<String> {
        self.write(text);
        reload(&self.router)
    }
}

/// Asks for a reload and waits for its end; gives the lines of the log since.
#[track_caller]
fn reload(router: &Router) -> Vec<String> {
    let from = router.log.len();
    router.signal(Signal::HUP);
    router.log.wait_from(from, &["configuration reloaded; "]);
    router.log.lines().split_off(from)
}

#[track_caller]
fn assert_told(lines: &[String], words: &[&str]) {
    let is_told = lines.iter().any(|line| words.iter().all(|word| line.contains(word)));
    assert!(is_told, "no line with {words:?} in {lines:#?}");
}

fn tcp_and_udp() -> String {
    endpoint("tcp", "tcpin:127.0.0.1:0", "") + &endpoint("udp", "udpin:127.0.0.1:0", "")
}

#[test]
fn a_wrong_file_is_told_line_by_line_and_changes_nothing() {
    let scene = Scene::start(&tcp_and_udp(), &[]);
    let router = &scene.router;
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    let wrong = endpoint("tcp", "tcpin:127.0.0.1:0", "max_pears = 3\nmtoo = 9");
    let unknown = endpoint("tcp", "tcpin:127.0.0.1:0", "block_messages_in = [\"RAW_IUM\"]");
    for (text, reasons) in [
        (
            wrong.as_str(),
            vec![
                ":3:1: unknown key `max_pears`: did you mean `max_peers`?",
                ":4:1: unknown key `mtoo`",
            ],
        ),
        (&unknown, vec![":3:21: tcp: no message is called RAW_IUM: did you mean RAW_IMU?"]),
        ("", vec!["nothing to join"]),
        ("dialect = [\"absent.xml\"]", vec!["nothing to join"]),
        (&format!("dialect = [\"absent.xml\"]\n{}", tcp_and_udp()), vec!["absent.xml"]),
    ] {
        fs::write(&scene.file, text).unwrap();
        let from = router.log.len();
        router.signal(Signal::HUP);
        router.log.wait_from(from, &["ERROR", "cannot be reloaded: everything stays as it was"]);
        let lines = router.log.lines().split_off(from);
        reasons.iter().for_each(|reason| assert_told(&lines, &["ERROR", reason]));
        router.assert_serves(&mut gcs, &mut vehicle);
    }
    fs::remove_file(&scene.file).unwrap();
    let from = router.log.len();
    router.signal(Signal::HUP);
    router.log.wait_from(from, &["ERROR", path(&scene.file), "No such file"]);
    let lines = scene.change(&tcp_and_udp());
    assert_told(&lines, &["endpoints: 0 added, 0 removed, 0 opened again, 0 changed, 2 as before"]);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn who_asks_for_a_reload_is_told_what_came_of_it() {
    let scene = Scene::start(&tcp_and_udp(), &[]);
    let control = scene.router.control();
    let ask = || run(&["reload", "--control", path(&control)]);
    let told = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    fs::write(&scene.file, format!("strict = true\n{}", tcp_and_udp())).unwrap();
    let output = ask();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = told(output.stdout);
    assert!(text.starts_with("configuration reloaded; ") && text.contains("2 as before"), "{text}");
    // What keeps it from being used is what a check tells.
    let wrong = tcp_and_udp() + &endpoint("fc", "udpin:127.0.0.1:0", "rate = { HEARTBEET = 4 }");
    fs::write(&scene.file, wrong).unwrap();
    let output = ask();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let text = told(output.stderr);
    assert!(text.ends_with("cannot be reloaded: everything stays as it was"), "{text}");
    let check = run(&["check", path(&scene.file)]);
    assert_eq!(check.status.code(), Some(2));
    let line = text.lines().next().unwrap();
    assert!(line.contains("did you mean HEARTBEAT?"), "{text}");
    assert!(told(check.stderr).lines().any(|it| it == line), "{text}");
    assert!(!scene.router.log.has(&["fc: listening on "]));
    let nobody = run(&["reload", "--control", "/nowhere/control"]);
    assert_eq!(nobody.status.code(), Some(1));
}

#[test]
fn many_who_ask_for_a_reload_at_once_are_all_answered_and_then_what_they_ask_next() {
    let scene = Scene::start(&tcp_and_udp(), &[]);
    let connect = || Client::connect(Some(&scene.router.control())).unwrap();
    let mut clients: Vec<_> = (0..6).map(|_| connect()).collect();
    for client in &mut clients {
        client.send(Request::Reload).unwrap();
        client.send(Request::Status).unwrap();
    }
    // One that does not wait for it harms nobody.
    let mut gone = connect();
    gone.send(Request::Reload).unwrap();
    drop(gone);
    for client in &mut clients {
        let mut next = || client.receive(PATIENCE).unwrap().expect("an answer").answer;
        assert!(matches!(next(), Answer::Done(text) if text.contains("2 as before")));
        assert!(matches!(next(), Answer::Status(_)));
    }
    scene.change(&tcp_and_udp());
}

#[test]
fn a_filter_changes_under_a_connection() {
    let scene = Scene::start(&tcp_and_udp(), &[]);
    let mut vehicle = scene.router.udp("udp", VEHICLE);
    let mut gcs = scene.router.tcp("tcp", GCS);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    let blocking = endpoint("tcp", "tcpin:127.0.0.1:0", "block_messages_out = [\"ATTITUDE\"]")
        + &endpoint("udp", "udpin:127.0.0.1:0", "");
    let lines = scene.change(&blocking);
    assert_told(&lines, &["tcp: changed: block_messages_out"]);
    vehicle.send(attitude(VEHICLE, 2));
    vehicle.send(heartbeat(VEHICLE));
    gcs.expect(heartbeat(VEHICLE));
    scene.change(&tcp_and_udp());
    vehicle.send(attitude(VEHICLE, 3));
    gcs.expect(attitude(VEHICLE, 3));
}

#[test]
fn endpoints_come_go_and_get_new_names_beside_one_that_stays() {
    let stays = endpoint("stays", "tcpin:127.0.0.1:0", "");
    let scene = Scene::start(&(stays.clone() + &endpoint("old", "udpin:127.0.0.1:0", "")), &[]);
    let router = &scene.router;
    let mut vehicle = router.tcp("stays", VEHICLE);
    let mut gcs = router.udp("old", GCS);
    // Another name for the same place: whoever is there stays there.
    let lines = scene.change(&(stays.clone() + &endpoint("new", "udpin:127.0.0.1:0", "")));
    assert_told(&lines, &["old: changed: name"]);
    router.assert_serves(&mut vehicle, &mut gcs);
    // It goes, and with it what was learned there; somebody else comes.
    let lines = scene.change(&(stays.clone() + &endpoint("more", "tcpin:127.0.0.1:0", "")));
    assert_told(&lines, &["new: removed"]);
    assert_told(&lines, &["endpoints: 1 added, 1 removed, 0 opened again, 0 changed, 1 as before"]);
    router.wait_until_lost(GCS);
    let mut other = router.tcp("more", GCS_2);
    router.assert_serves(&mut vehicle, &mut other);
}

#[test]
fn a_group_with_another_name_is_still_a_group() {
    let grouped = |group: &str| {
        let group = format!("group = \"{group}\"");
        endpoint("radio", "tcpin:127.0.0.1:0", &group)
            + &endpoint("modem", "tcpin:127.0.0.1:0", &group)
            + &endpoint("gcs", "tcpin:127.0.0.1:0", "")
    };
    let scene = Scene::start(&grouped("old"), &[]);
    let router = &scene.router;
    let mut vehicle = router.tcp("radio", VEHICLE);
    let mut modem = router.tcp("modem", WITNESS);
    let mut gcs = router.tcp("gcs", GCS);
    let lines = scene.change(&grouped("new"));
    assert_told(&lines, &["radio: changed: group"]);
    vehicle.send(heartbeat(VEHICLE));
    gcs.expect(heartbeat(VEHICLE));
    // What one member brings is not sent over the other; what the station sends is, over both.
    gcs.send(heartbeat(GCS));
    modem.expect(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
}

#[test]
fn a_server_for_ipv6_has_ipv4_as_long_as_no_other_wants_it() {
    let reserved = TcpServer::down();
    let port = reserved.address().port();
    let both = endpoint("both", &format!("tcpin:[::]:{port}"), "");
    let ipv4 = endpoint("ipv4", &format!("tcpin:0.0.0.0:{port}"), "");
    let other = endpoint("other", "udpin:127.0.0.1:0", "");
    let scene = Scene::start(&other, &[]);
    let served_by = |lines: &[String], name: &str| {
        let is_waiting = |line: &String| line.contains("waiting for it");
        assert!(!lines.iter().any(is_waiting), "{lines:#?}");
        let from = scene.router.log.len();
        let _peer = TcpWire::to(([127, 0, 0, 1], port).into());
        scene.router.log.wait_from(from, &[&format!("{name}: link #")]);
    };
    // Both at once, then one, then the other one as well.
    let lines = scene.change(&(other.clone() + &both + &ipv4));
    served_by(&lines, "ipv4");
    let lines = scene.change(&(other.clone() + &both));
    assert_told(&lines, &["both: opening again: another endpoint has its port for IPv4"]);
    served_by(&lines, "both");
    let lines = scene.change(&(other.clone() + &both + &ipv4));
    served_by(&lines, "ipv4");
}

#[test]
fn endpoints_of_the_command_line_stay_whatever_the_file_says() {
    let scene = Scene::start(
        &endpoint("file", "udpin:127.0.0.1:0", ""),
        &["tcpin:127.0.0.1:0?name=line", "udpout:127.0.0.1:9"],
    );
    let router = &scene.router;
    let mut vehicle = router.tcp("line", VEHICLE);
    let lines = scene.change("strict = true\n");
    assert_told(&lines, &["endpoints: 0 added, 1 removed, 0 opened again, 0 changed, 2 as before"]);
    let mut gcs = router.tcp("line", GCS);
    router.assert_serves(&mut vehicle, &mut gcs);
}

#[test]
fn another_address_is_opened_in_the_same_turn_also_if_another_endpoint_had_it() {
    // They are kept from everybody else, and nobody listens there.
    let reserved = [TcpServer::down(), TcpServer::down()];
    let ports = [0, 1].map(|n: usize| reserved[n].address().port());
    let at = |name: &str, port: u16, options: &str| {
        endpoint(name, &format!("tcpin:127.0.0.1:{port}"), options)
    };
    let scene = Scene::start(&(at("a", ports[0], "") + &at("b", ports[1], "")), &[]);
    let router = &scene.router;
    let mut vehicle = router.tcp("a", VEHICLE);
    // Both change places, and neither can change under its links.
    let swapped = at("a", ports[1], "dev = \"lo\"") + &at("b", ports[0], "dev = \"lo\"");
    let lines = scene.change(&swapped);
    assert_told(&lines, &["a: opening again: changed address, dev"]);
    let is_waiting = |line: &String| line.contains("waiting for it");
    assert!(!lines.iter().any(is_waiting), "{lines:#?}");
    vehicle.receive_to_end();
    for port in ports {
        let address: std::net::SocketAddr = ([127, 0, 0, 1], port).into();
        let mut peer = Peer::new(TcpWire::to(address), WITNESS);
        peer.send_mark();
    }
    router.wait_until_seen(WITNESS);
}

#[test]
fn a_serial_port_stays_open_and_changes_its_baud_rate_in_place() {
    let pty = Pty::new();
    let device = pty.device().to_owned();
    let with = |bauds: &str, more: &str| {
        endpoint("fc", &format!("serial:{device}:{bauds}"), more)
            + &endpoint("tcp", "tcpin:127.0.0.1:0", "")
    };
    let scene = Scene::start(&with("57600", ""), &[]);
    let router = &scene.router;
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let opened = || router.log.lines().iter().filter(|it| it.contains("fc: link #")).count();
    let before = opened();
    let lines = scene.change(&with("57600", "sniffer = true"));
    assert_told(&lines, &["fc: changed: sniffer"]);
    router.assert_serves(&mut gcs, &mut vehicle);
    assert_eq!(vehicle.wire.baud(), 57_600);
    let lines = scene.change(&with("115200", "bandwidth = 5000"));
    assert_told(&lines, &["fc: changed: baudrate, bandwidth, sniffer"]);
    eventually("the port has its new rate", || vehicle.wire.baud() == 115_200);
    router.assert_serves(&mut gcs, &mut vehicle);
    assert_eq!(opened(), before);
}

#[test]
fn what_was_heard_at_the_old_baud_rate_proves_no_new_one() {
    let pty = Pty::new();
    let device = pty.device().to_owned();
    let with = |bauds: &str| {
        endpoint("fc", &format!("serial:{device}:{bauds}"), "")
            + &endpoint("tcp", "tcpin:127.0.0.1:0", "")
    };
    let scene = Scene::start(&with("57600"), &[]);
    let router = &scene.router;
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    scene.change(&with("9600,115200"));
    eventually("the next rate is tried", || vehicle.wire.baud() == 115_200);
    router.assert_serves(&mut gcs, &mut vehicle);
    router.log.wait_for(&["fc: frames at "]);
}

#[test]
fn a_longer_queue_and_a_faster_pace_let_out_what_waits() {
    let with = |options: &str| {
        endpoint("slow", "tcpin:127.0.0.1:0", options) + &endpoint("udp", "udpin:127.0.0.1:0", "")
    };
    let scene = Scene::start(&with("bandwidth = 10\nqueue_time = \"60s\""), &[]);
    let mut vehicle = scene.router.udp("udp", VEHICLE);
    let mut gcs = scene.router.tcp_silent("slow", GCS);
    let frames: Vec<_> = (0..10).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send_each(&frames);
    // At the old pace, 40 bytes take 4 s each: patience would end before the last.
    gcs.expect(&frames[0]);
    scene.change(&with(""));
    gcs.expect_each(&frames[1..]);
}

#[test]
fn a_shorter_patience_holds_for_a_peer_that_is_silent_already() {
    let with = |timeout: &str| {
        endpoint("udp", "udpin:127.0.0.1:0", &format!("peer_timeout = \"{timeout}\""))
    };
    let scene = Scene::start(&with("60m"), &[]);
    let _gcs = scene.router.udp("udp", GCS);
    let lines = scene.change(&with("100ms"));
    assert_told(&lines, &["udp: changed: peer_timeout"]);
    scene.router.log.wait_for(&["udp: link #", " down: silent for 0.1 s"]);
}

#[test]
fn a_shorter_patience_holds_for_a_peer_that_is_stuck_already() {
    let with = |timeout: &str| {
        endpoint("tcp", "tcpin:127.0.0.1:0", &format!("stall_timeout = \"{timeout}\""))
            + &endpoint("in", "tcpin:127.0.0.1:0", "")
    };
    let scene = Scene::start(&with("60m"), &[]);
    let router = &scene.router;
    let stuck = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS);
    router.wait_for_link("tcp", &stuck.wire);
    let mut vehicle = router.tcp("in", VEHICLE);
    let mut gcs = router.tcp("in", GCS_2);
    // More than fits on the way to the one that reads nothing.
    for n in 0..20_000 {
        vehicle.send(bulk(VEHICLE, n));
        if n % 200 == 199 {
            gcs.meet(&mut vehicle);
        }
    }
    scene.change(&with("100ms"));
    router.log.wait_for(&["tcp: link #", " down: it takes nothing any more"]);
}

#[test]
fn the_log_level_and_routing_change_and_the_log_format_does_not() {
    let general = |text: &str| format!("{text}\n{}", tcp_and_udp());
    let scene = Scene::start(&general("log_level = \"warn\"\nlog_format = \"text\""), &["-v"]);
    let lines = scene.change(&general("log_level = \"error\"\nlog_format = \"json\""));
    // The command line still has the last word.
    assert_told(&lines, &["endpoints: 0 added"]);
    assert_told(&lines, &["WARN", "log_format: another value takes effect at the next start"]);

    let scene = Scene::start(&general("log_level = \"info\""), &[]);
    let router = &scene.router;
    scene.change(&general("log_level = \"debug\"\nlearn = \"heartbeat\""));
    let mut gcs = router.udp("udp", GCS);
    let vehicle = router.tcp("tcp", VEHICLE);
    gcs.send(command_long(GCS, OTHER));
    router.log.wait_for(&["DEBUG", "no route to 2/1"]);
    drop(vehicle);
    fs::write(&scene.file, general("log_level = \"warn\"\nlog_format = \"json\"")).unwrap();
    router.signal(Signal::HUP);
    router.log.wait_for(&["WARN", "log_format"]);
    let from = router.log.len();
    fs::write(&scene.file, "x").unwrap();
    router.signal(Signal::HUP);
    router.log.wait_from(from, &["ERROR", "everything stays as it was"]);
    let lines = router.log.lines().split_off(from);
    assert!(!lines.iter().any(|line| line.contains("INFO")), "{lines:#?}");
}

/// The files in /etc/mavswitch are found where nobody names others.
#[test]
fn a_file_that_appears_in_conf_d_adds_its_endpoints() {
    if !in_own_namespaces(a_file_that_appears_in_conf_d_adds_its_endpoints, &["mount"]) {
        return;
    }
    sh("mount -t tmpfs tmpfs /etc && mkdir -p /etc/mavswitch/conf.d");
    fs::write("/etc/mavswitch/mavswitch.toml", tcp_and_udp()).unwrap();
    let router = Router::start(&[]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let more = endpoint("more", "udpin:127.0.0.1:0", "");
    fs::write("/etc/mavswitch/conf.d/more.toml", more).unwrap();
    assert_told(&reload(&router), &["endpoints: 1 added", "2 as before"]);
    let mut gcs = router.udp("more", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    fs::remove_file("/etc/mavswitch/conf.d/more.toml").unwrap();
    assert_told(&reload(&router), &["more: removed"]);
}

#[test]
fn a_terminal_that_is_closed_ends_the_program_and_no_other_signal_of_that_kind_does() {
    let pty = Pty::new();
    let router = Router::launch_at(&pty.path, &["tcpin:127.0.0.1:0"]);
    router.log.wait_for(&["ready"]);
    reload(&router);
    drop(pty);
    router.signal(Signal::HUP);
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
}

/// How many frames may be under way: few enough to fit into every buffer on their way, so that
/// only the router can lose one.
const WINDOW: u32 = 100;

/// How many frames are sent at once, and how often: 10,000 a second.
const BURST: u32 = 20;
const BURSTS: Duration = Duration::from_millis(2);

/// How often the configuration changes.
const RELOADS: usize = 100;

/// What comes and goes beside two that stay. Each has something that the one before had in another
/// way: a name, a place, an option, or all of them.
fn beside(number: usize) -> String {
    let mtu = 300 + number;
    match number % 4 {
        0 => String::new(),
        1 => {
            endpoint("x", "udpout:127.0.0.1:9", &format!("mtu = {mtu}"))
                + &endpoint("y", "tcpin:127.0.0.1:0", "group = \"g\"")
                + &endpoint("z", "serial:/dev/absent:57600", "")
        }
        2 => {
            endpoint("x", "udpout:127.0.0.1:10", &format!("mtu = {mtu}"))
                + &endpoint("y", "tcpin:127.0.0.1:0", "group = \"h\"\npath = \"best\"")
                + &endpoint("w", "tcpout:127.0.0.1:9", "")
        }
        _ => {
            endpoint("v", "udpout:127.0.0.1:10", &format!("bandwidth = {}00", mtu))
                + &endpoint("y", "udpin:127.0.0.1:0", "sniffer = true")
        }
    }
}

#[test]
fn ten_thousand_frames_a_second_lose_none_while_others_come_and_go() {
    let stays = endpoint("in", "udpin:127.0.0.1:0", "") + &endpoint("out", "tcpin:127.0.0.1:0", "");
    let scene = Scene::start(&stays, &[]);
    let router = &scene.router;
    let mut vehicle = router.udp("in", VEHICLE);
    let mut gcs = router.tcp("out", GCS);
    router.assert_serves(&mut vehicle, &mut gcs);
    (0..8).for_each(|number| drop(scene.change(&(stays.clone() + &beside(number)))));
    scene.change(&stays);
    let condition = Condition::of(router);
    let (received, is_over) = (AtomicU32::new(0), AtomicBool::new(false));
    // How many there are in all, once that is known.
    let total = AtomicU32::new(u32::MAX);
    let begin = Instant::now();
    thread::scope(|scope| {
        let sender = scope.spawn(|| {
            let mut schedule = Schedule::every(BURSTS);
            let mut sent = 0;
            while !is_over.load(Ordering::Relaxed) {
                schedule.wait();
                let end = received.load(Ordering::Acquire) + WINDOW;
                let burst = sent..end.min(sent + BURST);
                burst.clone().for_each(|n| vehicle.send(attitude(VEHICLE, n)));
                sent = burst.end.max(sent);
            }
            sent
        });
        let receiver = scope.spawn(|| {
            let mut next = 0;
            while next < total.load(Ordering::Relaxed) {
                let Some(frame) = gcs.try_receive(Duration::from_millis(20)) else {
                    assert!(begin.elapsed() < PATIENCE * 2, "frame {next} is lost");
                    continue;
                };
                assert_eq!(number_in(&frame), next, "one is lost, or comes twice");
                next += 1;
                received.store(next, Ordering::Release);
            }
        });
        for number in 1..=RELOADS {
            scene.change(&(stays.clone() + &beside(number)));
            // Each configuration is in use for a while.
            thread::sleep(Duration::from_millis(20));
        }
        let time = begin.elapsed();
        is_over.store(true, Ordering::Relaxed);
        let sent = sender.join().unwrap();
        total.store(sent, Ordering::Relaxed);
        receiver.join().unwrap();
        let rate = f64::from(sent) / time.as_secs_f64();
        println!("{sent} frames, {rate:.0} a second, {RELOADS} reloads in {time:?}");
    });
    scene.change(&stays);
    condition.assert_restored(router);
}
