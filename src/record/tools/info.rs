//! What is in a log: how long it is, who speaks, what is said how often, what is missing.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::error::ToolError;
use super::progress::Progress;
use crate::mavlink::{Component, Dialect, MessageId};
use crate::record::{ReaderStats, Record, TlogReader};
use crate::routing::Sequence;

/// What is in a log.
#[derive(Clone, Debug)]
pub struct Info {
    /// Records and bytes.
    pub stats: ReaderStats,
    /// The earliest and the latest time, in microseconds since 1970.
    pub span: (u64, u64),
    /// How often a record is older than the one before it.
    pub steps_back: u64,
    /// The longest pauses of [`GAP`] and more, at most [`LISTED`], in the order of time.
    pub gaps: Vec<Gap>,
    /// How many such pauses there are.
    pub gap_count: u64,
    /// What each component sent, and what of it is missing by its sequence numbers (rule 51).
    pub components: BTreeMap<Component, Sequence>,
    /// How often each message was sent: the first [`MESSAGES`] that occur.
    pub messages: BTreeMap<MessageId, u64>,
    /// Records of other messages than these.
    pub others: u64,
    last: u64,
}

/// A pause.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Gap {
    /// The time before it, in microseconds since 1970.
    pub at: u64,
    /// How long it is.
    pub duration: Duration,
}

/// A pause as short as this is none.
const GAP: Duration = Duration::from_secs(2);

/// How many pauses are told one by one.
const LISTED: usize = 10;

/// How many messages are told one by one: more than there are.
const MESSAGES: usize = 4096;

/// Reads a log to its end and says what is in it.
///
/// # Errors
///
/// If it cannot be read, or has no record.
pub fn info(path: &Path) -> Result<Info, ToolError> {
    let file = File::open(path).map_err(ToolError::read(path))?;
    let mut progress = Progress::new(file.metadata().map_or(0, |data| data.len()));
    let info = Info::read(TlogReader::new(file), |bytes| progress.add(bytes));
    let info = info.map_err(ToolError::read(path))?;
    if info.stats.records == 0 {
        return Err(ToolError::NoLog { path: path.to_owned(), bytes: info.stats.bytes });
    }
    Ok(info)
}

impl Info {
    fn read<R: Read>(
        mut reader: TlogReader<R>,
        mut tell: impl FnMut(u64),
    ) -> std::io::Result<Self> {
        let mut info = Self {
            stats: ReaderStats::default(),
            span: (u64::MAX, 0),
            steps_back: 0,
            gaps: Vec::new(),
            gap_count: 0,
            components: BTreeMap::new(),
            messages: BTreeMap::new(),
            others: 0,
            last: 0,
        };
        loop {
            let before = reader.stats().bytes;
            let Some(record) = reader.next_record()? else { break };
            info.handle(&record);
            tell(reader.stats().bytes - before);
        }
        info.stats = reader.stats();
        info.gaps.sort_by_key(|gap| gap.at);
        Ok(info)
    }

    fn handle(&mut self, record: &Record<'_>) {
        let header = record.frame.header();
        self.handle_time(record.micros);
        self.components.entry(header.source).or_default().handle(header.seq);
        if self.messages.len() < MESSAGES || self.messages.contains_key(&header.id) {
            *self.messages.entry(header.id).or_default() += 1;
        } else {
            self.others += 1;
        }
    }

    fn handle_time(&mut self, micros: u64) {
        let is_first = self.span == (u64::MAX, 0);
        self.span = (self.span.0.min(micros), self.span.1.max(micros));
        let last = std::mem::replace(&mut self.last, micros);
        if is_first {
            return;
        }
        self.steps_back += u64::from(micros < last);
        let duration = Duration::from_micros(micros.saturating_sub(last));
        if duration >= GAP {
            self.gap_count += 1;
            self.gaps.push(Gap { at: last, duration });
            self.gaps.sort_by_key(|gap| std::cmp::Reverse(gap.duration));
            self.gaps.truncate(LISTED);
        }
    }

    /// From the earliest time to the latest.
    pub fn duration(&self) -> Duration {
        Duration::from_micros(self.span.1.saturating_sub(self.span.0))
    }

    /// What a person wants to know of it, with the messages by the names that `dialect` has.
    pub fn told<'a>(&'a self, dialect: &'a Dialect) -> impl fmt::Display + 'a {
        Told { info: self, dialect }
    }

    fn rate(&self, frames: u64) -> f64 {
        let seconds = self.duration().as_secs_f64();
        if seconds > 0.0 { frames as f64 / seconds } else { 0.0 }
    }

    fn write_gaps(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.gap_count {
            0 => writeln!(f, "no pause of 2 s or more")?,
            count => writeln!(f, "{count} pauses of 2 s or more; the longest:")?,
        }
        for gap in &self.gaps {
            let since = Duration::from_micros(gap.at.saturating_sub(self.span.0));
            writeln!(f, "  {:>10.1} s at {}", gap.duration.as_secs_f64(), rough(since))?;
        }
        if self.steps_back > 0 {
            writeln!(f, "the time steps back {} times", self.steps_back)?;
        }
        Ok(())
    }

    fn write_components(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n{:<10} {:>10} {:>10} {:>8}", "component", "frames", "lost", "%")?;
        for (component, Sequence { received, lost, .. }) in &self.components {
            let share = 100.0 * *lost as f64 / (received + lost).max(1) as f64;
            writeln!(f, "{:<10} {received:>10} {lost:>10} {share:>8.2}", component.to_string())?;
        }
        if self.components.values().any(|it| it.lost > 0) {
            let why = "(what `log filter` left out counts as lost)";
            writeln!(f, "{why}")?;
        }
        Ok(())
    }

    fn write_messages(&self, f: &mut fmt::Formatter<'_>, dialect: &Dialect) -> fmt::Result {
        writeln!(f, "\n{:<7} {:<36} {:>10} {:>10}", "id", "message", "frames", "Hz")?;
        for (id, frames) in &self.messages {
            let name = dialect.by_id(*id).map_or("?", |definition| &definition.name);
            writeln!(f, "{:<7} {name:<36} {frames:>10} {:>10.2}", id.0, self.rate(*frames))?;
        }
        if self.others > 0 {
            writeln!(f, "{:<7} {:<36} {:>10}", "", "others", self.others)?;
        }
        Ok(())
    }

    fn write_summary(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ReaderStats { records, bytes, skipped_bytes } = self.stats;
        let (start, end) = (time(self.span.0), time(self.span.1));
        writeln!(f, "from      {start}\nto        {end}")?;
        writeln!(f, "duration  {}", rough(self.duration()))?;
        writeln!(f, "frames    {records} ({:.1} a second)", self.rate(records))?;
        match skipped_bytes {
            0 => writeln!(f, "bytes     {bytes}"),
            skipped => writeln!(f, "bytes     {bytes}, of which {skipped} belong to no frame"),
        }
    }
}

/// What a person wants to know of a log.
struct Told<'a> {
    info: &'a Info,
    dialect: &'a Dialect,
}

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.info.write_summary(f)?;
        self.info.write_gaps(f)?;
        self.info.write_components(f)?;
        self.info.write_messages(f, self.dialect)
    }
}

/// A date and time in UTC.
fn time(micros: u64) -> String {
    humantime::format_rfc3339_millis(UNIX_EPOCH + Duration::from_micros(micros)).to_string()
}

/// A duration to the millisecond, or of more than a minute to the second.
fn rough(duration: Duration) -> String {
    let millis = u64::try_from(duration.as_millis()).unwrap_or(u64::MAX);
    let step = if millis < 60_000 { 1 } else { 1_000 };
    humantime::format_duration(Duration::from_millis(millis / step * step)).to_string()
}

#[cfg(test)]
mod tests;
