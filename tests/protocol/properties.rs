//! What must be true of whatever a gate makes of a frame: of every message that there is, in every
//! layout, with any payload.

use std::sync::Arc;

use crate::frames::{Random, Receiver, Taken, frame};
use crate::network::*;
use mavswitch::mavlink::{
    CheckedFrame, Component, Definition, Dialect, FrameBuffer, Input, Key, MessageId, Recipes,
    Streams, SystemMap, Target, Timestamp, Version, trimmed,
};
use mavswitch::routing::{
    DropReason, GateOptions, LinkOptions, OldFrames, RouterOptions, Sign, SigningClock, Verify,
};

/// Units of 10 µs since 2015.
const NOW: Timestamp = Timestamp::new(37_000_000_000_000);

fn key() -> Key {
    Key::from_passphrase("the key of this vehicle")
}

/// A payload of any bytes and of any length that the message may have; MAVLink 1 has one length.
fn payload(definition: &Definition, version: Version, random: &mut Random) -> Vec<u8> {
    let (base, most) = (definition.base_len.min(255), definition.max_len.min(255));
    let mut payload = random.bytes(usize::from(if version == Version::V1 { base } else { most }));
    // Often there are zeros at the end, which MAVLink 2 may cut off or not.
    let zeros = random.below(payload.len() + 1) * random.below(2);
    let end = payload.len() - zeros;
    payload[end..].fill(0);
    let is_cut = version == Version::V2 && random.below(2) == 0;
    if is_cut { trimmed(&payload).to_vec() } else { payload }
}

/// Each message in each version that it has, so often.
fn every_frame(times: usize, mut check: impl FnMut(&Definition, &[u8], &Taken, &mut Random)) {
    let (mut random, dialect) = (Random::new(77), Dialect::builtin());
    for definition in dialect.definitions() {
        for time in 0..times * 2 {
            let version = if time % 2 == 0 { Version::V2 } else { Version::V1 };
            if version == Version::V1 && definition.id.0 > 255 {
                continue;
            }
            let payload = payload(definition, version, &mut random);
            let source = Component::new(1 + random.below(5) as u8, 1 + random.below(3) as u8);
            let key = (definition.id.0, definition.crc_extra);
            let bytes = frame(version, random.byte(), source, key, &payload);
            let taken = Receiver::new().receive(&bytes, Input::Paused).remove(0);
            assert_eq!(taken.bytes, bytes, "{definition:?}");
            check(definition, &payload, &taken, &mut random);
        }
    }
}

fn view(taken: &Taken) -> CheckedFrame<'_> {
    let Taken { bytes, header, target, verified } = taken;
    CheckedFrame { bytes, header: *header, target: *target, verified: *verified }
}

#[test]
fn ids_there_and_back_are_the_same_frame_and_nothing_else_of_it_changes() {
    let recipes = Recipes::new(&Dialect::builtin());
    let (mut changed, mut targets) = (0, 0);
    every_frame(4, |definition, payload, taken, random| {
        let other = 6 + random.below(250) as u8;
        let pairs =
            [(taken.header.source.system, other), (taken.target.system, other.wrapping_add(1))];
        let pairs = pairs.into_iter().take(1 + random.below(2));
        let Some(map) = SystemMap::new(&pairs.collect::<Vec<_>>()) else { return };
        let (mut there, mut back) = <(FrameBuffer, FrameBuffer)>::default();
        let before = view(taken);
        let new = there.remap(&before, &map, recipes.target_at(&before)).unwrap();
        let read = Receiver::new().receive(new.bytes, Input::Paused).remove(0);
        assert_eq!((read.header, read.target), (new.header, new.target), "{definition:?}");
        assert_eq!(read.header.source.system, map.apply(taken.header.source.system));
        assert_eq!(read.target.system, map.apply(taken.target.system), "{definition:?}");
        // In the payload, the target alone is another.
        let from = new.bytes.len() - payload.len() - 2;
        let others: Vec<usize> =
            (0..payload.len()).filter(|at| new.bytes[from + at] != payload[*at]).collect();
        match definition.target {
            Target::None => assert!(others.is_empty(), "{definition:?}"),
            Target::System(at) | Target::SystemComponent(at, _) => {
                assert!(others.iter().all(|other| *other == usize::from(at)), "{definition:?}");
                targets += others.len();
            }
        }
        let old = back.remap(&new, &map, recipes.target_at(&new)).unwrap();
        assert_eq!(old, before, "{definition:?}");
        changed += 1;
    });
    assert!(changed > 2_000 && targets > 100, "{changed} frames, {targets} targets");
}

#[test]
fn an_extension_is_all_that_is_lost_on_the_way_to_mavlink_1_and_back() {
    let recipes = Recipes::new(&Dialect::builtin());
    let mut converted = 0;
    every_frame(3, |definition, payload, taken, _| {
        let before = view(taken);
        let (mut old, mut new) = <(FrameBuffer, FrameBuffer)>::default();
        let base_len = recipes.base_len(&before);
        let Some(made) = base_len.and_then(|len| old.downgrade(&before, len)) else {
            let is_old = taken.header.version == Version::V1;
            return assert!(is_old || definition.id.0 > 255 || definition.base_len > 255);
        };
        let read = Receiver::new().receive(made.bytes, Input::Paused).remove(0);
        assert_eq!((read.header, read.header.version), (made.header, Version::V1));
        // COMMAND_ACK names its target in an extension: in MAVLink 1 it is for everybody.
        let is_kept = match definition.target {
            Target::None => true,
            Target::System(at) | Target::SystemComponent(at, _) => {
                u16::from(at) < definition.base_len
            }
        };
        let expected = if is_kept { made.target } else { Component::new(0, 0) };
        assert_eq!(read.target, expected, "{definition:?}");
        let again = new.upgrade(&made).unwrap();
        let kept = payload.len().min(usize::from(definition.base_len));
        let mut base = payload[..kept].to_vec();
        base.resize(usize::from(definition.base_len), 0);
        let expected = frame(
            Version::V2,
            taken.header.seq,
            taken.header.source,
            (definition.id.0, definition.crc_extra),
            trimmed(&base),
        );
        assert_eq!(again.bytes, expected, "{definition:?}");
        converted += 1;
    });
    assert!(converted > 300, "only {converted}");
}

#[test]
fn what_one_gateway_signs_the_other_believes_and_hands_out_as_it_was() {
    let sign = Some(Sign { key: key(), v1: OldFrames::Upgrade });
    let verify =
        Some(Verify { key: key(), allow_unsigned: vec![], strip: true, before_sending: false });
    let gate = GateOptions { sign, verify, ..GateOptions::default() };
    let mut ends = [0; 2].map(|_| Network::new(RouterOptions::default()));
    let [air, wire] = [0; 2].map(|_| LinkOptions::default());
    let air = LinkOptions { gate, ..air };
    let links = ends.each_mut().map(|end| {
        *end.router.signing_clock_mut() = SigningClock::new(NOW, NOW, end.now);
        (end.link_with(air.clone()), end.link_with(wire.clone()))
    });
    let [near, far] = &mut ends;
    let mut streams = Streams::default();
    let mut signed = 0;
    every_frame(2, |definition, payload, taken, _| {
        // What is for somebody unknown goes nowhere, and that key is nobody's to see.
        if taken.target.system != 0 || taken.header.id == MessageId::SETUP_SIGNING {
            return;
        }
        near.pass(6);
        far.pass(6);
        near.receive(links[0].1, &taken.bytes);
        let on_air = near.sent(links[0].0);
        Receiver::new().each(&on_air, Input::Paused, |frame| {
            assert!(streams.accept(frame, &key(), NOW).is_ok(), "{definition:?}");
        });
        far.receive(links[1].0, &on_air);
        let arrived = far.sent(links[1].1);
        if taken.header.version == Version::V2 {
            assert_eq!(arrived, taken.bytes, "{definition:?}");
        } else {
            let id = (definition.id.0, definition.crc_extra);
            let (seq, source) = (taken.header.seq, taken.header.source);
            let upgraded = frame(Version::V2, seq, source, id, trimmed(payload));
            assert_eq!(arrived, upgraded, "{definition:?}");
        }
        signed += 1;
    });
    assert!(signed > 1_000, "only {signed}");
    let refused = DropReason::ALL.into_iter().filter(|reason| reason.is_refusal());
    let counters = far.counters(links[1].0);
    assert_eq!(refused.map(|reason| counters[reason]).sum::<u64>(), 0);
}

/// Gates that ask for all there is, in one way and in the other.
fn gates() -> Vec<GateOptions> {
    let recipes = Some(Arc::new(Recipes::new(&Dialect::builtin())));
    let remap = || SystemMap::new(&[(1, 7), (2, 200)]).map(Arc::new);
    let verify = |strip| {
        let allow_unsigned = vec![MessageId::RADIO_STATUS];
        Some(Verify { key: key(), allow_unsigned, strip, before_sending: strip })
    };
    let sign = |v1| Some(Sign { key: key(), v1 });
    let plain = GateOptions { recipes, ..GateOptions::default() };
    vec![
        plain.clone(),
        GateOptions { sign: sign(OldFrames::Drop), version: Some(Version::V2), ..plain.clone() },
        GateOptions { remap: remap(), version: Some(Version::V1), ..plain.clone() },
        GateOptions { verify: verify(true), remap: remap(), ..plain.clone() },
        GateOptions { verify: verify(false), sign: sign(OldFrames::Upgrade), ..plain.clone() },
        GateOptions {
            remap: remap(),
            sign: sign(OldFrames::Pass),
            version: Some(Version::V1),
            passes_unconverted: true,
            max_rate: Some(1_000),
            ..plain
        },
    ]
}

#[test]
fn whatever_comes_through_gates_of_all_kinds_only_whole_frames_leave() {
    let mut network = Network::new(RouterOptions::default());
    let links: Vec<_> = gates()
        .into_iter()
        .map(|gate| network.link_with(LinkOptions { gate, ..LinkOptions::default() }))
        .collect();
    let mut left = 0;
    every_frame(2, |_, _, taken, random| {
        let mut bytes = taken.bytes.clone();
        let unsigned = view(taken);
        let mut buffer = FrameBuffer::default();
        match random.below(6) {
            0 => {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 + random.byte() % 255;
            }
            1 => bytes.truncate(random.below(bytes.len())),
            2 => bytes = random.bytes(300),
            3 if taken.header.version == Version::V2 => {
                let key = if random.below(2) == 0 { key() } else { Key::from_passphrase("no") };
                let at = Timestamp::new(random.next() >> 16);
                bytes = buffer.sign(&unsigned, &key, random.byte(), at).unwrap().bytes.to_vec();
            }
            _ => {}
        }
        network.receive(links[random.below(links.len())], &bytes);
        for link in &links {
            let sent = network.sent(*link);
            let whole = Receiver::new().receive_all(&sent);
            assert_eq!(whole.concat(), sent, "only whole frames");
            left += whole.len();
        }
        network.delivered();
    });
    assert!(left > 1_000, "only {left}");
}
