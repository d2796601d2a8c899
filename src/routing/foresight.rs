//! What a gate would do with a frame that is only asked about: nothing is believed, signed or counted
//! by it, and no bucket is emptied.
//!
//! It says the same as the gate itself, step by step, but for the one thing that only the bytes of a
//! frame that came can tell: whether a signature is good.

use super::counters::DropReason;
use super::gate::Gate;
use super::port::Port;
use super::queue::Precedence;
use super::time::Time;
use crate::mavlink::{CheckedFrame, SIGNATURE};

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
        if self.options.is_readonly {
            return Some(DropReason::ReadOnly);
        }
        self.pass(frame, &mut Default::default()).err()
    }

    /// Why a frame would not leave, or else how long it would be then, in bytes.
    fn foresee_out(&self, frame: &CheckedFrame<'_>) -> Result<usize, DropReason> {
        let mut buffers = Default::default();
        let frame = self.shaped(frame, &mut buffers)?;
        let signature = self.signs(&frame).map_or(0, |_| SIGNATURE);
        Ok(frame.bytes.len() + signature)
    }
}

impl Port {
    /// Why a frame that came would not get past the gate, if it would not.
    pub(super) fn foresee_in(&self, frame: &CheckedFrame<'_>, now: Time) -> Option<DropReason> {
        self.gate.as_ref()?.foresee_in(frame, now)
    }

    /// Whether what becomes of a frame that came hangs on its signature.
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
        let gate = self.gate.as_ref().filter(|_| self.leaves_by_gate());
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
