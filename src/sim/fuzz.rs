//! For a fuzzer: whatever is asked of vehicles, what they say is sound, and comes to an end.

use super::flight::VehicleKind;
use super::requests;
use super::swarm::{Swarm, SwarmOptions};
use crate::mavlink::{
    Checker, Component, Dialect, Frame, FrameSpec, Input, Layout, Splitter, Timing, Version,
};
use crate::routing::{LocalPeer, Time};

/// How many vehicles are asked.
const COUNT: u8 = 3;

/// Asks `data` of a swarm: pieces of a byte that chooses the message, a length, a payload, and
/// milliseconds to wait.
///
/// # Panics
///
/// If a vehicle says something that is no whole frame of a published definition, or does not stop
/// talking.
pub fn fuzz_sim(data: &[u8]) {
    let options = SwarmOptions { count: COUNT, system: 1, vehicle: VehicleKind::Copter, rate: 10 };
    let mut now = Time::ZERO;
    let mut swarm = Swarm::new(options, now);
    let mut checker = Checker::new(Dialect::builtin());
    let mut data = data;
    while let [choice, len, wait, rest @ ..] = data {
        let (payload, rest) = rest.split_at(usize::from(*len).min(rest.len()));
        data = rest;
        ask(&mut swarm, usize::from(*choice), payload, now);
        now = Time::from_micros(now.as_micros() + u64::from(*wait) * 1_000);
        hear(&mut swarm, &mut checker, now);
    }
}

fn ask(swarm: &mut Swarm, choice: usize, payload: &[u8], now: Time) {
    let layouts: Vec<Layout> = requests::understood().chain(Timing::LAYOUTS).collect();
    let Layout { id, crc_extra } = layouts[choice % layouts.len()];
    let version = if choice < 128 { Version::V2 } else { Version::V1 };
    let station = Component::new(255, 190);
    let spec = FrameSpec { version, ..FrameSpec::new(station, id, crc_extra, payload) };
    if let Ok(frame) = Frame::parse(&spec.to_frame()) {
        swarm.handle_frame(&frame, now);
    }
}

fn hear(swarm: &mut Swarm, checker: &mut Checker, now: Time) {
    let mut out = vec![0; Splitter::CARRY];
    let mut said = 0;
    while swarm.poll_transmit(now, &mut out)
        || swarm.bulk(now).is_some() && swarm.poll_bulk(now, &mut out)
    {
        said += 1;
    }
    // Answers, one of each message that is due, and the parameters.
    assert!(said <= usize::from(COUNT) * 64, "{said} frames at once");
    assert!(swarm.poll_timeout().is_some_and(|at| at > now), "it has more to say");
    let len = out.len() - Splitter::CARRY;
    let mut splitter = Splitter::new();
    let mut cutter = splitter.cut(&mut out, len, Input::Paused);
    let mut heard = 0;
    while let Some(frame) = cutter.next(checker) {
        assert!(frame.verified && (1..=COUNT).contains(&frame.header.source.system));
        heard += 1;
    }
    assert_eq!((heard, splitter.stats().skipped_bytes), (said, 0));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exercise_fuzz_sim() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for _ in 0..50 {
            // Short numbers are what the offsets of targets and missions want.
            let data: Vec<u8> = (0..4_000).map(|_| next() >> (next() % 8)).collect();
            fuzz_sim(&data);
        }
    }
}
