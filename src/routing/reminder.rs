//! Keeps from telling the same of the same again and again.

use std::time::Duration;

use super::time::Time;

/// How long nothing more is told of the same.
const AGAIN: Duration = Duration::from_secs(60);

/// How many are remembered; one more takes the place of the one that was told of longest ago.
const REMEMBERED: usize = 64;

/// Of whom something was told in the last minute, for once a minute is enough.
#[derive(Clone, Debug)]
pub struct Reminder<T>(Vec<(T, Time)>);

impl<T> Default for Reminder<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: PartialEq> Reminder<T> {
    /// Whether it is time to tell of somebody; if so, that is remembered.
    pub fn is_due(&mut self, of: T, now: Time) -> bool {
        if let Some((_, told)) = self.0.iter_mut().find(|told| told.0 == of) {
            let is_due = now.since(*told) >= AGAIN;
            if is_due {
                *told = now;
            }
            return is_due;
        }
        if self.0.len() < REMEMBERED {
            self.0.reserve_exact(REMEMBERED - self.0.len());
            self.0.push((of, now));
        } else if let Some(oldest) = self.0.iter_mut().min_by_key(|told| told.1) {
            *oldest = (of, now);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_told_of_once_a_minute() {
        let mut reminder = Reminder::default();
        let mut is_due =
            |system, seconds: u64| reminder.is_due(system, Time::from_millis(seconds * 1_000));
        assert!(is_due(1, 0) && is_due(2, 1) && !is_due(1, 59) && is_due(1, 60));
        assert!(!is_due(1, 119));
        assert!((3..=255).all(|system| is_due(system, 120)));
        assert_eq!(reminder.0.len(), REMEMBERED);
    }
}
