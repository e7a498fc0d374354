//! Changes to words, numbers and lines.

use std::ops::Range;

use super::Random;

/// Numbers at which readers go wrong.
const NUMBERS: [&str; 22] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "255",
    "256",
    "65536",
    "2147483647",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551616",
    "1e-320",
    "1e38",
    "-1e39",
    "1e308",
    "1e999",
    "nan",
    "inf",
    "1e",
];
/// Words of the formats, which chance alone would hardly spell.
const WORDS: [&str; 34] = [
    "\0",
    "\u{feff}",
    "\"",
    "{",
    "}",
    "[",
    "]",
    "null",
    "true",
    "{}",
    "[]",
    "ROOT",
    "JOINT",
    "End Site",
    "CHANNELS",
    "OFFSET",
    "MOTION",
    "Frames:",
    "Frame Time:",
    "Xposition",
    "Zrotation",
    "Model: ",
    "AnimationCurve: ",
    "KeyTime: *",
    "C: \"OO\",",
    "LimbNode",
    "Properties70: {",
    "'<f8'",
    "'|O'",
    "'>i4'",
    "True",
    "MAT4",
    "CUBICSPLINE",
    "#0",
];

/// The text with one change; nothing where it is none.
pub(super) fn mutate(input: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(input).ok()?;
    let mut changed = input.to_vec();
    match random.below(6) {
        0 | 1 => {
            let number =
                chosen(text, random, |letter| letter.is_ascii_digit() || matches!(letter, b'-' | b'+' | b'.' | b'e'))?;
            changed.splice(number, random.one_of(&NUMBERS)?.bytes());
        }
        2 => {
            let word = chosen(text, random, |letter| !letter.is_ascii_whitespace())?;
            changed.splice(word, random.one_of(&WORDS)?.bytes());
        }
        3 => {
            let at = random.index(text.len())?;
            changed.splice(at..at, random.one_of(&WORDS)?.bytes());
        }
        4 => {
            let line = chosen(text, random, |letter| letter != b'\n')?;
            changed.drain(line);
        }
        _ => {
            let line = chosen(text, random, |letter| letter != b'\n')?;
            let to = chosen(text, random, |letter| letter != b'\n')?.start;
            let mut copy = text.as_bytes()[line].to_vec();
            copy.push(b'\n');
            changed.splice(to..to, copy);
        }
    }
    Some(changed)
}

/// A run of such letters: the first one after a place taken by chance, from the beginning where there is none after it.
fn chosen(text: &str, random: &mut Random, belongs: impl Fn(u8) -> bool) -> Option<Range<usize>> {
    let bytes = text.as_bytes();
    let from = random.index(bytes.len())?;
    let mut start = (from..bytes.len()).chain(0..from).find(|at| belongs(bytes[*at]))?;
    while start > 0 && belongs(bytes[start - 1]) {
        start -= 1;
    }
    let length = bytes[start..].iter().take_while(|letter| belongs(**letter)).count();
    Some(start..start + length)
}
