//! What is configured for the program as a whole, and the table of the keys that say it.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum;

use super::control_place::ControlPlace;
use super::key_files::KeyFile;
use super::own::{self, OwnOptions};
use super::record::{self, RecordOptions};
use super::shape::Shape;
use super::value::{self, FOREVER};
use crate::routing::{Learn, RouterOptions};

/// What is configured for the program as a whole.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct General {
    /// How to route.
    pub router: RouterOptions,
    /// Definition files to know the messages of.
    pub dialect: Vec<PathBuf>,
    /// The signing keys that endpoints may use; no two have the same name.
    pub keys: Vec<KeyFile>,
    /// How log lines look.
    pub log_format: LogFormat,
    /// What to log.
    pub log_level: LogLevel,
    /// Where metrics and the status page are served; nowhere if there is none.
    pub metrics: Option<SocketAddr>,
    /// Where the control socket is.
    pub control: ControlPlace,
    /// What to record.
    pub record: RecordOptions,
    /// Who the program itself is.
    pub own: OwnOptions,
}

/// How log lines look.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum LogFormat {
    /// As `journal` if standard error is the journal of systemd, otherwise as `text`
    #[default]
    Auto,
    /// One line of text for each event, with the time
    Text,
    /// One JSON object for each event
    Json,
    /// Lines with priorities and without the time, for the journal of systemd
    Journal,
    /// One line of text without the time, for another log that adds its own
    Plain,
}

/// What to log: each level has those before it.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum LogLevel {
    /// What cannot go on
    Error,
    /// What is wrong
    Warn,
    /// Who comes and who goes
    #[default]
    Info,
    /// What helps to find a fault
    Debug,
    /// Everything
    Trace,
}

/// One general key of the file; its name is that of the option on the command line.
#[derive(Clone, Copy, Debug)]
pub struct GeneralSpec {
    /// The key: `route_age`.
    pub name: &'static str,
    /// Which TOML types the value may have.
    pub shape: Shape,
    /// What the value has to be, for errors: "expected " goes before it.
    pub expects: &'static str,
    /// What the key does, in one line.
    pub help: &'static str,
    /// The value that holds where nothing is written, in TOML, if there is one.
    pub default: Option<&'static str>,
    /// Whether another value holds from the next reload on; if not, from the next start on.
    pub is_reloaded: bool,
    /// Reads a value; `None` if it is not right.
    pub(super) set: fn(&mut General, &[String]) -> Option<()>,
    /// The words of the value, or none if there is no value.
    pub(super) show: fn(&General) -> Vec<String>,
}

/// All general keys, in the order in which they are printed and explained.
pub const GENERAL: &[GeneralSpec] = &[
    GeneralSpec {
        name: "learn",
        shape: Shape::Text,
        expects: "all or heartbeat",
        help: "learn routes from every frame, or from HEARTBEAT only",
        default: Some("\"all\""),
        is_reloaded: true,
        set: |to, words| put(&mut to.router.learn, words.first().and_then(|word| learn(word))),
        show: |general| vec![show_learn(general.router.learn).to_owned()],
    },
    GeneralSpec {
        name: "strict",
        shape: Shape::Flag,
        expects: "true or false",
        help: "send nothing to components that were never heard, not even to their system's links",
        default: Some("false"),
        is_reloaded: true,
        set: |to, words| put(&mut to.router.strict, words.first().and_then(|it| value::flag(it))),
        show: |general| vec![general.router.strict.to_string()],
    },
    GeneralSpec {
        name: "route_age",
        shape: Shape::Number,
        expects: "a number of seconds, or 0 for never",
        help: "forget a route that was silent for so many seconds; 0: never",
        default: Some("300"),
        is_reloaded: true,
        set: |to, words| {
            let age = words.first().and_then(|word| seconds(word));
            put(&mut to.router.route_age, age.map(|age| (!age.is_zero()).then_some(age)))
        },
        show: |general| {
            let age = general.router.route_age.unwrap_or_default();
            vec![age.as_secs_f64().to_string()]
        },
    },
    GeneralSpec {
        name: "sniffer",
        shape: Shape::Number,
        expects: "a system id of 1 to 255",
        help: "send everything to the links on which this system id is heard, whoever it is for",
        default: None,
        is_reloaded: true,
        set: |to, words| {
            let system = words.first().and_then(|word| value::number(word, 1..=255));
            put(&mut to.router.sniffer, system.map(Some))
        },
        show: |general| general.router.sniffer.iter().map(ToString::to_string).collect(),
    },
    GeneralSpec {
        name: "dialect",
        shape: Shape::Paths,
        expects: "an array of file names",
        help: "know the messages of these XML definition files too; relative to this file",
        default: None,
        is_reloaded: true,
        set: |to, words| put(&mut to.dialect, Some(words.iter().map(PathBuf::from).collect())),
        show: |general| general.dialect.iter().map(|it| it.display().to_string()).collect(),
    },
    GeneralSpec {
        name: "keys",
        shape: Shape::Files,
        expects: "a table of file names, each key with a name of its own",
        help: "the signing keys that endpoints may name, each in a file; relative to this file",
        default: None,
        is_reloaded: true,
        set: |to, words| put(&mut to.keys, words.iter().map(|word| key_file(word)).collect()),
        show: |general| general.keys.iter().map(ToString::to_string).collect(),
    },
    GeneralSpec {
        name: "log_format",
        shape: Shape::Text,
        expects: "auto, text, json, journal or plain",
        help: "how log lines look: auto, text, json, journal or plain; auto: journal under systemd, else text",
        default: Some("\"auto\""),
        is_reloaded: false,
        set: |to, words| put(&mut to.log_format, words.first().and_then(|word| choice(word))),
        show: |general| show_choice(&general.log_format),
    },
    GeneralSpec {
        name: "log_level",
        shape: Shape::Text,
        expects: "error, warn, info, debug or trace",
        help: "what to log: error, warn, info, debug or trace",
        default: Some("\"info\""),
        is_reloaded: true,
        set: |to, words| put(&mut to.log_level, words.first().and_then(|word| choice(word))),
        show: |general| show_choice(&general.log_level),
    },
    GeneralSpec {
        name: "metrics",
        shape: Shape::Text,
        expects: "an IP address and a port, as 127.0.0.1:9550",
        help: "serve metrics for Prometheus and a status page by HTTP at this address and port",
        default: None,
        is_reloaded: true,
        set: |to, words| {
            put(&mut to.metrics, words.first().and_then(|word| word.parse().ok()).map(Some))
        },
        show: |general| general.metrics.iter().map(ToString::to_string).collect(),
    },
    GeneralSpec {
        name: "control",
        shape: Shape::Text,
        expects: "an absolute path, or off",
        help: "the control socket, by which `mavswitch status` and others ask; off: none",
        default: None,
        is_reloaded: false,
        set: |to, words| {
            put(&mut to.control, words.first().and_then(|word| ControlPlace::parse(word)))
        },
        show: |general| general.control.show().into_iter().collect(),
    },
    own::SYSTEM,
    own::COMPONENT,
    record::RECORD,
    record::TELEMETRY,
    record::WHEN,
    record::MAX_SIZE,
    record::MAX_TIME,
    record::MIN_FREE,
    record::MAX_FILES,
    record::FLIGHT_LOG,
    record::FLIGHT_LOG_SYSTEM,
];

impl LogLevel {
    /// The level of this name: `debug`.
    pub fn find(name: &str) -> Option<Self> {
        choice(name)
    }

    /// Its name.
    pub fn name(self) -> String {
        show_choice(&self).concat()
    }
}

impl General {
    /// The value of a key in TOML, if it has one.
    pub fn show(&self, spec: &GeneralSpec) -> Option<String> {
        let words = (spec.show)(self);
        (!words.is_empty()).then(|| spec.shape.to_toml(&words))
    }
}

/// A time in seconds, to the millisecond: `300`, `0.5`.
pub fn seconds(text: &str) -> Option<Duration> {
    let seconds: f64 = text.parse().ok()?;
    let range = 0.0..=FOREVER.as_secs_f64();
    range.contains(&seconds).then(|| Duration::from_millis((seconds * 1000.0).round() as u64))
}

/// A key and its file: `radio=/etc/mavswitch/radio.key`.
pub fn key_file(text: &str) -> Option<KeyFile> {
    let (name, path) = text.split_once('=')?;
    let name = value::key_name(name)?;
    (!path.is_empty()).then(|| KeyFile { name, path: path.into(), key: None })
}

fn learn(word: &str) -> Option<Learn> {
    [Learn::All, Learn::Heartbeat].into_iter().find(|learn| show_learn(*learn) == word)
}

fn show_learn(learn: Learn) -> &'static str {
    match learn {
        Learn::All => "all",
        Learn::Heartbeat => "heartbeat",
    }
}

pub(super) fn choice<T: ValueEnum>(word: &str) -> Option<T> {
    T::from_str(word, false).ok()
}

pub(super) fn show_choice(value: &impl ValueEnum) -> Vec<String> {
    value.to_possible_value().map(|value| value.get_name().to_owned()).into_iter().collect()
}

pub(super) fn put<T>(field: &mut T, value: Option<T>) -> Option<()> {
    *field = value?;
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_of_the_table_are_those_of_the_values() {
        for spec in GENERAL {
            assert_eq!(General::default().show(spec).as_deref(), spec.default, "{}", spec.name);
        }
    }

    #[test]
    fn every_choice_is_named_where_it_is_explained() {
        fn assert_named<T: ValueEnum>(key: &str) {
            let spec = GENERAL.iter().find(|spec| spec.name == key).unwrap();
            for value in T::value_variants() {
                let name = &show_choice(value)[0];
                assert!(spec.expects.contains(name) && spec.help.contains(name), "{key}: {name}");
            }
        }
        assert_named::<LogFormat>("log_format");
        assert_named::<LogLevel>("log_level");
        assert_named::<record::RecordWhen>("record_when");
        assert_named::<record::FlightLog>("flight_log");
    }

    #[test]
    fn seconds_are_a_number_from_0_on() {
        assert_eq!(seconds("0"), Some(Duration::ZERO));
        assert_eq!(seconds("0.5"), Some(Duration::from_millis(500)));
        assert_eq!(seconds("1e3"), Some(Duration::from_secs(1000)));
        for text in ["", "-1", "nan", "inf", "5s", "1e300"] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }
}
