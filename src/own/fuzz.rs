//! For a fuzzer: whatever the own component is told, what it says is sound, and comes to an end.

use super::component::OwnComponent;
use super::{Place, Vehicle};
use crate::mavlink::{
    Checker, Component, Dialect, Frame, FrameSpec, Input, Layout, Splitter, Timing, Version,
};
use crate::routing::{LinkId, LocalPeer, Time};

const OWN: Component = Component::new(1, 191);

/// Tells it `data`: pieces of a byte that chooses message and sender, a length, a payload, and tens
/// of milliseconds to wait.
///
/// # Panics
///
/// If it says something that is no whole frame of a published definition, or does not stop talking.
pub fn fuzz_own(data: &[u8]) {
    let mut own = OwnComponent::new(Some(OWN));
    let mut checker = Checker::new(Dialect::builtin());
    let (mut data, mut now) = (data, Time::ZERO);
    while let [choice, len, wait, rest @ ..] = data {
        let (payload, rest) = rest.split_at(usize::from(*len).min(rest.len()));
        data = rest;
        tell(&mut own, *choice, payload, now);
        now = Time::from_micros(now.as_micros() + u64::from(*wait) * 10_000);
        live_a_second(&mut own, *choice, now);
        hear(&mut own, &mut checker, now);
    }
}

fn tell(own: &mut OwnComponent, choice: u8, payload: &[u8], now: Time) {
    let Layout { id, crc_extra } = Timing::LAYOUTS[usize::from(choice & 1)];
    let version = if choice & 2 == 0 { Version::V2 } else { Version::V1 };
    let source = Component::new(choice >> 4, choice >> 2 & 3);
    let spec = FrameSpec { version, ..FrameSpec::new(source, id, crc_extra, payload) };
    if let Ok(frame) = Frame::parse(&spec.to_frame()) {
        own.handle_frame(&frame, now);
    }
}

fn live_a_second(own: &mut OwnComponent, choice: u8, now: Time) {
    let link = LinkId::new(usize::from(choice & 3)).unwrap_or_else(|| unreachable!());
    let place = Place { link, since: Time::ZERO };
    let component = Component::new(choice | 1, 1);
    own.begin_second();
    own.measure(place, component, now);
    let boot_ms = (choice & 4 != 0).then_some(u32::from(choice));
    own.ask_for_streams(&Vehicle { place, component, boot_ms }, 4, now);
    own.end_second(|place| place.link.index() != usize::from(choice >> 6));
}

fn hear(own: &mut OwnComponent, checker: &mut Checker, now: Time) {
    let mut out = vec![0; Splitter::CARRY];
    let mut said = 0;
    while own.poll_single(&mut out).is_some() || own.poll_transmit(now, &mut out) {
        said += 1;
    }
    // A question, seven requests, the heartbeat and an answer.
    assert!(said <= 10, "{said} frames at once");
    let len = out.len() - Splitter::CARRY;
    let mut splitter = Splitter::new();
    let mut cutter = splitter.cut(&mut out, len, Input::Paused);
    let mut heard = 0;
    while let Some(frame) = cutter.next(checker) {
        assert!(frame.verified && frame.header.source == OWN);
        heard += 1;
    }
    assert_eq!((heard, splitter.stats().skipped_bytes), (said, 0));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exercise_fuzz_own() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for _ in 0..50 {
            // Lengths as those of the messages, and many zeros.
            let data: Vec<u8> = (0..2_000).map(|_| next() >> (next() % 8)).collect();
            fuzz_own(&data);
        }
    }
}
