//! Sends no faster than the line, so that the backlog stands in our queue, where we choose what to
//! refuse, and not in the system's, where everything waits alike.

use std::time::Duration;

use super::time::Time;

/// The pace of one link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Pacer {
    /// What the line carries, in bytes a second. Invariant: not zero.
    line_rate: u32,
    /// What the link is sent now: the line rate, or less while a radio asks for less.
    rate: u32,
    /// What may be sent now, in millionths of a byte; below zero after a frame that was longer.
    credit: i64,
    counted: Time,
    /// When a radio last told how full its buffer is.
    reported: Time,
}

/// Credit that may be saved up: a loop that comes late still fills the line.
const BURST: Duration = Duration::from_millis(50);

/// The least time between two sends: a fast line is sent several frames at once.
const PERIOD: Duration = Duration::from_millis(5);

/// How far a radio may slow a link down, in parts of the line rate.
const SLOWEST: u32 = 20;

/// How long a radio is believed that its buffer is full: they report once a second. One that says
/// nothing more was plugged out, or was somebody else's.
const BELIEVED: Duration = Duration::from_secs(10);

impl Pacer {
    /// The pace of a line that carries `line_rate` bytes a second; 0 is taken for 1.
    pub(super) fn new(line_rate: u32, now: Time) -> Self {
        let line_rate = line_rate.max(1);
        let mut pacer = Self { line_rate, rate: line_rate, credit: 0, counted: now, reported: now };
        pacer.credit = pacer.most();
        pacer
    }

    /// What the link is sent now, in bytes a second.
    pub(super) fn rate(&self) -> u32 {
        self.rate
    }

    /// What the line carries, in bytes a second.
    pub(super) fn line_rate(&self) -> u32 {
        self.line_rate
    }

    /// How many bytes may be sent now. A frame that begins within them may be sent whole.
    pub(super) fn budget(&mut self, now: Time) -> usize {
        let elapsed = i64::try_from(now.since(self.counted).as_micros()).unwrap_or(i64::MAX);
        self.counted = self.counted.max(now);
        let earned = elapsed.saturating_mul(i64::from(self.rate));
        self.credit = self.credit.saturating_add(earned).min(self.most());
        // Anything above zero lets a frame begin.
        usize::try_from(self.credit + MICROS - 1).map_or(0, |credit| credit / MICROS as usize)
    }

    /// So many bytes were sent.
    pub(super) fn consume(&mut self, bytes: usize) {
        self.credit -= bytes as i64 * MICROS;
    }

    /// When there is something to send for again. Changes with [`Pacer::consume`].
    pub(super) fn ready_at(&self, now: Time) -> Time {
        let debt = (-self.credit).max(0) / i64::from(self.rate) + 1;
        now + Duration::from_micros(debt as u64).max(PERIOD)
    }

    /// A radio tells how much of its buffer is free, in per cent: it is sent less as the buffer
    /// fills, and more again as it drains, as ArduPilot does.
    pub(super) fn handle_radio_status(&mut self, txbuf: u8, now: Time) {
        self.reported = now;
        let percent = match txbuf {
            0..20 => 70,
            20..50 => 90,
            50..=90 => 100,
            91..=95 => 110,
            96.. => 130,
        };
        let rate = u64::from(self.rate) * percent / 100 + u64::from(percent > 100);
        let slowest = u64::from((self.line_rate / SLOWEST).max(1));
        // At most the line rate, which is a u32.
        self.rate = rate.clamp(slowest, u64::from(self.line_rate)) as u32;
    }

    /// Goes back to the line rate if the radio that asked for less is not heard any more; says
    /// whether it did.
    pub(super) fn forget_radio(&mut self, now: Time) -> bool {
        let is_over = self.rate < self.line_rate && now.since(self.reported) >= BELIEVED;
        if is_over {
            self.rate = self.line_rate;
        }
        is_over
    }

    fn most(&self) -> i64 {
        BURST.as_micros() as i64 * i64::from(self.rate)
    }
}

/// Millionths in a whole.
const MICROS: i64 = 1_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backlog_leaves_at_the_line_rate_however_late_the_loop_comes() {
        for step in [1, 7, 20, 49] {
            let mut pacer = Pacer::new(5_760, Time::ZERO);
            pacer.consume(288); // what may be sent at once
            let mut sent = 0;
            for millis in (0..10_000).step_by(step) {
                while pacer.budget(Time::from_millis(millis as u64)) > 0 {
                    pacer.consume(40);
                    sent += 40;
                }
            }
            assert!((57_000..=57_700).contains(&sent), "{sent} bytes in steps of {step} ms");
        }
    }

    #[test]
    fn it_is_ready_when_it_says() {
        let mut pacer = Pacer::new(960, Time::ZERO);
        pacer.consume(280);
        assert_eq!(pacer.budget(Time::ZERO), 0);
        let ready = pacer.ready_at(Time::ZERO);
        assert_eq!(pacer.budget(ready - Duration::from_micros(10)), 0);
        assert!(pacer.budget(ready) > 0);
    }

    #[test]
    fn the_slowest_line_sends_a_long_frame_in_one_wait_however_long() {
        let mut pacer = Pacer::new(1, Time::ZERO);
        pacer.consume(280);
        let ready = pacer.ready_at(Time::ZERO);
        assert_eq!(ready.since(Time::ZERO).as_secs(), 279, "280, less what may be sent at once");
        assert!(pacer.budget(ready) > 0);
        assert!(pacer.budget(Time::from_micros(u64::MAX)) > 0, "and no end of waiting is too long");
    }

    #[test]
    fn a_radio_slows_its_link_down_and_lets_it_recover() {
        let mut pacer = Pacer::new(5_760, Time::ZERO);
        for _ in 0..3 {
            pacer.handle_radio_status(10, Time::ZERO);
        }
        assert_eq!(pacer.rate(), 1_975);
        for _ in 0..100 {
            pacer.handle_radio_status(0, Time::ZERO);
        }
        assert_eq!(pacer.rate(), 288, "never to a stop");
        for _ in 0..20 {
            pacer.handle_radio_status(100, Time::ZERO);
        }
        assert_eq!(pacer.rate(), 5_760, "never above the line rate");
    }

    #[test]
    fn a_radio_that_reports_no_more_slows_nothing_down_any_more() {
        let mut pacer = Pacer::new(5_760, Time::ZERO);
        pacer.handle_radio_status(0, Time::from_millis(500));
        assert_eq!(pacer.rate(), 4_032);
        assert!(!pacer.forget_radio(Time::from_millis(10_499)), "still believed");
        assert!(pacer.forget_radio(Time::from_millis(10_500)));
        assert_eq!(pacer.rate(), 5_760);
        assert!(!pacer.forget_radio(Time::from_millis(99_000)), "once");
    }
}
