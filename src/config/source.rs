//! The text of one configuration file: read with a limit, parsed as TOML, and places found in it.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::Spanned;
use toml::de::DeTable;

use super::error::printable;
use super::place::{ConfigProblem, Place};

/// How large a file may be, in bytes; a thousand endpoints need a tenth of it.
pub const MAX_LEN: u64 = 1 << 20;

/// How many characters of a wrong value are shown.
const SHOWN: usize = 40;

/// One configuration file.
pub(super) struct Source {
    /// As the user named it, fit to be printed.
    name: Arc<str>,
    /// What paths in it are relative to.
    dir: PathBuf,
    text: String,
}

impl Source {
    /// Reads a file.
    pub(super) fn read(path: &Path) -> Result<Self, ConfigProblem> {
        let (name, bytes) = read_limited(path)?;
        // Absolute, so that the configuration means the same when it is printed and used elsewhere.
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let dir = absolute.parent().unwrap_or(&absolute).to_owned();
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self { name, dir, text }),
            Err(error) => Err(not_utf8(name, &error)),
        }
    }

    /// Reads a file of a format that does not say how its text is encoded.
    pub(super) fn read_any_text(path: &Path) -> Result<Self, ConfigProblem> {
        let (name, bytes) = read_limited(path)?;
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Ok(Self { name, dir: PathBuf::new(), text })
    }

    /// A file that was read by somebody else.
    pub(super) fn new(name: &str, text: String) -> Self {
        Self { name: printable(name).into(), dir: PathBuf::new(), text }
    }

    /// The whole text.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Parses the text as TOML.
    pub(super) fn table(&self) -> Result<Spanned<DeTable<'_>>, ConfigProblem> {
        DeTable::parse(&self.text).map_err(|error| {
            let span = error.span().unwrap_or(self.text.len()..self.text.len());
            let text = match error.message() {
                "duplicate key" => format!("`{}` is there twice: keep one", self.excerpt(&span)),
                message => message.to_owned(),
            };
            ConfigProblem::at(&self.place(&span), text)
        })
    }

    /// Where the first byte of `span` stands.
    pub(super) fn place(&self, span: &Range<usize>) -> Place {
        let before = self.text.get(..span.start).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Place {
            file: self.name.clone(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// The text at `span`, on one line and not too long.
    pub(super) fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default();
        let mut shown: String = line.chars().take(SHOWN).collect();
        if shown.len() < text.len() {
            shown.push_str("...");
        }
        shown
    }

    /// A path as it was meant: relative to the file that names it.
    pub(super) fn resolve(&self, path: &Path) -> PathBuf {
        self.dir.join(path)
    }
}

/// The name of a file, fit to be printed, and what is in it.
fn read_limited(path: &Path) -> Result<(Arc<str>, Vec<u8>), ConfigProblem> {
    let name: Arc<str> = printable(&path.display().to_string()).into();
    let bytes = read_bytes(path)
        .map_err(|error| ConfigProblem::of_file(&name, format!("cannot read: {error}")))?;
    if bytes.len() as u64 > MAX_LEN {
        let text = format!("larger than {} MiB (is this a configuration?)", MAX_LEN >> 20);
        return Err(ConfigProblem::of_file(&name, text));
    }
    Ok((name, bytes))
}

fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_LEN + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn not_utf8(name: Arc<str>, error: &std::string::FromUtf8Error) -> ConfigProblem {
    let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let source =
        Source { name, dir: PathBuf::new(), text: String::from_utf8_lossy(good).into_owned() };
    let place = source.place(&(good.len()..good.len()));
    ConfigProblem::at(&place, "not UTF-8: save the file as UTF-8")
}
