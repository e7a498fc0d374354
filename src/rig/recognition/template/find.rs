//! Which template a skeleton follows, and what it says of the joints.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

use super::{super::names::readable, RigTemplate, builtin::builtin_templates};
use crate::{
    model::Skeleton,
    rig::{Role, Side},
};

/// Exporters that number all nodes put the number behind every name (`Hips_01`); on fewer names than this share it is the
/// rig's own.
const NUMBERED_SHARE: f64 = 0.8;

/// What a template says of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::rig::recognition) struct TemplateMatch {
    /// The template's name.
    pub name: String,
    /// Whether it is one of the user's own.
    pub is_own: bool,
    /// The joints of its roles that the skeleton has, from the body outward.
    pub roles: BTreeMap<Role, Vec<usize>>,
}

/// A template made ready for comparison.
#[derive(Debug)]
pub(in crate::rig::recognition) struct Matcher {
    name: String,
    prefixes: Vec<String>,
    roles: Vec<(Role, Vec<Spellings>)>,
    expected: Vec<Spellings>,
    required: Vec<Spellings>,
    excluded: Vec<Spellings>,
    at_least: f64,
}

/// The spellings of one joint, plain; a `*` stands for any text.
type Spellings = Vec<String>;

static BUILTIN: LazyLock<Vec<Matcher>> = LazyLock::new(|| builtin_templates().iter().map(Matcher::new).collect());

/// The first template that the skeleton follows: the user's own, then built-in ones whose prefix is there, then the others.
pub(in crate::rig::recognition) fn find(skeleton: &Skeleton, own: &[RigTemplate]) -> Option<TemplateMatch> {
    let names = PlainNames::new(skeleton);
    let bare = names.behind("");
    let own: Vec<Matcher> = own.iter().map(Matcher::new).collect();
    let fits = |matcher: &Matcher, with_prefix: bool, is_own: bool| {
        let prefixes = matcher.prefixes.iter().filter(|prefix| prefix.is_empty() != with_prefix);
        let compare = |prefix: &String| {
            if prefix.is_empty() {
                matcher.compare(&bare, with_prefix)
            } else {
                let names = Some(names.behind(prefix)).filter(|names| !names.is_empty())?;
                matcher.compare(&names, with_prefix)
            }
        };
        let found = prefixes.filter_map(compare).next();
        found.map(|roles| TemplateMatch { name: matcher.name.clone(), is_own, roles })
    };
    let first = |matchers: &[Matcher], is_own: bool| {
        let pass = |with_prefix: bool| matchers.iter().find_map(|matcher| fits(matcher, with_prefix, is_own));
        pass(true).or_else(|| pass(false))
    };
    first(&own, true).or_else(|| first(&BUILTIN, false))
}

impl Matcher {
    pub(super) fn new(template: &RigTemplate) -> Self {
        let sides = template.sides.clone().unwrap_or_default();
        let spell = |name: &String, side: Side| spellings(name, &sides, side);
        let list = |names: &[String]| {
            let both = |name: &String| {
                let sides: &[Side] = if name.contains("{side}") { &Side::BOTH } else { &[Side::Center] };
                sides.iter().map(|side| spell(name, *side)).collect::<Vec<_>>()
            };
            names.iter().flat_map(both).collect::<Vec<_>>()
        };
        let mut roles = Vec::new();
        for (key, names) in &template.roles {
            let of_role = key.parse::<Role>().ok().into_iter();
            let both = Role::of_both_sides(key).into_iter().flatten();
            for role in of_role.chain(both) {
                roles.push((role, names.iter().map(|name| spell(name, role.side)).collect::<Vec<_>>()));
            }
        }
        let expected = if template.expected.is_empty() {
            roles.iter().filter_map(|(_, names)| names.first().cloned()).collect()
        } else {
            list(&template.expected)
        };
        let mut prefixes: Vec<String> = template.prefixes.iter().map(|prefix| plain(prefix)).collect();
        if prefixes.is_empty() {
            prefixes.push(String::new());
        }
        Self {
            name: template.name.clone(),
            prefixes,
            roles,
            expected,
            required: list(&template.required),
            excluded: list(&template.excluded),
            at_least: template.at_least,
        }
    }

    /// The joints of the template's roles, where the names are those of this template.
    fn compare(&self, names: &BTreeMap<&str, usize>, with_prefix: bool) -> Option<BTreeMap<Role, Vec<usize>>> {
        let has = |spellings: &Spellings| joint_of(names, spellings).is_some();
        let found = self.expected.iter().filter(|spellings| has(spellings)).count() as f64;
        let fits = found > 0.0
            && found >= self.at_least * self.expected.len() as f64
            && (with_prefix || (self.required.iter().all(has) && !self.excluded.iter().any(has)));
        if !fits {
            return None;
        }
        let joints = |names_of_role: &Vec<Spellings>| {
            let mut joints: Vec<usize> = Vec::new();
            for joint in names_of_role.iter().filter_map(|spellings| joint_of(names, spellings)) {
                if !joints.contains(&joint) {
                    joints.push(joint);
                }
            }
            joints
        };
        let roles = self.roles.iter().map(|(role, names)| (*role, joints(names)));
        Some(roles.filter(|(_, joints)| !joints.is_empty()).collect())
    }
}

/// The joint that one of the spellings names; the first in name order for a spelling with a `*`.
fn joint_of(names: &BTreeMap<&str, usize>, spellings: &Spellings) -> Option<usize> {
    spellings.iter().find_map(|spelling| match spelling.split_once('*') {
        None => names.get(spelling.as_str()).copied(),
        Some((start, _)) => {
            let from_start = names.range(start..).take_while(|(name, _)| name.starts_with(start));
            from_start.filter(|(name, _)| fits_wildcard(name, spelling)).map(|(_, joint)| *joint).next()
        }
    })
}

/// Whether a name is what a pattern with `*` says. Each piece is taken where it first fits, the last at the end.
fn fits_wildcard(name: &str, pattern: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return name == pattern };
    let Some(mut name) = name.strip_prefix(start) else { return false };
    let mut pieces: Vec<&str> = rest.split('*').collect();
    let Some(last) = pieces.pop() else { return true };
    for piece in pieces {
        let Some(at) = name.find(piece) else { return false };
        name = name.get(at + piece.len()..).unwrap_or_default();
    }
    name.ends_with(last)
}

/// The joints' names without the number that an exporter puts behind all of them.
pub(super) fn own_names(skeleton: &Skeleton) -> Vec<String> {
    let names: Vec<&str> = skeleton.joints().iter().map(|joint| readable(&joint.name)).collect();
    let unnumbered = |name: &str| {
        let cut = name.trim_end_matches(|character: char| character.is_ascii_digit());
        (cut.len() < name.len()).then(|| cut.strip_suffix('_').map(str::to_owned)).flatten()
    };
    let numbered = names.iter().filter(|name| unnumbered(name).is_some()).count() as f64;
    // Joints that are called nothing but a number keep it.
    let bare: BTreeSet<String> = names.iter().filter_map(|name| unnumbered(name)).collect();
    let all_numbered = numbered >= NUMBERED_SHARE * names.len() as f64 && bare.len() as f64 > 0.5 * numbered;
    let own = |name: &&str| unnumbered(name).filter(|_| all_numbered).unwrap_or_else(|| (*name).to_owned());
    names.iter().map(own).collect()
}

/// A joint's name as it is compared: behind its last namespace, without separators and upper case.
pub(super) fn plain_name(name: &str) -> String {
    plain(name.rsplit([':', '|']).find(|part| !part.is_empty()).unwrap_or_default()).replace('*', "")
}

fn spellings(name: &str, sides: &[Vec<String>; 2], side: Side) -> Spellings {
    let words: &[String] = match side {
        Side::Left => &sides[0],
        Side::Right => &sides[1],
        Side::Center => &[],
    };
    let mut all = Vec::new();
    for spelling in name.split('|') {
        if spelling.contains("{side}") {
            all.extend(words.iter().map(|word| plain(&spelling.replace("{side}", word))));
        } else {
            all.push(plain(spelling));
        }
    }
    all
}

/// Lower case, without separators; `*` stays.
fn plain(name: &str) -> String {
    let kept = name.chars().filter(|character| character.is_alphanumeric() || *character == '*');
    kept.flat_map(char::to_lowercase).collect()
}

/// The names of a skeleton, plain: whole, and behind the last namespace.
struct PlainNames {
    whole: Vec<String>,
    bare: Vec<String>,
}

impl PlainNames {
    fn new(skeleton: &Skeleton) -> Self {
        let names = own_names(skeleton);
        // A star in a joint's own name stands for nothing.
        let whole = names.iter().map(|name| plain(name).replace('*', "")).collect();
        Self { whole, bare: names.iter().map(|name| plain_name(name)).collect() }
    }

    /// What is left of the names that begin with a prefix, and the first joint of each. A number may belong to the prefix
    /// (`mixamorig7:Hips`) or to the name (`HX07`), so both ways of reading it are there.
    fn behind(&self, prefix: &str) -> BTreeMap<&str, usize> {
        let mut found = BTreeMap::new();
        for (joint, (whole, bare)) in self.whole.iter().zip(&self.bare).enumerate() {
            let rest = if prefix.is_empty() {
                Some(bare.as_str())
            } else {
                whole.strip_prefix(prefix).or_else(|| bare.strip_prefix(prefix))
            };
            let Some(rest) = rest.filter(|rest| !rest.is_empty()) else { continue };
            found.entry(rest).or_insert(joint);
            let unnumbered = rest.trim_start_matches(|character: char| character.is_ascii_digit());
            if !prefix.is_empty() && !unnumbered.is_empty() {
                found.entry(unnumbered).or_insert(joint);
            }
        }
        found
    }
}
