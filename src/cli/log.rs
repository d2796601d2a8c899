//! `mavswitch log`: what can be done with telemetry logs.

use std::io;
use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::config::{DialectFileError, MessageRef, ids, load_dialect, message_hint, messages};
use crate::mavlink::{Dialect, MessageId, TooManyDefinitions};
use crate::record::tools::{Copied, ToolError, filter, info, merge};
use crate::record::{Moment, Selection};
use crate::routing::FilterLists;

/// What can be done with telemetry logs (.tlog).
#[derive(Subcommand, Debug)]
pub enum LogCommand {
    /// Tell what is in a log: duration, components, messages and their rates, pauses, loss
    Info {
        /// A telemetry log
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// What messages are called
        #[command(flatten)]
        names: Names,
    },
    /// Make a log of a part of one
    Cut {
        /// A telemetry log
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Which part
        #[command(flatten)]
        part: Part,
        /// The new log
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Make one log of several, in the order of their times
    Merge {
        /// Telemetry logs
        #[arg(value_name = "FILE", required = true, num_args = 2..)]
        files: Vec<PathBuf>,
        /// The new log
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Make a log of some messages, systems or components of one
    Filter {
        /// A telemetry log
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// What passes
        #[command(flatten)]
        lists: Box<Lists>,
        /// What messages are called
        #[command(flatten)]
        names: Names,
        /// Which part
        #[command(flatten)]
        part: Part,
        /// The new log
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}

/// Which part of a log.
#[derive(Args, Clone, Debug)]
pub struct Part {
    /// Leave out what is before: 90 or 1m30s after the start, or 2026-11-22T10:30:00 (UTC)
    #[arg(long, value_name = "TIME")]
    pub from: Option<Moment>,
    /// Leave out what is from then on
    #[arg(long, value_name = "TIME")]
    pub to: Option<Moment>,
}

/// What messages are called that not everybody has.
#[derive(Args, Clone, Debug)]
pub struct Names {
    /// Know the messages of this XML definition file too; may be repeated
    #[arg(long, value_name = "FILE.xml")]
    pub dialect: Vec<PathBuf>,
}

/// What passes, as the filters of endpoints have it.
#[derive(Args, Clone, Debug)]
pub struct Lists {
    /// Only these messages, by name or number
    #[arg(long, value_name = "MESSAGE[,MESSAGE...]")]
    pub allow_messages: Option<String>,
    /// Not these messages
    #[arg(long, value_name = "MESSAGE[,MESSAGE...]")]
    pub block_messages: Option<String>,
    /// Only what these systems sent
    #[arg(long, value_name = "ID[,ID...]")]
    pub allow_systems: Option<String>,
    /// Not what these systems sent
    #[arg(long, value_name = "ID[,ID...]")]
    pub block_systems: Option<String>,
    /// Only what components with these ids sent
    #[arg(long, value_name = "ID[,ID...]")]
    pub allow_components: Option<String>,
    /// Not what components with these ids sent
    #[arg(long, value_name = "ID[,ID...]")]
    pub block_components: Option<String>,
}

/// Why a log command could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The tool says why.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// A definition file cannot be read.
    #[error(transparent)]
    Dialect(#[from] DialectFileError),
    /// Definition files contradict each other.
    #[error("{0}")]
    Names(TooManyDefinitions),
    /// A list of the filter is wrong.
    #[error("--{0} {1}: {2}")]
    List(&'static str, String, String),
    /// There is nothing between the times.
    #[error("--from is not before --to: nothing is between them")]
    EmptyPart,
    /// What is to be said cannot be written.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

impl LogError {
    /// Whether the command line is wrong, and not what it is about.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::List(..) | Self::EmptyPart)
    }
}

impl LogCommand {
    /// Carries it out; says what came of it, for a person.
    ///
    /// # Errors
    ///
    /// If a list is wrong, or a file cannot be read or written.
    pub fn run(&self) -> Result<String, LogError> {
        let copied = match self {
            Self::Info { file, names } => {
                let dialect = names.load()?;
                return Ok(info(file)?.told(&dialect).to_string());
            }
            Self::Cut { file, part, output } => {
                filter(file, output, &mut part.select(&FilterLists::default())?)?
            }
            Self::Merge { files, output } => {
                let files: Vec<_> = files.iter().map(PathBuf::as_path).collect();
                merge(&files, output)?
            }
            Self::Filter { file, lists, names, part, output } => {
                let lists = lists.read(&names.load()?)?;
                filter(file, output, &mut part.select(&lists)?)?
            }
        };
        Ok(told(copied))
    }
}

fn told(copied: Copied) -> String {
    let Copied { written, read, skipped_bytes } = copied;
    let skipped = match skipped_bytes {
        0 => String::new(),
        bytes => format!("; {bytes} bytes belong to no frame"),
    };
    format!("{written} of {read} frames written{skipped}\n")
}

impl Part {
    fn select(&self, lists: &FilterLists) -> Result<Selection, LogError> {
        Selection::new(self.from, self.to, lists).ok_or(LogError::EmptyPart)
    }
}

impl Names {
    fn load(&self) -> Result<Dialect, LogError> {
        let mut dialect = Dialect::builtin();
        for file in &self.dialect {
            dialect.add(load_dialect(file)?).map_err(LogError::Names)?;
        }
        Ok(dialect)
    }
}

impl Lists {
    fn read(&self, dialect: &Dialect) -> Result<FilterLists, LogError> {
        let message_ids =
            |name, list: &Option<String>| read_messages(name, list.as_deref(), dialect);
        Ok(FilterLists {
            allow_messages: message_ids("allow-messages", &self.allow_messages)?,
            block_messages: message_ids("block-messages", &self.block_messages)?,
            allow_systems: read_ids("allow-systems", self.allow_systems.as_deref())?,
            block_systems: read_ids("block-systems", self.block_systems.as_deref())?,
            allow_components: read_ids("allow-components", self.allow_components.as_deref())?,
            block_components: read_ids("block-components", self.block_components.as_deref())?,
            block_single: None,
        })
    }
}

fn read_ids(name: &'static str, list: Option<&str>) -> Result<Vec<u8>, LogError> {
    let Some(text) = list else { return Ok(Vec::new()) };
    let expected = "expected ids of 0 to 255 with commas between";
    ids(text).ok_or_else(|| LogError::List(name, text.to_owned(), expected.to_owned()))
}

fn read_messages(
    name: &'static str,
    list: Option<&str>,
    dialect: &Dialect,
) -> Result<Vec<MessageId>, LogError> {
    let Some(text) = list else { return Ok(Vec::new()) };
    let wrong = |why| LogError::List(name, text.to_owned(), why);
    let expected = "expected messages by name or number with commas between";
    let messages = messages(text).ok_or_else(|| wrong(expected.to_owned()))?;
    let unknown = |name: &str| {
        let hint = message_hint(name, dialect, "write its number, or say --dialect");
        wrong(format!("no message is called {name}: {hint}"))
    };
    let id = |message| match message {
        MessageRef::Id(id) => Ok(MessageId(id)),
        MessageRef::Name(name) => dialect.id_of(&name).ok_or_else(|| unknown(&name)),
    };
    messages.into_iter().map(id).collect()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::mavlink::{Component, FrameSpec};
    use crate::record::write_record;
    use crate::test_dir::TestDir;

    #[derive(Parser)]
    struct Line {
        #[command(subcommand)]
        command: LogCommand,
    }

    fn run(words: &[&str]) -> Result<String, LogError> {
        Line::parse_from([&["log"], words].concat()).command.run()
    }

    /// A log of a HEARTBEAT and of a message that only this definition file has.
    #[test]
    fn messages_of_ones_own_have_their_names() {
        let dir = TestDir::new();
        let xml = "<mavlink><messages><message id='11000' name='FLAP_STATE'>\
                   <field type='uint8_t' name='angle'/></message></messages></mavlink>";
        let mine = dir.write("mine.xml", xml);
        let own = load_dialect(&mine).unwrap().remove(0);
        let mut log = Vec::new();
        for (id, crc_extra) in [(0, 50), (11_000, own.crc_extra)] {
            let spec = FrameSpec::new(Component::new(1, 1), MessageId(id), crc_extra, &[7]);
            write_record(&mut log, 1_000_000, &spec.to_frame()).unwrap();
        }
        let log = dir.write("flight.tlog", log);
        let (log, mine) = (log.to_str().unwrap(), mine.to_str().unwrap());
        assert!(!run(&["info", log]).unwrap().contains("FLAP_STATE"));
        assert!(run(&["info", log, "--dialect", mine]).unwrap().contains("11000   FLAP_STATE"));
        let few = dir.path().join("few.tlog");
        let only = ["filter", log, "-o", few.to_str().unwrap(), "--allow-messages", "FLAP_STATE"];
        assert!(matches!(run(&only), Err(LogError::List("allow-messages", ..))));
        let near = ["filter", log, "-o", few.to_str().unwrap(), "--block-messages", "HEARTBAET"];
        let told = run(&near).unwrap_err().to_string();
        assert!(
            told.ends_with("no message is called HEARTBAET: did you mean HEARTBEAT?"),
            "{told}"
        );
        let empty = ["cut", log, "-o", few.to_str().unwrap(), "--from", "2", "--to", "1"];
        let error = run(&empty).unwrap_err();
        assert!(error.is_usage() && !few.exists(), "{error}");
        let told = run(&[&only[..], &["--dialect", mine]].concat()).unwrap();
        assert_eq!(told, "1 of 2 frames written\n");
    }
}
