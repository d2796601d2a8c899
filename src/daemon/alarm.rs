//! Wakes the loop for a deadline that is far away.
//!
//! The system takes a microsecond to hear of a deadline and to forget it again, which would be once
//! for every frame if each wait had to name it. So it is told of a far one once.

use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::time::Duration;

use mio::unix::SourceFd;
use mio::{Interest, Registry, Token};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
    timerfd_settime,
};

use crate::routing::Time;

/// A nearer deadline is named by the wait: it is one of many that come and go, and to set the alarm
/// for each would be a call more.
const NEAR: Duration = Duration::from_millis(100);

/// An alarm of the poll.
pub(super) struct Alarm {
    timer: OwnedFd,
    /// When it will ring; `None` if it is not set.
    rings_at: Option<Time>,
}

impl Alarm {
    /// One that is not set; when it rings, that is an event of `token`.
    ///
    /// # Errors
    ///
    /// If the system refuses a timer.
    pub(super) fn new(registry: &Registry, token: Token) -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        registry.register(&mut SourceFd(&timer.as_raw_fd()), token, Interest::READABLE)?;
        Ok(Self { timer, rings_at: None })
    }

    /// How long the loop may wait, if it has to do something at `deadline`: `None` if the alarm wakes
    /// it in time. It may ring too early, when what it was set for is no longer to be done.
    pub(super) fn wait_for(
        &mut self,
        deadline: Time,
        clock: impl FnOnce() -> Time,
    ) -> Option<Duration> {
        if self.rings_at.is_some_and(|at| at <= deadline) {
            return None;
        }
        let wait = deadline.since(clock());
        if wait < NEAR || self.set(wait).is_err() {
            return Some(wait);
        }
        self.rings_at = Some(deadline);
        None
    }

    /// It has rung. To be read it need not be: the system tells of it once, and anew when it is set.
    pub(super) fn handle_event(&mut self) {
        self.rings_at = None;
    }

    fn set(&self, wait: Duration) -> io::Result<()> {
        let it_value = Timespec::try_from(wait).map_err(io::Error::other)?;
        let once = Itimerspec { it_interval: Timespec::default(), it_value };
        timerfd_settime(&self.timer, TimerfdTimerFlags::empty(), &once)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mio::{Events, Poll};

    const TOKEN: Token = Token(7);

    /// The deadline is so far from now that the wait names it.
    fn near() -> Duration {
        NEAR - Duration::from_millis(1)
    }

    #[test]
    fn a_far_deadline_is_told_once_and_rings_and_a_near_one_is_waited_for() {
        let mut poll = Poll::new().unwrap();
        let mut alarm = Alarm::new(poll.registry(), TOKEN).unwrap();
        let (now, far) = (Time::from_millis(5), Time::from_millis(5) + NEAR);
        assert_eq!(alarm.wait_for(now + near(), || now), Some(near()));
        assert_eq!(alarm.wait_for(far, || now), None);
        let unread = || -> Time { panic!("the clock is not asked for what is set already") };
        assert_eq!(alarm.wait_for(far, unread), None);
        assert_eq!(alarm.wait_for(far + NEAR, unread), None, "it rings before that");
        assert_eq!(alarm.wait_for(now + near(), || now), Some(near()), "it would ring after that");

        let mut events = Events::with_capacity(4);
        for round in 0..2 {
            poll.poll(&mut events, None).unwrap();
            let tokens: Vec<Token> = events.iter().map(mio::event::Event::token).collect();
            assert_eq!(tokens, [TOKEN], "round {round}");
            alarm.handle_event();
            assert_eq!(alarm.wait_for(far + NEAR, || far), None, "it is set again");
        }
    }

    #[test]
    fn a_deadline_before_the_one_it_is_set_for_sets_it_anew() {
        let mut poll = Poll::new().unwrap();
        let mut alarm = Alarm::new(poll.registry(), TOKEN).unwrap();
        let day = Time::ZERO + Duration::from_secs(86_400);
        assert_eq!(alarm.wait_for(day, || Time::ZERO), None);
        assert_eq!(alarm.wait_for(Time::ZERO + NEAR, || Time::ZERO), None);
        let mut events = Events::with_capacity(4);
        poll.poll(&mut events, None).unwrap();
        assert_eq!(events.iter().count(), 1);
    }
}
