//! `joints`: a table in indices.

use super::{DriveFrom, JointDrive};
use glam::{DMat3, DVec3};

use crate::retarget::ops::{
    JointRow, JointSource, JointsOp,
    context::{Context, is_in, turn},
};

pub(in crate::retarget) fn resolve(op: &JointsOp, context: &mut Context<'_>) -> Vec<JointDrive> {
    let masked = context.masked(&op.scope);
    let mut drives: Vec<JointDrive> = Vec::with_capacity(op.rows.len());
    for (index, row) in op.rows.iter().enumerate() {
        let drive = resolve_row(row, index, context).filter(|drive| is_in(masked.as_ref(), drive.joint));
        drives.extend(drive);
    }
    // Parents come before children in a skeleton; rows of one joint stay in their order.
    drives.sort_by_key(|drive| drive.joint);
    drives
}

fn resolve_row(row: &JointRow, index: usize, context: &mut Context<'_>) -> Option<JointDrive> {
    let at = |field: &str| format!("rows/{index}/{field}");
    let joint = context.target_joint(&row.target, &at("target"));
    let from = match &row.source {
        JointSource::Joint(name) => context.source_joint(name, &at("source")).map(DriveFrom::Joint),
        JointSource::Pair([first, second]) => {
            let points = (context.source_joint(first, &at("source/0")), context.source_joint(second, &at("source/1")));
            let end = joint.and_then(|joint| bone_end(row, joint, &at("points_to"), context));
            points
                .0
                .zip(points.1)
                .zip(end)
                .map(|((first, second), end)| DriveFrom::Pair { points: [first, second], end })
        }
    };
    let axis_order = axis_order(&row.axis_order);
    if axis_order.is_none() {
        let detail = format!(
            "'{}' is no order of axes; it names x, y and z once each, with or without signs, as in 'xzy' or '+x-z+y'",
            row.axis_order
        );
        context.refuse(&at("axis_order"), detail);
    }
    Some(JointDrive {
        from: from?,
        joint: joint?,
        space: row.space,
        position_gain: row.position.then_some(row.position_gain),
        rotation_gain: row.rotation.then_some(row.rotation_gain),
        position_offset: DVec3::from(row.position_offset),
        rotation_offset: turn(row.rotation_offset),
        axis_order: axis_order?,
        axis_offset: turn(row.axis_offset),
    })
}

/// The joint that a bone leads to: the one that the row names, else the farthest child.
fn bone_end(row: &JointRow, joint: usize, place: &str, context: &mut Context<'_>) -> Option<usize> {
    let skeleton = context.target.skeleton();
    let position = |joint: usize| context.target.rest.transforms()[joint].translation;
    if let Some(name) = &row.points_to {
        let end = context.target_joint(name, place)?;
        if end == joint || !skeleton.is_ancestor_or_self(joint, end) {
            context.refuse(place, format!("'{name}' is not below '{}', so no bone leads to it", row.target));
            return None;
        }
        return Some(end);
    }
    let children = (joint + 1..skeleton.len()).filter(|&child| skeleton.parent(child) == Some(joint));
    let distance = |child: &usize| position(*child).distance(position(joint));
    let farthest = children.max_by(|first, second| distance(first).total_cmp(&distance(second)));
    if farthest.is_none() {
        let detail =
            format!("'{}' has no joint below it, so it points nowhere; take one source joint for it", row.target);
        context.refuse(place, detail);
    }
    farthest
}

/// The matrix that takes the source's components to the target's. Nothing where the text does not name each axis once.
fn axis_order(text: &str) -> Option<DMat3> {
    let mut rows = [DVec3::ZERO; 3];
    let (mut count, mut sign) = (0, 1.0);
    let mut is_signed = false;
    for letter in text.chars().filter(|letter| !letter.is_whitespace()) {
        let axis = match letter.to_ascii_lowercase() {
            '+' | '-' if is_signed => return None,
            '+' => None,
            '-' => {
                sign = -1.0;
                None
            }
            'x' => Some(DVec3::X),
            'y' => Some(DVec3::Y),
            'z' => Some(DVec3::Z),
            _ => return None,
        };
        is_signed = axis.is_none();
        if let Some(axis) = axis {
            *rows.get_mut(count)? = axis * sign;
            (count, sign) = (count + 1, 1.0);
        }
    }
    let is_permutation = rows.iter().map(|row| row.abs()).sum::<DVec3>() == DVec3::ONE;
    (count == 3 && !is_signed && is_permutation).then(|| DMat3::from_cols(rows[0], rows[1], rows[2]).transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_of_axes_names_each_axis_once() {
        let vector = DVec3::new(1.0, 2.0, 3.0);
        for (text, wanted) in [
            ("xyz", DVec3::new(1.0, 2.0, 3.0)),
            ("ZXY", DVec3::new(3.0, 1.0, 2.0)),
            ("+x -z +y", DVec3::new(1.0, -3.0, 2.0)),
            ("-x-y-z", DVec3::new(-1.0, -2.0, -3.0)),
        ] {
            assert_eq!(axis_order(text).map(|order| order * vector), Some(wanted), "{text}");
        }
        for text in ["", "xy", "xxy", "xyzx", "--xyz", "xyz-", "abc", "x+-yz"] {
            assert_eq!(axis_order(text), None, "{text:?}");
        }
    }
}
