//! Auto-Rig Pro's `.bmap`: records of lines, of which the first has settings after percent signs.

use serde_json::Value;

use super::pairs::{Pair, spec};
use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

/// A record's first line has at least so many percent signs: after the bone, a switch, the space, two offsets and a factor.
const MIN_SETTINGS: usize = 5;
/// What stands for a bone that is not there.
const NOBODY: &str = "None";

/// Whether a text is such a map.
pub(in crate::retarget) fn is_bmap(text: &str) -> bool {
    text.lines().find(|line| !line.trim().is_empty()).is_some_and(is_head)
}

fn is_head(line: &str) -> bool {
    line.matches('%').count() >= MIN_SETTINGS && line.split('%').nth(1).is_some_and(|word| truth(word).is_some())
}

fn truth(word: &str) -> Option<bool> {
    match word.trim() {
        "True" => Some(true),
        "False" => Some(false),
        _ => None,
    }
}

/// The spec that a map stands for. Bones that are assigned to none are left out.
///
/// # Errors
/// For every record that cannot be read; pointers are `/line/<line of the file>`.
pub(in crate::retarget) fn read_bmap(text: &str) -> Result<Value, SpecError> {
    let lines: Vec<(usize, &str)> = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim())).collect();
    let (mut pairs, mut fields) = (Vec::new(), Vec::new());
    let heads: Vec<usize> = (0..lines.len()).filter(|index| is_head(lines[*index].1)).collect();
    for (record, begin) in heads.iter().enumerate() {
        let end = heads.get(record + 1).copied().unwrap_or(lines.len());
        let (number, head) = lines[*begin];
        let target = head.split('%').next().unwrap_or_default().trim();
        let of = |offset: usize| lines[*begin..end].get(offset).copied();
        let mut wrong = |number: usize, detail: String| {
            let detail = format!("line {number}: {detail}");
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("/line/{number}"), detail));
        };
        let Some((_, source)) = of(1) else {
            wrong(number, format!("the record of '{target}' ends without the bone that it follows"));
            continue;
        };
        let root = of(2).map(|(at, word)| (at, word, truth(word)));
        let is_root = match root {
            Some((_, _, Some(is_root))) => is_root,
            Some((at, word, None)) => {
                wrong(at, format!("'{word}' where True or False says whether '{target}' is the root"));
                continue;
            }
            None => {
                wrong(number, format!("the record of '{target}' ends before it says whether it is the root"));
                continue;
            }
        };
        let is_nobody = |name: &str| name.is_empty() || name == NOBODY;
        if !is_nobody(target) && !is_nobody(source) {
            pairs.push(Pair {
                pointer: format!("/line/{number}"),
                source: source.to_owned(),
                target: target.to_owned(),
                is_root,
                has_position: false,
            });
        }
    }
    match SpecError::from_fields(fields) {
        Some(error) => Err(error),
        None => spec(&pairs),
    }
}
