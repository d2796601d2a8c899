//! The program: arguments in, exit status out; all else but the log is in the library.

mod log;

use std::env;
use std::error::Error;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{self, Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{CommandFactory, Parser};
use clap_complete::Shell;
use mavswitch::check::{Finding, Ready, check, explain, prepare};
use mavswitch::cli::{
    AskError, Cli, Command, ListenArgs, LogCommand, LogError, NOTHING_FOR_ROUTERD, NOTHING_TO_JOIN,
    RouterdCli, config_files,
};
use mavswitch::config::{
    Address, CONFIG_DIR, Config, ConfigError, LogLevel, ROUTERD_DIR, RouterdArguments,
    RouterdFiles, import_routerd, load_config, load_dialect, write_rows,
};
use mavswitch::daemon::{DaemonConfig, Host, StartError, run};
use mavswitch::link::list_ports;
use mavswitch::top::top;
use signal_hook::consts::SIGINT;

use crate::log::{Level, Log};

/// The exit status for a command line or a configuration that cannot be used; clap has the same.
/// To start again would not help, and a service manager can tell by it.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    if env::args_os().next().is_some_and(|name| RouterdCli::is_called(&name)) {
        return start(Called::Routerd(Box::new(RouterdCli::parse())));
    }
    let cli = Cli::parse();
    finish(match &cli.command {
        Some(Command::Dialect { file }) => print_dialect(file),
        Some(Command::Ports) => print_ports(),
        Some(Command::Check { file, config }) => {
            check_config(file.as_deref().or(config.as_deref()))
        }
        Some(Command::Import { from }) => import(from.as_deref()),
        Some(Command::Log(command)) => log(command),
        Some(Command::Status(args)) => answered(args.run()),
        Some(Command::Why(args)) => answered(args.run()),
        Some(Command::Listen(args)) => listen(args),
        Some(Command::Endpoint(command)) => answered(command.run()),
        Some(Command::Record(command)) => answered(command.run()),
        Some(Command::Reload(ask)) => answered(ask.reload()),
        Some(Command::LogLevel(args)) => answered(args.run()),
        Some(Command::Top(ask)) => top(ask.control.as_deref()).map_err(Into::into),
        Some(Command::Config(_)) => print_config(&cli),
        Some(Command::Completions { shell }) => print_completions(*shell),
        None => return start(Called::Mavswitch(Box::new(cli))),
    })
}

/// By which name the program was called, and so what its command line is.
enum Called {
    Mavswitch(Box<Cli>),
    Routerd(Box<RouterdCli>),
}

impl Called {
    /// What is configured, and what is to be said of it although it can be used.
    fn config(&self) -> Result<(Config, Vec<String>), ConfigError> {
        match self {
            Self::Mavswitch(cli) => Ok((cli.config()?, Vec::new())),
            Self::Routerd(cli) => {
                let imported = cli.import()?;
                let notes = imported.notes.iter().map(ToString::to_string);
                Ok((imported.config, notes.collect()))
            }
        }
    }

    /// What to type, for who typed nothing.
    fn nothing_to_join(&self) -> &'static str {
        match self {
            Self::Mavswitch(_) => NOTHING_TO_JOIN,
            Self::Routerd(_) => NOTHING_FOR_ROUTERD,
        }
    }
}

/// Routes, if there is a configuration that can be used.
fn start(called: Called) -> ExitCode {
    match called.config() {
        Ok((config, _)) if config.endpoints.is_empty() => {
            let _ = writeln!(io::stderr(), "{}", called.nothing_to_join());
            ExitCode::from(USAGE)
        }
        Ok((config, notes)) => route(called, config, &notes),
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
            status_of(&*error)
        }
    }
}

/// What a script is told of an error: whether what the user wrote is wrong.
fn status_of(error: &(dyn Error + 'static)) -> ExitCode {
    let is_usage = error.is::<ConfigError>()
        || error.is::<Unusable>()
        || matches!(error.downcast_ref(), Some(AskError::Configuration(_)))
        || error.downcast_ref::<LogError>().is_some_and(LogError::is_usage)
        || error.downcast_ref::<StartError>().is_some_and(StartError::is_usage);
    if is_usage { ExitCode::from(USAGE) } else { ExitCode::FAILURE }
}

/// A configuration that cannot be used: what is left to be told of it, line by line.
#[derive(Debug, thiserror::Error)]
#[error("{}", .0.join("\n"))]
struct Unusable(Vec<String>);

impl From<Vec<Finding>> for Unusable {
    fn from(wrong: Vec<Finding>) -> Self {
        Self(wrong.iter().map(ToString::to_string).collect())
    }
}

/// Says on standard error what is wrong.
fn complain(error: &dyn Display) {
    for line in error.to_string().lines() {
        // Nothing can be done if even that cannot be said.
        let _ = writeln!(io::stderr(), "mavswitch: {line}");
    }
}

fn route(called: Called, config: Config, notes: &[String]) -> ExitCode {
    let log = Log::start(&config.general);
    match join(config, notes, Arc::new(Program { called, log_level: log.level() })) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let status = status_of(&*error);
            if log.is_for_programs() {
                for line in error.to_string().lines() {
                    tracing::error!("{line}");
                }
            } else {
                // What is left of the log is written before the last word.
                drop(log);
                complain(&error);
            }
            status
        }
    }
}

/// Joins the endpoints until a signal ends it.
fn join(config: Config, notes: &[String], program: Arc<Program>) -> Result<(), Box<dyn Error>> {
    let config = for_daemon(config)?;
    tracing::info!("mavswitch {} starting", env!("CARGO_PKG_VERSION"));
    warn_of(notes);
    Ok(run(config, program)?)
}

/// Tells what is to be said of a configuration that can be used.
fn warn_of(notes: &[String]) {
    for note in notes {
        tracing::warn!("{note}");
    }
}

/// Reads the files too that the configuration names.
fn for_daemon(config: Config) -> Result<DaemonConfig, Unusable> {
    let Ready { general, endpoints, dialect, warnings } = prepare(config)?;
    warn_of(&warnings.iter().map(Finding::to_log_line).collect::<Vec<_>>());
    Ok(DaemonConfig { general, endpoints, dialect })
}

/// What the daemon asks for while it runs.
struct Program {
    /// The command line counts as at the start.
    called: Called,
    log_level: Level,
}

impl Host for Program {
    fn load(&self) -> Result<DaemonConfig, Vec<String>> {
        let lines = |error: &dyn Display| error.to_string().lines().map(str::to_owned).collect();
        let read = self.called.config().map_err(|error| -> Vec<String> { lines(&error) })?;
        let (config, notes) = read;
        if config.endpoints.is_empty() {
            return Err(vec!["nothing to join: no endpoint is configured any more".to_owned()]);
        }
        let fresh = for_daemon(config).map_err(|Unusable(lines)| lines)?;
        warn_of(&notes);
        Ok(fresh)
    }

    fn set_log_level(&self, level: LogLevel) {
        self.log_level.set(level);
    }
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
    if findings.iter().any(|finding| finding.is_wrong) {
        return Err(Unusable(vec![format!("{}: cannot be used", names(&files))]).into());
    }
    let warnings = match findings.len() {
        0 => String::new(),
        1 => ", with 1 warning".to_owned(),
        count => format!(", with {count} warnings"),
    };
    print(format!("{}: right{warnings}\n", names(&files)).as_bytes())
}

fn names(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    if names.is_empty() { format!("{CONFIG_DIR} (no files)") } else { names.join(", ") }
}

fn print_config(cli: &Cli) -> Result<(), Box<dyn Error>> {
    let mut config = cli.config()?;
    let general = &mut config.general;
    for file in general.dialect.iter_mut().chain(&mut general.record.dir) {
        // In a file, names are relative to the file.
        *file = path::absolute(&*file)?;
    }
    for key in &mut config.general.keys {
        key.path = path::absolute(&key.path)?;
    }
    for endpoint in &mut config.endpoints {
        if let Address::Tlog(file) = &mut endpoint.config.address {
            *file = path::absolute(&*file)?;
        }
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

/// Prints what came of asking a daemon.
fn answered(outcome: Result<String, AskError>) -> Result<(), Box<dyn Error>> {
    print(outcome?.as_bytes())
}

/// Prints frames as they pass. To interrupt it is the common way to end it.
fn listen(args: &ListenArgs) -> Result<(), Box<dyn Error>> {
    let always = Arc::new(AtomicBool::new(true));
    signal_hook::flag::register_conditional_shutdown(SIGINT, 0, always)?;
    Ok(args.run()?)
}

/// Does something with telemetry logs.
fn log(command: &LogCommand) -> Result<(), Box<dyn Error>> {
    print(command.run()?.as_bytes())
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
