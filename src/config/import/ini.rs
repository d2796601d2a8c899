//! The lines of a file of mavlink-router: sections, keys and values, each with its place.
//!
//! What they mean is for others to say; here every value is text. Known crates for this kind of
//! file either give no line numbers or read other rules than mavlink-router has: a comment has a
//! line of its own, and whatever follows the first `=` is the value.

use std::ops::Range;

use crate::config::place::{ConfigProblem, Place};
use crate::config::source::Source;

/// One `[...]` and what stands below it.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// Between the brackets, without blanks around it.
    pub(super) title: String,
    pub(super) place: Place,
    pub(super) entries: Vec<Entry>,
}

/// One `KEY = VALUE`.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Without blanks around it; not empty.
    pub(super) key: String,
    /// Without blanks around it; not empty.
    pub(super) value: String,
    /// Where the key stands.
    pub(super) key_place: Place,
    /// Where the value stands.
    pub(super) place: Place,
}

/// Reads the lines of a file; the last one counts whether or not it ends.
pub(super) fn read(source: &Source) -> Result<Vec<Section>, Vec<ConfigProblem>> {
    let mut reader = Reader { source, sections: Vec::new(), problems: Vec::new() };
    let mut start = 0;
    for line in source.text().split_inclusive('\n') {
        reader.line(start..start + line.len());
        start += line.len();
    }
    if reader.problems.is_empty() { Ok(reader.sections) } else { Err(reader.problems) }
}

struct Reader<'s> {
    source: &'s Source,
    sections: Vec<Section>,
    problems: Vec<ConfigProblem>,
}

impl Reader<'_> {
    fn refuse(&mut self, span: &Range<usize>, text: &str) {
        self.problems.push(ConfigProblem::at(&self.source.place(span), text));
    }

    fn line(&mut self, line: Range<usize>) {
        let line = self.trim(line);
        match self.text(&line).bytes().next() {
            None | Some(b'#' | b';') => {}
            Some(b'[') => self.section(&line),
            Some(_) => self.entry(&line),
        }
    }

    fn text(&self, span: &Range<usize>) -> &str {
        self.source.text().get(span.clone()).unwrap_or_default()
    }

    /// The span without blanks around it.
    fn trim(&self, span: Range<usize>) -> Range<usize> {
        let text = self.text(&span);
        let start = span.start + (text.len() - text.trim_start().len());
        start..start + text.trim().len()
    }

    fn section(&mut self, line: &Range<usize>) {
        let (title, behind) = self.text(line)[1..].split_once(']').unzip();
        let behind = behind.map(str::len);
        let title = title.unwrap_or_default().trim().to_owned();
        // A wrong one too, lest the keys below it are told to have none.
        let place = self.source.place(line);
        self.sections.push(Section { title, place, entries: Vec::new() });
        match behind {
            None => self.refuse(line, "a section without its end: write ] behind the name"),
            Some(0) => {}
            Some(len) => {
                let text =
                    "something stands behind the ]: take it out (a comment has its own line)";
                self.refuse(&(line.end - len..line.end), text);
            }
        }
    }

    fn entry(&mut self, line: &Range<usize>) {
        let Some(equals) = self.text(line).find('=') else {
            return self.refuse(line, "no = here: write KEY = VALUE (a comment begins with #)");
        };
        let key = self.trim(line.start..line.start + equals);
        let value = self.trim(line.start + equals + 1..line.end);
        if key.is_empty() {
            return self.refuse(line, "no key before the =: write KEY = VALUE");
        }
        if value.is_empty() {
            return self.refuse(line, "a key without a value: write one, or take the line out");
        }
        let entry = Entry {
            key: self.text(&key).to_owned(),
            value: self.text(&value).to_owned(),
            key_place: self.source.place(&key),
            place: self.source.place(&value),
        };
        match self.sections.last_mut() {
            Some(section) => section.entries.push(entry),
            None => self.refuse(line, "a key before the first section: write [General] above it"),
        }
    }
}
