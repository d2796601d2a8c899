//! The control socket: who asks is answered, and whoever asks wrongly harms nobody.

use std::fs;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use mavswitch::control::{Client, ClientError, MAX_REQUEST, Request};
use mavswitch::status::{ComponentStatus, Counters, EndpointState, Snapshot};
use rustix::process::Signal;

use crate::harness::*;

/// A connection on which anything may be said.
fn raw(router: &Router) -> UnixStream {
    let stream = UnixStream::connect(router.control()).expect("a daemon that listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    stream
}

/// What is answered until the router closes the connection.
fn answers(mut stream: UnixStream) -> String {
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("an end of the connection");
    text
}

#[test]
fn the_socket_is_for_user_and_group_and_goes_with_the_router() {
    let dir = TempDir::new();
    let path = dir.path("control");
    let arguments = ["--control", path.to_str().unwrap(), "udpin:127.0.0.1:0?name=udp"];
    let router = Router::start(&arguments);
    let mode = fs::symlink_metadata(&path).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o660);
    router.signal(Signal::TERM);
    let (status, _) = router.wait_for_end();
    assert!(status.success() && !path.exists());
}

#[test]
fn status_tells_of_endpoints_links_and_components() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp"]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    let snapshot = router.status();
    let states: Vec<_> = snapshot.endpoints.iter().map(|it| (it.name.as_str(), it.state)).collect();
    assert_eq!(states, [("udp", EndpointState::Listening), ("tcp", EndpointState::Listening)]);
    let [udp, tcp] = &snapshot.endpoints[..] else { panic!("two endpoints") };
    assert_eq!((udp.links.len(), tcp.links.len()), (1, 1));
    let heard: Vec<_> = snapshot
        .components
        .iter()
        .map(|it| (it.system, it.component, it.heard[0].endpoint.as_str()))
        .collect();
    assert_eq!(heard, [(1, 1, "udp"), (255, 190, "tcp")]);
}

#[test]
fn half_lines_garbage_and_huge_lines_are_answered_or_dropped() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp"]);
    let mut stream = raw(&router);
    stream.write_all(b"{\"version\":1,\"id\":7,\"requ").unwrap();
    let mut other = raw(&router);
    other.write_all(b"GET / HTTP/1.1\r\n\r\n\xff\xfe\n{\"version\":9,\"id\":3}\n").unwrap();
    other.shutdown(Shutdown::Write).unwrap();
    let text = answers(other);
    assert_eq!(text.matches("this is no request").count(), 3, "{text}");
    assert!(text.contains("\"id\":3,\"error\":\"version 9"), "{text}");
    stream.write_all(b"est\":\"fly\"}\n").unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    assert!(answers(stream).contains("\"id\":7,\"error\":\"this is no request: unknown variant"));
    let mut huge = raw(&router);
    huge.write_all(&vec![b'x'; MAX_REQUEST]).unwrap();
    assert!(answers(huge).contains("at most"));
    assert_eq!(router.status().endpoints.len(), 1);
}

#[test]
fn there_is_room_for_so_many_clients_and_again_when_they_go() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp"]);
    let mut clients: Vec<Client> = (0..8).map(|_| router.client()).collect();
    for client in &mut clients {
        client.status().unwrap();
    }
    let text = answers(raw(&router));
    assert!(text.contains("8 clients are connected already"), "{text}");
    // Whether it asks before or after it was turned away: it is told why.
    for _ in 0..20 {
        match router.client().status() {
            Err(ClientError::Refused(text)) => assert!(text.contains("8 clients"), "{text}"),
            other => panic!("{other:?}"),
        }
    }
    clients.clear();
    eventually("a place for a client", || router.client().status().is_ok());
}

#[test]
fn a_router_that_finds_another_one_at_its_socket_goes_on_without() {
    let dir = TempDir::new();
    let path = dir.path("control");
    let path = path.to_str().unwrap();
    let first = Router::start(&["--control", path, "udpin:127.0.0.1:0?name=udp"]);
    let second = Router::start(&["--control", path, "udpin:127.0.0.1:0?name=other"]);
    second.log.wait_for(&["no control socket at", "another mavswitch has it", "--control PATH"]);
    let mut client = Client::connect(Some(path.as_ref())).unwrap();
    assert_eq!(client.status().unwrap().endpoints[0].name, "udp");
    first.signal(Signal::KILL);
    first.wait_for_end();
    let third = Router::start(&["--control", path, "udpin:127.0.0.1:0?name=third"]);
    let mut client = Client::connect(Some(path.as_ref())).unwrap();
    assert_eq!(client.status().unwrap().endpoints[0].name, "third");
    drop((second, third));
}

#[test]
fn endpoints_come_and_go_by_request() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp"]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut client = router.client();
    let mut ask = |request| match client.ask(request) {
        Ok(_) => String::new(),
        Err(ClientError::Refused(text)) => text,
        Err(error) => panic!("{error}"),
    };
    let add = |text: &str| Request::EndpointAdd { endpoint: text.to_owned() };
    assert_eq!(ask(add("tcpin:127.0.0.1:0?name=tcp")), "");
    let mut gcs = router.tcp("tcp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    assert!(ask(add("tcpin:127.0.0.1:0?name=tcp")).contains("already"));
    assert!(ask(add("tcpin:127.0.0.1:0?nme=tcp")).contains("did you mean `name`?"));
    let taken = format!("tcpin:{}?name=second", router.address("tcp"));
    assert!(ask(add(&taken)).contains("endpoint tcp has this port already"));
    let other = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = format!("tcpin:{}?name=second", other.local_addr().unwrap());
    assert!(ask(add(&taken)).contains("another program is there"));
    assert!(ask(Request::EndpointRemove { name: "nobody".into() }).contains("udp, tcp"));
    assert_eq!(ask(Request::EndpointDisable { name: "tcp".into() }), "");
    gcs.receive_to_end();
    assert_eq!(ask(Request::EndpointEnable { name: "tcp".into() }), "");
    assert_eq!(ask(Request::EndpointRemove { name: "tcp".into() }), "");
    for done in ["switched off", "switched on", "removed"] {
        router.log.wait_for(&[&format!("tcp: {done} by request")]);
    }
    let names = client.status().unwrap().endpoints.into_iter().map(|it| it.name);
    assert_eq!(names.collect::<Vec<_>>(), ["udp"]);
}

/// The counters of the only link of an endpoint.
fn counted<'a>(snapshot: &'a Snapshot, endpoint: &str) -> &'a Counters {
    let endpoint = snapshot.endpoints.iter().find(|it| it.name == endpoint).unwrap();
    &endpoint.links[0].counters
}

#[test]
fn what_is_told_is_what_was_sent() {
    let out = "tcpin:127.0.0.1:0?name=gcs&block_messages_out=HEARTBEAT";
    let router = Router::start(&["tcpin:127.0.0.1:0?name=fc", out]);
    let mut gcs = router.tcp_silent("gcs", GCS);
    let mut vehicle = router.tcp_silent("fc", VEHICLE);
    // One of ten is lost on the way to the router.
    let frames: Vec<_> =
        (0..20_000).filter(|n| n % 10 != 3).map(|n| attitude(VEHICLE, n)).collect();
    let heartbeats: Vec<_> = (0..50).map(|_| heartbeat(CAMERA)).collect();
    let unanswered: Vec<_> = (0..7).map(|_| command_long(CAMERA, OTHER)).collect();
    let damaged: Vec<_> = (0..20).map(|n| corrupted(&attitude(VEHICLE, n))).collect();
    let mut follower = router.client();
    follower.send(Request::Follow { interval_ms: 100 }).unwrap();
    thread::scope(|scope| {
        scope.spawn(|| {
            vehicle.send([&heartbeats[..], &unanswered, &damaged].concat().concat());
            vehicle.send(frames.concat());
        });
        gcs.expect_each(&frames);
    });
    let told = router.status();
    let (fc, gcs) = (counted(&told, "fc"), counted(&told, "gcs"));
    let whole: Vec<_> = [&heartbeats[..], &unanswered, &frames].concat();
    let bytes = |frames: &[Vec<u8>]| frames.iter().map(|frame| frame.len() as u64).sum::<u64>();
    assert_eq!((fc.frames_in, fc.bytes_in), (whole.len() as u64, bytes(&whole)));
    assert_eq!((fc.bad_crc, fc.garbage_bytes), (20, bytes(&damaged)));
    assert_eq!(fc.refused.get("no_route"), Some(&7));
    assert_eq!((gcs.frames_out, gcs.bytes_out), (frames.len() as u64, bytes(&frames)));
    assert_eq!(gcs.refused.get("filtered_out"), Some(&50));
    let of = |system, component| {
        let is_it = |it: &&ComponentStatus| (it.system, it.component) == (system, component);
        told.components.iter().find(is_it).unwrap()
    };
    assert_eq!((of(1, 1).heard[0].frames, of(1, 1).heard[0].lost), (18_000, 2_000));
    assert_eq!((of(1, 100).heard[0].frames, of(1, 100).heard[0].lost), (57, 0));
    assert!(of(1, 100).vehicle.is_some() && of(1, 1).vehicle.is_none());
    let messages = told.messages.iter();
    let messages: Vec<_> =
        messages.map(|it| (it.component, it.name.as_deref().unwrap(), it.frames)).collect();
    let expected = [(1, "ATTITUDE", 18_000), (100, "HEARTBEAT", 50), (100, "COMMAND_LONG", 7)];
    assert_eq!(messages, expected);
    assert!(follower.receive(PATIENCE).unwrap().is_some());
}

#[test]
fn a_client_that_never_reads_costs_nothing() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp"]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let before = router.process().resident_kib();
    let lazy: Vec<UnixStream> = (0..3)
        .map(|_| {
            let mut stream = raw(&router);
            stream.write_all(b"{\"request\":\"follow\",\"interval_ms\":100}\n").unwrap();
            stream.write_all("{\"request\":\"status\"}\n".repeat(2_000).as_bytes()).unwrap();
            stream
        })
        .collect();
    for _ in 0..100 {
        router.assert_serves(&mut gcs, &mut vehicle);
    }
    assert_eq!(router.status().endpoints.len(), 2);
    router.assert_grown_less_than(4, before);
    drop(lazy);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_thousand_changes_under_traffic_cost_the_others_nothing() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=tcp", "udpin:127.0.0.1:0?name=udp"]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut client = router.client();
    let mut round = |n: u32| {
        let endpoint = format!("udpin:127.0.0.1:0?name=extra&max_peers={}", 1 + n % 9);
        client.ask(Request::EndpointAdd { endpoint: endpoint.clone() }).unwrap();
        let endpoint = endpoint + "&rate=ATTITUDE:4";
        client.ask(Request::EndpointChange { endpoint }).unwrap();
        client.ask(Request::EndpointRemove { name: "extra".into() }).unwrap();
    };
    round(0);
    let before = (router.process().descriptors(), router.process().resident_kib());
    let is_over = AtomicBool::new(false);
    let sent = thread::scope(|scope| {
        let traffic = scope.spawn(|| {
            let mut sent = 0;
            while !is_over.load(Ordering::Relaxed) {
                let frames: Vec<_> = (sent..sent + 50).map(|n| attitude(VEHICLE, n)).collect();
                vehicle.send(frames.concat());
                gcs.expect_each(&frames);
                sent += 50;
            }
            sent
        });
        (0..334).for_each(&mut round);
        is_over.store(true, Ordering::Relaxed);
        traffic.join().unwrap()
    });
    println!("1,002 changes while {sent} frames passed");
    assert_eq!(router.process().descriptors(), before.0);
    router.assert_grown_less_than(2, before.1);
}

#[test]
fn people_are_told_in_tables_and_without_a_daemon_what_to_do() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp"]);
    let _vehicle = router.udp("udp", VEHICLE);
    let told = router.ask(&["status"]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(told.status.success() && text.contains("listening"), "{text}");
    let json = router.ask(&["status", "--json"]);
    let snapshot: Snapshot = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(snapshot.endpoints[0].name, "udp");
    let added = router.ask(&["endpoint", "add", "udpin:127.0.0.1:0?name=more"]);
    assert!(added.status.success(), "{added:?}");
    let no_log = router.ask(&["endpoint", "add", "tlog:/nowhere/x.tlog"]);
    let text = String::from_utf8(no_log.stderr).unwrap();
    assert_eq!(no_log.status.code(), Some(1));
    assert!(text.contains("not added: cannot play back /nowhere/x.tlog: No such file"), "{text}");
    let level = router.ask(&["log-level", "debug"]);
    assert!(level.status.success(), "{level:?}");
    router.log.wait_for(&["log level: debug, by request"]);
    let refused = router.ask(&["endpoint", "remove", "nobody"]);
    let text = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(text.contains("there are: udp, more"), "{text}");
    let nobody = run(&["status", "--control", "/nowhere/control"]);
    let text = String::from_utf8(nobody.stderr).unwrap();
    assert_eq!(nobody.status.code(), Some(1));
    assert!(text.contains("/nowhere/control: No such file"), "{text}");
}
