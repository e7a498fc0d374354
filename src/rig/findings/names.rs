//! Names that are missing, repeated or on the wrong side.

use std::collections::BTreeMap;

use super::{Finding, FindingCode, places};
use crate::rig::Rig;

pub(super) fn examine(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let joints = rig.skeleton().joints();
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    for joint in joints {
        *uses.entry(&joint.name).or_default() += 1;
    }
    let own = || joints.iter().enumerate().filter(|(_, joint)| joint.is_joint);
    let nameless: Vec<usize> = own().filter(|(_, joint)| joint.name.is_empty()).map(|(index, _)| index).collect();
    found.extend(places::about(rig, FindingCode::JointNamesMissing, &nameless, |count| {
        format!("{count} without a name")
    }));
    let repeats = |name: &str| !name.is_empty() && uses.get(name).is_some_and(|count| *count > 1);
    let repeated: Vec<usize> = own().filter(|(_, joint)| repeats(&joint.name)).map(|(index, _)| index).collect();
    found.extend(places::about(rig, FindingCode::JointNamesRepeated, &repeated, |count| {
        let name = repeated.first().map_or("", |joint| &joints[*joint].name);
        format!("{count} with a name that another node has too, the first is called '{name}'")
    }));
    found.extend(places::about(rig, FindingCode::NameMisleads, &rig.recognition.misnamed, |count| {
        let roles = rig.recognition.roles.iter();
        let first = rig.recognition.misnamed.first();
        let role =
            roles.into_iter().find(|(_, finding)| finding.joints.first() == first).map(|(role, _)| role.to_string());
        format!("{count} called after another part; the first is the {}", role.unwrap_or_default().replace('_', " "))
    }));
    if rig.recognition.sides_swapped {
        let left = rig.recognition.roles.iter().find(|(role, _)| role.side == crate::rig::Side::Left);
        let place = left
            .and_then(|(_, finding)| finding.joints.first())
            .map_or_else(String::new, |joint| places::label(rig, *joint));
        let detail = "the feet point forward, and what is named left lies on the right of that".to_owned();
        found.push(Finding { code: FindingCode::SidesSwapped, place, detail });
    }
}
