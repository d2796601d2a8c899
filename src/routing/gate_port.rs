//! The gate of a link as its port uses it: made, and gone through by what leaves.

use super::counters::DropReason;
use super::gate::Gate;
use super::link_set::LinkId;
use super::options::LinkOptions;
use super::port::Port;
use super::queue::Precedence;
use super::signing::Signing;
use super::time::Time;
use crate::mavlink::{CheckedFrame, FrameBuffer};

impl Port {
    /// Makes the gate that the options of the link ask for.
    pub(super) fn set_gate(&mut self, link: LinkId, signing: &mut Signing, now: Time) {
        let LinkOptions { gate: options, membership, .. } = &self.options;
        let is_proven = self.gate.as_ref().is_some_and(|gate| gate.has_proof_for(options));
        self.gate = Gate::new(options, *membership, link, signing, now);
        if let Some(gate) = &mut self.gate {
            gate.awaits_proof &= !is_proven;
        }
    }

    /// Whether frames come through a gate.
    #[inline]
    pub(super) fn has_gate(&self) -> bool {
        self.gate.is_some()
    }

    /// Whether frames leave through a gate, if they do; one that only keeps out what comes is no
    /// matter to them.
    #[inline]
    pub(super) fn leaves_by_gate(&self) -> bool {
        self.gate.as_ref().is_some_and(|gate| gate.rewrites || gate.awaits_proof)
    }

    /// Why a frame is not sent through the gate, whatever it would be there, if so.
    fn refusal_at_gate(
        &self,
        frame: &CheckedFrame<'_>,
        precedence: Precedence,
        signing: &Signing,
        now: Time,
    ) -> Option<DropReason> {
        let gate = self.gate.as_deref()?;
        if gate.awaits_proof {
            return Some(DropReason::Unproven);
        }
        if gate.options.needs_belief && frame.header.signed && !signing.is_believed {
            return Some(DropReason::FilteredOut);
        }
        self.refusal(frame, precedence, now)
    }

    /// Queues a frame in the shape that the gate gives it, or counts why not.
    #[inline(never)]
    pub(super) fn offer_gated(
        &mut self,
        frame: &CheckedFrame<'_>,
        precedence: Precedence,
        signing: &mut Signing,
        now: Time,
    ) {
        if let Some(reason) = self.refusal_at_gate(frame, precedence, signing, now) {
            return self.counters[reason] += 1;
        }
        // Out of the port for the time being, so that both can be used.
        let Some(gate) = self.gate.take() else { return };
        let (mut shaped, mut signed) = <([FrameBuffer; 3], FrameBuffer)>::default();
        // Signed in the order of the queue, so that no stream goes back (rule 42).
        match gate.let_out(frame, &mut signing.clock, now, (&mut shaped, &mut signed)) {
            // Caps are counted by the ids that a frame has here, as they are looked up.
            Ok(made) => self.queue(&CheckedFrame { bytes: made.bytes, ..*frame }, precedence, now),
            Err(reason) => self.counters[reason] += 1,
        }
        self.gate = Some(gate);
    }
}
