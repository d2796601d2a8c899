//! How old frames were on arrival, third by third, in as little memory after a day as after a second.

use std::time::Duration;

use crate::Clock;

/// Steps of a tenth from a microsecond to a quarter of an hour.
const STEPS: usize = 220;

/// Counts of ages that are alike.
#[derive(Clone)]
struct Histogram([u64; STEPS]);

impl Histogram {
    fn quantile(&self, part: f64) -> Duration {
        let all: u64 = self.0.iter().sum();
        let (mut left, mut step) = ((all as f64 * part) as u64, 0);
        while step + 1 < STEPS && left >= self.0[step] {
            left -= self.0[step];
            step += 1;
        }
        Duration::from_secs_f64(1.1_f64.powi(step as i32 + 1) / 1e6)
    }
}

/// The ages of each third of a run.
#[derive(Clone)]
pub(crate) struct Thirds([Histogram; 3]);

impl Thirds {
    pub(crate) fn new() -> Self {
        Self([const { Histogram([0; STEPS]) }; 3])
    }

    /// What was sent at `sent`, by the clock of the run, has come.
    pub(crate) fn count(&mut self, clock: &Clock, sent: u64) {
        let micros = clock.now().saturating_sub(sent) as f64 / 1e3;
        let step = (micros.max(1.0).ln() / 1.1_f64.ln()) as usize;
        self.0[clock.third()].0[step.min(STEPS - 1)] += 1;
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (mine, its) in self.0.iter_mut().zip(&other.0) {
            mine.0.iter_mut().zip(&its.0).for_each(|(mine, its)| *mine += its);
        }
    }

    /// What this part of the frames of each third was not older than.
    pub(crate) fn quantiles(&self, part: f64) -> [Duration; 3] {
        [0, 1, 2].map(|third: usize| self.0[third].quantile(part))
    }
}
