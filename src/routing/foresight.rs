//! What a gate would do with a frame that is only asked about: nothing is believed, signed or counted
//! by it, and no bucket is emptied.
//!
//! It says the same as the gate itself, step by step, but for the one thing that only the bytes of a
//! frame that came can tell: whether a signature is good.

use super::counters::DropReason;
use super::gate::Gate;
use super::link_set::LinkId;
use super::port::Port;
use super::queue::Precedence;
use super::router::Router;
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, FrameBuffer, SIGNATURE, Version};

impl Gate {
    /// Why a frame that came would not be let in; if it is signed, with a good signature.
    fn foresee_in(&self, frame: &CheckedFrame<'_>, now: Time) -> Option<DropReason> {
        if let Some(reason) = self.foresee_keeping_out(frame.header.id, now) {
            return Some(reason);
        }
        let is_named =
            |id| self.options.verify.as_ref().is_none_or(|it| it.allow_unsigned.contains(&id));
        if !frame.header.signed && !is_named(frame.header.id) {
            return Some(DropReason::Unsigned);
        }
        let (mut stripped, mut remapped) = <(FrameBuffer, FrameBuffer)>::default();
        self.remap(&self.bared(frame, &mut stripped), &mut remapped).err()
    }

    /// Why a frame would not leave, or else how long it would be then, in bytes.
    fn foresee_out(&self, frame: &CheckedFrame<'_>) -> Result<usize, DropReason> {
        let [mut remapped, mut converted, mut shaped] = <[FrameBuffer; 3]>::default();
        let frame = self.remap(frame, &mut remapped)?;
        let frame = self.convert(&frame, &mut converted)?;
        let frame = self.shape(&frame, &mut shaped)?;
        let is_unsigned = frame.header.version == Version::V2 && !frame.header.signed;
        let signature = if self.options.sign.is_some() && is_unsigned { SIGNATURE } else { 0 };
        Ok(frame.bytes.len() + signature)
    }
}

impl Port {
    /// Why a frame that came would not get past the gate, if it would not.
    pub(super) fn foresee_in(&self, frame: &CheckedFrame<'_>, now: Time) -> Option<DropReason> {
        self.gate.as_ref()?.foresee_in(frame, now)
    }

    /// Whether a frame that came would be taken only if its signature is good.
    pub(super) fn looks_at_signature(&self, frame: &CheckedFrame<'_>, now: Time) -> bool {
        let looks = |gate: &Gate| {
            gate.options.verify.is_some()
                && gate.foresee_keeping_out(frame.header.id, now).is_none()
        };
        frame.header.signed && self.gate.as_deref().is_some_and(looks)
    }

    /// Why a frame would not be queued, if it would not.
    pub(super) fn foresee_out(
        &self,
        frame: &CheckedFrame<'_>,
        precedence: Precedence,
        now: Time,
    ) -> Option<DropReason> {
        let gate = self.gate.as_ref().filter(|_| self.is_rewritten());
        if gate.is_some_and(|gate| gate.awaits_proof) {
            return Some(DropReason::Unproven);
        }
        let refusal = self.refusal(frame, precedence, now);
        let Some(gate) = gate.filter(|_| refusal.is_none()) else { return refusal };
        match gate.foresee_out(frame) {
            Err(reason) => Some(reason),
            Ok(len) => (!self.has_room_for(len, precedence)).then_some(DropReason::QueueFull),
        }
    }
}

impl Router {
    /// The ids that a component has on a link, if its frames come or go by it: others than here where
    /// they are remapped.
    pub fn on_the_wire(&self, link: LinkId, component: Component) -> Component {
        let gate = self.port(link).and_then(|port| port.gate.as_ref());
        let map = gate.and_then(|gate| gate.options.remap.as_deref());
        let system = map.map_or(component.system, |map| map.apply(component.system));
        Component::new(system, component.component)
    }

    /// Whether a link takes only what is signed.
    pub fn asks_for_signatures(&self, link: LinkId) -> bool {
        let gate = self.port(link).and_then(|port| port.gate.as_ref());
        gate.is_some_and(|gate| gate.options.verify.is_some())
    }
}
