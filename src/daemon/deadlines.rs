//! What the loop does when a timer fires, and which timers a turn makes necessary.

use std::time::Duration;

use super::event_loop::{Daemon, clock};
use super::links::Output;
use super::timers::Timer;
use crate::link::Stream;
use crate::routing::{LinkId, Time};

impl Daemon {
    /// How long the loop may wait.
    pub(super) fn timeout(&mut self) -> Option<Duration> {
        if !self.ready.is_empty() {
            return Some(Duration::ZERO);
        }
        let deadline = self.timers.next_deadline()?;
        // A timer must not be found short of its deadline again and again: poll rounds up.
        self.alarm.wait_for(deadline, || clock(self.start))
    }

    /// Does what is due.
    pub(super) fn handle_timers(&mut self) {
        while let Some(timer) = self.timers.pop_due(self.now) {
            match timer {
                Timer::Endpoint(index) => self.handle_deadline(index),
                Timer::Peers(index) => self.expire_peers(index),
                Timer::Pause => self.handle_pause(),
                Timer::Pace(link) => self.handle_pace(link),
                Timer::Stall(link) => self.check_stalled(link),
                Timer::Proof(link) => self.check_proof(link),
                Timer::Local(link) => self.handle_local_deadline(link),
                Timer::Own => self.handle_own_deadline(),
                Timer::Log(index) => self.say_last_word(index),
                Timer::Control => self.control.handle_timeout(),
                Timer::Http => self.http.handle_timeout(),
                Timer::Notify => self.feed_watchdog(),
                Timer::Router => {
                    self.router_deadline = None;
                    self.router.handle_timeout(self.now);
                }
            }
        }
    }

    /// Sets the timers that this turn has made necessary, each once.
    pub(super) fn set_timers(&mut self) {
        let deadline = self.router.poll_timeout();
        if let Some(at) = deadline
            && self.router_deadline.is_none_or(|set| set > at)
        {
            self.timers.set(at, Timer::Router);
            self.router_deadline = deadline;
        }
        for link in std::mem::take(&mut self.io.paced).iter() {
            self.set_pace_timer(link);
        }
        for link in std::mem::take(&mut self.io.blocked).iter() {
            self.set_stall_timer(link);
        }
        self.ask_local_peers();
    }

    fn set_pace_timer(&mut self, id: LinkId) {
        let ready = self.router.port(id).and_then(|port| port.ready_at(self.now));
        if let (Some(at), Some(link)) = (ready, self.io.links.get_mut(id))
            && link.pace_deadline.is_none()
        {
            link.pace_deadline = Some(at);
            self.timers.set(at, Timer::Pace(id));
        }
    }

    /// Sends what the pace of a link now lets leave.
    fn handle_pace(&mut self, id: LinkId) {
        let Some(link) = self.io.links.get_mut(id) else { return };
        if link.pace_deadline.is_some_and(|deadline| deadline <= self.now) {
            link.pace_deadline = None;
            self.io.flush(&mut self.router, id, self.now);
        }
    }

    pub(super) fn set_stall_timer(&mut self, id: LinkId) {
        let Some(at) = self.stalled_at(id) else { return };
        if let Some(link) = self.io.links.get_mut(id)
            && link.stall_deadline.is_none()
        {
            link.stall_deadline = Some(at);
            self.timers.set(at, Timer::Stall(id));
        }
    }

    /// When a connection will have stalled, if it takes nothing until then. A serial port may
    /// wait for ever: whoever is behind it can be asked for nothing.
    fn stalled_at(&self, id: LinkId) -> Option<Time> {
        let link = self.io.links.get(id)?;
        let Output::Stream(output) = &link.output else { return None };
        let Stream::Tcp(_) = output.stream else { return None };
        let timeout = self.io.endpoints[link.endpoint].options().stall_timeout;
        Some(output.blocked_since? + timeout)
    }

    /// Closes a connection that has taken nothing for too long.
    fn check_stalled(&mut self, id: LinkId) {
        let Some(link) = self.io.links.get_mut(id) else { return };
        if link.stall_deadline.is_none_or(|deadline| deadline > self.now) {
            return;
        }
        link.stall_deadline = None;
        match self.stalled_at(id) {
            Some(at) if at <= self.now => self.close_link(id, "it takes nothing any more"),
            _ => self.set_stall_timer(id),
        }
    }
}
