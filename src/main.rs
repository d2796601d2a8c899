//! The program: arguments in, exit status out; all else is in the library.

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use clap_complete::Shell;
use mavswitch::cli::{Cli, Command, NOTHING_TO_JOIN, RouteArgs};
use mavswitch::config::{load_dialect, write_rows};
use mavswitch::daemon::{DaemonConfig, run};
use mavswitch::link::list_ports;
use mavswitch::log;
use mavswitch::mavlink::Dialect;

/// The exit status for a command line that cannot be used; clap has the same.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let log_format = log::start(&cli.log);
    let outcome = match cli.command {
        Some(Command::Dialect { file }) => print_dialect(&file),
        Some(Command::Ports) => print_ports(),
        Some(Command::Completions { shell }) => print_completions(shell),
        None if cli.route.endpoints.is_empty() => {
            let _ = writeln!(io::stderr(), "{NOTHING_TO_JOIN}");
            return ExitCode::from(USAGE);
        }
        None => route(cli.route),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            log::fail(log_format, error.as_ref());
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
    let mut rows = Vec::new();
    write_rows(&definitions, &name, &mut rows)?;
    print(&rows)
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

fn print_completions(shell: Shell) -> Result<(), Box<dyn Error>> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "mavswitch", &mut script);
    print(&script)
}

/// Writes to standard output, to whoever still reads.
fn print(text: &[u8]) -> Result<(), Box<dyn Error>> {
    match io::stdout().lock().write_all(text) {
        // Whoever reads has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => Ok(outcome?),
    }
}
