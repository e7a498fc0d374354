//! `limits`: how far each joint of the target goes, and about which axes.

use super::{JointLimit, LimitFrame};
use glam::{DQuat, DVec3};

use crate::{
    retarget::ops::{
        LimitRange, LimitsOp,
        context::{Context, is_in},
    },
    rig::{
        alignment::{CanonicalPose, canonical_rest, split},
        rig::Rig,
    },
};

/// From and to.
type Degrees = [f64; 2];

/// How far parts go, in degrees from the T pose: bend, side, twist. The ranges that game engines come with for people, about the
/// T pose instead of about their middles (docs/algorithm/joints.md).
const RANGES: [(&str, Degrees, Degrees, Degrees); 14] = [
    ("spine", [-40.0, 40.0], [-40.0, 40.0], [-40.0, 40.0]),
    ("neck", [-40.0, 40.0], [-40.0, 40.0], [-40.0, 40.0]),
    ("head", [-40.0, 40.0], [-40.0, 40.0], [-40.0, 40.0]),
    ("clavicle", [-15.0, 15.0], [-15.0, 30.0], [-15.0, 15.0]),
    ("upper_arm", [-70.0, 130.0], [-100.0, 60.0], [-90.0, 90.0]),
    ("forearm", [-5.0, 160.0], [-20.0, 20.0], [-90.0, 90.0]),
    ("hand", [-40.0, 40.0], [-80.0, 80.0], [-30.0, 30.0]),
    ("thigh", [-20.0, 120.0], [-60.0, 60.0], [-60.0, 60.0]),
    ("shin", [-5.0, 160.0], [-15.0, 15.0], [-90.0, 90.0]),
    ("foot", [-50.0, 50.0], [-30.0, 30.0], [-30.0, 30.0]),
    ("toe", [-50.0, 70.0], [-15.0, 15.0], [-10.0, 10.0]),
    ("jaw", [-10.0, 40.0], [-10.0, 10.0], [-10.0, 10.0]),
    ("eye", [-30.0, 30.0], [-40.0, 40.0], [-20.0, 20.0]),
    ("thumb", [-40.0, 60.0], [-60.0, 60.0], [-40.0, 40.0]),
];

/// As far as an angle goes.
const UNLIMITED: Degrees = [-180.0, 180.0];

/// Parts that have limits, though none come with the program.
const OTHERS: [&str; 4] = ["index", "middle", "ring", "pinky"];

pub(in crate::retarget) fn resolve(op: &LimitsOp, context: &mut Context<'_>) -> Vec<JointLimit> {
    let masked = context.masked(&op.scope);
    check_ranges(op, context);
    let (source, target, mapping) = (context.source, context.target, context.mapping);
    let target_zero = zero(target, mapping.plan_from_target);
    let source_zero = zero(source, mapping.plan_from_source.rotation);
    let plan_from_canonical = mapping.plan_from_target * target.canonical_from_scene.conjugate();
    let mut edits = Vec::new();
    for (role, joints) in &target.roles {
        let (side, part) = split(role);
        let Some([bend, across, twist]) = range(op, role, part) else { continue };
        let sources = source.role(role);
        for (position, &joint) in joints.iter().enumerate().filter(|(_, joint)| is_in(masked.as_ref(), **joint)) {
            let follows = sources.get(position * sources.len() / joints.len()).copied().filter(|_| op.relative);
            let radians = |range: [f64; 2]| range.map(f64::to_radians);
            edits.push(JointLimit {
                joint,
                source: follows,
                zero: target_zero[joint],
                source_zero: follows.map(|source| source_zero[source]).unwrap_or_default(),
                axes: axes(side, part).map(|axis| plan_from_canonical * axis),
                bend: radians(bend),
                side: radians(across),
                twist: radians(twist),
                begin: op.begin,
            });
        }
    }
    edits.sort_by_key(|limit| limit.joint);
    edits
}

/// Bend, side and twist: as the op has them, else as they come with the program, else without a limit.
fn range(op: &LimitsOp, role: &str, part: &str) -> Option<[Degrees; 3]> {
    let own = op.ranges.get(role).or_else(|| op.ranges.get(part)).copied();
    let usual = RANGES.iter().find(|entry| entry.0 == part).map(|(_, bend, side, twist)| [*bend, *side, *twist]);
    let Some(LimitRange { bend, side, twist }) = own else { return usual };
    let usual = usual.unwrap_or([UNLIMITED; 3]);
    let merged = |given: Option<[Option<f64>; 2]>, usual: Degrees| {
        given.map_or(usual, |[min, max]| [min.unwrap_or(UNLIMITED[0]), max.unwrap_or(UNLIMITED[1])])
    };
    Some([merged(bend, usual[0]), merged(side, usual[1]), merged(twist, usual[2])])
}

fn check_ranges(op: &LimitsOp, context: &mut Context<'_>) {
    for (name, range) in &op.ranges {
        let (_, part) = split(name);
        let known: Vec<&str> = RANGES.iter().map(|entry| entry.0).chain(OTHERS).collect();
        if !known.contains(&part) {
            context
                .refuse(&format!("ranges/{name}"), format!("'{name}' has no limits; these have: {}", known.join(", ")));
        }
        for (field, pair) in [("bend", range.bend), ("side", range.side), ("twist", range.twist)] {
            let [min, max] = pair.unwrap_or_default();
            let (least, most) = (min.unwrap_or(UNLIMITED[0]), max.unwrap_or(UNLIMITED[1]));
            if !(-180.0..=0.0).contains(&least) || !(0.0..=180.0).contains(&most) {
                let detail =
                    format!("[{least}, {most}] is no range; it goes from -180 to 0 at first and from 0 to 180 at last");
                context.refuse(&format!("ranges/{name}/{field}"), detail);
            }
        }
    }
}

/// The T pose of every joint.
fn zero(rig: &Rig<'_>, plan_from_scene: DQuat) -> Vec<LimitFrame> {
    let pose = canonical_rest(rig, CanonicalPose::T, rig.recognition.body.is_none()).rest;
    let rotation = |joint: usize| (plan_from_scene * pose.transforms()[joint].rotation).normalize();
    let frame = |joint: usize| {
        let parent = rig.skeleton().parent(joint).map_or(plan_from_scene, rotation);
        LimitFrame { parent, local: (parent.conjugate() * rotation(joint)).normalize() }
    };
    (0..rig.skeleton().len()).map(frame).collect()
}

/// Along the bone, the axis about which bending is positive, and the one across, in the T pose; left, up, front.
fn axes(side: &str, part: &str) -> [DVec3; 3] {
    // Mirrored: a direction has its left reversed, an axis of rotation its up and front.
    let is_right = side == "right_";
    let mirrored =
        |direction: DVec3| if is_right { DVec3::new(-direction.x, direction.y, direction.z) } else { direction };
    let turned = |axis: DVec3| if is_right { DVec3::new(axis.x, -axis.y, -axis.z) } else { axis };
    match part {
        // From left to front, and from left to up.
        "clavicle" | "upper_arm" | "forearm" | "hand" | "index" | "middle" | "ring" | "pinky" | "thumb" => {
            [mirrored(DVec3::X), turned(DVec3::NEG_Y), turned(DVec3::Z)]
        }
        // From down to front, and outward.
        "thigh" => [DVec3::NEG_Y, DVec3::NEG_X, turned(DVec3::Z)],
        // From down to the back.
        "shin" => [DVec3::NEG_Y, DVec3::X, turned(DVec3::Z)],
        // From front to up, and outward.
        "foot" | "toe" | "jaw" | "eye" => [DVec3::Z, DVec3::NEG_X, turned(DVec3::Y)],
        // From up to front, and to the left.
        _ => [DVec3::Y, DVec3::X, DVec3::NEG_Z],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bending_is_positive_where_joints_bend() {
        let bends = |side: &str, part: &str| {
            let [along, bend, _] = axes(side, part);
            DQuat::from_axis_angle(bend, std::f64::consts::FRAC_PI_2) * along
        };
        for side in ["left_", "right_"] {
            assert!(bends(side, "forearm").z > 0.99, "{side}: elbows bend to the front");
            assert!(bends(side, "thigh").z > 0.99, "{side}: hips bend to the front");
            assert!(bends(side, "shin").z < -0.99, "{side}: knees bend to the back");
            assert!(bends(side, "foot").y > 0.99, "{side}: feet bend up");
        }
        assert!(bends("", "spine").z > 0.99, "backs bend to the front");
    }

    #[test]
    fn across_is_outward_on_both_sides() {
        for (side, sign) in [("left_", 1.0), ("right_", -1.0)] {
            for (part, wanted) in [("thigh", DVec3::X), ("foot", DVec3::X)] {
                let [along, _, across] = axes(side, part);
                let moved = DQuat::from_axis_angle(across, 0.1) * along;
                assert!((moved - along).dot(wanted) * sign > 0.0, "{side}{part} goes outward: {moved}");
            }
            let [along, _, across] = axes(side, "upper_arm");
            assert!((DQuat::from_axis_angle(across, 0.1) * along).y > 0.0, "{side}arms go up");
        }
    }
}
