//! Who looks on, who records, and who changes what there is, each in a thread of its own, until the
//! run is over; then they are gone.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mavswitch::control::{Answer, ClientError, Request};
use mavswitch::mavlink::{Component, Key, Timestamp};

use crate::Clock;
use crate::harness::*;
use crate::scene::{PASSPHRASE, Scene};
use crate::trouble::goes_on;

/// All of them.
pub(crate) const ALL: [fn(&Scene, &Clock); 7] =
    [follower, listeners, sleepers, scrapers, operator, signer, recordings];

/// Somebody whose frames are signed.
const SIGNER: Component = Component::new(60, 190);

/// How long nobody waits for an answer in vain.
const SOON: Duration = Duration::from_millis(200);

/// A status client that takes each picture, and leaves in the middle of one.
fn follower(scene: &Scene, clock: &Clock) {
    while !clock.is_over() {
        let mut client = scene.router.client();
        let follow = Request::Follow { interval_ms: 100 };
        client.send(follow).expect("a daemon that reads");
        let mut pictures = 0;
        while pictures < 100 && !clock.is_over() {
            match client.receive(SOON).map(|line| line.map(|line| line.answer)) {
                Ok(Some(Answer::Status(_))) => pictures += 1,
                Ok(Some(Answer::Error(text))) if text.contains("connected already") => break,
                Ok(Some(other)) => panic!("{other:?}"),
                Ok(None) => {}
                // It was told so, and hung up on.
                Err(_) => break,
            }
        }
    }
}

/// Clients that see each frame, and leave again.
fn listeners(scene: &Scene, clock: &Clock) {
    while !clock.is_over() {
        let mut client = scene.router.client();
        client.send(Request::Listen { filter: String::new() }).expect("a daemon that reads");
        for _ in 0..500 {
            let _ = client.receive(SOON);
            if clock.is_over() {
                return;
            }
        }
    }
}

/// Clients that ask for everything and take nothing of it.
fn sleepers(scene: &Scene, clock: &Clock) {
    let requests = [r#"{"request":"follow","interval_ms":100}"#, r#"{"request":"listen"}"#];
    while !clock.is_over() {
        let asleep = requests.map(|request| {
            let mut stream = UnixStream::connect(scene.router.control()).expect("a daemon");
            writeln!(stream, "{request}").expect("a daemon that reads");
            stream
        });
        goes_on(clock, 5_000);
        drop(asleep);
    }
}

/// Prometheus, a browser, and somebody who never ends what he asks.
fn scrapers(scene: &Scene, clock: &Clock) {
    let address = scene.router.metrics();
    let mut slow: Option<TcpStream> = None;
    let mut round = 0_usize;
    while goes_on(clock, 100) {
        let path = ["/metrics", "/status.json", "/"][round % 3];
        let answer = get(address, path);
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{path}: {answer}");
        if round.is_multiple_of(20) {
            slow = TcpStream::connect(address).ok();
            let _ = slow.as_mut().map(|stream| stream.write_all(b"GET /met"));
        }
        round += 1;
    }
    drop(slow);
}

fn get(address: SocketAddr, path: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("a router that listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a time limit");
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("a router that reads");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer and its end");
    String::from_utf8_lossy(&answer).into_owned()
}

/// Adds, changes, switches and removes endpoints; a reload may have taken them away meanwhile.
fn operator(scene: &Scene, clock: &Clock) {
    let mut client = scene.router.client();
    let mut ask = |request| match client.ask(request) {
        Ok(_) | Err(ClientError::Refused(_)) => {}
        Err(error) => panic!("{error}"),
    };
    let name = || "guest".to_owned();
    while goes_on(clock, 100) {
        for endpoint in [
            "udpin:127.0.0.1:0?name=guest&allow_from=127.0.0.0/8",
            "tcpin:127.0.0.1:0?name=guest&sign=radio&verify=radio",
            "sim:?name=guest&system=70&count=3&rate=10",
        ] {
            ask(Request::EndpointAdd { endpoint: endpoint.to_owned() });
            ask(Request::EndpointChange { endpoint: format!("{endpoint}&max_rate=50") });
            goes_on(clock, 100);
            ask(Request::EndpointDisable { name: name() });
            ask(Request::EndpointEnable { name: name() });
            let (from, to) = ("60/190".to_owned(), "all".to_owned());
            ask(Request::Why { from, to, message: None, mavlink: None, signed: None });
            ask(Request::EndpointRemove { name: name() });
        }
    }
}

/// A ground station that signs, over UDP, from a new port now and then; what it is sent is signed.
fn signer(scene: &Scene, clock: &Clock) {
    let key = Key::from_passphrase(PASSPHRASE);
    let (mut last, mut heard) = (Timestamp::default(), 0_u64);
    while !clock.is_over() {
        let guarded = scene.router.address("guarded");
        let mut peer = Peer::new(UdpWire::to(guarded), SIGNER);
        // A stranger may have had the same port a moment ago, and is still sent to by another socket.
        peer.wire.socket.connect(guarded).expect("an address of its own");
        for number in 0..200 {
            // Somebody without the key is refused, before and after.
            peer.send(attitude(SIGNER, number));
            last = last.plus(1).max(now());
            peer.send(signed_by(&heartbeat(SIGNER), &key, last));
            while let Some(frame) = peer.try_receive(Duration::from_millis(1)) {
                assert!(key.has_signed(&frame), "{frame:02x?}");
                heard += 1;
            }
            if !goes_on(clock, 50) {
                break;
            }
        }
    }
    assert!(heard > 0, "nobody was heard over the guarded link");
}

fn now() -> Timestamp {
    Timestamp::from_unix(SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock"))
}

/// Holds that no more records are kept than are wanted; the one that is written may come on top.
fn recordings(scene: &Scene, clock: &Clock) {
    while goes_on(clock, 500) {
        let records = scene.records();
        assert!(records <= crate::scene::MAX_RECORDS + 1, "{records} records");
    }
    assert!(scene.records() > 0, "nothing was recorded");
}
