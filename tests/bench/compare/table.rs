//! Medians and their spread, as a table in Markdown.

use std::fmt;

use super::measure::Sample;
use super::router::Candidate;

/// One line a candidate.
pub(crate) struct Table {
    head: &'static str,
    rows: Vec<String>,
}

const HEAD: &str = "\
| | CPU/frame in | CPU/delivered (spread) | × floor | lost | age p50 | p99 | p99.9 | memory | switches/s |
|---|---|---|---|---|---|---|---|---|---|";

impl Table {
    /// All candidates, each against the floor of the same round.
    pub(crate) fn of(candidates: &[Candidate], samples: &[Vec<Sample>]) -> Self {
        let floor = candidates.iter().position(|candidate| candidate.name == Candidate::FLOOR);
        let floor = floor.map(|at| samples[at].as_slice());
        let rows = candidates.iter().zip(samples);
        let rows = rows.map(|(candidate, samples)| row(&candidate.name, samples, floor)).collect();
        Self { head: HEAD, rows }
    }

    /// With other columns.
    pub(crate) fn with_head(head: &'static str, rows: Vec<String>) -> Self {
        Self { head, rows }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.head)?;
        self.rows.iter().try_for_each(|row| writeln!(f, "{row}"))
    }
}

fn row(name: &str, samples: &[Sample], floor: Option<&[Sample]>) -> String {
    let of = |value: &dyn Fn(&Sample) -> f64| median(samples.iter().map(value));
    let costs: Vec<f64> = samples.iter().map(|sample| sample.cpu_out).collect();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let most = costs.iter().copied().fold(0.0, f64::max);
    let ratio = floor.map_or_else(
        || "-".to_owned(),
        |floor| {
            let ratios = costs.iter().zip(floor).map(|(cost, floor)| cost / floor.cpu_out);
            format!("{:.2}", median(ratios))
        },
    );
    let [p50, p99, p999] = [0, 1, 2].map(|at| of(&|sample| sample.ages[at]));
    format!(
        "| {name} | {:.2} µs | {:.2} µs ({least:.2}-{most:.2}) | {ratio} | {:.2} % | {p50:.0} µs \
         | {p99:.0} µs | {p999:.0} µs | {:.1} MiB | {:.0} |",
        of(&|sample| sample.cpu_in),
        of(&|sample| sample.cpu_out),
        of(&|sample| sample.loss) * 100.0,
        of(&|sample| sample.memory),
        of(&|sample| sample.switches),
    )
}

/// The value in the middle.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
