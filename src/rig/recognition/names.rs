//! How a joint's name is cut into words, and what the words say.
//!
//! Looks at one name at a time. Which joint of several gets a role is decided in [`super::recognize`], with the hierarchy.

use std::{collections::BTreeSet, sync::LazyLock};

use super::{
    Role, Side,
    languages::{Language, without_accents},
    lexicon::{CONTROLS, ENDS, LEFT, NEVER_GLUED, NOISE, OTHER_SCRIPTS, OTHER_WORDS, RIGHT, SENSES, Sense, TWISTS},
};

/// A name, read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ParsedName {
    /// Lower-case words in order, without sides and digits.
    pub words: Vec<String>,
    /// Runs of digits in order, as they are written.
    pub digits: Vec<String>,
    /// The side that the name says.
    pub side: Option<Side>,
    /// What the words mean.
    pub sense: Option<Sense>,
    /// Words that neither the sense nor any table of the lexicon explains.
    pub unexplained: Vec<String>,
    /// Steers, marks or holds something.
    pub is_control: bool,
    /// Marks the end of a chain.
    pub is_end: bool,
    /// Carries part of a limb's twist.
    pub is_twist: bool,
    /// Which layer of a control rig it belongs to.
    pub layer: Layer,
    /// Begins with two underscores, as helper joints of MakeHuman do.
    pub is_dummy: bool,
}

/// The layers of a Rigify control rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Layer {
    #[default]
    None,
    /// `DEF-`: deforms the mesh.
    Deform,
    /// `ORG-`: the plain skeleton that the controls move.
    Original,
}

/// No name of a joint is near as long in characters, and a file could hold megabytes of one.
const LONGEST_READ: usize = 256;
/// Names that say this much in English are not looked at in other languages.
const ENGLISH_PARTS: usize = 7;
/// Longer words are never taken apart; no word of a body is near as long.
const LONGEST_GLUED: usize = 32;

impl ParsedName {
    /// Reads a name. Any text gives a result; text without known words gives one without a sense.
    pub(super) fn parse(name: &str) -> Self {
        Self::parse_in(name, None)
    }

    /// Reads a name whose words may be of another language.
    pub(super) fn parse_in(name: &str, language: Option<Language>) -> Self {
        let mut parsed = Self { is_dummy: name.starts_with("__"), ..Self::default() };
        for token in tokens(name, language) {
            if token.starts_with(|character: char| character.is_ascii_digit()) {
                parsed.digits.push(token);
            } else if LEFT.contains(&token.as_str()) {
                parsed.side = Some(Side::Left);
            } else if RIGHT.contains(&token.as_str()) {
                parsed.side = Some(Side::Right);
            } else {
                parsed.words.push(token);
            }
        }
        let has = |table: &[&str]| parsed.words.iter().any(|word| table.contains(&word.as_str()));
        (parsed.is_control, parsed.is_end, parsed.is_twist) = (has(CONTROLS), has(ENDS), has(TWISTS));
        parsed.layer = match parsed.words.first().map(String::as_str) {
            Some("def") => Layer::Deform,
            Some("org") => Layer::Original,
            _ => Layer::None,
        };
        parsed.find_sense();
        parsed
    }

    /// Sets what a rig's template says of the name, whatever its words say. `place` counts the joints of the role from the
    /// body outward.
    pub(super) fn set_meaning(&mut self, role: Role, place: usize) {
        let Some(sense) = Sense::of(role.part) else { return };
        self.sense = Some(sense);
        self.side = Some(role.side).filter(|side| *side != Side::Center);
        self.unexplained.clear();
        (self.is_control, self.is_end, self.is_dummy) = (false, false, false);
        // The further joints of a split limb carry its twist.
        self.is_twist &= place > 0;
    }

    /// Takes everything away that the name's words say.
    pub(super) fn set_nameless(&mut self) {
        *self = Self {
            words: std::mem::take(&mut self.words),
            digits: std::mem::take(&mut self.digits),
            ..Self::default()
        };
    }

    /// Whether the name has that word.
    pub(super) fn has(&self, word: &str) -> bool {
        self.words.iter().any(|own| own == word)
    }

    fn find_sense(&mut self) {
        let row = SENSES.iter().find(|(row, _)| row.iter().all(|word| self.has(word)));
        let Some((row, sense)) = row else { return };
        self.sense = match (*sense, self.side) {
            (Sense::Nothing, _) => None,
            // `LeftHip` is a thigh or a helper above one; `pelvis.L` is never a joint that a limb turns about.
            (Sense::Pelvis, Some(_)) => self.words.iter().any(|word| word.starts_with("hip")).then_some(Sense::Hip),
            (Sense::Hip, None) => self.has("hip").then_some(Sense::Pelvis),
            (Sense::Spine | Sense::Neck | Sense::Head, Some(_)) => None,
            (sense, _) => Some(sense),
        };
        // A bone of the palm may say which finger it belongs to, a part of a tail that it is the middle one.
        let names_finger = |word: &str| {
            let is_finger = |(row, sense): &(&[&str], Sense)| matches!(sense, Sense::Finger(_)) && row.contains(&word);
            matches!(sense, Sense::Metacarpal | Sense::Tail) && SENSES.iter().any(is_finger)
        };
        // A letter is a prefix where it comes before the part (`b_Hip`, `J_Bip_C_Chest`); behind it, it tells the legs of a
        // spider apart (`leg_b_1`).
        let part = self.words.iter().position(|word| row.contains(&word.as_str())).unwrap_or(0);
        let explained = |(index, word): (usize, &String)| {
            let listed = [NOISE, CONTROLS, ENDS, TWISTS].iter().any(|table| table.contains(&word.as_str()));
            let in_place = word.len() > 1 || word == "x" || index < part;
            row.contains(&word.as_str()) || names_finger(word) || (listed && in_place)
        };
        // The words of a quadruped's leg (`Front_Leg_Shoulder_L`) name its segments; none of them contradicts it.
        if !matches!(sense, Sense::FrontLeg | Sense::HindLeg) {
            self.unexplained = self
                .words
                .iter()
                .enumerate()
                .filter(|entry| !explained(*entry))
                .map(|(_, word)| word.clone())
                .collect();
        }
    }
}

/// As much of a name as is ever looked at: its end, since what is before it are namespaces and paths.
pub(super) fn readable(name: &str) -> &str {
    let begin = name.char_indices().rev().nth(LONGEST_READ - 1);
    begin.map_or(name, |(begin, _)| &name[begin..])
}

/// Reads all names of a skeleton, in another language where English says next to nothing about them.
pub(super) fn parse_all<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Vec<ParsedName> {
    let parsed: Vec<ParsedName> = names.clone().map(ParsedName::parse).collect();
    let is_finger = |sense: &Sense| matches!(sense, Sense::Finger(_) | Sense::AnyFinger | Sense::Metacarpal);
    let senses: BTreeSet<Sense> =
        parsed.iter().filter_map(|name| name.sense).filter(|sense| !is_finger(sense)).collect();
    if senses.len() >= ENGLISH_PARTS {
        return parsed;
    }
    let words: Vec<Vec<String>> = names.clone().map(words).collect();
    match Language::of_names(&words) {
        Some(language) => names.map(|name| ParsedName::parse_in(name, Some(language))).collect(),
        None => parsed,
    }
}

/// Lower-case words, single letters and runs of digits, in order.
fn tokens(name: &str, language: Option<Language>) -> Vec<String> {
    let mut words = words(name);
    if let Some(language) = language {
        words = language.translate(&words);
    }
    let mut found = Vec::new();
    for word in words {
        push_word(&mut found, &word);
    }
    found
}

/// The words of a name as it is written, in lower case and without accents.
fn words(name: &str) -> Vec<String> {
    // Namespaces of Maya and MotionBuilder, paths of some exporters.
    let bare = readable(name).rsplit([':', '|']).find(|part| !part.is_empty()).unwrap_or("");
    let mut text = bare.to_owned();
    if !text.is_ascii() {
        for (other, english) in OTHER_SCRIPTS {
            text = text.replace(other, english);
        }
    }
    let runs = text.split(|character: char| !character.is_alphanumeric());
    runs.flat_map(split_case).map(|word| without_accents(&word)).collect()
}

/// Splits `LeftUpLeg01` into `Left`, `Up`, `Leg`, `01`, and `LThumb` into `L`, `Thumb`.
fn split_case(run: &str) -> Vec<String> {
    let characters: Vec<char> = run.chars().collect();
    let mut words = Vec::new();
    let mut word = String::new();
    for (index, &character) in characters.iter().enumerate() {
        if let Some(&before) = index.checked_sub(1).and_then(|before| characters.get(before)) {
            let after_is_lower = characters.get(index + 1).is_some_and(|after| after.is_lowercase());
            let digit_edge = before.is_ascii_digit() != character.is_ascii_digit();
            let rises =
                character.is_uppercase() && (before.is_lowercase() || (before.is_uppercase() && after_is_lower));
            if digit_edge || rises {
                words.push(std::mem::take(&mut word));
            }
        }
        word.push(character);
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    words
}

/// Adds a word, taken apart where it is glued from known ones (`lowerback`, `lhip`, `righthand`).
fn push_word(found: &mut Vec<String>, word: &str) {
    if is_known(word) || word.len() > LONGEST_GLUED || !word.is_ascii() {
        found.push(word.to_owned());
    } else if let Some(pieces) = unglue(word) {
        found.extend(pieces.into_iter().map(str::to_owned));
    } else if let Some((side, pieces)) =
        word.split_at_checked(1).filter(|(side, _)| matches!(*side, "l" | "r")).and_then(|(side, rest)| {
            if is_gluable(rest) { Some((side, vec![rest])) } else { unglue(rest).map(|pieces| (side, pieces)) }
        })
    {
        found.push(side.to_owned());
        found.extend(pieces.into_iter().map(str::to_owned));
    } else {
        found.push(word.to_owned());
    }
}

/// The fewest known words that a word is glued from, where there are at least two.
fn unglue(word: &str) -> Option<Vec<&str>> {
    let mut best: Vec<Option<Vec<&str>>> = vec![None; word.len() + 1];
    best[0] = Some(Vec::new());
    for end in 1..=word.len() {
        for start in 0..end {
            let piece = &word[start..end];
            if let Some(before) = best[start].as_ref().filter(|_| is_gluable(piece)) {
                let shorter = best[end].as_ref().is_none_or(|known| before.len() + 1 < known.len());
                if shorter {
                    best[end] = Some(before.iter().copied().chain([piece]).collect());
                }
            }
        }
    }
    best.pop().flatten().filter(|pieces| pieces.len() > 1)
}

/// Every word that the lexicon has.
static KNOWN: LazyLock<BTreeSet<&'static str>> = LazyLock::new(|| {
    let tables = [NOISE, CONTROLS, ENDS, TWISTS, LEFT, RIGHT, OTHER_WORDS];
    let senses = SENSES.iter().flat_map(|(row, _)| row.iter());
    tables.into_iter().flatten().chain(senses).copied().collect()
});

/// Those that glued names may be made of, and the length of the longest.
static GLUABLE: LazyLock<(BTreeSet<&'static str>, usize)> = LazyLock::new(|| {
    let may_glue = |word: &&str| word.len() > 1 && !NEVER_GLUED.contains(word);
    let words: BTreeSet<&str> = KNOWN.iter().copied().filter(may_glue).collect();
    let longest = words.iter().map(|word| word.len()).max().unwrap_or(0);
    (words, longest)
});

fn is_known(word: &str) -> bool {
    KNOWN.contains(word)
}

fn is_gluable(word: &str) -> bool {
    word.len() <= GLUABLE.1 && GLUABLE.0.contains(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Part;

    #[test]
    fn names_of_every_convention_have_one_side_and_sense() {
        let cases: &[(&str, Option<Side>, Sense)] = &[
            ("mixamorig7:LeftUpLeg", Some(Side::Left), Sense::Thigh),
            ("mixamorig_RightForeArm", Some(Side::Right), Sense::Forearm),
            ("Avatar_LeftShoulder", Some(Side::Left), Sense::Shoulder),
            ("CC_Base_R_Upperarm", Some(Side::Right), Sense::UpperArm),
            ("DEF-upper_arm.L.001", Some(Side::Left), Sense::UpperArm),
            ("ValveBiped.Bip01_L_Calf", Some(Side::Left), Sense::Shin),
            ("Bip01 R Toe0", Some(Side::Right), Sense::Toe),
            ("J_Bip_C_UpperChest", None, Sense::Spine),
            ("Character1_LeftHandMiddle2", Some(Side::Left), Sense::Finger(Part::Middle)),
            ("lShldrBend", Some(Side::Left), Sense::Shoulder),
            ("lowerback", None, Sense::Spine),
            ("rclavicle", Some(Side::Right), Sense::Clavicle),
            ("Lefthand", Some(Side::Left), Sense::Hand),
            ("UpArm_L", Some(Side::Left), Sense::UpperArm),
            ("LThumb", Some(Side::Left), Sense::Finger(Part::Thumb)),
            ("LHipJoint", Some(Side::Left), Sense::Hip),
            ("hip", None, Sense::Pelvis),
            ("左ひじ", Some(Side::Left), Sense::Forearm),
            ("下半身", None, Sense::Pelvis),
            ("thigh_stretch.r", Some(Side::Right), Sense::Thigh),
            ("b_LeftLeg01_015", Some(Side::Left), Sense::Leg),
            ("RightInHandIndex", Some(Side::Right), Sense::Metacarpal),
        ];
        for (name, side, sense) in cases {
            let parsed = ParsedName::parse(name);
            assert_eq!((parsed.side, parsed.sense), (*side, Some(*sense)), "{name}");
            assert!(parsed.unexplained.is_empty(), "{name}: {:?}", parsed.unexplained);
        }
    }

    #[test]
    fn what_is_no_part_of_the_body_is_marked() {
        for name in ["r-LEGCONTROL", "ik_foot_l", "headtracker", "handslot.r", "LeftHeelRoll", "PoleTarget.L"] {
            assert!(ParsedName::parse(name).is_control, "{name} is a control");
        }
        for name in ["HeadTop_End", "Bip01LFinger0Nub", "ENDSITE", "ball_leaf_l", "JawEND", "Head.tip"] {
            assert!(ParsedName::parse(name).is_end, "{name} is an end");
        }
        for name in ["DEF-side_hair.L", "forehead", "HeadBand", "LeftShoulderArmor", "earring_l"] {
            let parsed = ParsedName::parse(name);
            assert!(parsed.sense.is_none() || !parsed.unexplained.is_empty(), "{name} has words left over");
        }
        for name in ["", ":", "\u{1F600}", "....", "__"] {
            assert_eq!(ParsedName::parse(name).sense, None, "{name:?} says nothing");
        }
    }
}
