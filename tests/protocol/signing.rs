//! Signatures at the gate of a link: who is believed, what teaches nothing, what leaves signed.

use crate::frames::{Random, Receiver, frame, telemetry};
use crate::network::*;
use mavswitch::mavlink::{
    CheckedFrame, Component, FrameBuffer, Input, Key, MessageId, Refusal, Streams, Timestamp,
    Version,
};
use mavswitch::routing::{
    DropReason, GateOptions, LinkId, LinkOptions, OldFrames, RouterEvent, RouterOptions, Sign,
    SigningClock, Time, Verify,
};
use std::time::Duration;

pub(crate) const NOW: Timestamp = Timestamp::new(37_000_000_000_000);
/// 60 s, as timestamps count.
const MINUTE: u64 = 6_000_000;
const RADIO: Component = Component::new(51, 68);

pub(crate) fn key() -> Key {
    Key::from_passphrase("the key of this vehicle")
}

pub(crate) fn verify(strip: bool) -> GateOptions {
    let allow_unsigned = vec![MessageId::RADIO_STATUS, MessageId::RADIO];
    let verify = Some(Verify { key: key(), allow_unsigned, strip, before_sending: false });
    GateOptions { verify, ..GateOptions::default() }
}

pub(crate) fn sign(v1: OldFrames) -> GateOptions {
    GateOptions { sign: Some(Sign { key: key(), v1 }), ..GateOptions::default() }
}

pub(crate) fn gated(gate: GateOptions) -> LinkOptions {
    LinkOptions { gate, ..LinkOptions::default() }
}

/// A router at `NOW`, with a link that has such a gate, and an open one.
pub(crate) fn beside(gate: GateOptions) -> (Network, LinkId, LinkId) {
    let mut network = Network::new(RouterOptions::default());
    *network.router.signing_clock_mut() = SigningClock::new(NOW, NOW, network.now);
    let guarded = network.link_with(gated(gate));
    let open = network.link();
    (network, guarded, open)
}

/// A frame as somebody with this key sends it.
pub(crate) fn signed_by(key: &Key, link: u8, at: Timestamp, plain: &[u8]) -> Vec<u8> {
    let mut signed = Vec::new();
    Receiver::new().each(plain, Input::Paused, |frame| {
        let mut buffer = FrameBuffer::default();
        signed.extend(buffer.sign(frame, key, link, at).unwrap().bytes);
    });
    signed
}

pub(crate) fn each(bytes: &[u8], f: impl FnMut(&CheckedFrame<'_>)) {
    Receiver::new().each(bytes, Input::Paused, f);
}

fn refused(network: &mut Network, link: LinkId, bytes: &[u8], reason: DropReason) {
    let before = network.counters(link)[reason];
    assert_eq!(network.hears(link, bytes), [], "{reason:?}");
    assert_eq!(network.counters(link)[reason], before + 1, "{reason:?}");
}

#[test]
fn rule_57_signed_frames_pass_and_all_others_teach_nothing() {
    let (mut network, radio, station) = beside(verify(false));
    refused(&mut network, radio, &attitude(VEHICLE, 1), DropReason::Unsigned);
    let other = signed_by(&Key::from_passphrase("another"), 1, NOW, &attitude(VEHICLE, 2));
    refused(&mut network, radio, &other, DropReason::WrongSignature);
    let old = signed_by(&key(), 1, NOW.minus(MINUTE + 1), &attitude(VEHICLE, 3));
    refused(&mut network, radio, &old, DropReason::TooOld);
    assert!(network.router.table().find(VEHICLE).is_none(), "nobody was believed");
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), []);

    let good = signed_by(&key(), 1, NOW, &attitude(VEHICLE, 4));
    network.receive(radio, &good);
    assert_eq!(network.sent(station), good, "as it came");
    network.delivered();
    refused(&mut network, radio, &good, DropReason::Replayed);
    assert_eq!(network.hears(station, &command(STATION, VEHICLE)), [radio]);
}

#[test]
fn rule_58_what_a_radio_reports_needs_no_signature() {
    let (mut network, radio, station) = beside(verify(false));
    let status = frame(Version::V2, 0, RADIO, (109, 185), &[1; 9]);
    assert_eq!(network.hears(radio, &status), [station]);
    let old_status = frame(Version::V1, 0, RADIO, (166, 21), &[1; 9]);
    assert_eq!(network.hears(radio, &old_status), [station]);
}

#[test]
fn a_signature_is_taken_off_for_those_who_cannot_read_it() {
    let (mut network, radio, station) = beside(verify(true));
    let plain = attitude(VEHICLE, 1);
    network.receive(radio, &signed_by(&key(), 1, NOW, &plain));
    assert_eq!(network.sent(station), plain);
}

#[test]
fn what_leaves_is_signed_once_each_time_later_and_verifies() {
    let (mut network, radio, vehicle) = beside(sign(OldFrames::Upgrade));
    let mut random = Random::new(8);
    let mut streams = Streams::default();
    let mut last = Timestamp::default();
    for bytes in telemetry(2_000, &mut random) {
        network.receive(vehicle, &bytes);
        let sent = network.sent(radio);
        each(&bytes, |before| {
            each(&sent, |frame| {
                assert!(frame.header.signed && frame.verified);
                assert_eq!(
                    (frame.header.source, frame.header.id, frame.target),
                    (before.header.source, before.header.id, before.target)
                );
                if before.header.signed {
                    assert_eq!(frame.bytes, before.bytes, "another's signature stays");
                } else {
                    let time = streams.accept(frame, &key(), NOW).unwrap();
                    assert!(time > last);
                    last = time;
                }
            });
        });
    }
    assert!(last > NOW.plus(500), "many are for everybody");
}

#[test]
fn mavlink_1_passes_or_is_dropped_where_it_cannot_be_signed() {
    let old = frame(Version::V1, 0, VEHICLE, (30, 39), &[7; 28]);
    let (mut network, radio, vehicle) = beside(sign(OldFrames::Pass));
    network.receive(vehicle, &old);
    assert_eq!(network.sent(radio), old);
    let (mut network, radio, vehicle) = beside(sign(OldFrames::Drop));
    network.receive(vehicle, &old);
    assert!(network.sent(radio).is_empty());
    assert_eq!(network.counters(radio)[DropReason::Unsignable], 1);
}

#[test]
fn a_session_of_a_million_frames_has_no_false_refusal() {
    let both = || GateOptions { sign: sign(OldFrames::Pass).sign, ..verify(true) };
    let (mut near, near_radio, vehicle) = beside(both());
    let (mut far, far_radio, station) = beside(both());
    // The clocks of the two are half a minute apart.
    *far.router.signing_clock_mut() = SigningClock::new(NOW.plus(MINUTE / 2), NOW, far.now);
    let mut receivers = [Receiver::new(), Receiver::new()];
    let mut arrived = 0_u64;
    for turn in 0..31_250_u64 {
        let now = near.now + Duration::from_micros(137 * (turn % 3));
        (near.now, far.now) = (now, now);
        let seq = |n: u64| (turn * 16 + n).to_le_bytes()[0];
        let down: Vec<u8> = (0..31).flat_map(|n| attitude(VEHICLE, seq(n))).collect();
        near.receive_by(&mut receivers[0], vehicle, &down);
        near.receive_by(&mut receivers[0], vehicle, &heartbeat(VEHICLE));
        let air = near.sent(near_radio);
        far.receive_by(&mut receivers[1], far_radio, &air);
        arrived += u64::from(!far.sent(station).is_empty()) * 32;
    }
    let counters = far.counters(far_radio);
    assert_eq!((counters.frames_in, arrived), (1_000_000, 1_000_000));
    assert_eq!(refusals(&far, far_radio), 0);
}

fn refusals(network: &Network, link: LinkId) -> u64 {
    let counters = network.counters(link);
    let reasons = DropReason::ALL.into_iter().filter(|reason| reason.is_refusal());
    reasons.map(|reason| counters[reason]).sum()
}

#[test]
fn who_calls_again_goes_on_with_the_same_streams() {
    let (mut network, radio, station) = beside(verify(false));
    let good = signed_by(&key(), 1, NOW, &attitude(VEHICLE, 1));
    assert_eq!(network.hears(radio, &good), [station]);
    network.router.remove_link(radio);
    let again = network.link_with(gated(verify(false)));
    refused(&mut network, again, &good, DropReason::Replayed);
}

#[test]
fn a_stranger_joins_with_a_signature_and_not_with_one_that_was_heard_before() {
    let (mut network, radio, _) = beside(verify(false));
    let good = signed_by(&key(), 1, NOW, &attitude(VEHICLE, 1));
    let joins = |network: &Network, bytes: &[u8]| {
        let mut joins = Ok(());
        each(bytes, |frame| {
            joins = network.router.would_let_in(&verify(false), None, frame, network.now);
        });
        joins
    };
    assert_eq!(joins(&network, &attitude(VEHICLE, 1)), Err(Refusal::Unsigned));
    assert_eq!(joins(&network, &good), Ok(()));
    network.receive(radio, &good);
    assert_eq!(joins(&network, &good), Err(Refusal::Replayed));
    // A clock that was never set.
    let old = signed_by(&key(), 2, Timestamp::new(1), &attitude(VEHICLE, 2));
    assert_eq!(joins(&network, &old), Err(Refusal::TooOld));
    let forged = signed_by(&Key::from_passphrase("another"), 1, NOW.plus(1), &attitude(VEHICLE, 2));
    assert_eq!(joins(&network, &forged), Err(Refusal::WrongSignature));
}

#[test]
fn a_refused_source_is_told_of_once_a_minute() {
    let (mut network, radio, _) = beside(verify(false));
    let mut told = 0;
    for second in 0..120 {
        network.now = Time::from_millis(1_000_000 + second * 1_000);
        network.receive(radio, &attitude(VEHICLE, second as u8));
        while let Some(event) = network.router.poll_event() {
            let expected = RouterEvent::Refused(VEHICLE, radio, DropReason::Unsigned);
            assert_eq!(event, expected);
            told += 1;
        }
    }
    assert_eq!(told, 2);
}

#[test]
fn a_spectator_hears_all_and_is_not_heard() {
    let readonly = GateOptions { is_readonly: true, ..GateOptions::default() };
    let (mut network, spectator, vehicle) = beside(readonly);
    refused(&mut network, spectator, &heartbeat(STATION), DropReason::ReadOnly);
    assert_eq!(network.hears(vehicle, &attitude(VEHICLE, 1)), [spectator]);
}

/// A gate that sends nothing to somebody who has not shown the key.
fn guarded(key: Key, is_readonly: bool) -> GateOptions {
    let allow_unsigned = vec![MessageId::RADIO_STATUS];
    let verify = Some(Verify { key, allow_unsigned, strip: false, before_sending: true });
    GateOptions { verify, is_readonly, ..GateOptions::default() }
}

#[test]
fn whoever_calls_is_sent_nothing_before_a_good_signature() {
    let (mut network, caller, vehicle) = beside(guarded(key(), false));
    let other_key = Key::from_passphrase("another");
    let radio_status = frame(Version::V2, 0, RADIO, (109, 185), &[1; 9]);
    let no_proof = [
        heartbeat(STATION),
        signed_by(&other_key, 1, NOW, &heartbeat(STATION)),
        signed_by(&key(), 1, NOW.minus(MINUTE + 1), &heartbeat(STATION)),
        radio_status,
    ];
    for (number, bytes) in (1_u8..).zip(no_proof) {
        network.receive(caller, &bytes);
        network.delivered();
        network.receive(vehicle, &attitude(VEHICLE, number));
        assert!(network.sent(caller).is_empty(), "{number}");
        assert_eq!(network.counters(caller)[DropReason::Unproven], u64::from(number));
    }
    network.receive(caller, &signed_by(&key(), 1, NOW, &heartbeat(STATION)));
    network.receive(vehicle, &attitude(VEHICLE, 9));
    assert_eq!(network.sent(caller), attitude(VEHICLE, 9), "as it came");
}

#[test]
fn who_has_shown_the_key_need_not_do_so_again_while_it_is_the_same() {
    let (mut network, caller, vehicle) = beside(guarded(key(), false));
    network.receive(caller, &signed_by(&key(), 1, NOW, &heartbeat(STATION)));
    let slower = GateOptions { max_rate: Some(100), ..guarded(key(), false) };
    network.router.set_link_options(caller, gated(slower), network.now);
    network.receive(vehicle, &attitude(VEHICLE, 1));
    assert_eq!(network.sent(caller), attitude(VEHICLE, 1));
    let other_key = Key::from_passphrase("another");
    network.router.set_link_options(caller, gated(guarded(other_key, false)), network.now);
    network.receive(vehicle, &attitude(VEHICLE, 2));
    assert!(network.sent(caller).is_empty());
}

#[test]
fn a_spectator_shows_the_key_and_is_not_heard_all_the_same() {
    let (mut network, spectator, vehicle) = beside(guarded(key(), true));
    refused(&mut network, spectator, &heartbeat(STATION), DropReason::Unsigned);
    assert_eq!(network.hears(vehicle, &attitude(VEHICLE, 1)), [spectator]);
    assert_eq!(network.counters(spectator).frames_out, 0);
    let good = signed_by(&key(), 1, NOW, &heartbeat(STATION));
    refused(&mut network, spectator, &good, DropReason::ReadOnly);
    network.receive(vehicle, &attitude(VEHICLE, 2));
    assert_eq!(network.sent(spectator), attitude(VEHICLE, 2));
}

/// Whoever calls may be anybody: to check signatures is work, and so is bounded, and what is wrong
/// with them is told, as where frames are taken.
#[test]
fn a_spectator_without_the_key_is_told_apart_and_kept_within_its_share() {
    let capped = GateOptions { max_rate: Some(5), ..guarded(key(), true) };
    let (mut network, spectator, vehicle) = beside(capped);
    let other_key = Key::from_passphrase("another");
    for _ in 0..5 {
        let wrong = signed_by(&other_key, 1, NOW, &heartbeat(STATION));
        refused(&mut network, spectator, &wrong, DropReason::WrongSignature);
    }
    let told = RouterEvent::Refused(STATION, spectator, DropReason::WrongSignature);
    assert!(std::iter::from_fn(|| network.router.poll_event()).any(|event| event == told));
    let good = signed_by(&key(), 1, NOW, &heartbeat(STATION));
    refused(&mut network, spectator, &good, DropReason::MaxRate);
    network.now = Time::from_millis(1_001_000);
    refused(&mut network, spectator, &good, DropReason::ReadOnly);
    network.receive(vehicle, &attitude(VEHICLE, 1));
    assert_eq!(network.sent(spectator), attitude(VEHICLE, 1));
    network.delivered();
    // There is nothing left to find out, and so nothing to be told of.
    let wrong = signed_by(&other_key, 1, NOW, &heartbeat(STATION));
    refused(&mut network, spectator, &wrong, DropReason::ReadOnly);
}

#[test]
fn one_peer_cannot_send_more_than_its_share() {
    let capped = GateOptions { max_rate: Some(50), ..GateOptions::default() };
    let (mut network, flood, station) = beside(capped);
    for turn in 0..=2_000_u64 {
        network.now = Time::from_millis(1_000_000 + turn * 5);
        network.receive(flood, &attitude(VEHICLE, turn as u8));
        network.sent(station);
    }
    let counters = network.counters(flood);
    let passed = counters.frames_in - counters[DropReason::MaxRate];
    assert_eq!(passed, 50 + 500, "a second saved up, and ten seconds");
}
