//! An imported configuration as a file of our own, with what has no equivalent in comments.

use super::read::Imported;
use crate::config::error::printable;
use crate::config::write;

impl Imported {
    /// The configuration in TOML; `from` names where it came from.
    pub fn to_toml(&self, from: &str) -> String {
        let from = printable(from);
        let mut text = format!("# What {from} means, by `mavswitch import`.\n");
        if !self.notes.is_empty() {
            text.push_str("#\n# Not quite the same, or probably not meant:\n");
        }
        for note in &self.notes {
            text.push_str(&format!("# {note}\n"));
        }
        text.push('\n');
        text.push_str(&self.config.to_string());
        text
    }
}

/// Holds that a configuration from files reads back as the same.
///
/// # Panics
///
/// If it does not.
pub(super) fn assert_reads_back(imported: &Imported) {
    write::assert_reads_back(&imported.config);
}
