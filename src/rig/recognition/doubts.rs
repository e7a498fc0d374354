//! What a user should know about a recognition: guesses and contradictions, as warnings.

use super::{Part, Recognition, Role, RoleFinding, Side};
use crate::model::{Reporter, Skeleton};

/// Roles that are less sure than this are said to be guesses.
const SURE_ENOUGH: f64 = 0.9;
/// The same where the shape is all that there is, which is said of all roles at once.
const SURE_BY_SHAPE: f64 = 0.6;
/// Parts that no chain is made of.
const UNMAPPED: [Part; 7] = [
    Part::Root,
    Part::Eye,
    Part::Jaw,
    Part::IndexMetacarpal,
    Part::MiddleMetacarpal,
    Part::RingMetacarpal,
    Part::PinkyMetacarpal,
];

/// Warns of everything in a recognition that is a guess. `place` says which rig.
pub fn report_doubts(skeleton: &Skeleton, recognition: &Recognition, reporter: &mut Reporter, place: &str) {
    if !recognition.is_body() {
        reporter.warn(
            "rig_not_recognized",
            place,
            "neither the joints' names nor their shape make up a body",
            "give the roles or chains in the config, or name the joints by a known convention",
        );
    }
    if recognition.by_shape {
        reporter.warn(
            "roles_from_shape",
            place,
            "the joints' names say nothing; what they mean is seen from how they lie and hang together",
            "look at the roles, and give those that are wrong in the config",
        );
    }
    if recognition.sides_guessed {
        reporter.warn(
            "sides_guessed",
            place,
            "neither names nor feet nor knees say which side is left; the body is taken to face front",
            "give the roles of one side in the config if it faces back",
        );
    }
    if recognition.sides_swapped {
        reporter.warn(
            "sides_swapped",
            place,
            "joints that are named left lie on the right of a body whose feet point forward; where they lie counts",
            "give the roles in the config if the names are right",
        );
    }
    let least = if recognition.by_shape { SURE_BY_SHAPE } else { SURE_ENOUGH };
    let is_unsure = |role: &Role, finding: &RoleFinding| {
        finding.confidence < least && (finding.confidence < SURE_BY_SHAPE || !UNMAPPED.contains(&role.part))
    };
    for (role, finding) in recognition.roles.iter().filter(|(role, finding)| is_unsure(role, finding)) {
        let joint = finding.joints.first().map_or_else(String::new, |joint| skeleton.label(*joint));
        let reasons = finding.reasons.join("; ");
        reporter.warn(
            "role_uncertain",
            place,
            format!("{role} is taken to be '{joint}': {reasons}"),
            format!("give roles.{role} in the config if this is wrong"),
        );
    }
    for role in recognition.roles.keys().filter(|role| role.side == Side::Left) {
        let twin = role.mirrored();
        if recognition.is_body() && !recognition.roles.contains_key(&twin) {
            reporter.warn("role_one_sided", place, format!("there is {role}, but no {twin}"), "give it in the config");
        }
    }
}
