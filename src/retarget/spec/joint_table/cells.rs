//! A text as lines of cells.

/// One line of the table that is neither empty nor a comment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::retarget) struct Line {
    /// Where it begins in the text, from 1.
    pub(in crate::retarget) number: usize,
    /// Without quotes and surrounding space.
    pub(in crate::retarget) cells: Vec<String>,
}

/// A quote that is not closed, by the number of its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::retarget) struct OpenQuote(pub(in crate::retarget) usize);

/// The first line that is neither empty nor a comment.
pub(in crate::retarget) fn header(text: &str) -> Option<&str> {
    let text = text.trim_start_matches('\u{feff}');
    text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))
}

/// What separates cells: what the header has most of.
pub(in crate::retarget) fn separator(header: &str) -> Option<char> {
    let count = |separator: char| header.matches(separator).count();
    let most = [';', '\t', ','].into_iter().max_by_key(|separator| (count(*separator), *separator == ';'))?;
    (count(most) > 0).then_some(most)
}

/// Splits a text into lines and cells. A quoted cell may hold separators, line breaks and, doubled, quotes.
pub(in crate::retarget) fn lines(text: &str, separator: char) -> Result<Vec<Line>, OpenQuote> {
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = Vec::new();
    let mut state = State { number: 1, begin: 1, ..State::default() };
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if state.is_quoted && letters.peek() == Some(&'"') => {
                letters.next();
                state.cell.push('"');
            }
            '"' if state.is_quoted => state.is_quoted = false,
            '"' if state.cell.trim().is_empty() => {
                state.cell.clear();
                (state.is_quoted, state.was_quoted) = (true, true);
            }
            '\n' => {
                state.number += 1;
                if state.is_quoted {
                    state.cell.push(' ');
                } else {
                    state.end_line(&mut lines);
                }
            }
            '\r' => {}
            letter if letter == separator && !state.is_quoted && !state.is_comment() => state.end_cell(),
            letter => state.cell.push(letter),
        }
    }
    if state.is_quoted {
        return Err(OpenQuote(state.begin));
    }
    state.end_line(&mut lines);
    Ok(lines)
}

#[derive(Default)]
struct State {
    number: usize,
    begin: usize,
    cells: Vec<String>,
    cell: String,
    is_quoted: bool,
    was_quoted: bool,
}

impl State {
    fn is_comment(&self) -> bool {
        self.cells.is_empty() && !self.was_quoted && self.cell.trim_start().starts_with('#')
    }

    fn end_cell(&mut self) {
        let cell = std::mem::take(&mut self.cell);
        self.cells.push(cell.trim().to_owned());
        self.was_quoted = false;
    }

    fn end_line(&mut self, lines: &mut Vec<Line>) {
        let is_comment = self.is_comment();
        self.end_cell();
        let cells = std::mem::take(&mut self.cells);
        if !is_comment && cells.iter().any(|cell| !cell.is_empty()) {
            lines.push(Line { number: self.begin, cells });
        }
        self.begin = self.number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(text: &str, separator: char) -> Vec<Vec<String>> {
        lines(text, separator).expect("closed quotes").into_iter().map(|line| line.cells).collect()
    }

    #[test]
    fn quotes_hold_separators_and_quotes() {
        let text = "\u{feff}a;\"b; c\";\"say \"\"x\"\"\"\r\n\r\n# a; comment \" here\n;;\n d ;e\n";
        assert_eq!(cells(text, ';'), [vec!["a", "b; c", "say \"x\""], vec!["d", "e"]]);
        let numbers: Vec<usize> = lines(text, ';').expect("closed").iter().map(|line| line.number).collect();
        assert_eq!(numbers, [1, 5], "lines are counted as in the file");
        assert_eq!(lines("a\n\"b", ','), Err(OpenQuote(2)));
    }

    #[test]
    fn the_header_says_what_separates() {
        assert_eq!(separator("source;target;gain, in percent"), Some(';'));
        assert_eq!(separator("source,target"), Some(','));
        assert_eq!(separator("source\ttarget"), Some('\t'));
        assert_eq!(separator("source"), None);
    }
}
