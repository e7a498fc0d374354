//! How well a rest file fits its rig: what is refused, what could not be represented, and what is told of it.

use glam::DQuat;

use crate::model::{Reporter, Scene};

use super::{
    super::super::{
        alignment::split,
        error::{SpecError, SpecErrorKind},
        recognition::RigKind,
        rig::Rig,
    },
    super::rest_fit::{OrientationFrom, RestFit},
    limbs::Limbs,
    matching::Matching,
    orientation::Laid,
    solve::base_of,
};

/// With a smaller share of the main joints of a body, a rest file is refused.
const FEWEST_SHARE: f64 = 0.5;
/// Two files whose names match for so large a share of the joints are of one character, whatever it is.
const SAME_NAMES_SHARE: f64 = 0.7;
/// Directions that are off by more than this are told, in degrees.
const RESIDUAL_DEGREES: f64 = 5.0;
/// Bones that turn by less than this cannot be rolled wrong by much, in degrees.
const LITTLE_TURN_DEGREES: f64 = 3.0;
/// Joints that a message names.
const NAMES_TOLD: usize = 8;
/// The parts of a body that make up its pose.
const MAIN_PARTS: [&str; 12] = [
    "pelvis",
    "spine",
    "head",
    "upper_arm",
    "forearm",
    "hand",
    "thigh",
    "shin",
    "foot",
    "front_leg",
    "hind_leg",
    "leg",
];

fn refused(detail: String, hint: impl Into<String>) -> SpecError {
    SpecError::new(SpecErrorKind::NoSkeleton, detail, hint)
}

/// A rest file needs joints, and these must lie in different places.
pub(super) fn check_skeleton(side: &str, rest: &Scene) -> Result<(), SpecError> {
    if rest.skeleton.len() > 1 {
        return Ok(());
    }
    let count = if rest.skeleton.is_empty() { "no joints" } else { "only one joint" };
    Err(refused(format!("the rest file of the {side} has {count}"), "send the character itself, in its rest pose"))
}

/// Enough of the rig must be in the rest file.
pub(super) fn check_match(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Result<(), SpecError> {
    let side = rig.name;
    let main: Vec<usize> = main_joints(rig);
    let counted: Vec<usize> = if main.is_empty() {
        (0..rig.skeleton().len()).filter(|joint| rig.skeleton().joints()[*joint].is_joint).collect()
    } else {
        main
    };
    let missing: Vec<usize> = counted.iter().copied().filter(|joint| matching.anchors[*joint].is_none()).collect();
    let found = counted.len() - missing.len();
    if found > 0 && found as f64 >= FEWEST_SHARE * counted.len() as f64 {
        return Ok(());
    }
    let example = |rig: &Rig<'_>| {
        let named = rig.skeleton().joints().iter().find(|joint| joint.is_joint && !joint.name.is_empty());
        named.map_or_else(|| "not at all".to_owned(), |joint| format!("'{}'", joint.name))
    };
    Err(refused(
        format!(
            "the rest file of the {side} is of another skeleton: of {} main joints it has {found}, by name, role or structure; it \
             lacks {}",
            counted.len(),
            labels(rig, &missing)
        ),
        format!(
            "send the same character in its rest pose; joints of the {side} are called like {}, those of its rest file like {}; \
             target.roles and source.roles name joints whose names say nothing",
            example(rig),
            example(rest)
        ),
    ))
}

/// A dog's pose is none for a human.
pub(super) fn check_bodies(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Result<(), SpecError> {
    let (ours, theirs) = (rig.recognition.kind, rest.recognition.kind);
    let is_same = ours == theirs || ours == RigKind::Other || theirs == RigKind::Other;
    let joints = rig.skeleton().joints().iter().filter(|joint| joint.is_joint).count();
    if is_same || matching.by_name as f64 >= SAME_NAMES_SHARE * joints as f64 {
        return Ok(());
    }
    Err(refused(
        format!("the rest file of the {} is a {}, and the {} is a {}", rig.name, theirs.name(), rig.name, ours.name()),
        "send the same character in its rest pose",
    ))
}

/// Joints that all lie on one point show no pose.
pub(super) fn check_limbs(rig: &Rig<'_>, limbs: &Limbs) -> Result<(), SpecError> {
    let has_length = limbs.limbs.iter().any(|limb| limb.is_pose);
    if has_length && limbs.scale.is_finite() {
        return Ok(());
    }
    Err(refused(
        format!("the joints of the rest file of the {} lie on one point, so they show no pose", rig.name),
        "export the rest file with its rest transforms, or name a frame of its clip in target.rest or source.rest",
    ))
}

/// Joints that make up the pose of a body; empty where the rig is none.
fn main_joints(rig: &Rig<'_>) -> Vec<usize> {
    let is_main = |role: &str| MAIN_PARTS.contains(&super::super::super::alignment::unnumbered(split(role).1));
    let mut main: Vec<usize> =
        rig.roles.iter().filter(|(role, _)| is_main(role)).filter_map(|(_, joints)| joints.first().copied()).collect();
    main.sort_unstable();
    if rig.recognition.is_body() || main.len() > 4 { main } else { Vec::new() }
}

fn labels(rig: &Rig<'_>, joints: &[usize]) -> String {
    let shown: Vec<String> =
        joints.iter().take(NAMES_TOLD).map(|joint| format!("'{}'", rig.skeleton().label(*joint))).collect();
    let more =
        if joints.len() > NAMES_TOLD { format!(" and {} more", joints.len() - NAMES_TOLD) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// Says what was guessed, what is missing, and what could not be represented.
pub(super) fn report(
    laid: &Laid<'_>,
    orientation_from: OrientationFrom,
    turns: &[DQuat],
    reporter: &mut Reporter,
) -> RestFit {
    let Laid { rig, rest, matching, limbs, rig_from_rest } = *laid;
    let fit = RestFit {
        by_name: matching.by_name,
        by_role: matching.by_role,
        by_structure: matching.by_structure,
        missing: missing(rig, matching),
        surplus: rest
            .skeleton()
            .joints()
            .iter()
            .filter(|joint| joint.is_joint)
            .count()
            .saturating_sub(matching.count()),
        turned_degrees: rig_from_rest.angle_between(DQuat::IDENTITY).to_degrees(),
        scale: limbs.scale,
        is_one_build: limbs.is_one_build,
        orientation_from,
        residuals: residuals(rig, limbs, turns),
    };
    let place = if rig.name == "source" { "source_rest" } else { "target_rest" };
    if !fit.missing.is_empty() {
        reporter.warn(
            "rest_file_incomplete",
            place,
            format!(
                "joints of the {} that are not in its rest file ride their parents: {}",
                rig.name,
                labels(rig, &fit.missing)
            ),
            "export the rest file from the same rig",
        );
    }
    if matching.is_mirrored {
        reporter.warn(
            "rest_file_mirrored",
            place,
            "what is called left in the rest file is on the right side of its body; its joints were matched by where they are",
            format!("name the sides of the rest file as those of the {}", rig.name),
        );
    }
    if matching.by_name < matching.by_role + matching.by_structure {
        reporter.warn(
            "rest_file_matched_by_role",
            place,
            format!(
                "the rest file names its joints otherwise; {} were matched by name, {} by role, {} by structure",
                matching.by_name, matching.by_role, matching.by_structure
            ),
            "look at the result, or export the rest file with the names of the rig",
        );
    }
    report_rolls(laid, orientation_from, turns, place, reporter);
    for (joint, degrees) in fit.residuals.iter().filter(|(_, degrees)| *degrees > RESIDUAL_DEGREES) {
        reporter.warn(
            "rest_residual",
            format!("{place}: {}", rig.skeleton().label(*joint)),
            format!("what hangs from this joint lies otherwise in the rest file: {degrees:.1}° are left after solving"),
            "check that the rest file is of the same rig; the report lists the residual of every joint",
        );
    }
    fit
}

/// Where directions alone say how bones are turned, bones that turn far may be rolled otherwise than the file has them.
fn report_rolls(laid: &Laid<'_>, from: OrientationFrom, turns: &[DQuat], place: &'static str, reporter: &mut Reporter) {
    let is_far = |joint: usize| {
        let mut limbs = laid.limbs.of(joint).filter(|limb| limb.is_pose);
        limbs.any(|limb| limb.off_degrees(DQuat::IDENTITY) > LITTLE_TURN_DEGREES)
    };
    let far = (0..turns.len()).filter(|joint| is_far(*joint)).count();
    if from == OrientationFrom::Directions && far > 0 {
        reporter.warn(
            "rest_roll_guessed",
            place,
            format!(
                "the axes of the rest file say nothing of the {}'s; {far} bones point elsewhere than in its own rest pose, and were \
                 turned there the shortest way",
                laid.rig.name
            ),
            "send the rest file in the format and from the program of the rig, or with the mesh bound as the rig's is",
        );
    }
}

/// Joints with a role that correspond to nothing.
fn missing(rig: &Rig<'_>, matching: &Matching) -> Vec<usize> {
    // Where eyes and jaw are is no matter of a pose.
    let is_part = |role: &str| !matches!(split(role).1, "root" | "eye" | "jaw");
    let first = rig.roles.iter().filter(|(role, _)| is_part(role)).filter_map(|(_, joints)| joints.first());
    let mut missing: Vec<usize> = if rig.roles.is_empty() {
        (0..rig.skeleton().len()).filter(|joint| rig.skeleton().joints()[*joint].is_joint).collect()
    } else {
        first.copied().collect()
    };
    missing.retain(|joint| matching.anchors[*joint].is_none());
    missing.sort_unstable();
    missing
}

fn residuals(rig: &Rig<'_>, limbs: &Limbs, turns: &[DQuat]) -> Vec<(usize, f64)> {
    // What carries the pelvis is not turned.
    let base = base_of(rig);
    let is_above =
        |joint: usize| base.is_some_and(|base| joint != base && rig.skeleton().is_ancestor_or_self(joint, base));
    let mut residuals: Vec<(usize, f64)> = Vec::new();
    // Ends and helpers are solved for only where nothing else says how a joint is turned.
    for limb in limbs.limbs.iter().filter(|limb| limb.is_pose && limb.is_named && !is_above(limb.from)) {
        let degrees = limb.off_degrees(turns[limb.from]);
        match residuals.last_mut().filter(|last| last.0 == limb.from) {
            Some(last) => last.1 = last.1.max(degrees),
            None => residuals.push((limb.from, degrees)),
        }
    }
    residuals
}
