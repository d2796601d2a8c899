//! What is to be done later, and when the loop must wake up for it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::endpoint_table::EndpointId;
use crate::routing::{LinkId, Time};

/// What is to be done.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Timer {
    /// Try an endpoint again, or give up trying.
    Endpoint(EndpointId),
    /// Look for peers of an endpoint that fell silent.
    Peers(EndpointId),
    /// Look for links that stopped in the middle of a frame.
    Pause,
    /// Send what the pace of a link now lets leave.
    Pace(LinkId),
    /// See whether the other side of a connection still takes something.
    Stall(LinkId),
    /// See whether whoever has to show a key has done so.
    Proof(LinkId),
    /// Ask the other side of a link inside the program what it has to say.
    Local(LinkId),
    /// Let the program's own component live for another second.
    Own,
    /// Tell the service manager that the loop is alive.
    Notify,
    /// Look after the clients of the control socket.
    Control,
    /// See to the connections that ask for metrics, or listen for them again.
    Http,
    /// Write the line of an endpoint that had to wait.
    Log(EndpointId),
    /// [`crate::routing::Router::handle_timeout`].
    Router,
}

/// Deadlines. A timer that has become pointless is not taken out: it fires, and whoever looks after
/// it finds nothing to do, for each keeps the deadline that holds.
#[derive(Default, Debug)]
pub(super) struct Timers {
    heap: BinaryHeap<Reverse<(Time, Timer)>>,
}

impl Timers {
    /// Sets a timer.
    pub(super) fn set(&mut self, at: Time, timer: Timer) {
        self.heap.push(Reverse((at, timer)));
    }

    /// The nearest deadline.
    pub(super) fn next_deadline(&self) -> Option<Time> {
        self.heap.peek().map(|Reverse((at, _))| *at)
    }

    /// A timer that is due.
    pub(super) fn pop_due(&mut self, now: Time) -> Option<Timer> {
        if self.next_deadline()? > now {
            return None;
        }
        self.heap.pop().map(|Reverse((_, timer))| timer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timers_fire_in_the_order_of_their_deadlines_and_not_before() {
        let mut timers = Timers::default();
        timers.set(Time::from_millis(20), Timer::Pause);
        timers.set(Time::from_millis(10), Timer::Router);
        assert_eq!(timers.next_deadline(), Some(Time::from_millis(10)));
        assert_eq!(timers.pop_due(Time::from_millis(9)), None);
        assert_eq!(timers.pop_due(Time::from_millis(20)), Some(Timer::Router));
        assert_eq!(timers.pop_due(Time::from_millis(20)), Some(Timer::Pause));
        assert_eq!(timers.pop_due(Time::from_millis(99)), None);
    }
}
