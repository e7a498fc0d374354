//! A table to the spec that it stands for.

use serde_json::{Map, Value, json};

use super::{
    COLUMNS, Column, Kind,
    cells::{Line, OpenQuote, header, lines, separator},
};
use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

/// A table may have so many columns; there are not half as many names for them.
const MAX_COLUMNS: usize = 64;
/// A table may have so many rows.
const MAX_ROWS: usize = 10_000;
/// So many errors are told at once.
const MAX_ERRORS: usize = 50;

/// Whether a text is a joint table: its header has a column for the source and one for the target.
pub(in crate::retarget) fn is_table(text: &str) -> bool {
    let Some(header) = header(text) else { return false };
    let Some(separator) = separator(header) else { return false };
    let names: Vec<String> = header.split(separator).map(plain).collect();
    !header.starts_with(['{', '[']) && ["source", "target"].iter().all(|name| names.iter().any(|known| known == name))
}

/// The spec that a table stands for: one `joints` op with its rows, on top of the target at rest.
///
/// # Errors
/// For every cell that cannot be read; pointers are `/line/<line of the file>/<column>`.
pub(in crate::retarget) fn read_table(text: &str) -> Result<Value, SpecError> {
    let separator = header(text).and_then(separator).unwrap_or(',');
    let lines = lines(text, separator).map_err(|OpenQuote(line)| {
        let detail = format!("the quote that is opened in line {line} is never closed");
        SpecError::new(SpecErrorKind::Malformed, detail, "close it, or double quotes that belong to a name")
    })?;
    let mut fields = Vec::new();
    let (head, rows) = lines.split_first().ok_or_else(|| {
        SpecError::new(SpecErrorKind::Malformed, "the joint table is empty", "its first line names the columns")
    })?;
    if rows.len() > MAX_ROWS {
        let detail = format!("the joint table has {} rows, and at most {MAX_ROWS} are read", rows.len());
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, "leave out joints that are not driven"));
    }
    if head.cells.len() > MAX_COLUMNS {
        let detail = format!("the joint table has {} columns, and at most {MAX_COLUMNS} are read", head.cells.len());
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, "leave out columns without a name"));
    }
    let columns = read_header(head, &mut fields);
    let mut table = Vec::with_capacity(rows.len());
    for row in rows {
        table.push(read_row(row, &columns, separator, &mut fields));
    }
    fields.truncate(MAX_ERRORS);
    match SpecError::from_fields(fields) {
        Some(error) => Err(error),
        None => Ok(json!({ "ops": [hold(), { "op": "joints", "rows": table }] })),
    }
}

/// The op before the table: what no row drives stays as it is at rest.
fn hold() -> Value {
    json!({ "op": "fk", "rotation": "none" })
}

/// The column of each cell; nothing where its name is unknown.
fn read_header(head: &Line, fields: &mut Vec<SpecField>) -> Vec<Option<&'static Column>> {
    let mut columns: Vec<Option<&'static Column>> = Vec::with_capacity(head.cells.len());
    for (index, cell) in head.cells.iter().enumerate() {
        let name = plain(cell);
        let found = COLUMNS.iter().find(|column| column.name == name);
        let is_repeated = found.is_some_and(|found| columns.iter().flatten().any(|known| std::ptr::eq(*known, found)));
        let at = format!("/line/{}/{}", head.number, index + 1);
        if is_repeated {
            let detail = format!("line {}, column {}: '{cell}' is there twice", head.number, index + 1);
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, at, detail));
        } else if found.is_none() && !name.is_empty() {
            let detail = format!("line {}, column {}: there is no column '{cell}'", head.number, index + 1);
            let field = SpecField::new(SpecErrorKind::UnknownField, at, detail);
            fields.push(field.with_nearest(&name, COLUMNS.iter().map(|column| column.name)));
        }
        columns.push(found.filter(|_| !is_repeated));
    }
    columns
}

fn read_row(
    row: &Line,
    columns: &[Option<&'static Column>],
    separator: char,
    fields: &mut Vec<SpecField>,
) -> Map<String, Value> {
    let mut members = Map::new();
    let mut wrong = |index: usize, name: &str, detail: String| {
        if fields.len() >= MAX_ERRORS {
            return;
        }
        let detail = format!("line {}, column {} ({name}): {detail}", row.number, index + 1);
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("/line/{}/{name}", row.number), detail));
    };
    for (index, cell) in row.cells.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
        let Some(column) = columns.get(index).copied().flatten() else {
            if index >= columns.len() {
                wrong(index, "?", format!("'{cell}' is beyond the {} columns of the header", columns.len()));
            }
            continue;
        };
        let value = match column.kind {
            Kind::Text => Some(Value::from(cell.as_str())),
            Kind::Truth => truth(cell).map(Value::from),
            Kind::Number => number(cell, separator).map(Value::from),
        };
        match (value, column.index) {
            (Some(value), None) => {
                members.insert(column.field.to_owned(), value);
            }
            (Some(value), Some(axis)) => {
                members.entry(column.field).or_insert_with(|| json!([0.0, 0.0, 0.0]))[axis] = value;
            }
            (None, _) => {
                let wanted = if column.kind == Kind::Truth { "neither yes nor no" } else { "no number" };
                wrong(index, column.name, format!("'{cell}' is {wanted}"));
            }
        }
    }
    for (index, name) in ["source", "target"].into_iter().enumerate() {
        if !members.contains_key(name) {
            wrong(index, name, "a row names a source and a target".to_owned());
        }
    }
    if let Some(end) = members.remove("source_end") {
        let begin = members.get("source").cloned().unwrap_or_default();
        members.insert("source".to_owned(), json!([begin, end]));
    }
    members
}

/// A column's name as it is known: small letters, underscores between words.
fn plain(name: &str) -> String {
    let name = name.trim().trim_matches('"').trim().to_lowercase();
    name.split(|letter: char| letter.is_whitespace() || letter == '-' || letter == '_')
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join("_")
}

fn truth(cell: &str) -> Option<bool> {
    match cell.to_lowercase().as_str() {
        "yes" | "y" | "true" | "1" | "x" | "on" => Some(true),
        "no" | "n" | "false" | "0" | "-" | "off" => Some(false),
        _ => None,
    }
}

/// With a decimal point, or a decimal comma where commas do not separate cells.
fn number(cell: &str, separator: char) -> Option<f64> {
    let has_comma = cell.contains(',');
    if has_comma && (separator == ',' || cell.contains('.') || cell.matches(',').count() > 1) {
        return None;
    }
    // Spreadsheets write a minus that is no hyphen.
    let text = cell.replace(',', ".").replace('\u{2212}', "-");
    text.trim_end_matches(['°', ' ']).parse().ok().filter(|number: &f64| number.is_finite())
}
