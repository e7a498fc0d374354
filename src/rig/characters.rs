//! Which character of a file is meant, and which others it holds.

use glam::DVec3;

use crate::model::{ModelPose, Reporter, Scene, Skeleton};

use super::{
    error::{SpecError, SpecErrorKind, SpecField},
    lookup::find_joint,
    recognition::{Hints, Part, Recognition, Recognizer, recognize},
    rig::Rig,
    spec::RigSpec,
};

/// Layers of one rig lie in one place: what is nearer to the first character than this share of its size is no other character.
const SAME_PLACE_SHARE: f64 = 0.02;
/// Fewer joints are no character.
const FEWEST_JOINTS: usize = 10;
/// More characters are not looked for.
const MAX_CHARACTERS: usize = 8;
/// What a spec says in place of a joint where it means every character of a file.
pub const ALL_CHARACTERS: &str = "all";

impl Rig<'_> {
    /// The topmost joints of all characters of the file that the rig is of, the rig's own first; at most eight, and empty where
    /// the rig is no body. All that hangs from one belongs to its character.
    #[must_use]
    pub fn characters(&self, recognizer: Recognizer<'_>) -> Vec<usize> {
        let skeleton = self.skeleton();
        let hints = Hints { recognizer, ..Hints::of(self.scene) };
        let own = top_of(skeleton, &self.recognition).filter(|_| self.recognition.is_body());
        let Some(own) = own else { return Vec::new() };
        let mut tops = vec![own];
        tops.extend(others(self.scene, &self.rest, &self.recognition, &hints));
        let holds_another = |joint: usize, character: usize| {
            tops.iter().any(|top| *top != character && skeleton.is_ancestor_or_self(joint, *top))
        };
        let highest = |character: &usize| {
            let above = std::iter::successors(Some(*character), |joint| skeleton.parent(*joint));
            above.take_while(|joint| !holds_another(*joint, *character)).last().unwrap_or(*character)
        };
        tops.iter().map(highest).collect()
    }
}

/// Whether each joint is outside of the character that the spec names; empty where it names none.
pub(super) fn outside_of_character(
    name: &'static str,
    skeleton: &Skeleton,
    spec: &RigSpec,
) -> Result<Vec<bool>, SpecError> {
    let Some(character) = &spec.character else { return Ok(Vec::new()) };
    match find_joint(skeleton, name, character, &format!("/{name}/character")) {
        Ok(top) => Ok((0..skeleton.len()).map(|joint| !skeleton.is_ancestor_or_self(top, joint)).collect()),
        Err(_) if character == ALL_CHARACTERS => {
            let detail = "every character at once is only moved where one clip is retargeted onto a target";
            let field = SpecField::new(SpecErrorKind::InvalidValue, format!("/{name}/character"), detail);
            Err(SpecError::from_fields(vec![field])
                .unwrap_or_else(|| SpecError::new(SpecErrorKind::InvalidValue, detail, "")))
        }
        Err(field) => SpecError::from_fields(vec![field]).map_or_else(|| Ok(Vec::new()), Err),
    }
}

/// Says which character is taken where the file holds several and the spec names none.
pub(super) fn warn_of_others(
    name: &'static str,
    scene: &Scene,
    rest: &ModelPose,
    taken: &Recognition,
    hints: &Hints<'_>,
    reporter: &mut Reporter,
) {
    let others = others(scene, rest, taken, hints);
    let Some(top) = top_of(&scene.skeleton, taken).filter(|_| !others.is_empty()) else { return };
    let label = |joint: usize| format!("'{}'", scene.skeleton.label(joint));
    let others: Vec<String> = others.into_iter().map(label).collect();
    reporter.warn(
        "several_characters",
        name,
        format!("the file holds {} characters: {} is taken, not {}", others.len() + 1, label(top), others.join(", ")),
        format!("choose one with {name}.character, or \"{ALL_CHARACTERS}\" of them in a retarget"),
    );
}

/// The topmost joints of the other characters, in the order in which they would be taken.
fn others(scene: &Scene, rest: &ModelPose, taken: &Recognition, hints: &Hints<'_>) -> Vec<usize> {
    let skeleton = &scene.skeleton;
    let mut excluded = vec![false; skeleton.len()];
    let mut seen = vec![taken.clone()];
    let mut found = Vec::new();
    while let Some(top) = seen.last().filter(|last| last.is_body()).and_then(|last| top_of(skeleton, last)) {
        for (joint, excluded) in excluded.iter_mut().enumerate() {
            *excluded |= skeleton.is_ancestor_or_self(top, joint);
        }
        let left = excluded.iter().filter(|excluded| !**excluded).count();
        if left < FEWEST_JOINTS || found.len() + 1 >= MAX_CHARACTERS {
            break;
        }
        let next = recognize(skeleton, rest, &Hints { excluded: &excluded, ..*hints });
        let is_other = next.is_body() && !next.by_shape && seen.iter().all(|before| !lie_together(before, &next, rest));
        if is_other {
            found.extend(top_of(skeleton, &next));
        }
        seen.push(next);
    }
    found.retain(|top| scene.hidden_joints.binary_search(top).is_err());
    found
}

/// The joint that all limbs and the trunk of a body hang from.
fn top_of(skeleton: &Skeleton, recognition: &Recognition) -> Option<usize> {
    let of_body = recognition.roles.iter().filter(|(role, _)| role.part != Part::Root);
    let mut joints = of_body.flat_map(|(_, finding)| finding.joints.iter().copied());
    let first = joints.next()?;
    joints.try_fold(first, |top, joint| {
        let mut above = Some(top);
        while let Some(candidate) = above.filter(|candidate| !skeleton.is_ancestor_or_self(*candidate, joint)) {
            above = skeleton.parent(candidate);
        }
        above
    })
}

/// Whether two bodies are layers of one: the joints that mean the same lie in the same places.
fn lie_together(one: &Recognition, other: &Recognition, rest: &ModelPose) -> bool {
    let place = |joint: usize| rest.transforms()[joint].translation;
    let both = one.roles.iter().filter_map(|(role, finding)| {
        let twin = other.roles.get(role)?;
        (role.part != Part::Root).then(|| (place(finding.joints[0]), place(twin.joints[0])))
    });
    let pairs: Vec<(DVec3, DVec3)> = both.collect();
    let (low, high) = pairs
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (place, _)| (low.min(*place), high.max(*place)));
    let apart = pairs.iter().map(|(one, other)| one.distance(*other)).sum::<f64>();
    !pairs.is_empty() && apart <= SAME_PLACE_SHARE * (high - low).length() * pairs.len() as f64
}
