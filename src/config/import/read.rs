//! What files and command line of mavlink-router mean together.

use std::collections::HashSet;
use std::time::Duration;

use super::arguments::RouterdArguments;
use super::endpoint;
use super::endpoint_keys::{ENDPOINT_KEYS, EndpointDraft, SectionKind};
use super::files::RouterdFiles;
use super::general_keys::{Draft, GENERAL_KEYS};
use super::ini::{self, Entry, Section};
use super::merge::Merged;
use super::names::{find, kind_of, unknown_key};
use super::{value, write};
use crate::config::merge::{Config, Endpoint, too_many};
use crate::config::place::{ConfigError, ConfigProblem};
use crate::config::record::RecordOptions;
use crate::config::source::Source;
use crate::config::write::unused_name;

/// A configuration of mavlink-router as one of ours.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Imported {
    /// What it says. The last endpoint is [`tcp_server`](Self::tcp_server), if there is one.
    pub config: Config,
    /// What in it has no equivalent, or was probably not meant; in the order of the text.
    pub notes: Vec<ConfigProblem>,
    /// The server that is there unless it is turned off.
    pub tcp_server: Option<TcpServer>,
}

/// The TCP server, for IPv4 and IPv6.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TcpServer {
    /// The port; not 0.
    pub port: u16,
    /// Whether somebody asked for it, be it on this port.
    pub is_written: bool,
}

impl Imported {
    /// Takes the TCP server out again, and tells why.
    pub fn leave_out_tcp_server(&mut self, why: &str) {
        if self.tcp_server.take().is_some() {
            self.config.endpoints.pop();
            self.notes.push(ConfigProblem::of_file(&"TcpServerPort".into(), why));
        }
    }
}

/// Reads the files, and what the command line adds to them and overrides.
///
/// # Errors
///
/// If a file cannot be read, or anything is wrong: all that was found, each with its place.
pub fn import_routerd(
    files: &RouterdFiles,
    arguments: &RouterdArguments,
) -> Result<Imported, ConfigError> {
    let sources = files.paths.iter().map(|path| Source::read_any_text(path));
    let mut imported = import_sources(sources, arguments)?;
    imported.notes.splice(0..0, files.notes.iter().cloned());
    Ok(imported)
}

fn import_sources(
    sources: impl Iterator<Item = Result<Source, ConfigProblem>>,
    arguments: &RouterdArguments,
) -> Result<Imported, ConfigError> {
    let mut merged = Merged::default();
    let mut problems = Vec::new();
    for source in sources {
        let sections = source.map_err(|problem| vec![problem]);
        match sections.and_then(|source| ini::read(&source)) {
            Ok(sections) => merged.add(sections),
            Err(found) => problems.extend(found),
        }
    }
    let mut reader = Reader { problems, notes: merged.notes, ..Reader::default() };
    reader.sections(&merged.sections);
    reader.arguments(arguments);
    reader.finish()
}

#[derive(Default)]
struct Reader {
    draft: Draft,
    endpoints: Vec<EndpointDraft>,
    tcp_server_is_written: bool,
    problems: Vec<ConfigProblem>,
    notes: Vec<ConfigProblem>,
}

impl Reader {
    fn sections(&mut self, sections: &[Section]) {
        for section in sections {
            match kind_of(section) {
                Ok(None) => section.entries.iter().for_each(|entry| self.general(entry)),
                Ok(Some((kind, name))) => self.endpoint(section, kind, name),
                Err(problem) => self.problems.push(problem),
            }
        }
    }

    fn general(&mut self, entry: &Entry) {
        let spec = GENERAL_KEYS.iter().find(|spec| spec.name.eq_ignore_ascii_case(&entry.key));
        let Some(spec) = spec else {
            let text = unknown_key(&entry.key, None);
            return self.problems.push(ConfigProblem::at(&entry.key_place, text));
        };
        self.tcp_server_is_written |= spec.name == "TcpServerPort";
        match (spec.set)(&mut self.draft, &entry.value) {
            Some(()) => self.note(entry, spec.name, (spec.note)(&entry.value)),
            None => self.refuse_value(entry, spec.name, spec.expects),
        }
    }

    fn endpoint(&mut self, section: &Section, kind: SectionKind, name: String) {
        let found_before = self.problems.len();
        let mut draft = EndpointDraft::new(kind);
        draft.name = Some(name);
        draft.place = Some(section.place.clone());
        for entry in &section.entries {
            match find(&entry.key).filter(|spec| spec.sections.contains(&kind)) {
                Some(spec) => match (spec.set)(&mut draft, &entry.value) {
                    Some(()) => self.note(entry, spec.name, (spec.note)(&entry.value)),
                    None => self.refuse_value(entry, spec.name, spec.expects),
                },
                None => {
                    let text = unknown_key(&entry.key, Some(kind));
                    self.problems.push(ConfigProblem::at(&entry.key_place, text));
                }
            }
        }
        // A misspelt key is not told as a missing one too.
        if self.problems.len() == found_before {
            self.problems.extend(missing(section, kind));
            self.endpoints.push(draft);
        }
    }

    fn note(&mut self, entry: &Entry, key: &str, note: Option<&str>) {
        let note = note.map(|note| format!("`{key}` = {}: {note}", entry.value));
        self.notes.extend(note.map(|note| ConfigProblem::at(&entry.place, note)));
    }

    fn refuse_value(&mut self, entry: &Entry, key: &str, expects: &str) {
        let (shown, hint) = (shorten(&entry.value), value::hint(&entry.value));
        let text = format!("bad value `{shown}` for `{key}`: expected {expects}{hint}");
        self.problems.push(ConfigProblem::at(&entry.place, text));
    }

    /// What the command line says overrides the files; its endpoints add to theirs.
    fn arguments(&mut self, arguments: &RouterdArguments) {
        for (flag, key, text) in arguments.general() {
            let Some(spec) = GENERAL_KEYS.iter().find(|spec| spec.name == key) else { continue };
            self.tcp_server_is_written |= spec.name == "TcpServerPort";
            let told = match (spec.set)(&mut self.draft, text) {
                Some(()) => (&mut self.notes, (spec.note)(text).map(|it| format!("{flag}: {it}"))),
                None => {
                    let expects = spec.expects;
                    let text = format!("{flag}: bad value `{text}`: expected {expects}");
                    (&mut self.problems, Some(text))
                }
            };
            let (to, text) = told;
            to.extend(text.map(ConfigProblem::of_command_line));
        }
        for endpoint in arguments.endpoints() {
            match endpoint {
                Ok(draft) => self.endpoints.push(draft),
                Err(text) => {
                    self.problems.push(ConfigProblem::of_command_line(text));
                }
            }
        }
    }

    fn finish(mut self) -> Result<Imported, ConfigError> {
        endpoint::give_ports(&mut self.endpoints);
        let mut general = self.draft.general;
        if general.record.dir.is_none() {
            // Without a directory, the other keys mean nothing.
            general.record = RecordOptions::default();
        }
        let mut config = Config { general, endpoints: Vec::new() };
        for draft in self.endpoints {
            match endpoint::settle(&draft) {
                Ok(endpoint) => config.endpoints.extend(endpoint),
                Err(problem) => self.problems.push(problem),
            }
        }
        let is_written = self.tcp_server_is_written;
        let tcp_server = self.draft.tcp_port.map(|port| TcpServer { port, is_written });
        config.endpoints.extend(tcp_server.map(|it| endpoint::tcp_server(it.port)));
        self.problems.extend(too_many(&config.endpoints));
        settle_all(&mut config.endpoints, self.draft.dedup);
        let notes = self.notes;
        ConfigError::unless_none(Imported { config, notes, tcp_server }, self.problems)
    }
}

/// The keys that a section must have and has not.
fn missing(section: &Section, kind: SectionKind) -> impl Iterator<Item = ConfigProblem> {
    let required = ENDPOINT_KEYS.iter().filter(move |spec| spec.required_in.contains(&kind));
    let has = |name: &str| section.entries.iter().any(|it| it.key.eq_ignore_ascii_case(name));
    required.filter(move |spec| !has(spec.name)).map(|spec| {
        let text = format!("[{}] has no `{}`: add one", section.title, spec.name);
        ConfigProblem::at(&section.place, text)
    })
}

/// Gives every endpoint what is said for all, and a name that no other has.
fn settle_all(endpoints: &mut [Endpoint], dedup: Option<Duration>) {
    let mut names = HashSet::new();
    for endpoint in endpoints {
        let options = &mut endpoint.config.options;
        options.dedup = dedup;
        if options.name.is_some() {
            let name = unused_name(&endpoint.config, &mut names);
            endpoint.config.options.name = Some(name);
        }
    }
}

/// As much of a value as an error shows.
fn shorten(text: &str) -> String {
    const SHOWN: usize = 40;
    let mut shown: String = text.chars().take(SHOWN).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    shown
}

/// For a fuzzer: reads a file of mavlink-router, and if it is one, holds that what it was taken for
/// is the same when it was written out and read back.
///
/// # Panics
///
/// If it reads back as anything else, or if a message has control characters.
pub fn fuzz_import(data: &[u8]) {
    let source = Source::new("fuzz.conf", String::from_utf8_lossy(data).into_owned());
    let read = import_sources([Ok(source)].into_iter(), &RouterdArguments::default());
    let told = match read {
        Ok(imported) => {
            write::assert_reads_back(&imported);
            imported.notes
        }
        Err(error) => {
            assert!(!error.problems.is_empty());
            error.problems
        }
    };
    assert!(told.iter().all(|told| !told.to_string().contains(char::is_control)), "{told:?}");
}
