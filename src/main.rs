//! The program: arguments in, exit status out; all else is in the library.

use std::error::Error;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use mavswitch::cli::{Cli, Command, LogArgs, LogFormat, NOTHING_TO_JOIN, RouteArgs};
use mavswitch::config::{load_dialect, write_rows};
use mavswitch::daemon::{DaemonConfig, run};
use mavswitch::link::list_ports;
use mavswitch::mavlink::Dialect;
use tracing::level_filters::LevelFilter;
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};

/// The exit status for a command line that cannot be used; clap has the same.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let log = start_log(&cli.log);
    let outcome = match cli.command {
        Some(Command::Dialect { file }) => print_dialect(&file),
        Some(Command::Ports) => print_ports(),
        None if cli.route.endpoints.is_empty() => {
            let _ = writeln!(io::stderr(), "{NOTHING_TO_JOIN}");
            return ExitCode::from(USAGE);
        }
        None => route(cli.route),
    };
    // Writes what is left of the log before the last word.
    drop(log);
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nothing can be done if even that cannot be said.
            let _ = writeln!(io::stderr(), "mavswitch: {error}");
            ExitCode::FAILURE
        }
    }
}

fn route(args: RouteArgs) -> Result<(), Box<dyn Error>> {
    let mut dialect = Dialect::builtin();
    for file in &args.dialect {
        dialect.add(load_dialect(file)?)?;
    }
    let router = args.router_options();
    tracing::info!("mavswitch {} starting", env!("CARGO_PKG_VERSION"));
    Ok(run(DaemonConfig { endpoints: args.endpoints, router, dialect })?)
}

fn print_dialect(file: &Path) -> Result<(), Box<dyn Error>> {
    let definitions = load_dialect(file)?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    match write_rows(&definitions, &name, &mut io::stdout().lock()) {
        // Whoever reads has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => Ok(outcome?),
    }
}

fn print_ports() -> Result<(), Box<dyn Error>> {
    let ports = list_ports();
    if ports.is_empty() {
        println!("no serial ports (is the cable in, and does it carry data?)");
    }
    for port in &ports {
        println!("{port}");
    }
    Ok(())
}

/// Starts the log. Lines are written until the guard is dropped; those that nobody takes in time
/// are left out.
fn start_log(args: &LogArgs) -> WorkerGuard {
    let level = match (args.verbose, args.quiet) {
        (0, 0) => LevelFilter::INFO,
        (1, _) => LevelFilter::DEBUG,
        (_, 1) => LevelFilter::WARN,
        (0, _) => LevelFilter::ERROR,
        _ => LevelFilter::TRACE,
    };
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LOG_LINES)
        .finish(io::stderr());
    let builder = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal())
        // Its only words would go where the log itself cannot go.
        .log_internal_errors(false)
        .with_writer(writer);
    match args.log_format {
        LogFormat::Text => builder.init(),
        LogFormat::Json => builder.json().init(),
        LogFormat::Plain => builder.without_time().init(),
    }
    guard
}

/// How many lines wait while nobody reads the log.
const LOG_LINES: usize = 1_024;
