//! Words, lines and numbers out of bytes, without a copy. Knows no BVH keyword.

use crate::formats::FormatError;

/// Walks over the bytes of a text file and counts lines.
#[derive(Debug)]
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

/// What [`Scanner::next_value`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'a> {
    /// A number; it may be infinite where the text has too many digits.
    Number(f64),
    /// The end of a line; empty lines give none.
    LineEnd,
    /// A word that is no number.
    NotANumber(&'a [u8]),
    /// Nothing is left.
    End,
}

/// Powers of ten that a double holds exactly.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];
/// Whole numbers below this are exact as a double.
const LARGEST_EXACT: u64 = 1 << 53;
/// As many digits always fit into 64 bits.
const MAX_DIGITS: usize = 19;

impl<'a> Scanner<'a> {
    /// Starts at the first byte after a byte order mark.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), at: 0, line: 1 }
    }

    /// The line that the scanner is on, counted from 1.
    pub(super) const fn line(&self) -> usize {
        self.line
    }

    /// The same as the place of an error or a warning.
    pub(super) fn place(&self) -> String {
        format!("line {}", self.line)
    }

    /// How many bytes are left.
    pub(super) const fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word; a brace is always one by itself. Nothing at the end.
    pub(super) fn next_word(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let start = self.at;
        let first = *self.bytes.get(start)?;
        self.at += 1;
        if !is_brace(first) {
            while self.bytes.get(self.at).is_some_and(|byte| !byte.is_ascii_whitespace() && !is_brace(*byte)) {
                self.at += 1;
            }
        }
        Some(&self.bytes[start..self.at])
    }

    /// The next word, left where it is.
    pub(super) fn peek_word(&mut self) -> Option<&'a [u8]> {
        let (at, line) = (self.at, self.line);
        let word = self.next_word();
        (self.at, self.line) = (at, line);
        word
    }

    /// What is left of this line before an opening brace, trimmed.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|byte| !matches!(byte, b'\n' | b'\r' | b'{')) {
            self.at += 1;
        }
        self.bytes[start..self.at].trim_ascii()
    }

    /// The next number or line end of a table.
    #[inline]
    pub(super) fn next_value(&mut self) -> Value<'a> {
        loop {
            let Some(byte) = self.bytes.get(self.at) else { return Value::End };
            match byte {
                b' ' | b'\t' | b'\x0b' | b'\x0c' => self.at += 1,
                b'\n' | b'\r' => {
                    self.skip_space();
                    return if self.at == self.bytes.len() { Value::End } else { Value::LineEnd };
                }
                _ => return self.number(),
            }
        }
    }

    /// Reads a number that must be there.
    ///
    /// # Errors
    /// When there is none, or it is not finite; the detail names `what`.
    pub(super) fn expect_number(&mut self, what: &str) -> Result<f64, FormatError> {
        self.skip_space();
        match self.next_value() {
            Value::Number(number) if number.is_finite() => Ok(number),
            Value::Number(_) => Err(self.malformed(format!("{what} is too large for a number"))),
            Value::NotANumber(word) => Err(self.not_a_number(what, word)),
            Value::LineEnd | Value::End => Err(self.malformed(format!("the file ends where {what} should be"))),
        }
    }

    /// An error at the current line.
    pub(super) fn malformed(&self, detail: impl Into<String>) -> FormatError {
        FormatError::malformed("bvh", self.place(), detail)
    }

    /// The error for a word where a number should be.
    pub(super) fn not_a_number(&self, what: &str, word: &[u8]) -> FormatError {
        let shown = show(word);
        let error = self.malformed(format!("{what} is '{shown}', which is not a finite number"));
        let is_comma =
            word.contains(&b',') && word.iter().all(|byte| byte.is_ascii_digit() || b"+-.,eE".contains(byte));
        if is_comma { error.with_hint("write decimal points, not decimal commas") } else { error }
    }

    fn skip_space(&mut self) {
        while let Some(byte) = self.bytes.get(self.at) {
            match byte {
                b'\n' => self.line += 1,
                // A carriage return ends a line only where no line feed does.
                b'\r' if self.bytes.get(self.at + 1) != Some(&b'\n') => self.line += 1,
                byte if byte.is_ascii_whitespace() || *byte == b'\x0b' => {}
                _ => return,
            }
            self.at += 1;
        }
    }

    /// Digits into an exact double where mantissa and power of ten are exact, which nearly all numbers in files are;
    /// anything else goes to the standard library. There is a byte that is no space.
    #[inline]
    fn number(&mut self) -> Value<'a> {
        let start = self.at;
        let text = &self.bytes[start..];
        let is_negative = text.first() == Some(&b'-');
        let mut at = usize::from(matches!(text.first(), Some(b'-' | b'+')));
        let (mut mantissa, mut digits) = digits(&text[at..], 0);
        at += digits;
        let mut decimals = 0;
        if text.get(at) == Some(&b'.') {
            (mantissa, decimals) = self::digits(&text[at + 1..], mantissa);
            at += 1 + decimals;
            digits += decimals;
        }
        let ends_here = text.get(at).is_none_or(u8::is_ascii_whitespace);
        self.at = start + at;
        let is_exact = (1..=MAX_DIGITS).contains(&digits) && mantissa < LARGEST_EXACT;
        if is_exact && ends_here {
            let magnitude = mantissa as f64 / POWERS_OF_TEN[decimals];
            return Value::Number(magnitude.copysign(if is_negative { -1.0 } else { 1.0 }));
        }
        self.slow_number(start)
    }

    #[cold]
    fn slow_number(&mut self, start: usize) -> Value<'a> {
        while self.bytes.get(self.at).is_some_and(|byte| !byte.is_ascii_whitespace()) {
            self.at += 1;
        }
        let word = &self.bytes[start..self.at];
        // The standard library also takes "nan" and "infinity", which are no numbers here.
        let is_numeric = word.iter().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(byte));
        let number = std::str::from_utf8(word).ok().filter(|_| is_numeric).and_then(|text| text.parse().ok());
        number.map_or(Value::NotANumber(word), Value::Number)
    }
}

/// Appends the decimal digits that a text begins with to a number, and counts them. The number has overflown where they are more
/// than [`MAX_DIGITS`].
///
/// Eight at a time: all bytes are told from digits at once, those behind the last digit are shifted out, and neighbors are put
/// together to pairs, pairs to fours and fours to the eight by multiplications whose parts do not meet.
#[inline]
fn digits(text: &[u8], mut number: u64) -> (u64, usize) {
    const FACTORS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];
    const ZEROS: u64 = u64::from_le_bytes([b'0'; 8]);
    /// What lifts everything above nine into the highest bit.
    const ABOVE_NINE: u64 = u64::from_le_bytes([0x80 - 10; 8]);
    const HIGHEST_BITS: u64 = u64::from_le_bytes([0x80; 8]);
    const EVERY_FOURTH_BYTE: u64 = 0x0000_00ff_0000_00ff;
    let mut count = 0;
    loop {
        let rest = &text[count..];
        let bytes = match rest.first_chunk::<8>() {
            Some(bytes) => *bytes,
            None => {
                let mut padded = [0; 8];
                padded[..rest.len()].copy_from_slice(rest);
                padded
            }
        };
        let values = u64::from_le_bytes(bytes) ^ ZEROS;
        // A byte beyond ASCII carries into those behind it, which do not count any more.
        let others = (values.wrapping_add(ABOVE_NINE) | values) & HIGHEST_BITS;
        let found = others.trailing_zeros() as usize / 8;
        if found == 0 {
            return (number, count);
        }
        let aligned = values << (64 - 8 * found);
        let pairs = aligned.wrapping_mul(10).wrapping_add(aligned >> 8);
        let fours = (pairs & EVERY_FOURTH_BYTE).wrapping_mul(100 + (1_000_000 << 32));
        let others = ((pairs >> 16) & EVERY_FOURTH_BYTE).wrapping_mul(1 + (10_000 << 32));
        number = number.wrapping_mul(FACTORS[found]).wrapping_add(fours.wrapping_add(others) >> 32);
        count += found;
        if found < 8 {
            return (number, count);
        }
    }
}

/// A word of the file as an error shows it: short, and without control characters.
pub(super) fn show(word: &[u8]) -> String {
    const MAX_CHARACTERS: usize = 40;
    let text = String::from_utf8_lossy(word);
    let mut shown: String = text.chars().take(MAX_CHARACTERS).filter(|character| !character.is_control()).collect();
    if text.chars().count() > MAX_CHARACTERS {
        shown.push('…');
    }
    shown
}

const fn is_brace(byte: u8) -> bool {
    matches!(byte, b'{' | b'}')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn first(text: &str) -> Value<'_> {
        Scanner::new(text.as_bytes()).next_value()
    }

    #[test]
    fn numbers_of_every_spelling() {
        for (text, value) in [
            ("0", 0.0),
            ("-12.5", -12.5),
            ("+.5", 0.5),
            ("7.", 7.0),
            ("1e3", 1000.0),
            ("-2.5E-2", -0.025),
            ("0.0333333333333333333333333", 0.033_333_333_333_333_33),
            ("123456789012345678901234567890", 1.234_567_890_123_456_8e29),
            ("0.00000000000000000000000000001", 1e-29),
            ("1234567", 1_234_567.0),
            ("12345678", 12_345_678.0),
            ("123456789", 123_456_789.0),
            ("-8765.43210987", -8_765.432_109_87),
            ("18446744073709551616", 18_446_744_073_709_551_616.0),
            ("0000000000000000000000012", 12.0),
        ] {
            assert_eq!(first(text), Value::Number(value), "{text}");
        }
    }

    #[test]
    fn words_that_are_no_numbers() {
        let words = [
            "nan",
            "-inf",
            "infinity",
            "1,5",
            "1.2.3",
            "--1",
            ".",
            "-",
            "1e",
            "0x10",
            "1}",
            "1:",
            "1/",
            "7é8",
            "12345678é",
        ];
        for text in words {
            assert_eq!(first(text), Value::NotANumber(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn lines_are_counted_for_every_line_end() {
        let mut scanner = Scanner::new(b"\xef\xbb\xbfa\r\nb\rc\n\n d");
        let lines: Vec<usize> = std::iter::from_fn(|| scanner.next_word().map(|_| scanner.line())).collect();
        assert_eq!(lines, [1, 2, 3, 5], "carriage return, line feed, both, and an empty line");
    }

    proptest! {
        #[test]
        fn the_fast_path_is_the_standard_library(value in -1e9..1e9_f64, decimals in 0..12_usize) {
            let text = format!("{value:.decimals$}");
            let expected: f64 = text.parse().expect("formatted by the standard library");
            prop_assert_eq!(first(&text), Value::Number(expected), "{}", text);
        }
    }
}
