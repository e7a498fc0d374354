//! Several joints in one finding: nobody reads the same sentence forty times.

use super::{Finding, FindingCode};
use crate::rig::Rig;

/// How many joints are named.
const NAMED: usize = 4;

/// A finding about joints; nothing where there are none. `detail` gets how many they are, as `1 joint` or `7 joints`.
pub(super) fn about(
    rig: &Rig<'_>,
    code: FindingCode,
    joints: &[usize],
    detail: impl FnOnce(&str) -> String,
) -> Option<Finding> {
    let place = label(rig, *joints.first()?);
    let count = if joints.len() == 1 { "1 joint".to_owned() } else { format!("{} joints", joints.len()) };
    let others: Vec<String> = joints[1..].iter().take(NAMED).map(|joint| label(rig, *joint)).collect();
    let more = joints.len().saturating_sub(1 + NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let others = if others.is_empty() { String::new() } else { format!(" (also {}{more})", others.join(", ")) };
    Some(Finding { code, place, detail: format!("{}{others}", detail(&count)) })
}

/// What a joint is called. Looked up for a few joints only.
pub(super) fn label(rig: &Rig<'_>, joint: usize) -> String {
    rig.skeleton().label(joint)
}
