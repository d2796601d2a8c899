//! The command line, declared once: the parser, `--help`, man page and completions derive from it.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::config::EndpointConfig;
use crate::routing::{Learn, RouterOptions};

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
    ///
    /// Ports left out are 14550 for UDP and 5760 for TCP; a baud rate left out is 57600. The
    /// spellings of pymavlink, MAVProxy, MAVSDK, mavp2p, mavlink-server and mavlink-router are
    /// understood as well. Options follow as in a URL: udpout:10.0.0.2:14550?name=gcs
    #[arg(value_name = "ENDPOINT", verbatim_doc_comment)]
    pub endpoints: Vec<EndpointConfig>,

    /// Learn routes from every frame, or from HEARTBEAT only
    #[arg(long, value_name = "FROM", default_value = "all")]
    pub learn: LearnFrom,

    /// Send nothing to components that were never heard, not even to their system's links
    #[arg(long)]
    pub strict: bool,

    /// Forget a route that was silent for so many seconds; 0: never
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = seconds)]
    pub route_age: Duration,

    /// Send everything to the links on which this system id is heard, whoever it is for
    #[arg(long, value_name = "SYSTEM", value_parser = clap::value_parser!(u8).range(1..))]
    pub sniffer: Option<u8>,

    /// Know the messages of this XML definition file too; may be repeated
    #[arg(long, value_name = "FILE.xml")]
    pub dialect: Vec<PathBuf>,
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

    /// How log lines look
    #[arg(long, value_name = "FORMAT", default_value = "text", global = true)]
    pub log_format: LogFormat,
}

/// Which frames teach routes.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum LearnFrom {
    /// Every frame that passed a full check
    All,
    /// HEARTBEAT frames
    Heartbeat,
}

/// How log lines look.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum LogFormat {
    /// One line of text for each event, with the time
    Text,
    /// One JSON object for each event
    Json,
    /// One line of text without the time, for a log that adds its own
    Plain,
}

impl RouteArgs {
    /// How the router shall route.
    pub fn router_options(&self) -> RouterOptions {
        RouterOptions {
            learn: match self.learn {
                LearnFrom::All => Learn::All,
                LearnFrom::Heartbeat => Learn::Heartbeat,
            },
            strict: self.strict,
            route_age: (!self.route_age.is_zero()).then_some(self.route_age),
            sniffer: self.sniffer,
        }
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "write a number of seconds, as 300".to_owned())?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "write a number from 0 on, as 300".to_owned())
}

/// What to type, for who typed nothing.
pub const NOTHING_TO_JOIN: &str = "\
mavswitch: nothing to join: name the endpoints, for example a flight controller and a port for
ground stations:

  mavswitch /dev/ttyACM0 udpin:0.0.0.0:14550

`mavswitch --help` explains them all.";

const EXAMPLES: &str = "\
Examples:
  A flight controller on USB, ground stations by UDP and TCP:
    mavswitch /dev/ttyACM0 udpin:0.0.0.0:14550 tcpin:0.0.0.0:5760

  A flight controller on a UART, telemetry to a laptop, and a program on this computer:
    mavswitch serial:/dev/ttyAMA0:921600 udpout:192.168.1.20:14550 udpin:127.0.0.1:14540

  A simulator by TCP, shared by two ground stations on this computer:
    mavswitch tcpout:127.0.0.1:5760 udpout:127.0.0.1:14550 udpout:127.0.0.1:14551

Exit status: 0 after SIGINT, SIGTERM or SIGHUP, 1 if it cannot start, 2 for a wrong command line.";
