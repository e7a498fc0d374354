//! What a user should know about a mapping that nobody gave: guesses in the rigs, limbs that nothing drives, bodies of other
//! kinds.

use crate::model::Reporter;

use crate::{
    retarget::{mapping::Mapping, spec::RetargetSpec},
    rig::{
        Ride, RigSpec,
        alignment::{split, unnumbered},
        error::{SpecError, SpecErrorKind},
        leg_rows::leg_rows,
        mesh_off_joints,
        recognition::{Recognition, RigKind, report_doubts},
        rig::Rig,
    },
};

/// Parts without which a figure stands there with a stiff limb. Others ride along and look alive.
const LIMBS: [&str; 13] = [
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
    "tail",
    "wing",
];

/// Joints that are named in one message.
const NAMED_AT_MOST: usize = 8;

/// Whether the spec leaves it to us what drives what.
pub(in crate::retarget) fn is_found_out(spec: &RetargetSpec) -> bool {
    spec.map.is_none()
}

/// Refuses bodies of other kinds where nobody says which limb is to drive which.
pub(in crate::retarget) fn check_kinds(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
) -> Result<(), SpecError> {
    let says_something = |rig: &RigSpec| !rig.chains.is_empty() || !rig.roles.is_empty();
    let (from, to) = (&source.recognition, &target.recognition);
    let on_two = |recognition: &Recognition| recognition.kind == RigKind::Biped;
    let differ = from.is_body() && to.is_body() && on_two(from) != on_two(to);
    if !differ || !is_found_out(spec) || says_something(&spec.source) || says_something(&spec.target) {
        return Ok(());
    }
    Err(SpecError::new(
        SpecErrorKind::NothingToMap,
        format!(
            "the source is a {} and the target a {}: no limb of one is a limb of the other",
            standing(source),
            standing(target)
        ),
        "say in \"map\" which chains drive which, with source.chains and target.chains, or send a target of the same kind",
    ))
}

/// What a body is called that stands on so many legs.
fn standing(rig: &Rig<'_>) -> String {
    match rig.recognition.kind {
        RigKind::Other => format!("creature on {} legs", 2 * leg_rows(rig).len()),
        kind => kind.name().to_owned(),
    }
}

/// Warns of what is uncertain in rigs that the spec says nothing about.
pub(in crate::retarget) fn report_rigs(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    reporter: &mut Reporter,
) {
    for (rig, said) in [(source, &spec.source), (target, &spec.target)] {
        if is_found_out(spec) && said.chains.is_empty() && said.roles.is_empty() {
            report_doubts(rig.skeleton(), &rig.recognition, reporter, rig.name);
        }
    }
    if let Some(finding) = mesh_off_joints(target) {
        reporter.warn(
            "mesh_off_joints",
            target.name,
            format!("{}: {}; whatever turns them carries the mesh off", finding.place, finding.detail),
            "bind the mesh again where its joints are",
        );
    }
}

/// Warns of the target's limbs that nothing drives.
pub(in crate::retarget) fn report_idle_limbs(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    mapping: &Mapping,
    reporter: &mut Reporter,
) {
    if !is_found_out(spec) || spec.ops.is_some() {
        return;
    }
    let driven = mapping.driven();
    let is_limb = |role: &str| LIMBS.contains(&unnumbered(split(role).1));
    let is_idle = |joints: &[usize]| !joints.is_empty() && !joints.iter().any(|joint| driven[*joint]);
    let idle: Vec<&str> = target
        .roles
        .iter()
        .filter(|(role, joints)| is_limb(role) && is_idle(joints))
        .map(|(role, _)| role.as_str())
        .collect();
    if idle.is_empty() {
        return;
    }
    let missing: Vec<&str> = idle.iter().copied().filter(|role| source.role(role).is_empty()).collect();
    let why = if missing.len() == idle.len() { "the source has no such limb" } else { "no pair was found for them" };
    reporter.warn(
        "limbs_not_mapped",
        "target",
        format!("nothing drives {}: {why}; they keep their rest pose and ride along", idle.join(", ")),
        "if the source has them, name their joints in source.roles",
    );
}

/// Tells where a clip is cut. `cuts` are the frames behind that.
pub(in crate::retarget) fn report_cuts(cuts: &[usize], reporter: &mut Reporter) {
    let Some(first) = cuts.first() else { return };
    let more = if cuts.len() > 1 { format!(", and {} times more", cuts.len() - 1) } else { String::new() };
    reporter.warn(
        "clip_cut",
        "source",
        format!(
            "from frame {} to frame {first} the whole body jumps, as it does behind a rest pose or where takes meet{more}; what is before and \
             behind is moved as clips of their own",
            first - 1
        ),
        "cut off what does not belong to the motion, with edit.range",
    );
}

/// Tells which joints ride the nearest part of the body because they hang from nothing that moves.
pub(in crate::retarget) fn report_loose_joints(target: &Rig<'_>, loose: &[Ride], reporter: &mut Reporter) {
    if loose.is_empty() {
        return;
    }
    let pairs: Vec<String> = loose
        .iter()
        .take(NAMED_AT_MOST)
        .map(|ride| format!("{} rides {}", target.skeleton().label(ride.joint), target.skeleton().label(ride.on)))
        .collect();
    let more = loose.len().saturating_sub(NAMED_AT_MOST);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    reporter.warn(
        "loose_joints_carried",
        "target",
        format!(
            "joints of the skin hang from nothing that moves, so they ride what is nearest: {}{more}",
            pairs.join(", ")
        ),
        "hang them from the bones that they belong to, or export the whole rig",
    );
}
