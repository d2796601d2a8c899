//! The command line, declared once: the parser, `--help`, man page and completions derive from it.

mod ask;
mod log;
mod own;
mod record;
mod routerd;
mod watch;
mod words;

use std::net::SocketAddr;
use std::path::{self, Path, PathBuf};
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

use crate::config::{
    self, CONFIG_DIR, Config, ConfigError, ControlPlace, EndpointConfig, General, KeyFile,
    LogFormat, LogLevel, default_files, load_config,
};
use crate::routing::Learn;

pub use ask::{AskArgs, AskError, EndpointCommand, LogLevelArgs, RecordCommand, StatusArgs};
pub use log::{LogCommand, LogError};
pub use own::OwnArgs;
pub use record::RecordArgs;
pub use routerd::{NOTHING_FOR_ROUTERD, ROUTERD, RouterdCli};
pub use watch::{ListenArgs, WhyArgs};

/// Routes MAVLink frames between autopilot, radios, onboard programs and ground stations.
///
/// Joins serial, UDP and TCP endpoints, learns from the traffic which component lives behind which
/// link, and delivers every frame by its target. Frames are forwarded byte for byte; nothing has to
/// be configured about dialects or versions.
#[derive(Parser, Debug)]
#[command(name = "mavswitch", version, after_long_help = EXAMPLES)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// Something else than routing.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What to route.
    #[command(flatten)]
    pub route: RouteArgs,
    /// What to log.
    #[command(flatten)]
    pub log: LogArgs,
}

/// Other things than routing.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Print the messages that a definition file declares, as rows of the built-in table
    Dialect {
        /// A MAVLink XML definition file; the files it includes are read too
        #[arg(value_name = "FILE.xml")]
        file: PathBuf,
    },
    /// List the serial ports of this computer: what each one is, and whether you may open it
    Ports,
    /// Print what a shell needs to complete command lines, for its directory of completions
    Completions {
        /// Which shell
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },
    /// Check a configuration file, and tell what it means and what is missing; opens no endpoint
    Check {
        /// The file; without it, those in /etc/mavswitch
        #[arg(value_name = "FILE")]
        file: Option<PathBuf>,
        /// The same, as the router takes it
        #[arg(short, long, value_name = "FILE", conflicts_with = "file")]
        config: Option<PathBuf>,
    },
    /// Print what a configuration of mavlink-router means, as a file of mavswitch
    ///
    /// Comments tell what has no equivalent. As `mavlink-routerd`, a symbolic link to the program,
    /// it reads such a configuration without any import.
    Import {
        /// The file, or a directory with main.conf and config.d; without it, /etc/mavlink-router
        #[arg(value_name = "FILE|DIR")]
        from: Option<PathBuf>,
    },
    /// Work on telemetry logs: info, cut, merge, filter
    #[command(subcommand)]
    Log(LogCommand),
    /// Tell what is going on in a running mavswitch: endpoints, links, components, messages
    Status(StatusArgs),
    /// Explain why a frame goes where it goes; without arguments, tell what looks wrong
    Why(WhyArgs),
    /// Print frames as they pass through a running mavswitch, with their fields
    Listen(ListenArgs),
    /// Add, change, remove, enable or disable an endpoint of a running mavswitch
    #[command(subcommand)]
    Endpoint(EndpointCommand),
    /// Watch what is going on in a running mavswitch, live on the terminal
    Top(AskArgs),
    /// Have a running mavswitch start or stop to record telemetry
    #[command(subcommand)]
    Record(RecordCommand),
    /// Have a running mavswitch read its configuration anew; if anything is wrong, fail and say what
    ///
    /// The same as SIGHUP or `systemctl reload mavswitch`. What is wrong changes nothing, and the
    /// status is 2 then.
    Reload(AskArgs),
    /// Have a running mavswitch log more or less
    LogLevel(LogLevelArgs),
    /// Print the effective configuration, of files and command line together, as a file
    Config(Box<RouteArgs>),
}

/// What to route, and how.
#[derive(Args, Debug)]
pub struct RouteArgs {
    /// What to join; give as many as there are
    ///
    /// udpin:HOST:PORT     listen for UDP; each remote address is a peer of its own
    /// udpout:HOST:PORT    send UDP to one address
    /// udpbcast:ADDR:PORT  send UDP to a whole network, until somebody answers
    /// mcast:GROUP:PORT    send UDP to a multicast group, and listen to it
    /// tcpin:HOST:PORT     listen for TCP connections
    /// tcpout:HOST:PORT    connect by TCP, again and again
    /// serial:DEVICE:BAUD  a serial port; /dev/ttyACM0 alone will do
    /// tlog:FILE           play back a telemetry log
    /// sim:                a simulated vehicle, to try it all without hardware
    ///
    /// Ports left out are 14550 for UDP and 5760 for TCP; a baud rate left out is 57600. The
    /// spellings of pymavlink, MAVProxy, MAVSDK, mavp2p, mavlink-server and mavlink-router are
    /// understood as well. Options follow as in a URL: udpout:10.0.0.2:14550?name=gcs
    #[arg(value_name = "ENDPOINT", value_parser = words::endpoint, verbatim_doc_comment)]
    pub endpoints: Vec<EndpointConfig>,

    /// Read this configuration file, and not those in /etc/mavswitch
    ///
    /// Without it, /etc/mavswitch/mavswitch.toml is read if it is there, and then
    /// /etc/mavswitch/conf.d/*.toml in the order of their names. What the command line says
    /// overrides the files; its endpoints add to theirs.
    #[arg(short, long, value_name = "FILE")]
    pub config: Option<PathBuf>,

    /// Learn routes from every frame, or from HEARTBEAT only [default: all]
    #[arg(long, value_name = "FROM")]
    pub learn: Option<LearnFrom>,

    /// Send nothing to components that were never heard, not even to their system's links
    ///
    /// `--strict=false` overrides a configuration file.
    #[arg(long, value_name = "YES", num_args = 0..=1, require_equals = true,
          default_missing_value = "true", hide_possible_values = true)]
    pub strict: Option<bool>,

    /// Forget a route that was silent for so many seconds; 0: never [default: 300]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub route_age: Option<Duration>,

    /// Send everything to the links on which this system id is heard, whoever it is for
    #[arg(long, value_name = "SYSTEM", value_parser = clap::value_parser!(u8).range(1..))]
    pub sniffer: Option<u8>,

    /// Know the messages of this XML definition file too; may be repeated
    #[arg(long, value_name = "FILE.xml")]
    pub dialect: Vec<PathBuf>,

    /// Serve metrics for Prometheus, and a status page, by HTTP at this address and port
    ///
    /// http://127.0.0.1:9550/ is the page, /metrics the metrics, /status.json the same as JSON.
    /// Whoever can reach the port can read them; nothing can be changed there.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = metrics)]
    pub metrics: Option<SocketAddr>,

    /// A signing key that endpoints may name, and the file that it is in; may be repeated
    #[arg(long, value_name = "NAME=FILE", value_parser = key)]
    pub key: Vec<KeyFile>,

    /// Where to have the control socket, by which `mavswitch status` and others ask; off: nowhere
    ///
    /// Without it, it is in the directory that the service manager made, or else in
    /// $XDG_RUNTIME_DIR/mavswitch, or for root in /run/mavswitch.
    #[arg(long, value_name = "PATH|off", value_parser = control_place)]
    pub control: Option<ControlPlace>,

    /// Who the program itself is.
    #[command(flatten)]
    pub own: OwnArgs,

    /// What to record.
    #[command(flatten)]
    pub record: RecordArgs,
}

/// What to log, and how.
#[derive(Args, Debug)]
pub struct LogArgs {
    /// Log more: what each link carried, and who found no route
    #[arg(short, long, action = clap::ArgAction::Count, global = true, conflicts_with = "quiet")]
    pub verbose: u8,

    /// Log only what is wrong; twice: nothing but errors
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    pub quiet: u8,

    /// How log lines look [default: auto]
    #[arg(long, value_name = "FORMAT", global = true)]
    pub log_format: Option<LogFormat>,
}

/// Which frames teach routes.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum LearnFrom {
    /// Every frame that passed a full check
    All,
    /// HEARTBEAT frames
    Heartbeat,
}

impl Cli {
    /// What is configured: by files, and by the command line, which overrides them.
    ///
    /// # Errors
    ///
    /// If a file cannot be read or is wrong, or if the command line does not go with it.
    pub fn config(&self) -> Result<Config, ConfigError> {
        let route = match &self.command {
            Some(Command::Config(route)) => route,
            _ => &self.route,
        };
        let mut config = load_config(&config_files(route.config.as_deref())?)?;
        route.apply_to(&mut config)?;
        self.log.apply_to(&mut config.general);
        Ok(config)
    }
}

/// The configuration files to read: the one that was named, else those that are there.
///
/// # Errors
///
/// If the directory of them cannot be read.
pub fn config_files(named: Option<&Path>) -> Result<Vec<PathBuf>, ConfigError> {
    match named {
        Some(file) => Ok(vec![file.to_owned()]),
        None => default_files(Path::new(CONFIG_DIR)),
    }
}

impl RouteArgs {
    /// Adds what stands here to what the files say, and overrides it.
    fn apply_to(&self, config: &mut Config) -> Result<(), ConfigError> {
        let router = &mut config.general.router;
        match self.learn {
            Some(LearnFrom::All) => router.learn = Learn::All,
            Some(LearnFrom::Heartbeat) => router.learn = Learn::Heartbeat,
            None => {}
        }
        router.strict = self.strict.unwrap_or(router.strict);
        if let Some(age) = self.route_age {
            router.route_age = (!age.is_zero()).then_some(age);
        }
        router.sniffer = self.sniffer.or(router.sniffer);
        if !self.dialect.is_empty() {
            config.general.dialect.clone_from(&self.dialect);
        }
        config.general.metrics = self.metrics.or(config.general.metrics);
        let keys = &mut config.general.keys;
        ConfigError::unless_twice(&self.key)?;
        keys.retain(|known| self.key.iter().all(|key| key.name != known.name));
        keys.extend(self.key.iter().cloned());
        if let Some(place) = &self.control {
            config.general.control = place.clone();
        }
        self.own.apply_to(&mut config.general.own);
        self.record.apply_to(&mut config.general.record);
        config.add(&self.endpoints)
    }
}

impl LogArgs {
    fn apply_to(&self, general: &mut General) {
        general.log_format = self.log_format.unwrap_or(general.log_format);
        general.log_level = match (self.verbose, self.quiet) {
            (0, 0) => general.log_level,
            (1, _) => LogLevel::Debug,
            (_, 1) => LogLevel::Warn,
            (0, _) => LogLevel::Error,
            _ => LogLevel::Trace,
        };
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    config::seconds(text).ok_or_else(|| "write a number of seconds from 0 on, as 300".to_owned())
}

fn key(text: &str) -> Result<KeyFile, String> {
    config::key_file(text).ok_or_else(|| "write a name and a file, as radio=radio.key".to_owned())
}

fn metrics(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| match text.parse::<u16>() {
        Ok(port) => format!("write the address too, as 127.0.0.1:{port}"),
        Err(_) => "write an IP address and a port, as 127.0.0.1:9550".to_owned(),
    })
}

fn control_place(text: &str) -> Result<ControlPlace, String> {
    let path = match text {
        "off" => PathBuf::from(text),
        _ => path::absolute(text).map_err(|error| error.to_string())?,
    };
    let place = path.to_str().and_then(ControlPlace::parse);
    place.ok_or_else(|| "write a path, as /run/mavswitch/control, or off".to_owned())
}

/// What to type, for who typed nothing.
pub const NOTHING_TO_JOIN: &str = "\
mavswitch: nothing to join: name the endpoints, for example a flight controller and a port for
ground stations:

  mavswitch /dev/ttyACM0 udpin:0.0.0.0:14550

or write them to a configuration file, /etc/mavswitch/mavswitch.toml or one given with -c:

  [endpoint.flight-controller]
  address = \"/dev/ttyACM0\"

`mavswitch --help` explains them all.";

const EXAMPLES: &str = "\
Examples:
  A flight controller on USB, ground stations by UDP and TCP:
    mavswitch /dev/ttyACM0 udpin:0.0.0.0:14550 tcpin:0.0.0.0:5760

  A flight controller on a UART, telemetry to a laptop, and a program on this computer:
    mavswitch serial:/dev/ttyAMA0:921600 udpout:192.168.1.20:14550 udpin:127.0.0.1:14540

  A simulator by TCP, shared by two ground stations on this computer:
    mavswitch tcpout:127.0.0.1:5760 udpout:127.0.0.1:14550 udpout:127.0.0.1:14551

  What a configuration file says, and nothing else:
    mavswitch -c mavswitch.toml

The options of an endpoint, behind its `?`, are explained in mavswitch(1).

Exit status: 0 after SIGINT or SIGTERM, 1 if it cannot start, 2 for a wrong command line or a
wrong configuration, also if a file that it names cannot be read.";
