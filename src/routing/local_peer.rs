//! The other side of a link that stays inside the program: a simulated vehicle, a log that is
//! played back, a component of the router's own.
//!
//! A peer is a machine without a clock, a thread or a descriptor: frames come in by
//! [`LocalPeer::handle_frame`], frames go out by [`LocalPeer::poll_transmit`] and
//! [`LocalPeer::poll_bulk`], and time is an argument. To the router its link is one like any other:
//! what it says is cut, checked, counted, filtered, learned from and queued like the bytes of a
//! socket, and what is meant for it waits in a bounded queue that is emptied once a turn.
//!
//! When it is asked what it has to say: once its link is up, after frames were handed to it, and
//! when [`LocalPeer::poll_timeout`] is over; then for as long as it goes on, a bounded amount a turn,
//! so that a peer that never ends keeps nobody waiting.
//!
//! There are two ways of saying something. What has its time is said by
//! [`LocalPeer::poll_transmit`]: who is too slow for it loses it, as with any sender. What can wait
//! is said by [`LocalPeer::poll_bulk`]: only while every other link has room for it, so that a whole
//! parameter list or a log at full speed arrives as fast as the slowest link takes it. A connection
//! that has taken nothing for a second is not waited for.
//!
//! A peer must bound what it remembers of what it is told: the network tells it.

use std::fmt;

use super::queue::Precedence;
use super::time::Time;
use crate::mavlink::Frame;

/// The other side of a link inside the program; see the module.
pub trait LocalPeer: fmt::Debug {
    /// Hears a frame, which passed its check where it came in.
    ///
    /// It may have been made with an older definition of its message, and be for anybody at all.
    fn handle_frame(&mut self, frame: &Frame<'_>, now: Time);

    /// Appends the next frame that it has to say at `now`, a whole one; or says `false` until the
    /// next frame that it hears, or the next deadline.
    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool;

    /// Whether it has frames that can wait: which room the queues of the others must have before it
    /// is asked for one.
    fn bulk(&self, _now: Time) -> Option<Precedence> {
        None
    }

    /// Appends the next frame that can wait, a whole one; or says `false` if there is none after all.
    fn poll_bulk(&mut self, _now: Time, _out: &mut Vec<u8>) -> bool {
        false
    }

    /// When it next has something to say, or to do, of its own accord.
    fn poll_timeout(&self) -> Option<Time>;

    /// Why there is an end to it, if it will never say or do anything again: its link is then
    /// closed, and its endpoint not opened again.
    fn ended(&self) -> Option<&str> {
        None
    }

    /// Whether that end is a failure, which somebody has to hear of.
    fn has_failed(&self) -> bool {
        false
    }
}
