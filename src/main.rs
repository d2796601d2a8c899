//! The program: arguments in, exit status out; all else but the log is in the library.

mod log;

use std::env;
use std::error::Error;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{self, Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use clap_complete::Shell;
use mavswitch::check::{check, explain};
use mavswitch::cli::{
    Cli, Command, NOTHING_FOR_ROUTERD, NOTHING_TO_JOIN, RouterdCli, config_files,
};
use mavswitch::config::{
    CONFIG_DIR, Config, ConfigError, ConfigProblem, ROUTERD_DIR, RouterdArguments, RouterdFiles,
    import_routerd, load_config, load_dialect, write_rows,
};
use mavswitch::daemon::{DaemonConfig, run};
use mavswitch::link::list_ports;
use mavswitch::mavlink::Dialect;

use crate::log::Log;

/// The exit status for a command line or a configuration that cannot be used; clap has the same.
/// To start again would not help, and a service manager can tell by it.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    if env::args_os().next().is_some_and(|name| RouterdCli::is_called(&name)) {
        let imported = RouterdCli::parse().import();
        return start(imported.map(|it| (it.config, it.notes)), NOTHING_FOR_ROUTERD);
    }
    let cli = Cli::parse();
    finish(match &cli.command {
        Some(Command::Dialect { file }) => print_dialect(file),
        Some(Command::Ports) => print_ports(),
        Some(Command::Check { file }) => check_config(file.as_deref()),
        Some(Command::Import { from }) => import(from.as_deref()),
        Some(Command::Config(_)) => print_config(&cli),
        Some(Command::Completions { shell }) => print_completions(*shell),
        None => return start(cli.config().map(|config| (config, Vec::new())), NOTHING_TO_JOIN),
    })
}

/// Routes, if there is a configuration that can be used.
fn start(
    configured: Result<(Config, Vec<ConfigProblem>), ConfigError>,
    nothing_to_join: &str,
) -> ExitCode {
    match configured {
        Ok((config, _)) if config.endpoints.is_empty() => {
            let _ = writeln!(io::stderr(), "{nothing_to_join}");
            ExitCode::from(USAGE)
        }
        Ok((config, notes)) => route(config, &notes),
        Err(error) => {
            complain(&error);
            ExitCode::from(USAGE)
        }
    }
}

fn finish(outcome: Result<(), Box<dyn Error>>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            complain(&error);
            ExitCode::FAILURE
        }
    }
}

/// Says on standard error what is wrong.
fn complain(error: &dyn Display) {
    for line in error.to_string().lines() {
        // Nothing can be done if even that cannot be said.
        let _ = writeln!(io::stderr(), "mavswitch: {line}");
    }
}

/// Routes; tells the notes on the configuration first.
fn route(config: Config, notes: &[ConfigProblem]) -> ExitCode {
    let log = Log::start(&config.general);
    match join(config, notes) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if log.is_for_programs() {
                tracing::error!("{error}");
            } else {
                // What is left of the log is written before the last word.
                drop(log);
                complain(&error);
            }
            ExitCode::FAILURE
        }
    }
}

/// Joins the endpoints until a signal ends it.
fn join(config: Config, notes: &[ConfigProblem]) -> Result<(), Box<dyn Error>> {
    let mut dialect = Dialect::builtin();
    for file in &config.general.dialect {
        dialect.add(load_dialect(file)?)?;
    }
    let router = config.general.router;
    let endpoints = config.endpoints.into_iter().map(|endpoint| endpoint.config).collect();
    tracing::info!("mavswitch {} starting", env!("CARGO_PKG_VERSION"));
    for note in notes {
        tracing::warn!("{note}");
    }
    Ok(run(DaemonConfig { endpoints, router, dialect })?)
}

/// Tells what a configuration means on standard output, and what is to be said of it on standard
/// error.
fn check_config(file: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let files = config_files(file)?;
    let config = load_config(&files)?;
    print(explain(&config).as_bytes())?;
    let findings = check(&config);
    for finding in &findings {
        complain(finding);
    }
    let wrong = findings.iter().filter(|finding| finding.is_wrong).count();
    match wrong {
        0 => print(format!("{}: right\n", names(&files)).as_bytes()),
        _ => Err(format!("{}: cannot be used", names(&files)).into()),
    }
}

fn names(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    if names.is_empty() { format!("{CONFIG_DIR} (no files)") } else { names.join(", ") }
}

fn print_config(cli: &Cli) -> Result<(), Box<dyn Error>> {
    let mut config = cli.config()?;
    for file in &mut config.general.dialect {
        // In a file, names are relative to the file.
        *file = path::absolute(&*file)?;
    }
    print(config.to_string().as_bytes())
}

/// Prints a configuration of mavlink-router as one of ours, and what is to be said of it on
/// standard error too, where it is seen when the file is written.
fn import(from: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let from = from.unwrap_or_else(|| Path::new(ROUTERD_DIR));
    let imported = import_routerd(&RouterdFiles::at(from)?, &RouterdArguments::default())?;
    for note in &imported.notes {
        complain(note);
    }
    print(imported.to_toml(&from.display().to_string()).as_bytes())
}

/// Writes to standard output.
fn print(text: &[u8]) -> Result<(), Box<dyn Error>> {
    match io::stdout().lock().write_all(text) {
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
    let mut lines: Vec<String> = ports.iter().map(ToString::to_string).collect();
    if ports.is_empty() {
        lines.push("no serial ports (is the cable in, and does it carry data?)".to_owned());
    }
    match writeln!(io::stdout(), "{}", lines.join("\n")) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => Ok(outcome?),
    }
}

fn print_completions(shell: Shell) -> Result<(), Box<dyn Error>> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "mavswitch", &mut script);
    print(&script)
}
