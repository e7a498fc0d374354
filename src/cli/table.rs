//! A table as text: columns as wide as their widest cell, numbers to the right.

/// Writes rows under a head. A cell of the last column may be as long as it likes.
pub(super) fn table<const N: usize>(head: [&str; N], rows: &[[String; N]]) -> String {
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.chain([head[column].chars().count()]).max().unwrap_or(0)
    };
    let widths: [usize; N] = std::array::from_fn(width);
    let is_number = |column: usize| {
        let mut cells = rows.iter().map(|row| row[column].as_str()).filter(|cell| *cell != "-").peekable();
        cells.peek().is_some() && cells.all(|cell| cell.starts_with(|letter: char| letter.is_ascii_digit()))
    };
    let numbers: [bool; N] = std::array::from_fn(is_number);
    let line = |cells: [&str; N]| {
        let padded = cells.iter().enumerate().map(|(column, cell)| {
            let space = " ".repeat(widths[column].saturating_sub(cell.chars().count()));
            if numbers[column] { format!("{space}{cell}") } else { format!("{cell}{space}") }
        });
        format!("{}\n", padded.collect::<Vec<_>>().join("  ").trim_end())
    };
    let body = rows.iter().map(|row| line(std::array::from_fn(|column| row[column].as_str())));
    std::iter::once(line(head)).chain(body).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_they_have_to_be() {
        let rows = [
            ["walk".to_owned(), "100 %".to_owned(), String::new()],
            ["läuft".to_owned(), "-".to_owned(), "why".to_owned()],
        ];
        let text = table(["clip", "coverage", "why"], &rows);
        assert_eq!(
            text, "clip   coverage  why\nwalk      100 %\nläuft         -  why\n",
            "numbers to the right, no spaces at the end"
        );
    }
}
