//! The log: which events are written to standard error, and what a line looks like.
//!
//! Under systemd, standard error is the journal, which keeps times and priorities itself: there a
//! line opens with its priority as sd-daemon(3) has it, and carries no time.

use std::fmt;
use std::io::{self, IsTerminal, Write};

use mavswitch::config::{General, LogFormat, LogLevel};
use mavswitch::record::{beside_bars, hide_bars, show_bars};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Subscriber};
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Registry, reload};

/// How many lines wait while nobody reads the log.
const LINES: usize = 1_024;

/// The log of the whole program. A thread writes it, so that a reader who sleeps holds up nobody:
/// lines that nobody takes in time are left out. What is left is written when this is dropped.
pub(crate) struct Log {
    format: LogFormat,
    level: Level,
    _writer: WorkerGuard,
}

/// The level of the log.
#[derive(Clone)]
pub(crate) struct Level(reload::Handle<LevelFilter, Registry>);

impl Level {
    /// Writes what has this level, and those before it, from now on.
    pub(crate) fn set(&self, level: LogLevel) {
        // Fails only when the log is gone.
        let _ = self.0.reload(level_filter(level));
    }
}

impl Log {
    /// Writes events to standard error from now on.
    ///
    /// # Panics
    ///
    /// If it has been started before.
    pub(crate) fn start(general: &General) -> Self {
        let (writer, guard) = NonBlockingBuilder::default()
            .lossy(true)
            .buffered_lines_limit(LINES)
            .finish(BesideBars);
        let (filter, level) = reload::Layer::new(level_filter(general.log_level));
        let layer = tracing_subscriber::fmt::layer()
            .with_target(false)
            .with_ansi(io::stderr().is_terminal())
            // Its only words would go where the log itself cannot go.
            .log_internal_errors(false)
            .with_writer(writer);
        let format = resolved(general.log_format);
        if io::stderr().is_terminal() && is_for_people(format) {
            show_bars();
        }
        let registry = tracing_subscriber::registry().with(filter);
        match format {
            LogFormat::Auto | LogFormat::Text => registry.with(layer).init(),
            LogFormat::Json => registry.with(layer.json()).init(),
            LogFormat::Journal => registry.with(layer.event_format(JournalFormat)).init(),
            LogFormat::Plain => registry.with(layer.without_time()).init(),
        }
        Self { format, level: Level(level), _writer: guard }
    }

    /// What changes the level while the program runs.
    pub(crate) fn level(&self) -> Level {
        self.level.clone()
    }

    /// Whether programs read it: then the reason why the program ends is one more event.
    pub(crate) fn is_for_programs(&self) -> bool {
        !is_for_people(self.format)
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        // The last lines stand below all others.
        hide_bars();
    }
}

fn is_for_people(format: LogFormat) -> bool {
    !matches!(format, LogFormat::Json | LogFormat::Journal)
}

/// Standard error, without the bars of replays in the way of a line.
struct BesideBars;

impl Write for BesideBars {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        beside_bars(|| io::stderr().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

fn level_filter(level: LogLevel) -> LevelFilter {
    match level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    }
}

/// What [`LogFormat::Auto`] stands for here.
fn resolved(format: LogFormat) -> LogFormat {
    match format {
        LogFormat::Auto if is_journal() => LogFormat::Journal,
        LogFormat::Auto => LogFormat::Text,
        chosen => chosen,
    }
}

/// Whether standard error is the journal: systemd says which file that would be.
fn is_journal() -> bool {
    let Some(stream) = std::env::var_os("JOURNAL_STREAM") else { return false };
    let file = rustix::fs::fstat(io::stderr());
    file.is_ok_and(|file| stream.to_str() == Some(&format!("{}:{}", file.st_dev, file.st_ino)))
}

/// `<6>text`, on each line of a message: the journal takes every line for a message of its own.
struct JournalFormat;

impl<S, N> FormatEvent<S, N> for JournalFormat
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let mut text = String::new();
        context.format_fields(Writer::new(&mut text), event)?;
        let priority = priority(*event.metadata().level());
        text.lines().try_for_each(|line| writeln!(writer, "<{priority}>{line}"))
    }
}

/// What syslog(3) calls a level.
fn priority(level: tracing::Level) -> u8 {
    match level {
        tracing::Level::ERROR => 3,
        tracing::Level::WARN => 4,
        tracing::Level::INFO => 6,
        _ => 7,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::{Arc, Mutex};

    use super::*;

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn each_line_of_a_message_has_its_priority_and_no_time() {
        let written = Shared::default();
        let writer = written.clone();
        let subscriber = tracing_subscriber::fmt()
            .with_max_level(LevelFilter::TRACE)
            .with_writer(move || writer.clone())
            .event_format(JournalFormat)
            .finish();
        tracing::subscriber::with_default(subscriber, || {
            tracing::error!("one\ntwo");
            tracing::warn!(answer = 42, "three");
            tracing::info!("four");
            tracing::debug!("five");
            tracing::trace!("six");
        });
        let text = String::from_utf8(written.0.lock().unwrap().clone()).unwrap();
        assert_eq!(text, "<3>one\n<3>two\n<4>three answer=42\n<6>four\n<7>five\n<7>six\n");
    }
}
