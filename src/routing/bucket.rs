//! So many frames in a second and no more.

use super::time::Time;

/// Lets so many frames through in a second; what was not used is saved up for one second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bucket {
    /// In millionths of a frame, so that each microsecond brings the rate.
    level: u64,
    filled: Time,
}

/// One frame, in a [`Bucket`].
const FRAME: u64 = 1_000_000;

impl Bucket {
    /// With a second's frames in it, whatever the rate is.
    pub(super) fn full(now: Time) -> Self {
        Self { level: u64::MAX, filled: now }
    }

    /// Whether one more frame is let through at `rate` frames a second; then it is taken out.
    pub(super) fn permit(&mut self, rate: u32, now: Time) -> bool {
        let rate = u64::from(rate);
        let micros = u64::try_from(now.since(self.filled).as_micros()).unwrap_or(u64::MAX);
        self.level = self.level.saturating_add(micros.saturating_mul(rate)).min(rate * FRAME);
        self.filled = now;
        let is_permitted = self.level >= FRAME;
        if is_permitted {
            self.level -= FRAME;
        }
        is_permitted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_lets_the_rate_through_and_saves_up_a_second() {
        let mut bucket = Bucket::full(Time::ZERO);
        let mut passed = |from: u64, to: u64| {
            let at = (from..to).map(Time::from_millis);
            at.filter(|now| bucket.permit(100, *now)).count()
        };
        assert_eq!(passed(0, 1_000), 199, "what was saved up, and what came since");
        assert_eq!(passed(1_000, 2_000), 100);
        assert_eq!(passed(60_000, 60_050), 50);
    }
}
