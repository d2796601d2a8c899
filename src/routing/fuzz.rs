//! For a fuzzer: a router under any list of operations, beside a model that only remembers.
//!
//! The model does not decide where a frame goes. It holds what must be true wherever it goes.

use std::collections::HashSet;
use std::time::Duration;

use super::fuzz_gate::{self, Shape};
use super::{
    Capacity, DropReason, Explanation, Fate, FilterLists, GateOptions, GroupId, LinkId,
    LinkOptions, MAX_COMPONENTS, Membership, RateCap, Router, RouterOptions, Time,
};
use crate::mavlink::{
    CheckedFrame, Component, FrameBuffer, FrameSpec, Header, MessageId, Timestamp, encode,
};

/// Does what `data` says, four bytes an operation.
///
/// # Fuzzing
///
/// Asserts that no frame goes back to the link it came from, or to that link's group; that none
/// goes to a link twice; that directed frames go where their target was heard, and nowhere else;
/// that queues give out what was put in, whole and in order; that what goes nowhere is counted;
/// that tables and events stay within their bounds; that what leaves by a gate is as the gate has to
/// make it; and that [`Router::explain`] said of each frame beforehand what became of it.
pub fn fuzz_router(data: &[u8]) {
    run(data);
}

/// The same; says how many frames were explained before they were handled.
fn run(data: &[u8]) -> usize {
    let Some((options, operations)) = data.split_first() else { return 0 };
    let mut model = Model::new(*options);
    for operation in operations.chunks_exact(4) {
        model.step([operation[0], operation[1], operation[2], operation[3]]);
    }
    model.drain_all();
    model.explained
}

/// What is remembered of a link.
struct Shadow {
    link: LinkId,
    options: LinkOptions,
    /// What waits for it.
    queued: Vec<Vec<u8>>,
    /// Who was heard on it, ever.
    heard: HashSet<Component>,
}

struct Model {
    router: Router,
    now: Time,
    links: Vec<Shadow>,
    seq: u8,
    /// When the last frame was signed.
    signed_at: Timestamp,
    /// How many frames were explained before they were handled.
    explained: usize,
}

/// More links than this show nothing new.
const LINKS: usize = 12;

impl Model {
    fn new(options: u8) -> Self {
        let options = RouterOptions {
            strict: options & 1 != 0,
            route_age: (options & 2 != 0).then(|| Duration::from_secs(10)),
            ..RouterOptions::default()
        };
        let now = Time::from_millis(1_000_000);
        Self {
            router: Router::new(options),
            now,
            links: Vec::new(),
            seq: 0,
            signed_at: Timestamp::default(),
            explained: 0,
        }
    }

    fn step(&mut self, [operation, a, b, c]: [u8; 4]) {
        match operation % 16 {
            0 if self.links.len() < LINKS => self.add_link(a, b, c),
            1 if !self.links.is_empty() => {
                let gone = self.links.swap_remove(usize::from(a) % self.links.len());
                self.router.remove_link(gone.link);
            }
            2 => self.now = self.now + Duration::from_millis(u64::from(a) * 20),
            3 if !self.links.is_empty() => self.drain(usize::from(a) % self.links.len(), b),
            4 => self.router.handle_timeout(self.now),
            _ if !self.links.is_empty() => self.receive(a, b, c),
            _ => {}
        }
        assert!(self.router.table().components().len() <= MAX_COMPONENTS);
        let mut events = 0;
        while self.router.poll_event().is_some() {
            events += 1;
            assert!(events <= 1_024, "the events are bounded");
        }
    }

    fn add_link(&mut self, a: u8, b: u8, c: u8) {
        let membership = (a & 1 != 0).then(|| Membership {
            group: GroupId(b & 1),
            member: u16::from(b >> 4),
            rank: b >> 6,
            best_only: a & 2 != 0,
        });
        let paced = Capacity::Paced { rate: 5_760, queue_time: Duration::from_millis(250) };
        let options = LinkOptions {
            membership,
            capacity: if a & 4 != 0 { paced } else { Capacity::Bytes(2_000) },
            dedup: (a & 8 != 0).then(|| Duration::from_millis(u64::from(b) * 4)),
            is_sniffer: a & 16 != 0,
            repeats_nobody: b & 12 == 12,
            forward_setup_signing: a & 32 != 0,
            caps: if a & 64 != 0 {
                vec![RateCap { id: MessageId(30), interval: CAP }]
            } else {
                vec![]
            },
            filter_in: if a & 128 != 0 { without(b & 1) } else { FilterLists::default() },
            filter_out: if b & 2 != 0 { without(b >> 7) } else { FilterLists::default() },
            gate: GateOptions {
                is_readonly: b & 28 == 28,
                max_rate: (b & 40 == 40).then_some(20),
                ..fuzz_gate::options(c)
            },
        };
        let Some(link) = self.router.add_link(options.clone(), self.now) else { return };
        assert!(self.links.iter().all(|other| other.link != link), "a link's number is its own");
        self.links.push(Shadow { link, options, queued: Vec::new(), heard: HashSet::new() });
    }

    /// A frame arrives: from one of few components, for one of few.
    fn receive(&mut self, a: u8, b: u8, c: u8) {
        let from = usize::from(a) % self.links.len();
        let source = Component::new(b & 3, (b >> 2) & 3);
        let target = Component::new((b >> 4) & 3, (b >> 6) & 3);
        // Every other sequence number comes twice, as over two cables.
        self.seq = self.seq.wrapping_add(c >> 7);
        let ((id, crc_extra), target) = MESSAGES[usize::from(c & 7)](target);
        let shape = Shape::of(c >> 3, id);
        self.signed_at = self.signed_at.plus(1).max(self.router.signing_clock().show(self.now));
        let mut plain = Vec::new();
        encode(&spec(shape, source, id, crc_extra, self.seq), &mut plain);
        let bytes = shape.signed(plain, self.signed_at);
        let header = Header::parse(&bytes).expect("a frame");
        let frame = CheckedFrame { bytes: &bytes, header, target, verified: c & 64 == 0 };
        self.handle(from, &frame, shape);
    }

    fn handle(&mut self, from: usize, frame: &CheckedFrame<'_>, shape: Shape) {
        let before = self.counts();
        let link = self.links[from].link;
        let explanation = self.router.explain(link, frame, self.now).expect("the link is there");
        let drops = self.drops();
        self.router.handle(link, frame, self.now);
        let mut buffers = <[FrameBuffer; 2]>::default();
        let taken = self.router.as_taken(link, frame, &mut buffers);
        if frame.verified {
            self.links[from].heard.insert(taken.header.source);
        }
        let is_refused = self.is_refused(from, &drops);
        if explanation.if_signature_is_good {
            shape.check_verdict(is_refused);
        }
        // Whether a signature is good is not foreseen.
        if !(explanation.if_signature_is_good && is_refused) {
            self.compare(&explanation, link, &before, &drops);
        }
        self.note(from, &taken, &before);
    }

    /// Whether a frame from there was just refused for its signature.
    fn is_refused(&self, from: usize, drops: &[Vec<u64>]) -> bool {
        let now = &self.drops()[from];
        let reasons = DropReason::ALL.iter().filter(|reason| reason.is_refusal());
        reasons.into_iter().any(|reason| now[*reason as usize] > drops[from][*reason as usize])
    }

    /// Holds what must be true of one frame, and notes where it went.
    fn note(&mut self, from: usize, frame: &CheckedFrame<'_>, before: &[(u64, u64, u64)]) {
        let after = self.counts();
        let own_group = self.links[from].options.membership.map(|member| member.group);
        assert_eq!(after[from].0, before[from].0 + 1, "what came in is counted");
        let mut is_accounted = self.links.len() == 1;
        for (at, (after, before)) in after.iter().zip(before).enumerate() {
            is_accounted |= after.2 > before.2;
            let copies = after.1 - before.1;
            assert!(copies <= 1, "no frame goes to a link twice");
            if copies == 0 {
                continue;
            }
            is_accounted = true;
            let shadow = &self.links[at];
            assert_ne!(at, from, "no frame goes back");
            let group = shadow.options.membership.map(|member| member.group);
            assert!(group.is_none() || group != own_group, "nothing goes between paths");
            assert!(!frame.is_directed() || self.leads_to(at, frame.target), "nobody is there");
            let bytes = self.queued_last(at);
            let gate = &self.links[at].options.gate;
            fuzz_gate::check_output(gate, frame, &bytes);
            self.links[at].queued.push(bytes);
        }
        let only_kin = |shadow: &Shadow| {
            shadow.options.membership.map(|member| member.group) == own_group && own_group.is_some()
        };
        is_accounted |= self.links.iter().enumerate().all(|(at, s)| at == from || only_kin(s));
        assert!(is_accounted, "what goes nowhere is counted: {:?}", frame.header);
    }

    /// Holds what was said of a frame beforehand against what became of it.
    fn compare(
        &mut self,
        explanation: &Explanation,
        from: LinkId,
        before: &[(u64, u64, u64)],
        drops: &[Vec<u64>],
    ) {
        let (after, drops_after) = (self.counts(), self.drops());
        let sent: Vec<bool> = after.iter().zip(before).map(|(now, old)| now.1 > old.1).collect();
        let counted = |at: usize, reason: DropReason| {
            drops_after[at][reason as usize] > drops[at][reason as usize]
        };
        let at_source = self.place_of(from);
        if counted(at_source, DropReason::Duplicate) {
            return;
        }
        self.explained += 1;
        if let Some(reason) = explanation.refused {
            assert!(counted(at_source, reason), "{reason:?} was expected");
            return assert!(!sent.contains(&true), "{explanation:?}");
        }
        assert_eq!(explanation.fates.len(), self.links.len());
        for (link, fate) in &explanation.fates {
            let at = self.place_of(*link);
            assert_eq!(matches!(fate, Fate::Sent(_)), sent[at], "{link}: {explanation:?}");
            match fate {
                Fate::Loop(by) => assert!(counted(self.place_of(*by), DropReason::Loop)),
                Fate::Refused(DropReason::SetupSigning) => {
                    assert!(counted(at_source, DropReason::SetupSigning));
                }
                Fate::Refused(reason) => assert!(counted(at, *reason), "{link}: {reason:?}"),
                _ => {}
            }
        }
    }

    /// The last frame that waits for a link.
    fn queued_last(&mut self, at: usize) -> Vec<u8> {
        let port = self.router.port_mut(self.links[at].link).expect("the link is there");
        let last = port.frames().last().map(|(first, second)| [first, second].concat());
        last.expect("a frame was queued")
    }

    fn place_of(&self, link: LinkId) -> usize {
        let place = self.links.iter().position(|shadow| shadow.link == link);
        place.expect("the link is there")
    }

    /// What was dropped, by reason, of each link.
    fn drops(&self) -> Vec<Vec<u64>> {
        let drops = |shadow: &Shadow| {
            let counters = self.router.counters(shadow.link).expect("the link is there");
            DropReason::ALL.iter().map(|reason| counters[*reason]).collect()
        };
        self.links.iter().map(drops).collect()
    }

    /// Whether the target was heard here, or on another link of the same group; or all is sent here.
    fn leads_to(&self, at: usize, target: Component) -> bool {
        let group = self.links[at].options.membership.map(|member| member.group);
        let is_kin = |(other, shadow): (usize, &Shadow)| {
            let of_group = shadow.options.membership.map(|member| member.group);
            other == at || group.is_some() && of_group == group
        };
        let heard = |shadow: &Shadow| shadow.heard.iter().any(|c| c.system == target.system);
        let mut kin = self.links.iter().enumerate().filter(|(n, shadow)| is_kin((*n, *shadow)));
        kin.any(|(_, shadow)| heard(shadow) || shadow.options.is_sniffer)
    }

    /// Frames in, frames out, frames dropped, of each link.
    fn counts(&self) -> Vec<(u64, u64, u64)> {
        let counts = |shadow: &Shadow| {
            let counters = self.router.counters(shadow.link).expect("the link is there");
            let dropped = DropReason::ALL.iter().map(|reason| counters[*reason]).sum();
            (counters.frames_in, counters.frames_out, dropped)
        };
        self.links.iter().map(counts).collect()
    }

    /// Sends a part of what waits for a link.
    fn drain(&mut self, at: usize, amount: u8) {
        let shadow = &mut self.links[at];
        let port = self.router.port_mut(shadow.link).expect("the link is there");
        let count = port.sendable(self.now).min(usize::from(amount) * 8);
        let frames = port.frames().map(|(first, second)| [first, second].concat());
        let frames: Vec<_> = frames.collect();
        let whole = shadow.queued.len() - frames.len();
        assert!(whole <= 1, "at most one frame is torn");
        assert_eq!(frames, shadow.queued[whole..], "what comes out is what went in");
        port.consume(count);
        let rest = port.backlog();
        while shadow.queued.iter().skip(1).map(Vec::len).sum::<usize>() >= rest
            && !shadow.queued.is_empty()
        {
            shadow.queued.remove(0);
        }
    }

    fn drain_all(&mut self) {
        (0..self.links.len()).for_each(|at| self.drain(at, u8::MAX));
    }
}

/// Lists that one message does not pass, or one source.
fn without(what: u8) -> FilterLists {
    match what {
        0 => FilterLists { block_messages: vec![MessageId(11)], ..FilterLists::default() },
        _ => FilterLists { block_components: vec![3], ..FilterLists::default() },
    }
}

const CAP: Duration = Duration::from_millis(500);

/// Message id and CRC_EXTRA, and whom the message is for by its definition.
type Message = ((u32, u8), Component);

const MESSAGES: [fn(Component) -> Message; 8] = [
    |_| ((0, 50), Component::new(0, 0)),
    |_| ((30, 39), Component::new(0, 0)),
    |_| ((2, 137), Component::new(0, 0)),
    |_| ((109, 185), Component::new(0, 0)),
    |target| ((76, 152), target),
    |target| ((11, 89), Component::new(target.system, 0)),
    |target| ((256, 71), target),
    |target| ((4, 237), target),
];

fn spec(shape: Shape, source: Component, id: u32, crc_extra: u8, seq: u8) -> FrameSpec<'static> {
    const PAYLOAD: &[u8] = &[1, 2, 3, 4, 5, 6, 7, 8, 9];
    let (version, id) = (shape.version(), MessageId(id));
    FrameSpec { version, seq, source, id, crc_extra, payload: PAYLOAD, signature: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exercise_fuzz_router() {
        let mut random = random(7);
        for length in [0, 1, 400, 4_000, 40_000] {
            fuzz_router(&random(length));
        }
    }

    #[test]
    fn what_is_said_of_a_frame_comes_true_10_000_times() {
        let mut explained = 0;
        for seed in 0.. {
            explained += run(&random(seed)(4_001));
            if explained >= 10_000 {
                break;
            }
        }
    }

    fn random(seed: u32) -> impl FnMut(usize) -> Vec<u8> {
        let mut state = seed;
        move |length| {
            let next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            std::iter::repeat_with(next).take(length).collect()
        }
    }
}
