//! The program: arguments in, exit status out; all else is in the library.

use std::error::Error;
use std::io::{self, IsTerminal, Write};
use std::path::{self, Path};
use std::process::ExitCode;

use clap::Parser;
use mavswitch::cli::{Cli, Command, NOTHING_TO_JOIN};
use mavswitch::config::{Config, General, LogFormat, LogLevel, load_dialect, write_rows};
use mavswitch::daemon::{DaemonConfig, run};
use mavswitch::link::list_ports;
use mavswitch::mavlink::Dialect;
use tracing::level_filters::LevelFilter;

/// The exit status for a command line that cannot be used; clap has the same.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match &cli.command {
        Some(Command::Dialect { file }) => print_dialect(file),
        Some(Command::Ports) => print_ports(),
        Some(Command::Config(_)) => print_config(&cli),
        None => match cli.config() {
            Ok(config) if config.endpoints.is_empty() => {
                let _ = writeln!(io::stderr(), "{NOTHING_TO_JOIN}");
                return ExitCode::from(USAGE);
            }
            Ok(config) => route(config),
            Err(error) => Err(error.into()),
        },
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            for line in error.to_string().lines() {
                // Nothing can be done if even that cannot be said.
                let _ = writeln!(io::stderr(), "mavswitch: {line}");
            }
            ExitCode::FAILURE
        }
    }
}

fn route(config: Config) -> Result<(), Box<dyn Error>> {
    start_log(&config.general);
    let mut dialect = Dialect::builtin();
    for file in &config.general.dialect {
        dialect.add(load_dialect(file)?)?;
    }
    let router = config.general.router;
    let endpoints = config.endpoints.into_iter().map(|endpoint| endpoint.config).collect();
    tracing::info!("mavswitch {} starting", env!("CARGO_PKG_VERSION"));
    Ok(run(DaemonConfig { endpoints, router, dialect })?)
}

fn print_config(cli: &Cli) -> Result<(), Box<dyn Error>> {
    let mut config = cli.config()?;
    for file in &mut config.general.dialect {
        // In a file, names are relative to the file.
        *file = path::absolute(&*file)?;
    }
    print(&config.to_string())
}

/// Writes to standard output.
fn print(text: &str) -> Result<(), Box<dyn Error>> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        // Whoever reads has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => Ok(outcome?),
    }
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

fn start_log(general: &General) {
    let level = match general.log_level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    };
    let builder = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal())
        .with_writer(io::stderr);
    match general.log_format {
        LogFormat::Text => builder.init(),
        LogFormat::Json => builder.json().init(),
        LogFormat::Plain => builder.without_time().init(),
    }
}
