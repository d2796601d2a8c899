//! The sections of several files as one list: sections of one title are one section, and of its keys
//! the last one holds.

use super::ini::{Entry, Section};
use crate::config::place::ConfigProblem;

/// What all files say together.
#[derive(Default)]
pub(super) struct Merged {
    /// In the order in which the titles came first.
    pub(super) sections: Vec<Section>,
    /// Keys that one file has twice, which is seldom meant.
    pub(super) notes: Vec<ConfigProblem>,
}

impl Merged {
    /// Takes the sections of a later file.
    pub(super) fn add(&mut self, sections: Vec<Section>) {
        for section in sections {
            let is_it = |known: &&mut Section| known.title.eq_ignore_ascii_case(&section.title);
            match self.sections.iter_mut().find(is_it) {
                Some(known) => {
                    for entry in section.entries {
                        self.notes.extend(put(&mut known.entries, entry));
                    }
                }
                None => self.add_new(section),
            }
        }
    }

    fn add_new(&mut self, section: Section) {
        let mut entries = Vec::new();
        for entry in section.entries {
            self.notes.extend(put(&mut entries, entry));
        }
        self.sections.push(Section { entries, ..section });
    }
}

/// Adds an entry in place of an earlier one. Tells if both stand in the same file.
fn put(entries: &mut Vec<Entry>, entry: Entry) -> Option<ConfigProblem> {
    let is_it = |known: &&mut Entry| known.key.eq_ignore_ascii_case(&entry.key);
    let Some(known) = entries.iter_mut().find(is_it) else {
        entries.push(entry);
        return None;
    };
    let earlier = std::mem::replace(known, entry);
    let text = format!(
        "`{}` stands in line {} too, in a section of the same name: this one holds",
        known.key, earlier.key_place.line
    );
    let is_same_file = earlier.key_place.file == known.key_place.file;
    is_same_file.then(|| ConfigProblem::at(&known.key_place, text))
}
