//! Prints message definitions as rows of the message table, so that the built-in table is extended
//! by the same code that reads a user's dialect.

use std::io::{self, Write};

use crate::mavlink::{Definition, Target};

/// Prints `definitions` as rows of the message table, sorted by id, under the name `dialect`.
///
/// The format is that of `src/mavlink/messages.tsv`: a header line, then a row per definition,
/// columns separated by tabs, -1 for the offset of an absent field.
///
/// # Errors
///
/// Those of `out`.
pub fn write_rows(
    definitions: &[Definition],
    dialect: &str,
    out: &mut impl Write,
) -> io::Result<()> {
    writeln!(
        out,
        "msgid\tcrc_extra\tname\tbase_len\tmax_len\ttarget_system_offset\t\
         target_component_offset\tstatus\tdialect"
    )?;
    let mut rows: Vec<&Definition> = definitions.iter().collect();
    // Stable: of two definitions of one id the one that counts stays first.
    rows.sort_by_key(|row| row.id);
    for row in rows {
        let (id, extra, name) = (row.id, row.crc_extra, &row.name);
        let (base, max) = (row.base_len, row.max_len);
        let (system, component) = offsets(row.target);
        writeln!(
            out,
            "{id}\t{extra}\t{name}\t{base}\t{max}\t{system}\t{component}\tcurrent\t{dialect}"
        )?;
    }
    Ok(())
}

fn offsets(target: Target) -> (i16, i16) {
    match target {
        Target::None => (-1, -1),
        Target::System(system) => (system.into(), -1),
        Target::SystemComponent(system, component) => (system.into(), component.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::Dialect;

    #[test]
    fn rows_are_those_of_the_built_in_table() {
        let table = include_str!("../mavlink/messages.tsv");
        let mut out = Vec::new();
        write_rows(Dialect::builtin().definitions(), "mine", &mut out).unwrap();
        let rows = String::from_utf8(out).unwrap();
        assert_eq!(rows.lines().next(), table.lines().next());
        assert_eq!(rows.lines().count(), table.lines().count());
        for (row, line) in rows.lines().zip(table.lines()).skip(1) {
            let mut columns: Vec<&str> = line.split('\t').collect();
            columns[7..].copy_from_slice(&["current", "mine"]);
            assert_eq!(row, columns.join("\t"));
        }
    }
}
