//! Tables for people: columns as wide as what stands in them.

use std::fmt;

use crate::printable::printable;

/// A table; its rows are as long as its head.
#[derive(Debug)]
pub(super) struct Columns {
    /// What stands above; where it begins with a blank, the column is one of numbers.
    head: &'static [&'static str],
    rows: Vec<Vec<String>>,
    /// Whether the head stands out.
    colour: bool,
}

impl Columns {
    pub(super) fn new(head: &'static [&'static str], colour: bool) -> Self {
        Self { head, rows: Vec::new(), colour }
    }

    pub(super) fn push(&mut self, row: Vec<String>) {
        debug_assert_eq!(row.len(), self.head.len());
        self.rows.push(row.into_iter().map(|cell| printable(&cell)).collect());
    }

    fn width(&self, column: usize) -> usize {
        let cells = self.rows.iter().map(|row| row[column].chars().count());
        cells.chain([self.head[column].trim().len()]).max().unwrap_or_default()
    }

    fn line(&self, cells: &[&str]) -> String {
        let padded = cells.iter().enumerate().map(|(column, cell)| {
            let width = self.width(column);
            if self.head[column].starts_with(' ') {
                format!("{cell:>width$}")
            } else {
                format!("{cell:<width$}")
            }
        });
        let line = padded.collect::<Vec<_>>().join("  ");
        line.trim_end().to_owned()
    }
}

impl fmt::Display for Columns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heads: Vec<&str> = self.head.iter().map(|head| head.trim()).collect();
        let head = self.line(&heads);
        if self.colour {
            writeln!(f, "\x1b[1m{head}\x1b[0m")?;
        } else {
            writeln!(f, "{head}")?;
        }
        for row in &self.rows {
            let cells: Vec<&str> = row.iter().map(String::as_str).collect();
            writeln!(f, "{}", self.line(&cells))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_left_and_numbers_right() {
        let mut table = Columns::new(&["NAME", " RATE", "WHY"], false);
        table.push(vec!["fc".into(), "7".into(), String::new()]);
        table.push(vec!["laptop".into(), "12.5".into(), "far".into()]);
        assert_eq!(table.to_string(), "NAME    RATE  WHY\nfc         7\nlaptop  12.5  far\n");
    }
}
