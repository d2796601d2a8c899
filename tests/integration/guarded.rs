//! Servers that ask for signatures: who has to show the key, and what others are sent until then.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mavswitch::control::Request;
use mavswitch::mavlink::{Key, Timestamp};
use mavswitch::status::LinkStatus;

use crate::harness::*;

const PASSPHRASE: &str = "the key of this vehicle";

/// A frame as somebody with the key sends it, the `n`th of this test.
fn signed(frame: &[u8], n: u64) -> Vec<u8> {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock");
    let at = Timestamp::from_unix(since_1970).plus(n);
    signed_by(frame, &Key::from_passphrase(PASSPHRASE), at)
}

/// A router with a guarded server and an open one.
struct Scene {
    router: Router,
    _dir: TempDir,
}

impl Scene {
    fn start(guarded: &str) -> Self {
        let dir = TempDir::new();
        let key = dir.key_file("radio", PASSPHRASE);
        let guarded = format!("{guarded}?name=guarded&verify=radio");
        let arguments = ["--key", &key, &guarded, "udpin:127.0.0.1:0?name=open"];
        let router = Router::launch_in(&arguments, |command| {
            command.env("STATE_DIRECTORY", dir.path(""));
        });
        router.log.wait_for(&["ready"]);
        Self { router, _dir: dir }
    }

    /// The links of the guarded server.
    fn links(&self) -> Vec<LinkStatus> {
        self.router.endpoint("guarded").links
    }

    fn why(&self, arguments: &[&str]) -> String {
        self.router.told(&[&["why"], arguments].concat())
    }
}

#[test]
fn whoever_connects_is_sent_nothing_before_it_has_shown_the_key() {
    let scene = Scene::start("tcpin:127.0.0.1:0");
    let mut vehicle = scene.router.udp("open", VEHICLE);
    let mut stranger = scene.router.tcp_silent("guarded", OTHER);
    let mut gcs = scene.router.tcp_silent("guarded", GCS);
    stranger.send(heartbeat(OTHER));
    scene.router.log.wait_for(&["frames from 2/1 on guarded", "refused: not signed"]);
    let hello = signed(&heartbeat(GCS), 1);
    gcs.send(&hello);
    vehicle.expect(&hello);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));

    let links = scene.links();
    let sent: Vec<u64> = links.iter().map(|link| link.counters.frames_out).collect();
    let unproven = links[0].counters.refused.get("unproven").copied();
    assert_eq!((&sent[..], unproven), (&[0, 1][..], Some(2)), "{links:?}");
    assert_eq!(stranger.try_receive(Duration::from_millis(50)), None);
    let said = scene.why(&["1/1", "all", "ATTITUDE"]);
    assert!(said.contains("has sent nothing yet that is signed with the key"), "{said}");
}

#[test]
fn a_stranger_is_let_in_by_what_is_signed_in_its_datagram_and_only_that_is_heard() {
    let scene = Scene::start("udpin:127.0.0.1:0");
    let mut vehicle = scene.router.udp("open", VEHICLE);
    let mut gcs = Peer::new(UdpWire::to(scene.router.address("guarded")), GCS);
    let (unsigned, good) = (heartbeat(OTHER), signed(&heartbeat(GCS), 1));
    let late = [signed(&attitude(GCS, 1), 2), attitude(OTHER, 2), signed(&attitude(GCS, 3), 3)];
    gcs.send([unsigned, good.clone(), late.concat()].concat());
    vehicle.expect_each(&[good, late[0].clone(), late[2].clone()]);
    vehicle.send(command_long(VEHICLE, GCS));
    gcs.expect(command_long(VEHICLE, GCS));
    assert!(!scene.router.log.has(&["component 2/1 seen"]));
    assert_eq!(scene.links()[0].counters.refused["unsigned"], 1, "the one behind the good one");
}

#[test]
fn an_endpoint_that_is_added_later_has_the_keys_that_no_other_uses() {
    let dir = TempDir::new();
    let key = dir.key_file("radio", PASSPHRASE);
    let router = Router::start(&["--key", &key, "udpin:127.0.0.1:0?name=open"]);
    let mut vehicle = router.udp("open", VEHICLE);
    let mut client = router.client();
    let endpoint = "tcpin:127.0.0.1:0?name=later&verify=radio&sign=radio".to_owned();
    client.ask(Request::EndpointAdd { endpoint }).expect("an endpoint more");
    let mut gcs = router.tcp_silent("later", GCS);
    let hello = signed(&heartbeat(GCS), 1);
    gcs.send(&hello);
    vehicle.expect(&hello);
    vehicle.send(attitude(VEHICLE, 1));
    assert!(Key::from_passphrase(PASSPHRASE).has_signed(&gcs.receive()));
}

#[test]
fn why_says_what_hangs_on_a_signature() {
    let scene = Scene::start("tcpin:127.0.0.1:0");
    let mut vehicle = scene.router.udp("open", VEHICLE);
    let mut gcs = scene.router.tcp_silent("guarded", GCS);
    let hello = signed(&heartbeat(GCS), 1);
    gcs.send(&hello);
    vehicle.expect(&hello);
    let said = scene.why(&["255/190", "1/1", "COMMAND_LONG"]);
    assert!(said.contains("to open (") && said.contains("if its signature is good"), "{said}");
    let said = scene.why(&["255/190", "1/1", "COMMAND_LONG", "--signed", "false"]);
    assert!(said.contains("not taken from guarded") && said.contains("is not signed"), "{said}");
    let said = scene.why(&["255/190", "1/1", "COMMAND_LONG", "--mavlink", "1"]);
    assert!(said.contains("is not signed"), "MAVLink 1 cannot be: {said}");
    let said = scene.why(&["255/190", "all", "RADIO_STATUS", "--signed", "false"]);
    assert!(said.contains("to open ("), "it may come without: {said}");
}
