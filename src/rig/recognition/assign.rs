//! One assignment from two witnesses: what the names say, and what the shape says.
//!
//! Every candidate for a role is scored by its name, its geometry and its symmetry; the best candidates get their joints, one
//! role to a joint. How sure a role is comes from whether the witnesses agree.

use std::collections::BTreeMap;

use super::{
    Part, Role, RoleFinding, Side,
    body::Body,
    finding::{Findings, sure},
    lexicon::Sense,
    limb_names::{self, LimbVerdict, Naming, weigh_limb},
    structure::{Anatomy, GUESS, Place, SeenLimb},
};

/// What a candidate's score is made of; together 1.
const NAME_WEIGHT: f64 = 0.6;
const GEOMETRY_WEIGHT: f64 = 0.3;
const SYMMETRY_WEIGHT: f64 = 0.1;

/// What a name that says nothing is worth against one that says something else.
const SILENT_NAME: f64 = 0.3;
/// What a name is worth that may mean the role, but was not understood so.
const FITTING_NAME: f64 = 0.6;
/// What is left of a name where the rest of its limb is not named.
const LONE_NAME: f64 = 0.4;
/// What geometry is worth where the shape has no opinion.
const SILENT_SHAPE: f64 = 0.5;

/// How many times likelier than what the names say another way of seeing a limb has to be to count against them.
const CLEARLY_LIKELIER: f64 = 3.0;
/// A way of seeing a limb that comes nearer to the best than this share leaves the best a guess.
const CLEAR_RIVAL: f64 = 0.35;
/// How much less sure a toe is than the limb that it belongs to.
const BEYOND_DOUBT: f64 = 0.15;

/// How much surer or less sure one witness is than both.
mod witness {
    /// The surest that two witnesses are: neither is a proof.
    pub(super) const MOST: f64 = 0.99;
    /// A name that the shape says nothing about.
    pub(super) const NAME_ALONE: f64 = 0.97;
    /// A name whose joint is next to the one that the shape means.
    pub(super) const NEAR: f64 = 0.85;
    /// A name whose joint is elsewhere, where the shape is clear.
    pub(super) const CONTRADICTED: f64 = 0.58;
    /// Geometry that is less clear than this contradicts nobody; fingers lie too close for more.
    pub(super) const CLEAR: f64 = 0.7;
}

/// Which witness a candidate comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Witness {
    Names,
    Shape,
}

struct Candidate<'a> {
    score: f64,
    role: Role,
    witness: Witness,
    joints: &'a [usize],
}

/// The findings by name and what the shape says, together. Without a shape that is understood, names stand alone and are a
/// little less sure.
pub(super) fn combine(body: &Body<'_>, mut named: Findings, anatomy: Option<&Anatomy>) -> Findings {
    let Some(anatomy) = anatomy else { return alone(named) };
    let is_turned = is_turned(body, anatomy);
    let mut places = on_named_sides(anatomy, is_turned);
    let limbs = weigh_limbs(body, &mut named, &mut places, anatomy, is_turned);
    let mut candidates = candidates(body, &named, &places, &limbs);
    // Ties go to the trunk before the limbs, and to names before the shape.
    candidates.sort_by(|first, second| second.score.total_cmp(&first.score).then(first.role.cmp(&second.role)));
    let mut combined = Findings::new(named.declared.clone());
    for candidate in &candidates {
        let role = candidate.role;
        let is_free = candidate.joints.iter().any(|joint| !combined.is_taken(*joint));
        if combined.roles.contains_key(&role) || !is_free || combined.is_taken(candidate.joints[0]) {
            continue;
        }
        let is_of_named_hand = Part::FINGERS.contains(&role.part) && is_hand_named(body, &named.roles, role.side);
        let witnesses = (named.roles.get(&role), places.get(&role));
        let finding = judge(body, candidate, witnesses, is_of_named_hand, &limbs);
        combined.take_over(role, finding);
    }
    combined
}

fn candidates<'a>(
    body: &Body<'_>,
    named: &'a Findings,
    places: &'a BTreeMap<Role, Place>,
    limbs: &WeighedLimbs,
) -> Vec<Candidate<'a>> {
    let mut candidates: Vec<Candidate<'_>> = Vec::new();
    for (role, finding) in &named.roles {
        let geometry = match places.get(role) {
            Some(place) if agree(*role, &finding.joints, &place.joints) => place.geometry,
            Some(_) => 0.0,
            None => SILENT_SHAPE,
        };
        let twin = named.roles.get(&role.mirrored()).map(|twin| twin.joints.as_slice());
        let symmetry = symmetry(body, *role, &finding.joints, twin);
        // One segment of a limb that is named, and not the others, is named by chance (`arm_01`, `arm_02`).
        let name =
            if is_lone(&named.roles, places, *role) { LONE_NAME * finding.confidence } else { finding.confidence };
        let score = NAME_WEIGHT * name + GEOMETRY_WEIGHT * geometry + SYMMETRY_WEIGHT * symmetry;
        candidates.push(Candidate { score, role: *role, witness: Witness::Names, joints: &finding.joints });
    }
    for (role, place) in places {
        let finding = named.roles.get(role);
        if finding.is_some_and(|finding| agree(*role, &finding.joints, &place.joints)) {
            continue;
        }
        // A joint that is named as something else is that, unless its whole limb says otherwise.
        let is_corrected = limbs.corrected.contains_key(role);
        let Some(name) = name_for(body, *role, place.joints[0]).or(is_corrected.then_some(1.0)) else { continue };
        // Where another joint is named so, this one is not.
        let name = match finding {
            _ if is_corrected => 1.0,
            Some(_) => 0.0,
            None => name,
        };
        let twin = places.get(&role.mirrored()).map(|twin| twin.joints.as_slice());
        let symmetry = symmetry(body, *role, &place.joints, twin);
        let score = NAME_WEIGHT * name + GEOMETRY_WEIGHT * place.geometry + SYMMETRY_WEIGHT * symmetry;
        candidates.push(Candidate { score, role: *role, witness: Witness::Shape, joints: &place.joints });
    }
    candidates
}

/// What weighing limbs as a whole says of their roles.
#[derive(Debug, Default)]
struct WeighedLimbs {
    /// Why the names of a limb do not count, for roles that its shape decides against them.
    corrected: BTreeMap<Role, &'static str>,
    /// How likely each joint of a limb is the first of a role, all things weighed; roles of limbs that are not seen are not here.
    likelihoods: BTreeMap<Role, BTreeMap<usize, f64>>,
}

impl WeighedLimbs {
    /// How likely a joint is the first of a role; nothing where no limb with that role is seen.
    fn likelihood(&self, role: Role, joint: usize) -> Option<f64> {
        self.likelihoods.get(&role).map(|joints| joints.get(&joint).copied().unwrap_or_default())
    }
}

/// Weighs every arm and leg as a whole. Where that speaks against the names, they are taken out of `named`, and `places` says what
/// counts; a segment that is missing has no place.
fn weigh_limbs(
    body: &Body<'_>,
    named: &mut Findings,
    places: &mut BTreeMap<Role, Place>,
    anatomy: &Anatomy,
    is_turned: bool,
) -> WeighedLimbs {
    let mut weighed = WeighedLimbs::default();
    for limb in &anatomy.limbs {
        let side = if is_turned { limb.side.opposite() } else { limb.side };
        let Some(verdict) = weigh_limb(body, limb, side, named) else { continue };
        let parts = if limb.is_leg { limb_names::LEG } else { limb_names::ARM };
        let roles = parts.map(|part| Role::new(side, part));
        if !verdict.is_named {
            doubt_rivals(roles, verdict.rivals, places);
        }
        for (part, role) in roles.iter().enumerate() {
            if verdict.segments[part].is_none() {
                places.remove(role);
            }
            let likelihoods = limb.joints.iter().copied().zip(verdict.by_place.iter().map(|place| place[part]));
            weighed.likelihoods.insert(*role, likelihoods.collect());
        }
        let speaks_against = |(role, segment): (&Role, &Option<usize>)| {
            let joint = segment.map(|place| limb.joints[place]);
            match named.roles.get(role) {
                Some(finding) => Some(finding.joints[0]) != joint,
                None => joint.is_some_and(|joint| name_for(body, *role, joint).is_none()),
            }
        };
        let is_against = roles.iter().zip(&verdict.segments).any(speaks_against);
        if is_against && verdict.against_names >= CLEARLY_LIKELIER {
            correct(limb, side, &verdict, named, places, &mut weighed);
        }
    }
    weighed
}

/// Without names, what the shape may see in another joint as well is a guess. A clavicle is as sure as where the arm begins.
fn doubt_rivals(roles: [Role; 3], rivals: [f64; 3], places: &mut BTreeMap<Role, Place>) {
    let clavicle = (Role::new(roles[0].side, Part::Clavicle), rivals[0]);
    let is_arm = roles[0].part == Part::UpperArm;
    for (role, rival) in roles.into_iter().zip(rivals).chain(Some(clavicle).filter(|_| is_arm)) {
        if let Some(place) = places.get_mut(&role).filter(|_| rival > CLEAR_RIVAL) {
            place.geometry = place.geometry.min(GUESS);
        }
    }
}

/// Lets the shape of a limb count against its names.
fn correct(
    limb: &SeenLimb,
    side: Side,
    verdict: &LimbVerdict,
    named: &mut Findings,
    places: &mut BTreeMap<Role, Place>,
    weighed: &mut WeighedLimbs,
) {
    let reason = match verdict.naming {
        Naming::Own => "by its shape and place; a name of the limb contradicts them",
        Naming::Next => "by its shape and place: the joints of the limb are called after the next segment",
        Naming::Previous => "by its shape and place: the joints of the limb are called after the previous segment",
        Naming::Arbitrary => "by its shape and place: the names of the limb contradict them",
    };
    let parts = if limb.is_leg { limb_names::LEG } else { limb_names::ARM };
    let sure = parts.iter().filter_map(|part| places.get(&Role::new(side, *part))).map(|place| place.geometry);
    let sure = sure.fold(0.0, f64::max);
    let starts = verdict.segments;
    let mut set = |role: Role, joints: &[usize], geometry: f64| {
        let old = named.remove(role).map(|finding| finding.joints[0]);
        if joints.is_empty() {
            places.remove(&role);
        } else {
            let alternative = old.filter(|old| *old != joints[0]);
            places.insert(role, Place { joints: joints.to_vec(), geometry, alternative });
            weighed.corrected.insert(role, reason);
        }
    };
    for (index, part) in parts.into_iter().enumerate() {
        let next = starts[index + 1..].iter().flatten().next().copied();
        let end = if index == 2 { starts[index].map(|start| start + 1) } else { next };
        let joints = starts[index].map(|start| &limb.joints[start..end.unwrap_or(start + 1)]);
        set(Role::new(side, part), joints.unwrap_or_default(), verdict.likelihood[index] * sure);
    }
    let first = starts.iter().flatten().next().copied().unwrap_or(0);
    let [before, beyond] = limb_names::neighbors(limb.is_leg, side);
    if let Some(role) = before {
        set(role, &limb.joints[..first.min(1)], verdict.likelihood[0] * sure);
    }
    if let (Some(role), Some(end)) = (beyond, starts[2]) {
        let has_toe = !limb.fans[end] && limb.joints.len() > end + 1;
        let toe = if has_toe { &limb.joints[end + 1..end + 2] } else { &[] };
        set(role, toe, verdict.likelihood[2] * (sure - BEYOND_DOUBT));
    }
}

fn alone(mut named: Findings) -> Findings {
    for finding in named.roles.values_mut() {
        if finding.confidence < sure::DECLARED {
            finding.confidence *= witness::NAME_ALONE;
        }
    }
    named
}

/// Whether the names have left and right the other way round than the shape, for the most part. Whether they have it right is another
/// question, which the feet answer.
fn is_turned(body: &Body<'_>, anatomy: &Anatomy) -> bool {
    let (mut same, mut other) = (0_usize, 0_usize);
    for (role, place) in anatomy.places.iter().filter(|(role, _)| role.side != Side::Center) {
        let sides = place.joints.iter().filter_map(|joint| body.names[*joint].side);
        for side in sides {
            same += usize::from(side == role.side);
            other += usize::from(side == role.side.opposite());
        }
    }
    other > same
}

fn on_named_sides(anatomy: &Anatomy, is_turned: bool) -> BTreeMap<Role, Place> {
    let turn = |role: &Role| if is_turned { role.mirrored() } else { *role };
    anatomy.places.iter().map(|(role, place)| (turn(role), place.clone())).collect()
}

/// Whether two lists of joints mean the same: the same first joint, or for parts of several joints half of them.
fn agree(role: Role, named: &[usize], placed: &[usize]) -> bool {
    let is_list = matches!(
        role.part,
        Part::Spine | Part::Neck | Part::Tail | Part::Wing | Part::FrontLeg | Part::HindLeg | Part::Leg
    );
    let common = named.iter().filter(|joint| placed.contains(joint)).count();
    named[0] == placed[0] || (is_list && 2 * common >= named.len().max(placed.len()))
}

fn symmetry(body: &Body<'_>, role: Role, joints: &[usize], twin: Option<&[usize]>) -> f64 {
    let is_mirrored =
        twin.is_some_and(|twin| body.depth[twin[0]] == body.depth[joints[0]] && twin.len() == joints.len());
    if role.side == Side::Center || is_mirrored { 1.0 } else { 0.0 }
}

/// How much a joint's name speaks for a role that it was not given by name; nothing where it says something else.
fn name_for(body: &Body<'_>, role: Role, joint: usize) -> Option<f64> {
    let name = &body.names[joint];
    let Some(sense) = name.sense else { return Some(SILENT_NAME) };
    let is_other_side = name.side.is_some_and(|side| role.side != Side::Center && side == role.side.opposite());
    if may_mean(sense, role.part) && !is_other_side {
        Some(FITTING_NAME)
    } else {
        (!body.means(joint, &[sense])).then_some(0.0)
    }
}

/// Joints of limbs whose names speak of another part than the role that they have, rising.
pub(super) fn misnamed(body: &Body<'_>, roles: &BTreeMap<Role, RoleFinding>) -> Vec<usize> {
    let parts = limb_names::ARM.into_iter().chain(limb_names::LEG);
    let limbs = parts.flat_map(|part| Side::BOTH.map(|side| Role::new(side, part)));
    let contradicts = |role: Role| {
        let joint = *roles.get(&role)?.joints.first()?;
        let sense = body.names[joint].sense.filter(|sense| body.means(joint, &[*sense]))?;
        (!may_mean(sense, role.part)).then_some(joint)
    };
    let mut joints: Vec<usize> = limbs.filter_map(contradicts).collect();
    joints.sort_unstable();
    joints
}

/// Whether a word may stand for a part at all.
const fn may_mean(sense: Sense, part: Part) -> bool {
    match part {
        Part::Pelvis => matches!(sense, Sense::Pelvis | Sense::Hip | Sense::Spine),
        Part::Clavicle => matches!(sense, Sense::Clavicle | Sense::Shoulder | Sense::Arm),
        Part::UpperArm => matches!(sense, Sense::UpperArm | Sense::Arm | Sense::Shoulder),
        Part::Forearm => matches!(sense, Sense::Forearm | Sense::Arm),
        Part::Hand => matches!(sense, Sense::Hand | Sense::Wrist | Sense::Palm | Sense::Arm),
        Part::Thigh => matches!(sense, Sense::Thigh | Sense::Hip | Sense::Leg),
        Part::Shin => matches!(sense, Sense::Shin | Sense::Leg),
        Part::Foot => matches!(sense, Sense::Foot | Sense::Ankle | Sense::Leg),
        Part::Toe => matches!(sense, Sense::Toe | Sense::Foot | Sense::Leg),
        Part::Spine => matches!(sense, Sense::Spine),
        Part::Neck => matches!(sense, Sense::Neck | Sense::Spine),
        // A further neck joint without a head above it is no head.
        Part::Head => matches!(sense, Sense::Head | Sense::Spine),
        Part::FrontLeg | Part::HindLeg | Part::Leg => matches!(
            sense,
            Sense::FrontLeg
                | Sense::HindLeg
                | Sense::Hip
                | Sense::Thigh
                | Sense::Leg
                | Sense::Shin
                | Sense::Ankle
                | Sense::Foot
                | Sense::Toe
                | Sense::Arm
                | Sense::Shoulder
                | Sense::UpperArm
                | Sense::Clavicle
        ),
        Part::Wing => matches!(sense, Sense::Arm | Sense::Shoulder | Sense::UpperArm),
        Part::Thumb | Part::Index | Part::Middle | Part::Ring | Part::Pinky => {
            matches!(sense, Sense::Finger(_) | Sense::AnyFinger)
        }
        _ => false,
    }
}

/// Whether a role is the only named segment of a limb that the shape sees whole.
fn is_lone(named: &BTreeMap<Role, RoleFinding>, places: &BTreeMap<Role, Place>, role: Role) -> bool {
    const LIMBS: [[Part; 3]; 2] = [[Part::UpperArm, Part::Forearm, Part::Hand], [Part::Thigh, Part::Shin, Part::Foot]];
    let limb = LIMBS.iter().find(|limb| limb.contains(&role.part));
    limb.is_some_and(|limb| {
        let roles = limb.map(|part| Role::new(role.side, part));
        roles.iter().all(|role| places.contains_key(role))
            && roles.iter().filter(|role| named.contains_key(role)).count() == 1
    })
}

/// Whether the thumb and at least three fingers of a hand are told apart by their names. Such names are not given by chance, and the shape of a
/// hand that holds something at rest says little about which finger is which.
fn is_hand_named(body: &Body<'_>, named: &BTreeMap<Role, RoleFinding>, side: Side) -> bool {
    // By words: a number may count from either side.
    let is_named = |part: &Part| {
        let first = named.get(&Role::new(side, *part)).and_then(|finding| finding.joints.first());
        first.is_some_and(|joint| body.means(*joint, &[Sense::Finger(*part)]))
    };
    is_named(&Part::Thumb) && Part::FINGERS.iter().filter(|part| is_named(part)).count() >= 4
}

/// What is said of the role that a candidate gets. `is_of_named_hand` is whether it is a finger of a hand whose fingers are told apart by
/// their names.
fn judge(
    body: &Body<'_>,
    candidate: &Candidate<'_>,
    (named, place): (Option<&RoleFinding>, Option<&Place>),
    is_of_named_hand: bool,
    limbs: &WeighedLimbs,
) -> RoleFinding {
    let label = |joint: usize| body.skeleton.label(joint);
    let likelihood = limbs.likelihood(candidate.role, candidate.joints[0]);
    match (candidate.witness, named, place) {
        (Witness::Names, Some(named), Some(place)) if agree(candidate.role, &named.joints, &place.joints) => {
            let mut finding = named.clone();
            let doubt = (1.0 - named.confidence) * (1.0 - place.geometry);
            finding.confidence = named.confidence.max((1.0 - doubt).min(witness::MOST));
            if named.confidence < sure::DECLARED {
                finding.confidence *= likelihood.unwrap_or(1.0);
            }
            finding.reasons.push("its shape agrees".to_owned());
            finding
        }
        (Witness::Names, Some(named), Some(place)) => {
            let mut finding = named.clone();
            let other = place.joints[0];
            let (parent, own) = (|joint: usize| body.skeleton.parent(joint), named.joints[0]);
            let is_near = parent(own) == Some(other) || parent(other) == Some(own) || place.joints.contains(&own);
            if named.confidence < sure::DECLARED {
                finding.confidence *= match (likelihood, is_near) {
                    (None, _) if is_of_named_hand => witness::NAME_ALONE,
                    (Some(likelihood), _) => likelihood.max(witness::CONTRADICTED),
                    (None, false) if place.geometry >= witness::CLEAR => witness::CONTRADICTED,
                    (None, _) => witness::NEAR,
                };
            }
            finding.reasons.push(format!("its shape would say '{}'", label(other)));
            finding.alternatives.push(place.joints.clone());
            finding
        }
        (Witness::Names, Some(named), None) => {
            let mut finding = named.clone();
            if finding.confidence < sure::DECLARED {
                finding.confidence *= likelihood.unwrap_or(1.0).clamp(witness::CONTRADICTED, witness::NAME_ALONE);
            }
            finding
        }
        (_, named, place) => {
            let geometry = place.map_or(0.0, |place| place.geometry);
            let mut alternatives: Vec<Vec<usize>> = named.iter().map(|named| named.joints.clone()).collect();
            alternatives.extend(place.and_then(|place| place.alternative).map(|joint| vec![joint]));
            let (confidence, reason) = match named {
                Some(named) => {
                    let name = label(named.joints[0]);
                    (geometry * witness::CONTRADICTED, format!("by its shape, although '{name}' is named so"))
                }
                None => {
                    let corrected = limbs.corrected.get(&candidate.role).copied();
                    (geometry, corrected.unwrap_or("by its shape and place").to_owned())
                }
            };
            RoleFinding { joints: candidate.joints.to_vec(), confidence, alternatives, reasons: vec![reason] }
        }
    }
}
