//! Servers that ask for a key, and links that go in an order of their own.

use std::fs::File;
use std::io::Write;
use std::net::{SocketAddr, TcpStream};
use std::time::{SystemTime, UNIX_EPOCH};

use super::*;
use crate::config::{EndpointConfig, General};
use crate::daemon::endpoint::State;
use crate::daemon::links::Output;
use crate::daemon::settings::settle;
use crate::daemon::stage::{self, until};
use crate::link::Stream;
use crate::mavlink::{
    CheckedFrame, Component, Dialect, FrameBuffer, FrameSpec, Header, Key, MessageId, Timestamp,
};

/// A daemon with this endpoint, open.
fn daemon(endpoint: EndpointConfig) -> Daemon {
    let mut daemon = stage::daemon(General::default(), vec![endpoint]);
    daemon.open_all().unwrap();
    daemon
}

/// A server where the key of this passphrase has to be shown.
fn guarded(passphrase: &str) -> EndpointConfig {
    let mut config: EndpointConfig =
        "tcpin:127.0.0.1:0?name=guarded&max_peers=2&verify=radio".parse().unwrap();
    config.options.verify.as_mut().unwrap().key = Some(Key::from_passphrase(passphrase));
    config
}

/// A heartbeat of 255/190, signed.
fn signed(passphrase: &str) -> Vec<u8> {
    let payload = [0, 0, 0, 0, 6, 8, 0, 4, 3];
    let source = Component::new(255, 190);
    let bytes = FrameSpec::new(source, MessageId::HEARTBEAT, 50, &payload).to_frame();
    let header = Header::parse(&bytes).unwrap();
    let frame = CheckedFrame { bytes: &bytes, header, target: header.source, verified: true };
    let at = Timestamp::from_unix(SystemTime::now().duration_since(UNIX_EPOCH).unwrap());
    let mut buffer = FrameBuffer::default();
    buffer.sign(&frame, &Key::from_passphrase(passphrase), 1, at).unwrap().bytes.to_vec()
}

fn address(daemon: &Daemon) -> SocketAddr {
    let State::Listening(listener, _) = &daemon.io.endpoints.iter().next().unwrap().state else {
        panic!("it does not listen");
    };
    listener.local_addr().unwrap()
}

/// How many links the server counts, and how many there are.
fn links(daemon: &Daemon) -> (usize, usize) {
    let index = daemon.io.endpoints.ids()[0];
    let State::Listening(_, count) = &daemon.io.endpoints[index].state else {
        panic!("it does not listen");
    };
    (*count, daemon.links_of(index).len())
}

/// Somebody who has connected and has a link now.
fn connect(daemon: &mut Daemon) -> (TcpStream, String) {
    let stream = TcpStream::connect(address(daemon)).unwrap();
    let name = stream.local_addr().unwrap().to_string();
    until(daemon, "a link", |daemon| has(daemon, &name));
    (stream, name)
}

fn is_proven(daemon: &Daemon, link: LinkId) -> bool {
    daemon.router.port(link).is_some() && !daemon.router.awaits_proof(link)
}

fn has(daemon: &Daemon, peer: &str) -> bool {
    let index = daemon.io.endpoints.ids()[0];
    let links = daemon.links_of(index);
    links.iter().any(|id| daemon.io.links.get(*id).is_some_and(|link| link.peer == peer))
}

#[test]
fn who_does_not_show_the_key_is_replaced_by_the_next_and_closed_after_a_while() {
    let mut daemon = daemon(guarded("right"));
    let (mut holder, name) = connect(&mut daemon);
    holder.write_all(&signed("right")).unwrap();
    let first = daemon.links_of(daemon.io.endpoints.ids()[0])[0];
    until(&mut daemon, "a proof", |daemon| is_proven(daemon, first));
    // It is full with these, and all who come after them find a place all the same.
    let strangers: Vec<_> = (0..4).map(|_| connect(&mut daemon)).collect();
    assert_eq!(links(&daemon), (2, 2));
    assert!(has(&daemon, &name) && has(&daemon, &strangers[3].1), "the oldest stranger goes");
    daemon.now = daemon.clock() + PROOF;
    daemon.handle_timers();
    assert_eq!(links(&daemon), (1, 1));
    assert!(has(&daemon, &name), "who has shown the key stays");
    let index = daemon.io.endpoints.ids()[0];
    let refused = daemon.io.endpoints[index].refusals.by_name();
    assert_eq!(refused.get("unbelieved"), Some(&4), "{refused:?}");
}

#[test]
fn who_has_a_link_when_a_key_is_first_asked_for_has_to_show_it_too() {
    let mut open = guarded("right");
    open.options.verify = None;
    let mut daemon = daemon(open);
    let _stranger = connect(&mut daemon);
    daemon.now = daemon.clock() + PROOF;
    daemon.handle_timers();
    assert_eq!(links(&daemon), (1, 1), "nobody has asked for a key");
    let index = daemon.io.endpoints.ids()[0];
    let port = address(&daemon).port();
    let mut config = guarded("right");
    config.address = daemon.io.endpoints[index].config.address.clone();
    let settings = settle(vec![config], &Dialect::builtin()).unwrap().remove(0);
    daemon.change_endpoint(index, settings);
    assert_eq!((links(&daemon), address(&daemon).port()), ((1, 1), port));
    daemon.now = daemon.now + PROOF;
    daemon.handle_timers();
    assert_eq!(links(&daemon), (0, 0));
}

#[test]
fn what_was_heard_by_a_key_is_known_as_long_as_that_is_configured_and_no_longer() {
    let mut daemon = daemon(guarded("old"));
    let (mut holder, _) = connect(&mut daemon);
    let bytes = signed("old");
    holder.write_all(&bytes).unwrap();
    let index = daemon.io.endpoints.ids()[0];
    let first = daemon.links_of(index)[0];
    until(&mut daemon, "a proof", |daemon| is_proven(daemon, first));
    drop(holder);
    until(&mut daemon, "an end", |daemon| links(daemon) == (0, 0));
    let gate = daemon.io.endpoints[index].gate.clone();
    let header = Header::parse(&bytes).unwrap();
    let frame = CheckedFrame { bytes: &bytes, header, target: header.source, verified: true };
    let is_new =
        |daemon: &Daemon| daemon.router.would_let_in(&gate, None, &frame, daemon.now).is_ok();
    let configure = |daemon: &mut Daemon, passphrase| {
        daemon.change_all(settle(vec![guarded(passphrase)], &Dialect::builtin()).unwrap())
    };
    configure(&mut daemon, "old");
    assert!(!is_new(&daemon), "also with no link at all, it came before");
    configure(&mut daemon, "new");
    assert!(is_new(&daemon), "the old key is gone, and all that was heard by it");
}

#[test]
fn what_closes_a_link_that_is_broken_already_does_not_close_the_next_of_its_number() {
    let mut daemon = daemon("tcpin:127.0.0.1:0".parse().unwrap());
    let index = daemon.io.endpoints.ids()[0];
    let socket = || Output::Datagrams("127.0.0.1:9".parse().unwrap());
    let first = daemon.add_link(index, "first".into(), socket()).unwrap();
    daemon.close_later(first, "it broke");
    daemon.close_link(first, "it takes nothing any more");
    let second = daemon.add_link(index, "second".into(), socket()).unwrap();
    assert_eq!(first, second);
    daemon.close_broken();
    assert_eq!(links(&daemon), (1, 1));
}

#[test]
fn a_connection_that_cannot_be_watched_takes_no_place_and_frees_none() {
    let mut daemon = daemon("tcpin:127.0.0.1:0".parse().unwrap());
    let _peer = connect(&mut daemon);
    let index = daemon.io.endpoints.ids()[0];
    // The system watches no such file.
    let file = Stream::Serial(File::open("/dev/null").unwrap());
    daemon.add_stream(index, "unwatched".into(), file).unwrap_err();
    assert_eq!(links(&daemon), (1, 1));
}
