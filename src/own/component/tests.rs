//! What the component says, and to whom.

use super::*;
use crate::mavlink::{FrameSpec, Version, encode};

const OWN: Component = Component::new(1, 191);
const GCS: Component = Component::new(255, 190);
const NOW: Time = Time::from_millis(5_000);

fn own() -> OwnComponent {
    OwnComponent::new(Some(OWN))
}

fn tell(own: &mut OwnComponent, from: Component, payload: Payload, now: Time) {
    let mut bytes = Vec::new();
    payload.encode(from, 0, &mut bytes);
    own.handle_frame(&Frame::parse(&bytes).unwrap(), now);
}

/// What it says to whomever routes lead, each with its sequence number.
fn said(own: &mut OwnComponent) -> Vec<(u8, Vec<u8>)> {
    let mut frames = Vec::new();
    let mut bytes = Vec::new();
    while own.poll_transmit(NOW, &mut bytes) {
        let frame = Frame::parse(&bytes).unwrap();
        assert_eq!(frame.header().source, OWN);
        frames.push((frame.header().seq, bytes.split_off(0)));
    }
    frames
}

fn answers(own: &mut OwnComponent) -> Vec<Timing> {
    let frames = said(own);
    frames.iter().map(|(_, it)| Timing::read(&Frame::parse(it).unwrap()).unwrap()).collect()
}

#[test]
fn each_second_it_says_what_it_is() {
    let mut own = own();
    own.begin_second();
    own.begin_second();
    let frames = said(&mut own);
    assert_eq!(frames.iter().map(|(seq, _)| *seq).collect::<Vec<_>>(), [0, 1]);
    let frame = Frame::parse(&frames[0].1).unwrap();
    assert_eq!(frame.header().id, MessageId::HEARTBEAT);
    assert_eq!(frame.payload(), [0, 0, 0, 0, 18, 8, 0, 4, 3]);
}

#[test]
fn it_answers_a_timesync_for_it_for_its_system_and_for_all() {
    let mut own = own();
    for target in [(0, 0), (1, 0), (1, 191), (1, 1), (2, 0), (2, 191)] {
        let target = Component::new(target.0, target.1);
        tell(&mut own, GCS, Timing::timesync(0, i64::from(target.component), target), NOW);
    }
    let nanos = 5_000_000_000;
    let answer = |ts1| Timing::Timesync { tc1: nanos, ts1, target: GCS };
    assert_eq!(answers(&mut own), [answer(0), answer(0), answer(191)]);
}

#[test]
fn an_answer_is_never_a_question() {
    let mut own = own();
    tell(&mut own, GCS, Timing::timesync(0, 5, Component::new(0, 0)), Time::ZERO);
    assert_eq!(answers(&mut own), [Timing::Timesync { tc1: 1, ts1: 5, target: GCS }]);
    tell(&mut own, GCS, Timing::timesync(9, 5, OWN), NOW);
    tell(&mut own, GCS, Timing::timesync(9, 5, Component::new(0, 0)), NOW);
    tell(&mut own, GCS, Timing::ping(9, 5, OWN), NOW);
    tell(&mut own, GCS, Timing::ping(9, 5, Component::new(1, 0)), NOW);
    // What came back to it of its own, and what comes from nobody: an answer would be for everybody.
    tell(&mut own, OWN, Timing::ping(9, 5, Component::new(0, 0)), NOW);
    tell(&mut own, Component::new(0, 0), Timing::ping(9, 5, Component::new(0, 0)), NOW);
    assert_eq!(answers(&mut own), []);
}

#[test]
fn it_answers_a_ping_for_everybody_with_what_it_brought() {
    let mut own = own();
    tell(&mut own, GCS, Timing::ping(7, 8, Component::new(0, 0)), NOW);
    assert_eq!(answers(&mut own), [Timing::Ping { time_us: 7, seq: 8, target: GCS }]);
}

#[test]
fn a_flood_of_questions_gets_so_many_answers_and_no_more() {
    let mut own = own();
    (0..1_000).for_each(|seq| tell(&mut own, GCS, Timing::ping(7, seq, EVERYBODY), NOW));
    assert_eq!(said(&mut own).len(), MAX_REPLIES);
}

#[test]
fn another_definition_with_the_same_number_asks_nothing() {
    let mut own = own();
    // FILE_TRANSFER_DIR_LIST of old.
    let spec = FrameSpec {
        version: Version::V1,
        seq: 0,
        source: GCS,
        id: MessageId(111),
        crc_extra: 93,
        payload: &[0; 249],
        signature: None,
    };
    let mut bytes = Vec::new();
    encode(&spec, &mut bytes);
    own.handle_frame(&Frame::parse(&bytes).unwrap(), NOW);
    assert_eq!(answers(&mut own), []);
}

#[test]
fn it_asks_the_link_and_knows_how_long_the_answer_took() {
    let mut own = own();
    let place = Place { link: LinkId::new(3).unwrap(), since: Time::ZERO };
    let fc = Component::new(1, 1);
    own.measure(place, fc, NOW);
    let mut bytes = Vec::new();
    assert_eq!(own.poll_single(&mut bytes), Some((place.link, fc)));
    let asked = Timing::read(&Frame::parse(&bytes).unwrap());
    let Some(Timing::Timesync { tc1: 0, ts1, target }) = asked else { panic!("{asked:?}") };
    assert_eq!(target, fc);
    // That of somebody else, and its own.
    tell(&mut own, fc, Timing::timesync(9, ts1, Component::new(1, 192)), Time::from_millis(5_005));
    assert_eq!(own.round_trip(place), None);
    tell(&mut own, fc, Timing::timesync(9, ts1, OWN), Time::from_millis(5_012));
    assert_eq!(own.round_trip(place).unwrap().last.as_millis(), 12);
    own.end_second(|_| false);
    assert_eq!(own.round_trip(place), None);
}

#[test]
fn who_is_nobody_asks_for_streams_as_the_computer_of_the_vehicle() {
    let place = Place { link: LinkId::new(3).unwrap(), since: Time::ZERO };
    let vehicle = Vehicle { place, component: Component::new(7, 1), boot_ms: None };
    for (id, source) in [(None, Component::new(7, 191)), (Some(OWN), OWN)] {
        let mut own = OwnComponent::new(id);
        own.begin_second();
        own.measure(place, vehicle.component, NOW);
        assert!(own.ask_for_streams(&vehicle, 10, NOW));
        let (mut bytes, mut streams) = (Vec::new(), Vec::new());
        while own.poll_single(&mut bytes).is_some() {
            let frame = Frame::parse(&bytes).unwrap();
            assert_eq!(frame.header().source, source);
            if frame.header().id == MessageId(66) {
                let [rate, system, component, stream, start] =
                    [0, 2, 3, 4, 5].map(|at| frame.payload_byte(at));
                assert_eq!((rate, system, component, start), (10, 7, 1, 1));
                streams.push(stream);
            }
            bytes.clear();
        }
        assert_eq!(streams, [1, 2, 3, 6, 10, 11, 12]);
        assert_eq!(own.poll_transmit(NOW, &mut bytes), id.is_some());
    }
}
