//! Who has to show a key before it is sent anything: how long that may take, and who makes room.
//! Else anybody could take all the places of a server, and keep them from those who have the key.

use std::time::Duration;

use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::timers::Timer;
use crate::routing::LinkId;

/// How long it may take: heartbeats come each second, and whoever has the key signs them.
const PROOF: Duration = Duration::from_secs(10);

impl Daemon {
    /// Has a link closed in a while, unless the key is shown there by then. Does nothing if it was,
    /// or need not be.
    pub(super) fn ask_for_proof(&mut self, id: LinkId) {
        if let Some(link) = self.io.links.get_mut(id)
            && link.proof_deadline.is_none()
            && self.router.awaits_proof(id)
        {
            let at = self.now + PROOF;
            link.proof_deadline = Some(at);
            self.timers.set(at, Timer::Proof(id));
        }
    }

    /// Closes a link where the key was to be shown by now, and was not.
    pub(super) fn check_proof(&mut self, id: LinkId) {
        let Some(link) = self.io.links.get_mut(id) else { return };
        if link.proof_deadline.is_none_or(|deadline| deadline > self.now) {
            return;
        }
        link.proof_deadline = None;
        if self.router.awaits_proof(id) {
            let reason = format!("the key of `verify` not shown in {} s", PROOF.as_secs());
            self.close_unproven(id, &reason);
        }
    }

    /// Makes room at a server that is full: whoever has waited longest to show the key has to go.
    /// Says whether there was such a one.
    pub(super) fn replace_unproven(&mut self, index: EndpointId) -> bool {
        let links = self.links_of(index).into_iter();
        let unproven = links.filter(|id| self.router.awaits_proof(*id));
        let since = |id: &LinkId| self.io.links.get(*id).map(|link| link.since);
        let Some(oldest) = unproven.min_by_key(since) else { return false };
        self.close_unproven(
            oldest,
            "the key of `verify` not shown, and another one needs its place",
        );
        true
    }

    fn close_unproven(&mut self, id: LinkId, reason: &str) {
        if let Some(index) = self.io.links.get(id).map(|link| link.endpoint) {
            self.count_unproven(index);
            self.close_link(id, reason);
        }
    }
}

#[cfg(test)]
mod tests;
