//! The commands that look into a running daemon: `why` and `listen`.

use std::io::{self, IsTerminal, StdoutLock, Write};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::ask::{AskArgs, AskError};
use crate::config::load_layouts;
use crate::control::{Answer, Client, ClientError, Request};
use crate::listen::{Frames, Reader, SeenFrame, Widths};
use crate::mavlink::{Dialect, Layouts};
use crate::printable::escape_json;
use crate::status::diagnosis_text;

/// What to explain.
#[derive(Args, Clone, Debug)]
pub struct WhyArgs {
    /// Who sends: a component as 1/1, a system as 1, or the name of an endpoint
    #[arg(value_name = "FROM", requires = "to")]
    pub from: Option<String>,
    /// Whom it is for: the same, or all
    #[arg(value_name = "TO")]
    pub to: Option<String>,
    /// Which message: its name or number; without it, HEARTBEAT and COMMAND_LONG
    #[arg(value_name = "MESSAGE")]
    pub message: Option<String>,
    /// In which version of MAVLink [default: 2]
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    #[arg(requires = "from")]
    pub mavlink: Option<u8>,
    /// Whether it is signed; left out, it is where signatures are asked for
    #[arg(long, value_name = "true|false", requires = "from")]
    pub signed: Option<bool>,
    /// Print the answer as JSON
    #[arg(long)]
    pub json: bool,
    /// Whom to ask
    #[command(flatten)]
    pub ask: AskArgs,
}

/// What to listen to.
#[derive(Args, Clone, Debug)]
pub struct ListenArgs {
    /// Which frames, all of them by default; each word must take a frame, by one of its parts
    ///
    /// 1/1 or 1           what a component or a system sends
    /// HEARTBEAT or id=0  a message
    /// from=NAME          what comes from an endpoint
    /// dropped            what goes nowhere
    ///
    /// Parts of a word have commas between: 1/1 HEARTBEAT,ATTITUDE from=fc
    #[arg(value_name = "FILTER", verbatim_doc_comment)]
    pub filter: Vec<String>,
    /// Print each frame as a line of JSON
    #[arg(long)]
    pub json: bool,
    /// End after so many frames
    #[arg(short = 'n', long, value_name = "N")]
    pub count: Option<u64>,
    /// Read the fields of this XML definition file's messages too; may be repeated
    #[arg(long, value_name = "FILE.xml")]
    pub dialect: Vec<PathBuf>,
    /// Whom to ask
    #[command(flatten)]
    pub ask: AskArgs,
}

impl WhyArgs {
    /// Asks, and says why.
    ///
    /// # Errors
    ///
    /// If there is no daemon that answers, or something is not known to it.
    pub fn run(&self) -> Result<String, AskError> {
        let mut client = self.ask.connect()?;
        let (Some(from), Some(to)) = (self.from.clone(), self.to.clone()) else {
            let snapshot = client.status()?;
            return Ok(diagnosis_text(&snapshot));
        };
        let Self { mavlink, signed, .. } = *self;
        let message = self.message.clone();
        let Answer::Why(why) = client.ask(Request::Why { from, to, message, mavlink, signed })?
        else {
            return Err(ClientError::Unexpected.into());
        };
        if self.json {
            let text = serde_json::to_string_pretty(&why).map_err(io::Error::from)?;
            return Ok(escape_json(&text) + "\n");
        }
        Ok(why.to_text(&client.status()?))
    }
}

/// Nothing is waited for; this is only how often it is looked whether the daemon is still there.
const PATIENCE: Duration = Duration::from_secs(3_600);

impl ListenArgs {
    /// Prints frames until there were enough, the daemon ends, or nobody reads on.
    ///
    /// # Errors
    ///
    /// If there is no daemon that tells, a definition file cannot be read, or nothing can be written.
    pub fn run(&self) -> Result<(), AskError> {
        let reader = self.reader()?;
        let mut client = self.ask.connect()?;
        let filter = self.filter.join(" ");
        if !matches!(client.ask(Request::Listen { filter })?, Answer::Frames(_)) {
            return Err(ClientError::Unexpected.into());
        }
        match self.print(&mut client, &reader) {
            // Whoever reads has read enough, as `head` does.
            Err(AskError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            outcome => outcome,
        }
    }

    fn reader(&self) -> Result<Reader, AskError> {
        let (mut dialect, mut layouts) = (Dialect::builtin(), Layouts::builtin());
        for file in &self.dialect {
            // The first of a dialect's files has the last word, so it comes last.
            let found = load_layouts(file).map_err(Box::new)?;
            for definitions in found.into_iter().rev() {
                dialect.add(definitions.messages.clone()).map_err(io::Error::other)?;
                layouts.add(definitions);
            }
        }
        Ok(Reader::new(dialect, layouts))
    }

    fn print(&self, client: &mut Client, reader: &Reader) -> Result<(), AskError> {
        let mut out = Out::new(self.json);
        let mut left = self.count.unwrap_or(u64::MAX);
        while left > 0 {
            let Some(line) = client.receive(PATIENCE)? else { continue };
            let Answer::Frames(Frames { missed, frames }) = line.answer else {
                return Err(ClientError::Unexpected.into());
            };
            out.tell_missed(missed)?;
            for seen in frames.iter().take(usize::try_from(left).unwrap_or(usize::MAX)) {
                out.show(reader, seen)?;
                left -= 1;
            }
            out.stdout.flush()?;
        }
        Ok(())
    }
}

/// Where frames are shown.
struct Out {
    stdout: StdoutLock<'static>,
    json: bool,
    colour: bool,
    widths: Widths,
}

impl Out {
    fn new(json: bool) -> Self {
        let is_terminal = io::stdout().is_terminal();
        let is_plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let stdout = io::stdout().lock();
        Self { stdout, json, colour: is_terminal && !is_plain, widths: Widths::default() }
    }

    fn tell_missed(&mut self, missed: u64) -> io::Result<()> {
        match missed {
            0 => Ok(()),
            _ if self.json => writeln!(self.stdout, "{{\"missed\":{missed}}}"),
            _ => writeln!(self.stdout, "... up to {missed} frames not shown"),
        }
    }

    fn show(&mut self, reader: &Reader, seen: &SeenFrame) -> io::Result<()> {
        let line = match self.json {
            true => reader.json(seen),
            false => reader.line(seen, &mut self.widths, self.colour),
        };
        line.map_or(Ok(()), |line| writeln!(self.stdout, "{line}"))
    }
}
