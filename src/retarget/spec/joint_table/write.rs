//! Pairs of joints to a table that can be filled in further.

use super::COLUMNS;

/// One row of a table to start from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableRow {
    /// The joint that is followed.
    pub source: String,
    /// The joint that follows.
    pub target: String,
    /// Whether its position follows.
    pub position: bool,
}

/// A table with all columns, whose cells beyond the names and what follows are empty: defaults. Separated by semicolons, which most
/// spreadsheets take whatever their decimal sign is.
#[must_use]
pub fn write_table(rows: &[TableRow]) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|column| column.name).collect();
    let mut text = format!("{}\n", names.join(";"));
    for row in rows {
        let cells: Vec<String> = COLUMNS
            .iter()
            .map(|column| match column.name {
                "source" => quoted(&row.source),
                "target" => quoted(&row.target),
                "position" => if row.position { "yes" } else { "no" }.to_owned(),
                "rotation" => "yes".to_owned(),
                _ => String::new(),
            })
            .collect();
        text.push_str(&cells.join(";"));
        text.push('\n');
    }
    text
}

/// In quotes where it would not be read back as it is.
fn quoted(name: &str) -> String {
    let needs = name.contains([';', '"', ',', '\t', '\n']) || name.starts_with('#') || name != name.trim();
    if needs { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}
