//! Which frames a listener wants: `1/1 HEARTBEAT,ATTITUDE from=fc`.
//!
//! Words with spaces between: a frame is wanted if every word takes it. A word is a list with commas
//! between: it takes a frame if one of its parts does.

use crate::mavlink::{Dialect, Header, MessageId};

/// What is wanted. The default wants everything.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Selection {
    words: Vec<Vec<Wanted>>,
}

/// A part of a word.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Wanted {
    /// What a system sends, or one component of it: `1`, `1/1`.
    Source(u8, Option<u8>),
    /// A message: `HEARTBEAT`, `id=0`.
    Message(MessageId),
    /// What comes from an endpoint: `from=fc`.
    From(String),
    /// What goes nowhere: `dropped`.
    Dropped,
}

/// Why a text is no [`Selection`].
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum FilterError {
    /// There is no such message.
    #[error("{0} is no message known here{1} (write id=NUMBER for one of a dialect of your own)")]
    Message(String, String),
    /// There is no such endpoint.
    #[error("there is no endpoint {0}; there are: {1}")]
    Endpoint(String, String),
    /// It cannot be read.
    #[error(
        "`{0}` is nothing to select by: write 1/1 or 1 for what a component or a system sends, \
         HEARTBEAT or id=0 for a message, from=NAME for an endpoint, or dropped"
    )]
    Unknown(String),
}

impl Selection {
    /// Reads what was written. `endpoints` are the names of those there are.
    ///
    /// # Errors
    ///
    /// If a part of it is nothing known.
    pub fn parse(text: &str, dialect: &Dialect, endpoints: &[&str]) -> Result<Self, FilterError> {
        let word = |word: &str| parse_word(word, dialect, endpoints);
        let words = text.split_whitespace().map(word).collect::<Result<_, _>>()?;
        Ok(Self { words })
    }

    /// Whether a frame is wanted that came from this endpoint.
    pub fn takes(&self, header: &Header, endpoint: &str, is_dropped: bool) -> bool {
        let takes = |part: &Wanted| match part {
            Wanted::Source(system, component) => {
                let is_component = component.is_none_or(|it| it == header.source.component);
                *system == header.source.system && is_component
            }
            Wanted::Message(id) => *id == header.id,
            Wanted::From(name) => name == endpoint,
            Wanted::Dropped => is_dropped,
        };
        self.words.iter().all(|word| word.iter().any(takes))
    }
}

fn parse_word(
    word: &str,
    dialect: &Dialect,
    endpoints: &[&str],
) -> Result<Vec<Wanted>, FilterError> {
    // A name of an endpoint may have commas in it, as an address has.
    if let Some(name) = word.strip_prefix("from=") {
        if endpoints.contains(&name) {
            return Ok(vec![Wanted::From(name.to_owned())]);
        }
        return name.split(',').map(|name| from(name, endpoints)).collect();
    }
    word.split(',').map(|part| parse_part(part, dialect)).collect()
}

fn from(name: &str, endpoints: &[&str]) -> Result<Wanted, FilterError> {
    match endpoints.iter().find(|known| **known == name) {
        Some(name) => Ok(Wanted::From((*name).to_owned())),
        None => Err(FilterError::Endpoint(name.to_owned(), endpoints.join(", "))),
    }
}

fn parse_part(part: &str, dialect: &Dialect) -> Result<Wanted, FilterError> {
    let unknown = || FilterError::Unknown(part.to_owned());
    if part == "dropped" {
        return Ok(Wanted::Dropped);
    }
    if let Some(number) = part.strip_prefix("id=") {
        let id = number.parse().ok().filter(|id| *id <= 0xff_ffff).ok_or_else(unknown)?;
        return Ok(Wanted::Message(MessageId(id)));
    }
    if part.starts_with(|first: char| first.is_ascii_digit()) {
        let (system, component) = match part.split_once('/') {
            Some((system, component)) => (system, Some(component)),
            None => (part, None),
        };
        let number = |text: &str| text.parse::<u8>().map_err(|_| unknown());
        return Ok(Wanted::Source(number(system)?, component.map(number).transpose()?));
    }
    let name = part.to_ascii_uppercase();
    let found = dialect.definitions().iter().find(|message| message.name == name);
    match found {
        Some(message) => Ok(Wanted::Message(message.id)),
        None if is_name(&name) => Err(FilterError::Message(name.clone(), like(&name, dialect))),
        None => Err(unknown()),
    }
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

/// The nearest name to one that is misspelt, as a question.
fn like(name: &str, dialect: &Dialect) -> String {
    let names = dialect.definitions().iter().map(|message| message.name.as_ref());
    let near = names.map(|known| (strsim::jaro_winkler(known, name), known));
    let best = near.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(likeness, _)| *likeness > 0.85);
    best.map_or_else(String::new, |(_, known)| format!("; is {known} meant?"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::{Component, Version};

    fn header(id: u32, system: u8, component: u8) -> Header {
        let source = Component::new(system, component);
        let id = MessageId(id);
        Header { version: Version::V2, len: 0, signed: false, seq: 0, source, id }
    }

    fn parse(text: &str) -> Result<Selection, FilterError> {
        Selection::parse(text, &Dialect::builtin(), &["fc", "udpin:0.0.0.0:14550", "a,b"])
    }

    #[test]
    fn every_word_must_take_a_frame_by_one_of_its_parts() {
        let wanted = parse("1/1,2 heartbeat,ATTITUDE from=fc").unwrap();
        assert!(wanted.takes(&header(0, 1, 1), "fc", false));
        assert!(wanted.takes(&header(30, 2, 190), "fc", false));
        assert!(!wanted.takes(&header(30, 1, 190), "fc", false), "another component");
        assert!(!wanted.takes(&header(31, 1, 1), "fc", false), "another message");
        assert!(!wanted.takes(&header(0, 1, 1), "udpin:0.0.0.0:14550", false));
        assert!(Selection::default().takes(&header(31, 1, 1), "fc", true));
    }

    #[test]
    fn names_of_endpoints_may_look_like_anything() {
        let wanted = parse("from=a,b id=12345").unwrap();
        assert!(wanted.takes(&header(12_345, 1, 1), "a,b", false));
        let wanted = parse("from=fc,udpin:0.0.0.0:14550 dropped").unwrap();
        assert!(wanted.takes(&header(0, 1, 1), "udpin:0.0.0.0:14550", true));
        assert!(!wanted.takes(&header(0, 1, 1), "fc", false));
    }

    #[test]
    fn what_is_wrong_is_said_with_what_to_write() {
        let wrong = |text| parse(text).unwrap_err().to_string();
        assert!(wrong("HEARTBEET").contains("is HEARTBEAT meant?"), "{}", wrong("HEARTBEET"));
        assert!(wrong("from=gcs").ends_with("there are: fc, udpin:0.0.0.0:14550, a,b"));
        for text in ["256", "1/x", "id=99999999", "1/2/3", "?", "to=fc"] {
            assert!(matches!(parse(text), Err(FilterError::Unknown(_))), "{text}");
        }
    }
}
