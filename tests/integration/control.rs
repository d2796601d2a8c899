//! The control socket: who asks is answered, and whoever asks wrongly harms nobody.

use std::fs;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;

use mavswitch::control::{Client, ClientError, MAX_REQUEST, Request};
use mavswitch::status::EndpointState;
use rustix::process::Signal;

use crate::harness::*;

fn client(router: &Router) -> Client {
    Client::connect(Some(&router.control())).expect("a daemon that answers")
}

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
    let snapshot = client(&router).status().unwrap();
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
    assert_eq!(client(&router).status().unwrap().endpoints.len(), 1);
}

#[test]
fn there_is_room_for_so_many_clients_and_again_when_they_go() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp"]);
    let mut clients: Vec<Client> = (0..8).map(|_| client(&router)).collect();
    for client in &mut clients {
        client.status().unwrap();
    }
    let text = answers(raw(&router));
    assert!(text.contains("8 clients are connected already"), "{text}");
    clients.clear();
    eventually("a place for a client", || client(&router).status().is_ok());
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
    let mut client = client(&router);
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
    assert!(ask(add(&taken)).contains("another program is there"));
    assert!(ask(Request::EndpointRemove { name: "nobody".into() }).contains("udp, tcp"));
    assert_eq!(ask(Request::EndpointDisable { name: "tcp".into() }), "");
    gcs.receive_to_end();
    assert_eq!(ask(Request::EndpointEnable { name: "tcp".into() }), "");
    assert_eq!(ask(Request::EndpointRemove { name: "tcp".into() }), "");
    let names = client.status().unwrap().endpoints.into_iter().map(|it| it.name);
    assert_eq!(names.collect::<Vec<_>>(), ["udp"]);
}
