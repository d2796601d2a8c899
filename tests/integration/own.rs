//! The router as a component: heard where it is wanted, answering, measuring, asking for telemetry.

use std::thread;
use std::time::{Duration, Instant};

use mavswitch::mavlink::{Frame, MessageId, Timing};
use mavswitch::status::EndpointStatus;

use crate::harness::*;

pub(super) const OWN: Component = Component::new(1, 191);
pub(super) const ALL: Component = Component::new(0, 0);
pub(super) const TIMESYNC: Message = Message { id: 111, extra: 34, len: 18 };
const PING: Message = Message { id: 4, extra: 237, len: 14 };
const REQUEST_DATA_STREAM: Message = Message { id: 66, extra: 148, len: 6 };

/// MAV_AUTOPILOT.
const ARDUPILOT: u8 = 3;
const PX4: u8 = 12;

fn is(frame: &[u8], message: Message) -> bool {
    Frame::parse(frame).unwrap().header().id == MessageId(message.id)
}

/// The next frame of a message.
fn next(peer: &mut Peer<impl Wire>, message: Message) -> Vec<u8> {
    loop {
        let frame = peer.receive();
        if is(&frame, message) {
            return frame;
        }
    }
}

/// The next TIMESYNC or PING that is an answer, as it is when `target` asked, and who gives it.
pub(super) fn next_answer(peer: &mut Peer<impl Wire>, asker: Component) -> (Component, Timing) {
    loop {
        let frame = peer.receive();
        match Timing::read(&Frame::parse(&frame).unwrap()) {
            Some(
                timing @ (Timing::Timesync { tc1: 1.., target, .. } | Timing::Ping { target, .. }),
            ) if target == asker => return (source_of(&frame), timing),
            _ => {}
        }
    }
}

pub(super) fn timesync(from: Component, tc1: i64, ts1: i64, to: Component) -> Vec<u8> {
    let mut payload = [tc1.to_le_bytes(), ts1.to_le_bytes()].concat();
    payload.extend([to.system, to.component]);
    Draft::new(from, TIMESYNC, payload).build()
}

fn ping(from: Component, time_us: u64, seq: u32, to: Component) -> Vec<u8> {
    let mut payload = time_us.to_le_bytes().to_vec();
    payload.extend(seq.to_le_bytes());
    payload.extend([to.system, to.component]);
    Draft::new(from, PING, payload).build()
}

/// HEARTBEAT of a vehicle; 2 is MAV_TYPE_QUADROTOR, 26 MAV_TYPE_GIMBAL.
fn heartbeat_of(from: Component, kind: u8, autopilot: u8) -> Vec<u8> {
    Draft::new(from, HEARTBEAT, [0, 0, 0, 0, kind, autopilot, 0, 3, 3]).build()
}

/// Who asks for which streams of whom, and how often: the next seven requests.
fn requests(peer: &mut Peer<impl Wire>) -> Vec<(Component, [u8; 6])> {
    let request = |frame: Vec<u8>| {
        let payload = Frame::parse(&frame).unwrap();
        let fields = [0, 1, 2, 3, 4, 5].map(|at| payload.payload_byte(at));
        (source_of(&frame), fields)
    };
    (0..7).map(|_| request(next(peer, REQUEST_DATA_STREAM))).collect()
}

/// What asks for all streams of a vehicle at 10 Hz.
fn all_streams(from: Component, of: Component) -> Vec<(Component, [u8; 6])> {
    let streams = [1, 2, 3, 6, 10, 11, 12];
    streams.map(|stream| (from, [10, 0, of.system, of.component, stream, 1])).to_vec()
}

#[test]
fn it_says_once_a_second_what_it_is_and_only_where_that_is_wanted() {
    let since = Instant::now();
    let router = Router::start(&[
        "--system=1",
        "tcpin:127.0.0.1:0?name=near",
        "tcpin:127.0.0.1:0?name=thin&own_component=false",
    ]);
    let mut near = router.tcp("near", GCS);
    let mut thin = router.tcp("thin", OTHER);
    let first = next(&mut near, HEARTBEAT);
    let frame = Frame::parse(&first).unwrap();
    assert_eq!((frame.header().source, first[0]), (OWN, 0xfd));
    // MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, no mode, MAV_STATE_ACTIVE.
    assert_eq!(frame.payload(), [0, 0, 0, 0, 18, 8, 0, 4, 3]);
    (0..3).for_each(|_| assert_eq!(source_of(&next(&mut near, HEARTBEAT)), OWN));
    // However late each was looked at: the fourth is sent three seconds after the first.
    assert!(since.elapsed().as_millis() > 2_900, "{:?}", since.elapsed());
    let at_thin = thin.receive_rest_from(&mut near);
    assert!(at_thin.is_empty(), "neither heartbeat nor question");
}

#[test]
fn a_timesync_or_ping_is_answered_and_all_else_ignored() {
    let router = Router::start(&[
        "--system=1",
        "--component=25",
        "tcpin:127.0.0.1:0?name=gcs",
        "tcpin:127.0.0.1:0?name=other&own_component=false",
    ]);
    let own = Component::new(1, 25);
    router.wait_until_seen(own);
    let mut gcs = router.tcp("gcs", GCS);
    let mut other = router.tcp("other", OTHER);
    gcs.send(timesync(GCS, 0, 77, own));
    let (from, answer) = next_answer(&mut gcs, GCS);
    assert!(from == own && matches!(answer, Timing::Timesync { ts1: 77, .. }), "{answer:?}");
    let broadcast = timesync(GCS, 0, 78, ALL);
    gcs.send(&broadcast);
    let (from, answer) = next_answer(&mut gcs, GCS);
    assert!(from == own && matches!(answer, Timing::Timesync { ts1: 78, .. }), "{answer:?}");
    let question = ping(GCS, 5, 6, ALL);
    gcs.send(&question);
    let (from, answer) = next_answer(&mut gcs, GCS);
    assert_eq!((from, answer), (own, Timing::Ping { time_us: 5, seq: 6, target: GCS }));
    // What is for it alone goes no further, and brings nothing about.
    gcs.send(command_long(GCS, own));
    gcs.send(ping(GCS, 5, 7, own));
    gcs.send(timesync(GCS, 9, 79, own));
    gcs.send(ping(GCS, 5, 8, ALL));
    loop {
        let frame = gcs.receive();
        let timing = Timing::read(&Frame::parse(&frame).unwrap());
        match timing {
            Some(Timing::Ping { seq: 8, target: GCS, .. }) => break,
            // What it asks of its own accord.
            Some(Timing::Timesync { tc1: 0, .. } | Timing::Ping { target: ALL, .. }) => {}
            _ => assert!(is(&frame, HEARTBEAT), "it answers {timing:?}"),
        }
    }
    // Where its heartbeat is not wanted, its answers are.
    other.send(ping(OTHER, 8, 9, ALL));
    let (from, answer) = next_answer(&mut other, OTHER);
    assert_eq!((from, answer), (own, Timing::Ping { time_us: 8, seq: 9, target: OTHER }));
}

#[test]
fn it_wakes_the_router_about_once_a_second() {
    let station = Peer::<UdpWire>::awaiting(GCS);
    let udpout = format!("udpout:{}", station.wire.address());
    let router = Router::start(&["--system=1", &udpout]);
    router.wait_until_seen(OWN);
    let process = router.process();
    let before = process.wakeups();
    thread::sleep(Duration::from_secs(4));
    let wakeups = process.wakeups() - before;
    assert!(wakeups <= 10, "{wakeups} wake-ups in 4 s");
}

#[test]
fn questions_for_all_reach_the_others_too() {
    let router = Router::start(&["--system=1", "tcpin:127.0.0.1:0?name=tcp&own_component=false"]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    let (first, second) = (timesync(GCS, 0, 5, ALL), ping(GCS, 5, 6, ALL));
    gcs.send_each(&[first.clone(), second.clone()]);
    other.expect_each(&[first, second]);
}

/// Answers questions by `answer` until the status has a round trip for this endpoint.
fn answer_until_measured(
    router: &Router,
    peer: &mut Peer<TcpWire>,
    name: &str,
    answer: impl Fn(Timing) -> Option<Vec<u8>>,
) -> EndpointStatus {
    let since = Instant::now();
    loop {
        assert!(since.elapsed() < PATIENCE, "nothing is measured");
        let frame = peer.receive();
        let answer = Timing::read(&Frame::parse(&frame).unwrap()).and_then(&answer);
        answer.into_iter().for_each(|answer| peer.send(answer));
        let endpoint = router.endpoint(name);
        if endpoint.links[0].round_trip_ms.is_some() {
            return endpoint;
        }
    }
}

#[test]
fn the_round_trip_of_a_link_is_measured_where_somebody_answers() {
    let router = Router::start(&[
        "--system=1",
        "tcpin:127.0.0.1:0?name=sync",
        "tcpin:127.0.0.1:0?name=ping",
        "tcpin:127.0.0.1:0?name=silent",
    ]);
    let mut sync = router.tcp("sync", VEHICLE);
    let mut pinged = router.tcp("ping", OTHER);
    let _silent = router.tcp("silent", GCS);
    let measured = answer_until_measured(&router, &mut sync, "sync", |timing| match timing {
        Timing::Timesync { tc1: 0, ts1, target } => {
            // It is asked by its own id, and by nobody else.
            assert_eq!(target, VEHICLE);
            Some(timesync(VEHICLE, 1_000, ts1, OWN))
        }
        _ => None,
    });
    let link = &measured.links[0];
    assert!(link.last_round_trip_ms.unwrap() < 60_000.0);
    assert_eq!(link.last_round_trip_ms, link.round_trip_ms);
    answer_until_measured(&router, &mut pinged, "ping", |timing| match timing {
        Timing::Ping { time_us, seq, target: ALL } => Some(ping(OTHER, time_us, seq, OWN)),
        _ => None,
    });
    let silent = router.endpoint("silent");
    assert_eq!(silent.links[0].round_trip_ms, None);
    let shown = router.told(&["status"]);
    assert!(shown.contains("ROUND TRIP") && shown.contains(") ms"), "{shown}");
}

#[test]
fn an_ardupilot_is_asked_for_telemetry_and_again_when_it_comes_back() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=fc&request_streams=10",
        "tcpin:127.0.0.1:0?name=gcs",
    ]);
    let mut gcs = router.tcp("gcs", GCS);
    let mut ardupilot = router.tcp_silent("fc", VEHICLE);
    let mut px4 = router.tcp_silent("fc", OTHER);
    let gimbal = Component::new(1, 154);
    px4.send(heartbeat_of(OTHER, 2, PX4));
    px4.send(heartbeat_of(gimbal, 26, ARDUPILOT));
    router.wait_until_seen(gimbal);
    ardupilot.send(heartbeat_of(VEHICLE, 2, ARDUPILOT));
    // As nobody, it speaks as the computer on board of the vehicle.
    let asked = all_streams(Component::new(VEHICLE.system, 191), VEHICLE);
    assert_eq!(requests(&mut ardupilot), asked);
    drop(ardupilot);
    router.wait_until_lost(VEHICLE);
    let mut ardupilot = router.tcp_silent("fc", VEHICLE);
    ardupilot.send(heartbeat_of(VEHICLE, 2, ARDUPILOT));
    assert_eq!(requests(&mut ardupilot), asked);
    // Nobody else was asked or has heard of it.
    let told = px4.receive_rest_from(&mut gcs);
    let told = [told, gcs.receive_rest_from(&mut px4)].concat();
    assert!(told.iter().all(|frame| !is(frame, REQUEST_DATA_STREAM)));
}

#[test]
fn a_vehicle_whose_clock_since_boot_runs_backwards_is_asked_again() {
    let router = Router::start(&["--system=7", "tcpin:127.0.0.1:0?name=fc&request_streams=10"]);
    let mut ardupilot = router.tcp_silent("fc", VEHICLE);
    let asked = all_streams(Component::new(7, 191), VEHICLE);
    let since = Instant::now();
    for boot_ms in [90_000_u32, 1_000] {
        let mut payload = vec![0; 8];
        payload.extend(boot_ms.to_le_bytes());
        // Not asked before its heartbeat has come, and so not before its time is known.
        ardupilot.send(Draft::new(VEHICLE, SYSTEM_TIME, payload).build());
        ardupilot.send(heartbeat_of(VEHICLE, 2, ARDUPILOT));
        assert_eq!(requests(&mut ardupilot), asked);
    }
    // In any case it would have been asked again after 30 s.
    assert!(since.elapsed().as_secs() < 25, "{:?}", since.elapsed());
}

#[test]
fn a_ground_station_that_may_not_ask_for_telemetry_is_told_apart_from_one_that_may() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=fc",
        "tcpin:127.0.0.1:0?name=may",
        "tcpin:127.0.0.1:0?name=blocked&block_stream_requests=true",
    ]);
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut may = router.tcp("may", GCS_2);
    let mut blocked = router.tcp("blocked", GCS);
    let request = |from: Component| {
        let payload = [4, 0, VEHICLE.system, VEHICLE.component, 10, 1];
        Draft::new(from, REQUEST_DATA_STREAM, payload).build()
    };
    // MAV_CMD_SET_MESSAGE_INTERVAL, which somebody waits for an answer to.
    let mut interval = vec![0; 28];
    interval.extend([0xff, 0x01, VEHICLE.system, VEHICLE.component]);
    let interval = Draft::new(GCS, COMMAND_LONG, interval).build();
    blocked.send_each(&[request(GCS), interval.clone()]);
    vehicle.expect(interval);
    may.send(request(GCS_2));
    vehicle.expect(request(GCS_2));
    let counted = router.endpoint("blocked").links[0].counters.refused.clone();
    assert_eq!(counted.get("stream_request"), Some(&1), "{counted:?}");
    let told = router.told(&["why", "255/190", "1/1", "REQUEST_DATA_STREAM"]);
    assert!(told.contains("not taken from blocked") && told.contains("request_streams"), "{told}");
}
