//! Joints of two files that have the same name, whatever an exporter made of it.

use std::collections::BTreeMap;

use crate::model::Skeleton;

/// A prefix that so large a share of the joints have is the character's name, or the tool's.
const PREFIX_SHARE: f64 = 0.6;
const SHORTEST_PREFIX: usize = 3;
const LONGEST_PREFIX: usize = 24;

/// How names are compared, strictest first.
const FORMS: [fn(&str) -> String; 3] = [str::to_owned, bare, folded];

/// For each joint of `ours` the joint of `theirs` with its name: as it is, without a namespace and a number behind, without
/// capitals and punctuation, and without the prefix that the joints of a file share. A name that repeats matches nothing.
pub(super) fn by_name(ours: &Skeleton, theirs: &Skeleton) -> Vec<Option<usize>> {
    let mut twins = vec![None; ours.len()];
    let mut taken = vec![false; theirs.len()];
    for form in FORMS {
        pair(&formed(ours, form), &formed(theirs, form), &mut twins, &mut taken);
    }
    pair(&without_prefix(ours), &without_prefix(theirs), &mut twins, &mut taken);
    twins
}

fn formed(skeleton: &Skeleton, form: fn(&str) -> String) -> Vec<String> {
    skeleton.joints().iter().map(|joint| form(&joint.name)).collect()
}

fn pair(ours: &[String], theirs: &[String], twins: &mut [Option<usize>], taken: &mut [bool]) {
    let (ours, theirs) = (unique(ours), unique(theirs));
    for (name, joint) in ours {
        let Some(&twin) = theirs.get(name) else { continue };
        if twins[joint].is_none() && !taken[twin] {
            twins[joint] = Some(twin);
            taken[twin] = true;
        }
    }
}

/// Joints by name, of the names that one joint has.
fn unique(names: &[String]) -> BTreeMap<&str, usize> {
    let mut counts: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (joint, name) in names.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
        counts.entry(name).or_insert((joint, 0)).1 += 1;
    }
    counts.into_iter().filter(|(_, (_, count))| *count == 1).map(|(name, (joint, _))| (name, joint)).collect()
}

/// Without a namespace, and without the number that programs put behind names that repeat.
fn bare(name: &str) -> String {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    let numbered = name
        .rsplit_once('.')
        .filter(|(_, number)| number.len() == 3 && number.bytes().all(|byte| byte.is_ascii_digit()));
    numbered.map_or(name, |(name, _)| name).to_owned()
}

fn folded(name: &str) -> String {
    name.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn without_prefix(skeleton: &Skeleton) -> Vec<String> {
    let names: Vec<String> = skeleton.joints().iter().map(|joint| folded(&joint.name)).collect();
    let joints: Vec<&str> = names
        .iter()
        .zip(skeleton.joints())
        .filter(|(name, joint)| joint.is_joint && !name.is_empty())
        .map(|(name, _)| name.as_str())
        .collect();
    let prefix = shared_prefix(&joints).unwrap_or_default();
    let stripped =
        |name: &String| name.strip_prefix(&prefix).filter(|rest| !rest.is_empty()).unwrap_or(name).to_owned();
    names.iter().map(stripped).collect()
}

/// The longest prefix that most of the names have.
fn shared_prefix(names: &[&str]) -> Option<String> {
    (SHORTEST_PREFIX..=LONGEST_PREFIX).rev().find_map(|length| {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for name in names.iter().filter(|name| name.chars().count() > length) {
            *counts.entry(name.chars().take(length).collect()).or_default() += 1;
        }
        let (prefix, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
        (count as f64 >= PREFIX_SHARE * names.len() as f64 && count > 2).then_some(prefix)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Joint, Transform};

    fn skeleton(names: &[&str]) -> Skeleton {
        let joint = |(node, name): (usize, &&str)| Joint {
            name: (*name).to_owned(),
            parent: node.checked_sub(1),
            rest: Transform::IDENTITY,
            is_joint: true,
            node,
        };
        Skeleton::new(names.iter().enumerate().map(joint).collect()).expect("a skeleton")
    }

    #[test]
    fn exporters_do_not_hide_a_name() {
        let ours = skeleton(&["mixamorig:Hips", "mixamorig:Spine", "mixamorig:LeftArm", "mixamorig:RightArm"]);
        for theirs in [
            ["Hips", "Spine", "LeftArm", "RightArm"],
            ["mixamorigHips", "mixamorigSpine", "mixamorigLeftArm", "mixamorigRightArm"],
            ["mixamorig7:Hips", "mixamorig7:Spine", "mixamorig7:LeftArm", "mixamorig7:RightArm"],
            ["Avatar_Hips", "Avatar_Spine", "Avatar_LeftArm", "Avatar_RightArm"],
            ["hips", "spine", "left_arm", "RIGHT ARM"],
            ["Hips.001", "Spine.001", "LeftArm.001", "RightArm.001"],
        ] {
            assert_eq!(by_name(&ours, &skeleton(&theirs)), [Some(0), Some(1), Some(2), Some(3)], "{theirs:?}");
        }
    }

    #[test]
    fn names_that_repeat_match_nothing() {
        let twins = by_name(&skeleton(&["a", "b", "b"]), &skeleton(&["b", "a"]));
        assert_eq!(twins, [Some(1), None, None], "nobody knows which b is meant");
    }
}
