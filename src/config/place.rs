//! Where in a configuration file something is wrong, and how that is told.

use std::fmt;
use std::sync::Arc;

use super::error::printable;
use super::key_files::KeyFile;

/// Where in a file something stands.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Place {
    /// The file, as the user named it.
    pub file: Arc<str>,
    /// The line; the first is 1.
    pub line: usize,
    /// The character in the line; the first is 1.
    pub column: usize,
}

/// `mavswitch.toml:3:5`
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// One thing that is wrong with a configuration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ConfigProblem {
    /// Where; for a file that cannot be read, the file alone.
    pub place: Result<Place, Arc<str>>,
    /// What is wrong, and what to do about it; without control characters.
    pub text: String,
}

impl ConfigProblem {
    pub(super) fn at(place: &Place, text: impl fmt::Display) -> Self {
        Self { place: Ok(place.clone()), text: printable(&text.to_string()) }
    }

    /// Something about the command line, which has no lines to name.
    pub fn of_command_line(text: impl fmt::Display) -> Self {
        Self::of_file(&"command line".into(), text)
    }

    pub(super) fn of_file(file: &Arc<str>, text: impl fmt::Display) -> Self {
        Self { place: Err(file.clone()), text: printable(&text.to_string()) }
    }
}

impl fmt::Display for ConfigProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Ok(place) => write!(f, "{place}: {}", self.text),
            Err(file) => write!(f, "{file}: {}", self.text),
        }
    }
}

/// A configuration that cannot be used: everything that was found wrong, in the order of the text.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{}", lines(.problems))]
pub struct ConfigError {
    /// What is wrong: one thing at least.
    pub problems: Vec<ConfigProblem>,
}

impl ConfigError {
    /// Holds that the command line gives no name to two keys.
    pub(crate) fn unless_twice(keys: &[KeyFile]) -> Result<(), Self> {
        let is_twice = |at: &usize| keys[..*at].iter().any(|other| other.name == keys[*at].name);
        let told = |at: usize| format!("--key names `{}` twice: keep one", keys[at].name);
        let twice = (0..keys.len()).filter(is_twice).map(told);
        Self::unless_none((), twice.map(ConfigProblem::of_command_line).collect())
    }

    /// `value`, unless there are problems.
    pub(super) fn unless_none<T>(value: T, mut problems: Vec<ConfigProblem>) -> Result<T, Self> {
        if problems.is_empty() {
            return Ok(value);
        }
        problems.sort_by(|a, b| a.place.as_ref().ok().cmp(&b.place.as_ref().ok()));
        Err(Self { problems })
    }
}

fn lines(problems: &[ConfigProblem]) -> String {
    let lines: Vec<String> = problems.iter().map(ToString::to_string).collect();
    lines.join("\n")
}
