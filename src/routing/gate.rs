//! What stands between a link and the router where the user asks for it: who may send here at all,
//! and how fast; signatures checked on the way in and made on the way out; the one place where
//! frames are given another layout or other system ids.
//!
//! A link without any of this has no gate, and costs nothing. What a gate refuses teaches nothing.

use super::bucket::Bucket;
use super::counters::DropReason;
use super::gate_options::{GateOptions, OldFrames, Sign, Verify};
use super::group::Membership;
use super::link_set::LinkId;
use super::options::RouterEvent;
use super::port::Port;
use super::router::{Router, push_event};
use super::signing::{HeardId, Signing, SigningClock};
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, FrameBuffer, MessageId, Refusal, Version};

/// The gate of one link.
#[derive(Debug)]
pub(super) struct Gate {
    pub(super) options: GateOptions,
    /// The link id in the signatures that are made here (rule 59).
    link: u8,
    /// The streams that frames from here belong to, if they are checked.
    heard: Option<HeardId>,
    bucket: Bucket,
    /// Whether nothing is sent here yet, as nobody has shown that they have the key.
    pub(super) awaits_proof: bool,
    /// Whether it looks at what frames that come say; else it only counts them.
    reads: bool,
    /// Whether frames may leave other than they are, or not at all.
    pub(super) rewrites: bool,
}

impl Gate {
    /// The gate that `options` ask for, if they ask for any.
    pub(super) fn new(
        options: &GateOptions,
        membership: Option<Membership>,
        link: LinkId,
        signing: &mut Signing,
        now: Time,
    ) -> Option<Box<Self>> {
        if *options == GateOptions::default() {
            return None;
        }
        let member = membership.map(|membership| membership.member);
        let heard = options.verify.as_ref().map(|it| signing.streams_of(&it.key, member));
        let bucket = Bucket::full(now);
        // From the top: vehicles and ground stations number their own from the bottom.
        let link = 255 - (link.index() % 255) as u8;
        let reads = options.verify.is_some() || options.remap.is_some();
        let awaits_proof = options.verify.as_ref().is_some_and(|verify| verify.before_sending);
        let rewrites = options.rewrites();
        let options = options.clone();
        Some(Box::new(Self { options, link, heard, bucket, awaits_proof, reads, rewrites }))
    }

    /// Whoever is there has shown to have the key of these options.
    pub(super) fn has_proof_for(&self, options: &GateOptions) -> bool {
        let key = self.options.verify_key();
        !self.awaits_proof && key.is_some() && key == options.verify_key()
    }

    /// A frame that came and is not kept out, as it goes on.
    fn let_in<'a>(
        &mut self,
        frame: &CheckedFrame<'a>,
        signing: &mut Signing,
        now: Time,
        buffers: &'a mut [FrameBuffer; 2],
    ) -> Result<CheckedFrame<'a>, DropReason> {
        self.believe(frame, signing, now)?;
        // Whoever only looks on has to show the key all the same.
        if self.options.is_readonly {
            return Err(DropReason::ReadOnly);
        }
        self.pass(frame, buffers)
    }

    /// Why a frame that came is kept out whatever it says, if so.
    fn keeps_out(&mut self, id: MessageId, now: Time) -> Option<DropReason> {
        self.options.refusal(id, self.awaits_proof, &mut self.bucket, now)
    }

    /// The same of a frame that is only asked about: the bucket is left as it is.
    pub(super) fn foresee_keeping_out(&self, id: MessageId, now: Time) -> Option<DropReason> {
        self.options.refusal(id, self.awaits_proof, &mut self.bucket.clone(), now)
    }

    /// Whether the signature of a frame is right, if it must be.
    fn believe(
        &mut self,
        frame: &CheckedFrame<'_>,
        signing: &mut Signing,
        now: Time,
    ) -> Result<(), DropReason> {
        let (Some(verify), Some(heard)) = (&self.options.verify, self.heard) else {
            return Ok(());
        };
        match signing.accept(heard, frame, now) {
            Err(Refusal::Unsigned) if verify.allow_unsigned.contains(&frame.header.id) => Ok(()),
            Err(refusal) => Err(refusal.into()),
            Ok(()) => {
                self.awaits_proof = false;
                Ok(())
            }
        }
    }

    /// A frame that was believed, as it goes on.
    pub(super) fn pass<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        [bare, remapped]: &'a mut [FrameBuffer; 2],
    ) -> Result<CheckedFrame<'a>, DropReason> {
        self.remap(&self.bared(frame, bare), remapped)
    }

    /// Without its signature, if that is taken off.
    fn bared<'a>(&self, frame: &CheckedFrame<'a>, buffer: &'a mut FrameBuffer) -> CheckedFrame<'a> {
        let is_stripped = self.options.verify.as_ref().is_some_and(|verify| verify.strip);
        if is_stripped { buffer.strip(frame).unwrap_or(*frame) } else { *frame }
    }

    /// A frame with the system ids that it has on the other side; the way there and the way back are
    /// the same.
    fn remap<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        buffer: &'a mut FrameBuffer,
    ) -> Result<CheckedFrame<'a>, DropReason> {
        let Some(map) = self.options.remap.as_deref().filter(|map| map.concerns(frame)) else {
            return Ok(*frame);
        };
        let target_at = self.options.recipes.as_deref().and_then(|it| it.target_at(frame));
        buffer.remap(frame, map, target_at).ok_or(DropReason::Signed)
    }

    /// A frame in the layout in which it leaves.
    fn convert<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        buffer: &'a mut FrameBuffer,
    ) -> Result<CheckedFrame<'a>, DropReason> {
        let converted = match self.options.version {
            Some(wanted) if wanted != frame.header.version => match wanted {
                Version::V2 => buffer.upgrade(frame),
                Version::V1 => {
                    let recipes = self.options.recipes.as_deref();
                    let base_len = recipes.and_then(|recipes| recipes.base_len(frame));
                    base_len.and_then(|base_len| buffer.downgrade(frame, base_len))
                }
            },
            _ => return Ok(*frame),
        };
        let unconverted = self.options.passes_unconverted.then_some(*frame);
        converted.or(unconverted).ok_or(DropReason::NotConverted)
    }

    /// A frame that leaves, in the layout in which it can be signed, if it is to be.
    fn shape<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        buffer: &'a mut FrameBuffer,
    ) -> Result<CheckedFrame<'a>, DropReason> {
        match &self.options.sign {
            Some(sign) if frame.header.version == Version::V1 => match sign.v1 {
                OldFrames::Pass => Ok(*frame),
                OldFrames::Upgrade => buffer.upgrade(frame).ok_or(DropReason::Unsignable),
                OldFrames::Drop => Err(DropReason::Unsignable),
            },
            _ => Ok(*frame),
        }
    }

    /// A frame as it leaves, but for the signature that it may get.
    pub(super) fn shaped<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        [remapped, converted, shaped]: &'a mut [FrameBuffer; 3],
    ) -> Result<CheckedFrame<'a>, DropReason> {
        let frame = self.remap(frame, remapped)?;
        let frame = self.convert(&frame, converted)?;
        self.shape(&frame, shaped)
    }

    /// How a frame of this shape is signed, if it is.
    pub(super) fn signs(&self, frame: &CheckedFrame<'_>) -> Option<&Sign> {
        let is_due = frame.header.version == Version::V2 && !frame.header.signed;
        self.options.sign.as_ref().filter(|_| is_due)
    }

    /// A frame as it leaves.
    pub(super) fn let_out<'a>(
        &self,
        frame: &CheckedFrame<'a>,
        clock: &mut SigningClock,
        now: Time,
        (shaped, signed): (&'a mut [FrameBuffer; 3], &'a mut FrameBuffer),
    ) -> Result<CheckedFrame<'a>, DropReason> {
        let frame = self.shaped(frame, shaped)?;
        let Some(sign) = self.signs(&frame) else { return Ok(frame) };
        Ok(signed.sign(&frame, &sign.key, self.link, clock.next(now)).unwrap_or(frame))
    }
}

impl GateOptions {
    /// Why a frame that came is kept out whatever it says, if so. Where nothing is taken, it is looked
    /// at all the same as long as somebody has yet to show the key.
    fn refusal(
        &self,
        id: MessageId,
        awaits_proof: bool,
        bucket: &mut Bucket,
        now: Time,
    ) -> Option<DropReason> {
        if self.is_readonly && !awaits_proof {
            return Some(DropReason::ReadOnly);
        }
        if self.max_rate.is_some_and(|rate| !bucket.permit(rate, now)) {
            return Some(DropReason::MaxRate);
        }
        let is_blocked = self.blocks_stream_requests && id == MessageId::REQUEST_DATA_STREAM;
        is_blocked.then_some(DropReason::StreamRequest)
    }
}

impl From<Refusal> for DropReason {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Unsigned => Self::Unsigned,
            Refusal::WrongSignature => Self::WrongSignature,
            Refusal::Replayed => Self::Replayed,
            Refusal::TooOld => Self::TooOld,
            Refusal::TooManyStreams => Self::TooManyStreams,
        }
    }
}

impl Router {
    /// Takes a frame that arrived on a link with a gate, and was counted.
    #[inline(never)]
    pub(super) fn handle_gated(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> bool {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else { return false };
        let Some(gate) = &mut port.gate else { return false };
        if let Some(reason) = gate.keeps_out(frame.header.id, now) {
            port.counters[reason] += 1;
            return false;
        }
        if gate.reads { self.handle_read(link, frame, now) } else { self.admit(link, frame, now) }
    }

    /// Takes it if what it says is right; in a function of its own, as the buffers cost something.
    #[inline(never)]
    fn handle_read(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> bool {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else { return false };
        let Some(gate) = &mut port.gate else { return false };
        let mut buffers = <[FrameBuffer; 2]>::default();
        // Unsigned ones may be let in too, and need no belief.
        let verifies = gate.options.verify.is_some();
        match gate.let_in(frame, &mut self.signing, now, &mut buffers) {
            Ok(frame) => {
                self.signing.is_believed = verifies;
                let is_taken = self.admit(link, &frame, now);
                self.signing.is_believed = false;
                is_taken
            }
            Err(reason) => {
                port.counters[reason] += 1;
                let source = frame.header.source;
                if reason.is_refusal() && self.signing.told.is_due((link, source), now) {
                    push_event(&mut self.events, RouterEvent::Refused(source, link, reason));
                }
                false
            }
        }
    }

    fn gate(&self, link: LinkId) -> Option<&Gate> {
        self.port(link)?.gate.as_deref()
    }

    /// Whether the frames of a link come through a gate, so that [`Router::as_taken`] has to be asked.
    pub fn is_gated(&self, link: LinkId) -> bool {
        self.port(link).is_some_and(Port::has_gate)
    }

    /// Whether nothing is sent to a link yet, as whoever is there has not shown the key.
    pub fn awaits_proof(&self, link: LinkId) -> bool {
        self.gate(link).is_some_and(|gate| gate.awaits_proof)
    }

    /// Whether a link takes only what is signed.
    pub fn asks_for_signatures(&self, link: LinkId) -> bool {
        self.gate(link).is_some_and(|gate| gate.options.verify.is_some())
    }

    /// The ids that a component has on a link, if its frames come or go by it: others than here where
    /// they are remapped.
    pub fn on_the_wire(&self, link: LinkId, component: Component) -> Component {
        let map = self.gate(link).and_then(|gate| gate.options.remap.as_deref());
        let system = map.map_or(component.system, |map| map.apply(component.system));
        Component::new(system, component.component)
    }

    /// A frame that was taken from `link`, as its gate let it in: with other system ids, perhaps.
    pub fn as_taken<'a>(
        &self,
        link: LinkId,
        frame: &CheckedFrame<'a>,
        buffers: &'a mut [FrameBuffer; 2],
    ) -> CheckedFrame<'a> {
        // What cannot be remapped was not taken.
        self.gate(link).and_then(|gate| gate.pass(frame, buffers).ok()).unwrap_or(*frame)
    }

    /// Whether a frame shows that whoever sent it may be let in at such a gate.
    ///
    /// # Errors
    ///
    /// Why it does not.
    pub fn would_let_in(
        &self,
        options: &GateOptions,
        membership: Option<Membership>,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> Result<(), Refusal> {
        let member = membership.map(|membership| membership.member);
        let believes = |verify: &Verify| self.signing.would_accept(&verify.key, member, frame, now);
        options.verify.as_ref().map_or(Ok(()), believes)
    }

    /// The time that is signed with.
    pub fn signing_clock(&self) -> &SigningClock {
        &self.signing.clock
    }

    /// The same, to be put forward.
    pub fn signing_clock_mut(&mut self) -> &mut SigningClock {
        &mut self.signing.clock
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mavlink::{Key, SystemMap};

    #[test]
    fn only_what_frames_are_asked_for_costs_them_buffers() {
        let make = |options: GateOptions| {
            let mut signing = Signing::default();
            Gate::new(&options, None, LinkId::new(0).unwrap(), &mut signing, Time::ZERO)
                .map(|gate| (gate.reads, gate.rewrites))
        };
        let none = GateOptions::default;
        let key = || Key::from_passphrase("my dog");
        let verify =
            Verify { key: key(), allow_unsigned: vec![], strip: false, before_sending: false };
        let sign = Sign { key: key(), v1: OldFrames::Pass };
        assert_eq!(make(none()), None);
        assert_eq!(make(GateOptions { is_readonly: true, ..none() }), Some((false, false)));
        assert_eq!(make(GateOptions { max_rate: Some(50), ..none() }), Some((false, false)));
        assert_eq!(
            make(GateOptions { blocks_stream_requests: true, ..none() }),
            Some((false, false))
        );
        assert_eq!(make(GateOptions { verify: Some(verify), ..none() }), Some((true, false)));
        assert_eq!(make(GateOptions { sign: Some(sign), ..none() }), Some((false, true)));
        assert_eq!(make(GateOptions { version: Some(Version::V1), ..none() }), Some((false, true)));
        let remap = Some(Arc::new(SystemMap::new(&[(1, 2)]).unwrap()));
        assert_eq!(make(GateOptions { remap, ..none() }), Some((true, true)));
    }
}
