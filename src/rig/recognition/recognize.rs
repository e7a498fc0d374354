//! What the joints of a skeleton mean.
//!
//! Names first: what each may mean ([`super::lexicon`]), then which meaning the hierarchy allows ([`super::limbs`],
//! [`super::trunk`], [`super::fingers`]), then the shape of the rest pose as a second witness ([`super::structure`]), then both
//! together ([`super::assign`]). A joint that nothing points to has no role: an absent role can be given by hand, a wrong one
//! has to be found first.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    Part, Role, RoleFinding, Side,
    assign::{combine, misnamed},
    body::{Body, Extent},
    body_frame,
    extras::{find_props, find_twist_helpers},
    facing::sides_contradict_feet,
    finding::{Findings, sure},
    fingers::find_fingers,
    hints::Hints,
    input_digest::input_digest,
    kind::RigKind,
    lexicon::Sense,
    limbs::{find_arm, find_leg},
    memory::RecognitionMemory,
    names::ParsedName,
    quadruped,
    recognition_result::{Recognition, is_crawler},
    rest_pose_kind,
    structure::{Anatomy, find_anatomy},
    template::{self, TemplateMatch},
    trunk::{Limbs, find_details, find_root, find_trunk},
};
use crate::model::{ModelPose, Skeleton};

/// Parts that a lone hand, a bust or a creature may still be said to have; limbs only come with a body.
const PARTS_WITHOUT_BODY: [Part; 17] = [
    Part::Pelvis,
    Part::Spine,
    Part::Neck,
    Part::Head,
    Part::Jaw,
    Part::Eye,
    Part::Hand,
    Part::Thumb,
    Part::Index,
    Part::Middle,
    Part::Ring,
    Part::Pinky,
    Part::IndexMetacarpal,
    Part::MiddleMetacarpal,
    Part::RingMetacarpal,
    Part::PinkyMetacarpal,
    Part::Tail,
];

/// Parts that creatures on six and more legs have beside those.
const PARTS_OF_CRAWLER: [Part; 3] = [Part::Root, Part::Leg, Part::Wing];

/// Finds out what the joints of a skeleton mean.
///
/// `rest` is whatever pose the caller takes for the rest pose, in model space; it has one transform per joint.
///
/// Pure and deterministic. Where the file holds several skeletons, the one with the most known parts is looked at, of those that a
/// viewer shows.
#[must_use]
pub fn recognize(skeleton: &Skeleton, rest: &ModelPose, hints: &Hints<'_>) -> Recognition {
    let find = || find(skeleton, rest, hints);
    match hints.recognizer.memory {
        Some(memory) if skeleton.len() <= RecognitionMemory::MAX_JOINTS => {
            memory.recall(input_digest(skeleton, rest, hints), find)
        }
        _ => find(),
    }
}

fn find(skeleton: &Skeleton, rest: &ModelPose, hints: &Hints<'_>) -> Recognition {
    let mut declared = declared_roles(skeleton, hints.declared);
    let is_excluded = |joint: &usize| hints.excluded.get(*joint).copied().unwrap_or(false);
    declared.retain(|_, joints| !joints.iter().any(is_excluded));
    let template = template::find(skeleton, hints.recognizer.templates);
    let flagged = |joint: &usize| skeleton.joints()[*joint].is_joint;
    let mut recognition = Recognition::default();
    let joints_only = skeleton.joints().iter().any(|joint| joint.is_joint) && declared.values().flatten().all(flagged);
    if joints_only {
        recognition = attempt(skeleton, rest, &declared, template.as_ref(), hints, true);
    }
    if !recognition.is_body() {
        // No skin, or a skin of a prop only: the body may be made of plain nodes.
        let of_nodes = attempt(skeleton, rest, &declared, template.as_ref(), hints, false);
        if !joints_only || of_nodes.is_body() {
            recognition = of_nodes;
        }
    }
    if recognition.is_body() {
        let named = template.map(|template| template.name);
        let declared_name = hints.convention.filter(|_| !declared.is_empty());
        let is_vrm = declared_name.is_some_and(|name| name.starts_with("vrm"));
        recognition.recognised_as =
            if is_vrm { Some("vrm".to_owned()) } else { named.or_else(|| declared_name.map(str::to_owned)) };
    }
    recognition
}

fn attempt(
    skeleton: &Skeleton,
    rest: &ModelPose,
    declared: &BTreeMap<Role, Vec<usize>>,
    template: Option<&TemplateMatch>,
    hints: &Hints<'_>,
    joints_only: bool,
) -> Recognition {
    let extent = Extent { hidden: hints.hidden, excluded: hints.excluded, joints_only };
    let body = Body::new(skeleton, rest, template, extent);
    let anatomy = see_shape(&body, rest, joints_only);
    understand(&body, rest, declared, template, anatomy)
}

/// What names say alone.
struct ByName {
    findings: Findings,
    kind: RigKind,
    /// Whether four legs are named as such.
    four_named: bool,
}

fn found_by_name(
    body: &Body<'_>,
    rest: &ModelPose,
    declared: &BTreeMap<Role, Vec<usize>>,
    template: Option<&TemplateMatch>,
) -> ByName {
    let mut findings = Findings::new(declared.clone());
    let of_several = template.iter().flat_map(|template| &template.roles).filter(|(role, _)| role.is_one_of_several());
    for (role, joints) in of_several {
        findings.assign(*role, joints, sure::NAMED, "the rig's template says so");
    }
    let four_named = quadruped::find_named_legs(body, &mut findings);
    if !four_named {
        for side in Side::BOTH {
            find_arm(body, side, &mut findings);
            find_leg(body, side, &mut findings);
        }
    }
    find_trunk(body, limbs(&findings, four_named), &mut findings);
    let mut kind = if four_named { RigKind::Quadruped } else { kind_of(&findings) };
    if kind == RigKind::Biped && declared.is_empty() && quadruped::stands_on_four(&findings.roles, rest) {
        quadruped::arms_to_legs(body, &mut findings);
        kind = RigKind::Quadruped;
    }
    for side in Side::BOTH {
        find_fingers(body, side, &mut findings);
    }
    ByName { findings, kind, four_named }
}

/// What names and shape together say. Without a shape, names stand alone.
fn understand(
    body: &Body<'_>,
    rest: &ModelPose,
    declared: &BTreeMap<Role, Vec<usize>>,
    template: Option<&TemplateMatch>,
    anatomy: Option<Anatomy>,
) -> Recognition {
    let ByName { mut findings, mut kind, four_named } = found_by_name(body, rest, declared, template);
    if four_named && anatomy.as_ref().is_some_and(|anatomy| anatomy.is_crawler() && anatomy.stands_alone()) {
        // Front and hind legs with others between them.
        quadruped::forget_legs(&mut findings);
        kind = RigKind::Other;
    }
    let fits = |anatomy: &Anatomy| match kind {
        RigKind::Other => anatomy.stands_alone(),
        kind => anatomy.kind == kind,
    };
    let anatomy = anatomy.filter(fits);
    let says_side = |joint: &usize| body.names[*joint].side.is_some();
    let has_named_sides = findings.roles.keys().any(|role| role.side != Side::Center)
        || anatomy.iter().flat_map(|anatomy| anatomy.places.values()).any(|place| place.joints.iter().any(says_side));
    let sides_guessed = !has_named_sides && anatomy.as_ref().is_some_and(|anatomy| !anatomy.facing_known);
    // Legs that are counted are known before by the rig's template only.
    let by_shape = kind == RigKind::Other && anatomy.is_some() && !is_crawler(&findings.roles);
    let mut findings = combine(body, findings, anatomy.as_ref());
    if let Some(anatomy) = anatomy.filter(|_| by_shape) {
        kind = anatomy.kind;
    }
    if findings.first(Side::Center, Part::Root).is_none() {
        find_root(body, &mut findings);
    }
    find_details(body, &mut findings);
    let (mut twists, mut props) = (find_twist_helpers(body, &findings), find_props(body, &findings));
    let mut roles = findings.roles;
    if kind == RigKind::Other {
        let is_crawler = is_crawler(&roles);
        let may_stay =
            |part: &Part| PARTS_WITHOUT_BODY.contains(part) || (is_crawler && PARTS_OF_CRAWLER.contains(part));
        roles.retain(|role, _| may_stay(&role.part));
    }
    let mut frame = body_frame(&roles, rest).filter(|_| kind != RigKind::Other || is_crawler(&roles));
    // Sides that the file declares stand, whatever its feet do.
    let sides_swapped = declared.is_empty() && frame.is_some_and(|frame| sides_contradict_feet(&roles, rest, &frame));
    if sides_swapped {
        roles = swapped(roles);
        twists.iter_mut().for_each(|helper| helper.role = helper.role.mirrored());
        props.iter_mut().for_each(|prop| prop.side = prop.side.opposite());
        frame = body_frame(&roles, rest);
    }
    let confidence = confidence(kind, &roles);
    let misnamed = if declared.is_empty() { misnamed(body, &roles) } else { Vec::new() };
    let rest_pose = rest_pose_kind(&roles, rest, frame.as_ref());
    let twist_helpers = twists.iter().map(|helper| helper.joint).collect();
    Recognition {
        kind,
        recognised_as: None,
        confidence,
        roles,
        twist_helpers,
        twists,
        props,
        body: frame,
        rest_pose,
        sides_swapped,
        sides_guessed,
        misnamed,
        by_shape,
    }
}

/// What the shape of the body says. Joints that steer or mark something by their name are no part of it, unless nothing is
/// seen without them: some rigs call their hands ends.
fn see_shape(body: &Body<'_>, rest: &ModelPose, joints_only: bool) -> Option<Anatomy> {
    let joints = body.skeleton.joints();
    let parents: Vec<Option<usize>> = joints.iter().map(|joint| joint.parent).collect();
    let positions: Vec<DVec3> = rest.transforms().iter().map(|transform| transform.translation).collect();
    if positions.len() != joints.len() {
        return None;
    }
    let counts = |joint: usize| body.members[joint] && (joints[joint].is_joint || !joints_only);
    let is_mark = |joint: usize| body.names[joint].is_control || (body.names[joint].is_end && body.is_leaf(joint));
    let without_marks: Vec<bool> = (0..joints.len()).map(|joint| counts(joint) && !is_mark(joint)).collect();
    let seen = find_anatomy(&parents, &positions, &without_marks);
    let has_marks = (0..joints.len()).any(|joint| counts(joint) && is_mark(joint));
    if !has_marks || seen.as_ref().is_some_and(Anatomy::stands_alone) {
        return seen;
    }
    let all: Vec<bool> = (0..joints.len()).map(counts).collect();
    find_anatomy(&parents, &positions, &all).filter(Anatomy::stands_alone).or(seen)
}

/// The roles behind a file's own names for them. Names that say nothing, and joints that do not exist, are left out.
fn declared_roles(skeleton: &Skeleton, declared: &[(String, usize)]) -> BTreeMap<Role, Vec<usize>> {
    let mut roles: BTreeMap<Role, Vec<usize>> = BTreeMap::new();
    for (name, joint) in declared.iter().filter(|(_, joint)| *joint < skeleton.len()) {
        let parsed = ParsedName::parse(name);
        let Some(part) = parsed.sense.and_then(declared_part) else { continue };
        let role = Role::new(parsed.side.unwrap_or(Side::Center), part);
        let joints = roles.entry(role).or_default();
        if part.is_central() == parsed.side.is_none() && !joints.contains(joint) {
            joints.push(*joint);
        }
    }
    roles.retain(|_, joints| !joints.is_empty());
    // Parents come before children, so this is from the body outward.
    roles.values_mut().for_each(|joints| joints.sort_unstable());
    roles
}

const fn declared_part(sense: Sense) -> Option<Part> {
    Some(match sense {
        Sense::Pelvis => Part::Pelvis,
        Sense::Spine => Part::Spine,
        Sense::Neck => Part::Neck,
        Sense::Head => Part::Head,
        Sense::Jaw => Part::Jaw,
        Sense::Eye => Part::Eye,
        Sense::Clavicle | Sense::Shoulder => Part::Clavicle,
        Sense::UpperArm | Sense::Arm => Part::UpperArm,
        Sense::Forearm => Part::Forearm,
        Sense::Hand => Part::Hand,
        Sense::Thigh => Part::Thigh,
        Sense::Shin | Sense::Leg => Part::Shin,
        Sense::Foot => Part::Foot,
        Sense::Toe => Part::Toe,
        Sense::Finger(finger) => finger,
        _ => return None,
    })
}

fn limbs(findings: &Findings, four_named: bool) -> Limbs {
    let first = |parts: &[Part]| Side::BOTH.map(|side| parts.iter().find_map(|part| findings.first(side, *part)));
    if four_named {
        return Limbs { arms: first(&[Part::FrontLeg]), legs: first(&[Part::HindLeg]) };
    }
    Limbs { arms: first(&[Part::Clavicle, Part::UpperArm, Part::Forearm]), legs: first(&[Part::Thigh, Part::Shin]) }
}

fn kind_of(findings: &Findings) -> RigKind {
    let has = |side: Side, part: Part| findings.first(side, part).is_some();
    let center = |part: Part| has(Side::Center, part);
    let limb = |upper: Part, lower: Part, end: Part| {
        Side::BOTH.iter().all(|side| has(*side, upper) && (has(*side, lower) || has(*side, end)))
    };
    let legs = limb(Part::Thigh, Part::Shin, Part::Foot);
    let arms = limb(Part::UpperArm, Part::Forearm, Part::Hand);
    let trunk = center(Part::Spine) || center(Part::Head);
    if (legs && center(Part::Pelvis) && (trunk || arms)) || (arms && trunk) { RigKind::Biped } else { RigKind::Other }
}

fn swapped(roles: BTreeMap<Role, RoleFinding>) -> BTreeMap<Role, RoleFinding> {
    let swap = |(role, mut finding): (Role, RoleFinding)| {
        if role.side != Side::Center {
            finding.reasons.push("its name says the other side, but the feet say which way the body faces".into());
        }
        (role.mirrored(), finding)
    };
    roles.into_iter().map(swap).collect()
}

fn confidence(kind: RigKind, roles: &BTreeMap<Role, RoleFinding>) -> f64 {
    const CENTER: [Part; 3] = [Part::Pelvis, Part::Spine, Part::Head];
    const ARM_AND_LEG: [Part; 6] = [Part::UpperArm, Part::Forearm, Part::Hand, Part::Thigh, Part::Shin, Part::Foot];
    const WING_AND_LEG: [Part; 4] = [Part::Wing, Part::Thigh, Part::Shin, Part::Foot];
    let has = |part: Part| roles.contains_key(&Role::new(Side::Left, part));
    let paired: &[Part] = match kind {
        RigKind::Biped if has(Part::Wing) && !has(Part::UpperArm) => &WING_AND_LEG,
        RigKind::Biped => &ARM_AND_LEG,
        RigKind::Quadruped => &[Part::FrontLeg, Part::HindLeg],
        RigKind::Other if is_crawler(roles) => &[],
        RigKind::Other => return 0.0,
    };
    // Of legs that are counted nobody knows how many there should be.
    let legs = roles.keys().copied().filter(|role| role.part == Part::Leg && kind == RigKind::Other);
    let center = CENTER.iter().map(|part| Role::center(*part));
    let both = Side::BOTH.iter().flat_map(|side| paired.iter().map(|part| Role::new(*side, *part)));
    let expected: Vec<Role> = center.chain(both).chain(legs).collect();
    let sum: f64 = expected.iter().filter_map(|role| roles.get(role)).map(|finding| finding.confidence).sum();
    sum / expected.len() as f64
}
