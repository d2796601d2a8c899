//! The commands that ask a running daemon, or tell it what to do.

use std::io::{self, IsTerminal};
use std::path::{self, PathBuf};
use std::time::Duration;
use std::{env, thread};

use clap::{Args, Subcommand};

use crate::config::{Address, DialectFileError, EndpointConfig, LogLevel};
use crate::control::{Answer, Client, ClientError, Request};
use crate::printable::escape_json;
use crate::record::look_at_log;
use crate::status::to_text;

/// Whom to ask.
#[derive(Args, Clone, Debug)]
pub struct AskArgs {
    /// The control socket of the daemon; without it, it is looked for where daemons have it
    #[arg(long, value_name = "PATH")]
    pub control: Option<PathBuf>,
}

/// How to show what is going on.
#[derive(Args, Clone, Debug)]
pub struct StatusArgs {
    /// Print one picture as JSON, with counts instead of rates
    #[arg(long)]
    pub json: bool,
    /// Whom to ask
    #[command(flatten)]
    pub ask: AskArgs,
}

/// What can be done with endpoints of a running daemon. It lasts until the next reload or start.
#[derive(Subcommand, Debug)]
pub enum EndpointCommand {
    /// Join another endpoint
    Add {
        /// As on the command line: udpout:10.0.0.2:14550?name=laptop
        #[arg(value_name = "ENDPOINT")]
        endpoint: String,
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
    /// Give the endpoint of the same name these settings; links stay where that is possible
    Change {
        /// As on the command line, with its name
        #[arg(value_name = "ENDPOINT")]
        endpoint: String,
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
    /// Close an endpoint and forget it
    Remove {
        /// Its name, or its address if it has none
        #[arg(value_name = "NAME")]
        name: String,
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
    /// Open an endpoint that was switched off
    Enable {
        /// Its name, or its address if it has none
        #[arg(value_name = "NAME")]
        name: String,
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
    /// Close an endpoint until it is switched on again
    Disable {
        /// Its name, or its address if it has none
        #[arg(value_name = "NAME")]
        name: String,
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
}

/// Whether a running daemon records telemetry. It lasts until the next start.
#[derive(Subcommand, Debug)]
pub enum RecordCommand {
    /// Record telemetry from now on, to the directory that is configured
    Start {
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
    /// End the telemetry log, and record no more
    Stop {
        /// Whom to tell
        #[command(flatten)]
        ask: AskArgs,
    },
}

/// What to log from now on.
#[derive(Args, Clone, Debug)]
pub struct LogLevelArgs {
    /// How much
    #[arg(value_name = "LEVEL")]
    pub level: LogLevel,
    /// Whom to tell
    #[command(flatten)]
    pub ask: AskArgs,
}

/// How long a reload may take: the configuration is on a disk, which may be slow.
const RELOAD_PATIENCE: Duration = Duration::from_secs(60);

/// The time over which rates are told.
const RATES_OVER: Duration = Duration::from_secs(1);

/// Why a command could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// The daemon cannot be asked, or says why not.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// A definition file cannot be used.
    #[error("{0}")]
    Dialect(#[from] Box<DialectFileError>),
    /// A log that is to be played back cannot be: the endpoint, the file, and why.
    #[error("{endpoint}: not added: cannot play back {}: {error}", file.display())]
    Log {
        /// Its name.
        endpoint: String,
        /// The log.
        file: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The configuration that is to be taken over cannot be used.
    #[error("{}\nthe configuration cannot be reloaded: everything stays as it was", .0.join("\n"))]
    Configuration(Vec<String>),
    /// What is to be said cannot be written.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

impl AskArgs {
    /// A connection to the daemon.
    ///
    /// # Errors
    ///
    /// If there is none.
    pub fn connect(&self) -> Result<Client, ClientError> {
        Client::connect(self.control.as_deref())
    }

    /// Has the daemon read its configuration anew; says what that has changed.
    ///
    /// # Errors
    ///
    /// [`AskError::Configuration`] if it cannot be used; others if there is no daemon that answers.
    pub fn reload(&self) -> Result<String, AskError> {
        match self.connect()?.ask_within(RELOAD_PATIENCE, Request::Reload)? {
            Answer::Done(text) => Ok(format!("{text}\n")),
            Answer::Wrong(problems) => Err(AskError::Configuration(problems)),
            _ => Err(ClientError::Unexpected.into()),
        }
    }

    /// Has something done; says what was done.
    fn tell(&self, request: Request) -> Result<String, AskError> {
        match self.connect()?.ask(request)? {
            Answer::Done(text) => Ok(format!("{text}\n")),
            _ => Err(ClientError::Unexpected.into()),
        }
    }
}

/// Whether standard output is a terminal, and nobody asks for no colours (NO_COLOR).
fn is_colourful() -> bool {
    let is_refused = env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !is_refused
}

impl StatusArgs {
    /// Asks, and says what is going on.
    ///
    /// # Errors
    ///
    /// If there is no daemon that answers.
    pub fn run(&self) -> Result<String, AskError> {
        let mut client = self.ask.connect()?;
        let snapshot = client.status()?;
        if !self.json {
            thread::sleep(RATES_OVER);
            return Ok(to_text(&snapshot, &client.status()?, is_colourful()));
        }
        let text = serde_json::to_string_pretty(&snapshot).map_err(io::Error::from)?;
        Ok(escape_json(&text) + "\n")
    }
}

impl EndpointCommand {
    /// Has it done; says what was done.
    ///
    /// # Errors
    ///
    /// If there is no daemon that does it.
    pub fn run(&self) -> Result<String, AskError> {
        let (ask, request) = match self {
            Self::Add { endpoint, ask } => {
                let seen = as_seen_from_here(endpoint);
                seen.as_ref().map_or(Ok(()), look_at_its_log)?;
                (ask, Request::EndpointAdd { endpoint: to_send(endpoint, seen) })
            }
            Self::Change { endpoint, ask } => {
                let seen = as_seen_from_here(endpoint);
                (ask, Request::EndpointChange { endpoint: to_send(endpoint, seen) })
            }
            Self::Remove { name, ask } => (ask, Request::EndpointRemove { name: name.clone() }),
            Self::Enable { name, ask } => (ask, Request::EndpointEnable { name: name.clone() }),
            Self::Disable { name, ask } => (ask, Request::EndpointDisable { name: name.clone() }),
        };
        ask.tell(request)
    }
}

/// An endpoint that plays back a file, with a name of that by which a daemon finds it that works in
/// another directory. `None` if it is another endpoint, or none at all, which is told by the daemon.
fn as_seen_from_here(endpoint: &str) -> Option<EndpointConfig> {
    let mut config: EndpointConfig = endpoint.parse().ok()?;
    let Address::Tlog(file) = &mut config.address else { return None };
    *file = path::absolute(&*file).ok()?;
    Some(config)
}

/// What is said to the daemon: what was typed, if it means the same there.
fn to_send(endpoint: &str, seen: Option<EndpointConfig>) -> String {
    seen.map_or_else(|| endpoint.to_owned(), |config| config.to_string())
}

/// Finds out here whether there is anything to play back: the daemon waits for no disk before it
/// answers. What only the daemon may read is for it to find out.
fn look_at_its_log(config: &EndpointConfig) -> Result<(), AskError> {
    let Address::Tlog(file) = &config.address else { return Ok(()) };
    match look_at_log(file) {
        Err(error) if error.kind() != io::ErrorKind::PermissionDenied => {
            Err(AskError::Log { endpoint: config.name(), file: file.clone(), error })
        }
        _ => Ok(()),
    }
}

impl RecordCommand {
    /// Has it done; says what was done.
    ///
    /// # Errors
    ///
    /// If there is no daemon that does it.
    pub fn run(&self) -> Result<String, AskError> {
        let (ask, enabled) = match self {
            Self::Start { ask } => (ask, true),
            Self::Stop { ask } => (ask, false),
        };
        ask.tell(Request::Record { enabled })
    }
}

impl LogLevelArgs {
    /// Has it done; says what was done.
    ///
    /// # Errors
    ///
    /// If there is no daemon that does it.
    pub fn run(&self) -> Result<String, AskError> {
        self.ask.tell(Request::LogLevel { level: self.level.name() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_named_so_that_a_daemon_in_another_directory_finds_it() {
        let here = env::current_dir().unwrap();
        let sent = |text: &str| to_send(text, as_seen_from_here(text));
        for text in ["tlog:a.tlog?speed=0", "TLOG:a.tlog?speed=0"] {
            let config: EndpointConfig = sent(text).parse().unwrap();
            assert_eq!(config.address, Address::Tlog(here.join("a.tlog")), "{text}");
            assert_eq!(config.options.speed, 0.0);
        }
        let whole = "tlog:/100%/a b.tlog?name=a%20b";
        assert_eq!(sent(whole), whole);
        for text in ["udpout:10.0.0.2:14550?name=laptop", "tlog:", "nonsense"] {
            assert_eq!(sent(text), text);
        }
    }
}
