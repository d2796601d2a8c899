//! The log: which events are written to standard error, and what a line looks like.
//!
//! Under systemd, standard error is the journal, which keeps times and priorities itself: there a
//! line opens with its priority as sd-daemon(3) has it, and carries no time.

use std::error::Error;
use std::fmt;
use std::io::{self, IsTerminal, Write};

use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

use crate::cli::{LogArgs, LogFormat};

/// Writes events to standard error from now on. What this gives is never [`LogFormat::Auto`].
pub fn start(args: &LogArgs) -> LogFormat {
    let level = match (args.verbose, args.quiet) {
        (0, 0) => LevelFilter::INFO,
        (1, _) => LevelFilter::DEBUG,
        (_, 1) => LevelFilter::WARN,
        (0, _) => LevelFilter::ERROR,
        _ => LevelFilter::TRACE,
    };
    let builder = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal())
        .with_writer(io::stderr);
    let format = match args.log_format {
        LogFormat::Auto if is_journal() => LogFormat::Journal,
        LogFormat::Auto => LogFormat::Text,
        chosen => chosen,
    };
    match format {
        LogFormat::Auto | LogFormat::Text => builder.init(),
        LogFormat::Json => builder.json().init(),
        LogFormat::Journal => builder.event_format(JournalFormat).init(),
        LogFormat::Plain => builder.without_time().init(),
    }
    format
}

/// Says why the program ends: to a person, or as the last event of a log that a program reads.
pub fn fail(format: LogFormat, error: &dyn Error) {
    match format {
        LogFormat::Json | LogFormat::Journal => tracing::error!("{error}"),
        LogFormat::Auto | LogFormat::Text | LogFormat::Plain => {
            // Nothing can be done if even that cannot be said.
            let _ = writeln!(io::stderr(), "mavswitch: {error}");
        }
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
fn priority(level: Level) -> u8 {
    match level {
        Level::ERROR => 3,
        Level::WARN => 4,
        Level::INFO => 6,
        _ => 7,
    }
}

#[cfg(test)]
mod tests {
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
