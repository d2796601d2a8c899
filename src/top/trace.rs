//! How a figure went of late: rates out of counts, kept for a minute, drawn as small bars.

use std::collections::VecDeque;

/// How many rates are kept: with a picture a second, those of a minute.
const KEPT: usize = 60;

/// The rates of a counter.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Trace {
    last: Option<u64>,
    rates: VecDeque<f64>,
}

impl Trace {
    /// Takes how far the counter is now, `seconds` after the last time.
    pub(super) fn push(&mut self, count: u64, seconds: f64) {
        let before = self.last.replace(count);
        if let Some(before) = before
            && seconds > 0.0
        {
            // One that fell began anew.
            let new = count.checked_sub(before).unwrap_or(count);
            self.rates.push_back(new as f64 / seconds);
            if self.rates.len() > KEPT {
                self.rates.pop_front();
            }
        }
    }

    /// Per second, over the last three pictures: steady enough to be read.
    pub(super) fn rate(&self) -> f64 {
        let last = self.rates.iter().rev().take(3);
        let count = last.len().max(1);
        last.fold(0.0, |sum, rate| sum + rate) / count as f64
    }

    /// The last rates as bars, one a column, the newest at the right.
    pub(super) fn bars(&self, width: usize) -> String {
        const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
        let shown = self.rates.len().min(width);
        let rates = self.rates.iter().skip(self.rates.len() - shown);
        let top = rates.clone().fold(0.0, |top: f64, rate| top.max(*rate));
        let bar = |rate: &f64| match rate / top {
            share if share > 0.0 => BARS[((share * 8.0).ceil() as usize).clamp(1, 8) - 1],
            _ => ' ',
        };
        let mut text = " ".repeat(width - shown);
        text.extend(rates.map(bar));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_differences() {
        let mut trace = Trace::default();
        assert_eq!((trace.rate(), trace.bars(3)), (0.0, "   ".to_owned()));
        for count in [100, 110, 130, 130] {
            trace.push(count, 2.0);
        }
        assert_eq!(trace.rate(), 5.0);
        assert_eq!(trace.bars(5), "  ▄█ ");
        assert_eq!(trace.bars(2), "█ ");
        // Counted from nothing again.
        trace.push(20, 2.0);
        assert_eq!(trace.bars(1), "█");
    }

    #[test]
    fn a_minute_is_kept() {
        let mut trace = Trace::default();
        (0..1_000).for_each(|count| trace.push(count, 1.0));
        assert_eq!(trace.bars(100), format!("{}{}", " ".repeat(40), "█".repeat(60)));
    }
}
