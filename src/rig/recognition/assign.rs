//! One assignment from two witnesses: what the names say, and what the shape says.
//!
//! Every candidate for a role is scored by its name, its geometry and its symmetry; the best candidates get their joints, one
//! role to a joint. How sure a role is comes from whether the witnesses agree.

use std::collections::BTreeMap;

use super::{
    Part, Role, RoleFinding, Side,
    body::Body,
    finding::{Findings, sure},
    structure::{Anatomy, Place},
};

/// What a candidate's score is made of; together 1.
const NAME_WEIGHT: f64 = 0.6;
const GEOMETRY_WEIGHT: f64 = 0.3;
const SYMMETRY_WEIGHT: f64 = 0.1;

/// What a name that says nothing is worth against one that says something else.
const SILENT_NAME: f64 = 0.3;
/// What geometry is worth where the shape has no opinion.
const SILENT_SHAPE: f64 = 0.5;

/// How much surer or less sure one witness is than both.
mod witness {
    /// The surest that two witnesses are: neither is a proof.
    pub(super) const MOST: f64 = 0.99;
    /// A name that the shape says nothing about.
    pub(super) const NAME_ALONE: f64 = 0.94;
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
pub(super) fn combine(body: &Body<'_>, named: Findings, anatomy: Option<&Anatomy>) -> Findings {
    let Some(anatomy) = anatomy else { return alone(named) };
    let places = on_named_sides(&named.roles, anatomy);
    let mut candidates: Vec<Candidate<'_>> = Vec::new();
    for (role, finding) in &named.roles {
        let geometry = match places.get(role) {
            Some(place) if agree(*role, &finding.joints, &place.joints) => place.geometry,
            Some(_) => 0.0,
            None => SILENT_SHAPE,
        };
        let twin = named.roles.get(&role.mirrored()).map(|twin| twin.joints.as_slice());
        let symmetry = symmetry(body, *role, &finding.joints, twin);
        let score = NAME_WEIGHT * finding.confidence + GEOMETRY_WEIGHT * geometry + SYMMETRY_WEIGHT * symmetry;
        candidates.push(Candidate { score, role: *role, witness: Witness::Names, joints: &finding.joints });
    }
    for (role, place) in &places {
        let finding = named.roles.get(role);
        if finding.is_some_and(|finding| agree(*role, &finding.joints, &place.joints)) {
            continue;
        }
        let name = if finding.is_none() && is_nameless(body, &place.joints) { SILENT_NAME } else { 0.0 };
        let twin = places.get(&role.mirrored()).map(|twin| twin.joints.as_slice());
        let symmetry = symmetry(body, *role, &place.joints, twin);
        // A joint that is named as something else, in a rig that has names for this, is that.
        if finding.is_none() && name == 0.0 {
            continue;
        }
        let score = NAME_WEIGHT * name + GEOMETRY_WEIGHT * place.geometry + SYMMETRY_WEIGHT * symmetry;
        candidates.push(Candidate { score, role: *role, witness: Witness::Shape, joints: &place.joints });
    }
    // Ties go to the trunk before the limbs, and to names before the shape.
    candidates.sort_by(|first, second| second.score.total_cmp(&first.score).then(first.role.cmp(&second.role)));
    let mut combined = Findings::new(named.declared.clone());
    for candidate in &candidates {
        let role = candidate.role;
        let is_free = candidate.joints.iter().any(|joint| !combined.is_taken(*joint));
        if combined.roles.contains_key(&role) || !is_free || combined.is_taken(candidate.joints[0]) {
            continue;
        }
        let finding = judge(body, candidate, named.roles.get(&role), places.get(&role));
        combined.take_over(role, finding);
    }
    combined
}

fn alone(mut named: Findings) -> Findings {
    for finding in named.roles.values_mut() {
        if finding.confidence < sure::DECLARED {
            finding.confidence *= witness::NAME_ALONE;
        }
    }
    named
}

/// The places, with left and right as the names have it for the most part. Whether the names have it right is another
/// question, which the feet answer.
fn on_named_sides<'a>(named: &BTreeMap<Role, RoleFinding>, anatomy: &'a Anatomy) -> BTreeMap<Role, &'a Place> {
    let sided = named.iter().filter(|(role, _)| role.side != Side::Center);
    let (mut same, mut other) = (0_usize, 0_usize);
    for (role, finding) in sided {
        let holds =
            |role: &Role| anatomy.places.get(role).is_some_and(|place| place.joints.contains(&finding.joints[0]));
        same += usize::from(holds(role));
        other += usize::from(holds(&role.mirrored()));
    }
    let turn = |role: &Role| if other > same { role.mirrored() } else { *role };
    anatomy.places.iter().map(|(role, place)| (turn(role), place)).collect()
}

/// Whether two lists of joints mean the same: the same first joint, or for parts of several joints half of them.
fn agree(role: Role, named: &[usize], placed: &[usize]) -> bool {
    let is_list = matches!(role.part, Part::Spine | Part::Neck | Part::Tail | Part::FrontLeg | Part::HindLeg);
    let common = named.iter().filter(|joint| placed.contains(joint)).count();
    named[0] == placed[0] || (is_list && 2 * common >= named.len().max(placed.len()))
}

fn symmetry(body: &Body<'_>, role: Role, joints: &[usize], twin: Option<&[usize]>) -> f64 {
    let is_mirrored =
        twin.is_some_and(|twin| body.depth[twin[0]] == body.depth[joints[0]] && twin.len() == joints.len());
    if role.side == Side::Center || is_mirrored { 1.0 } else { 0.0 }
}

/// Whether the names of those joints say nothing about the body.
fn is_nameless(body: &Body<'_>, joints: &[usize]) -> bool {
    joints.iter().take(1).all(|joint| body.names[*joint].sense.is_none())
}

/// What is said of the role that a candidate gets.
fn judge(
    body: &Body<'_>,
    candidate: &Candidate<'_>,
    named: Option<&RoleFinding>,
    place: Option<&&Place>,
) -> RoleFinding {
    let label = |joint: usize| body.skeleton.label(joint);
    match (candidate.witness, named, place) {
        (Witness::Names, Some(named), Some(place)) if agree(candidate.role, &named.joints, &place.joints) => {
            let mut finding = named.clone();
            let doubt = (1.0 - named.confidence) * (1.0 - place.geometry);
            finding.confidence = named.confidence.max((1.0 - doubt).min(witness::MOST));
            finding.reasons.push("its shape agrees".to_owned());
            finding
        }
        (Witness::Names, Some(named), Some(place)) => {
            let mut finding = named.clone();
            let other = place.joints[0];
            let (parent, own) = (|joint: usize| body.skeleton.parent(joint), named.joints[0]);
            let is_near = parent(own) == Some(other) || parent(other) == Some(own) || place.joints.contains(&own);
            if named.confidence < sure::DECLARED {
                finding.confidence *= match (is_near, place.geometry >= witness::CLEAR) {
                    (_, false) | (true, _) => witness::NEAR,
                    (false, true) => witness::CONTRADICTED,
                };
            }
            finding.reasons.push(format!("its shape would say '{}'", label(other)));
            finding.alternatives.push(place.joints.clone());
            finding
        }
        (Witness::Names, Some(named), None) => {
            let mut finding = named.clone();
            if finding.confidence < sure::DECLARED {
                finding.confidence *= witness::NAME_ALONE;
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
                None => (geometry, "by its shape and place; its name says nothing".to_owned()),
            };
            RoleFinding { joints: candidate.joints.to_vec(), confidence, alternatives, reasons: vec![reason] }
        }
    }
}
