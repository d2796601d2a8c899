//! The command line of mavlink-router, for when the program is called by its name.
//!
//! Its flags are those of the original, so that scripts and units go on as they are; what they mean
//! is for `config` to say.

use std::env;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::net::{Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::{ArgAction, Parser};

use crate::config::{
    ConfigError, ConfigProblem, Imported, RouterdArguments, RouterdFiles, import_routerd,
};
use crate::link::listen;

/// What the program is called as to take this command line.
pub const ROUTERD: &str = "mavlink-routerd";

/// Routes MAVLink frames, configured as mavlink-router is.
///
/// This is mavswitch under another name: it reads mavlink-router's command line and configuration
/// files. `mavswitch import` turns them into a configuration of its own, which can do more.
#[derive(Parser, Debug)]
#[command(name = ROUTERD, version = VERSION, infer_long_args = true, after_help = AFTER)]
pub struct RouterdCli {
    /// A serial port, or an address to listen at by UDP
    #[arg(value_name = "DEVICE[:BAUD]|IP:PORT")]
    pub masters: Vec<String>,

    /// Send to this address by UDP; without a port, to the first of 14550 and up that is not in use
    #[arg(short = 'e', long = "endpoints", alias = "endpoint", value_name = "IP[:PORT]")]
    pub udp: Vec<String>,

    /// Connect to this address by TCP
    #[arg(short = 'p', long = "tcp-endpoint", value_name = "IP:PORT")]
    pub tcp: Vec<String>,

    /// Print statistics (not there yet)
    #[arg(short = 'r', long = "report_msg_statistics", action = ArgAction::Count)]
    pub report: u8,

    /// Listen for TCP connections on this port; 0: do not [default: 5760]
    #[arg(short = 't', long = "tcp-port", value_name = "PORT", overrides_with = "tcp_port")]
    pub tcp_port: Option<String>,

    /// Read this configuration file, and not /etc/mavlink-router/main.conf
    #[arg(short = 'c', long, value_name = "FILE", overrides_with = "conf_file")]
    pub conf_file: Option<PathBuf>,

    /// Read the files in this directory next, and not those in /etc/mavlink-router/config.d
    #[arg(short = 'd', long, value_name = "DIR", overrides_with = "conf_dir")]
    pub conf_dir: Option<PathBuf>,

    /// Record the logs that vehicles make in this directory
    #[arg(short = 'l', long, value_name = "DIR", overrides_with = "log")]
    pub log: Option<String>,

    /// Record telemetry too, in the same directory
    #[arg(short = 'T', long, action = ArgAction::Count)]
    pub telemetry_log: u8,

    /// What to log: error, warning, info, debug or trace
    #[arg(short = 'g', long, value_name = "LEVEL", overrides_with = "debug_log_level")]
    pub debug_log_level: Option<String>,

    /// The same as --debug-log-level=debug
    #[arg(short = 'v', long, action = ArgAction::Count)]
    pub verbose: u8,

    /// Send everything to the links on which this system id is heard, whoever it is for
    #[arg(short = 's', long, value_name = "SYSTEM", overrides_with = "sniffer_sysid")]
    pub sniffer_sysid: Option<String>,

    /// Log to the system's log: systemd puts it there in any case
    #[arg(short = 'y', long, action = ArgAction::Count)]
    pub syslog: u8,

    /// Whether another program had the port of the TCP server at the start: found out once, since
    /// later it may be this one that has it.
    #[arg(skip)]
    default_port_is_taken: OnceLock<bool>,
}

/// The port of the TCP server if nobody asked for another.
const TCP_PORT: u16 = 5760;

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (mavswitch)");

const AFTER: &str = "\
Environment: MAVLINK_ROUTERD_CONF_FILE and MAVLINK_ROUTERD_CONF_DIR stand for -c and -d.
SIGHUP has the files read anew.
Exit status: 0 after SIGINT or SIGTERM, 1 if it cannot start, 2 for a wrong command line or a
wrong configuration, also if a file that it names cannot be read.";

impl RouterdCli {
    /// Whether the program was called by the name of mavlink-router.
    pub fn is_called(program: &OsStr) -> bool {
        Path::new(program).file_name() == Some(OsStr::new(ROUTERD))
    }

    /// What is configured, by files, environment and command line together.
    ///
    /// The TCP server is left out if nobody asked for it and another program has its port: a second
    /// router on the computer, which would not start otherwise.
    ///
    /// # Errors
    ///
    /// If a file cannot be read, or anything is wrong.
    pub fn import(&self) -> Result<Imported, ConfigError> {
        let file = self.conf_file.clone().or_else(|| named("MAVLINK_ROUTERD_CONF_FILE"));
        let dir = self.conf_dir.clone().or_else(|| named("MAVLINK_ROUTERD_CONF_DIR"));
        let files = RouterdFiles::find(file.as_deref(), dir.as_deref())?;
        let mut imported = import_routerd(&files, &self.arguments())?;
        let is_taken = *self.default_port_is_taken.get_or_init(|| is_taken(TCP_PORT));
        if is_taken && imported.tcp_server.is_some_and(|server| !server.is_written) {
            imported.leave_out_tcp_server(&format!(
                "another program listens on TCP port {TCP_PORT}: going on without the TCP server \
                 (choose a port with -t, or turn it off with -t 0)"
            ));
        }
        if self.syslog > 0 && env::var_os("JOURNAL_STREAM").is_none() {
            let text = "-y: the log goes to standard error; systemd brings that to its journal";
            imported.notes.push(ConfigProblem::of_command_line(text));
        }
        Ok(imported)
    }

    fn arguments(&self) -> RouterdArguments {
        let flag = |count: u8| (count > 0).then(|| "true".to_owned());
        let debug = (self.verbose > 0).then(|| "debug".to_owned());
        let general = [
            ("-t", "TcpServerPort", self.tcp_port.clone()),
            ("-r", "ReportStats", flag(self.report)),
            ("-l", "Log", self.log.clone()),
            ("-T", "LogTelemetry", flag(self.telemetry_log)),
            ("-s", "SnifferSysid", self.sniffer_sysid.clone()),
            ("-v", "DebugLogLevel", debug),
            ("-g", "DebugLogLevel", self.debug_log_level.clone()),
        ];
        let written = general.into_iter().filter_map(|(flag, key, text)| Some((flag, key, text?)));
        RouterdArguments {
            masters: self.masters.clone(),
            udp: self.udp.clone(),
            tcp: self.tcp.clone(),
            general: written.collect(),
        }
    }
}

/// A path from the environment; mavlink-router takes an empty one for none as well.
fn named(variable: &str) -> Option<PathBuf> {
    env::var_os(variable).filter(|path| !path.is_empty()).map(PathBuf::from)
}

/// Whether nobody else can listen on a TCP port.
fn is_taken(port: u16) -> bool {
    let address = SocketAddr::new(Ipv6Addr::UNSPECIFIED.into(), port);
    listen(address, None, true).is_err_and(|error| error.kind() == ErrorKind::AddrInUse)
}

/// What to type, for who typed nothing.
pub const NOTHING_FOR_ROUTERD: &str = "\
mavlink-routerd: nothing to join: name a serial port or an address, for example

  mavlink-routerd -e 192.168.1.20:14550 /dev/ttyS1:1500000

or write them to /etc/mavlink-router/main.conf, or leave the TCP server on.";

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(words: &[&str]) -> RouterdCli {
        let words = [&[ROUTERD], words].concat();
        RouterdCli::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn it_is_known_by_the_last_part_of_its_name() {
        for name in ["mavlink-routerd", "/usr/bin/mavlink-routerd", "./mavlink-routerd"] {
            assert!(RouterdCli::is_called(OsStr::new(name)), "{name}");
        }
        for name in ["mavswitch", "/opt/mavlink-routerd/mavswitch", "mavlink-router", ""] {
            assert!(!RouterdCli::is_called(OsStr::new(name)), "{name}");
        }
    }

    #[test]
    fn flags_are_read_in_every_spelling_that_the_original_reads() {
        let cli =
            parse(&["-e127.0.0.1", "--endpoint", "1.2.3.4:5", "--endp=::", "/dev/ttyS1:9600"]);
        assert_eq!(cli.udp, ["127.0.0.1", "1.2.3.4:5", "::"]);
        assert_eq!(cli.masters, ["/dev/ttyS1:9600"]);
        let cli = parse(&["0.0.0.0:1", "-rvTy", "--tcp-port", "0", "-t5", "--tcp-end=1.2.3.4:5"]);
        assert_eq!((cli.report, cli.verbose, cli.telemetry_log, cli.syslog), (1, 1, 1, 1));
        assert_eq!(
            (cli.tcp_port.as_deref(), &cli.tcp[..]),
            (Some("5"), &["1.2.3.4:5".to_owned()][..])
        );
        let cli =
            parse(&["--report_msg_statistics", "--debug-log-level=TRACE", "--sniffer-sysid=9"]);
        assert_eq!((cli.debug_log_level.as_deref(), cli.report), (Some("TRACE"), 1));
        let cli =
            parse(&["--conf-f", "a", "--conf-d", "b", "--telemetry-log", "--log", "c", "-r", "-r"]);
        assert_eq!((cli.conf_file, cli.conf_dir), (Some("a".into()), Some("b".into())));
    }

    #[test]
    fn its_own_tcp_server_does_not_stop_it_when_the_files_are_read_again() {
        let cli = parse(&["-c", "/nonexistent/main.conf", "-d", "/nonexistent/config.d"]);
        let server = || cli.import().unwrap().tcp_server;
        let first = server();
        // Now the port is taken for sure, by this test or by another program.
        let _own = listen((Ipv6Addr::UNSPECIFIED, TCP_PORT).into(), None, true);
        assert_eq!(server(), first);
    }

    #[test]
    fn telemetry_and_version_swallow_no_word() {
        let cli = parse(&["-T", "/dev/ttyS1"]);
        assert_eq!(cli.masters, ["/dev/ttyS1"]);
        let error = RouterdCli::try_parse_from([ROUTERD, "-V", "-y"]).unwrap_err();
        assert_eq!(error.to_string(), format!("{ROUTERD} {VERSION}\n"));
    }
}
