//! The pose of a rest file, on the rig that it is for.
//!
//! A rest file says where joints are and how the body stands. It may come from another format, exporter or bone-axis convention, in
//! other axes and another unit, with its joints in another order, with joints more or less, so none of its local rotations is
//! taken over. Joints are matched, the file is turned into the rig's model space, and the rotations are solved for that bring the
//! rig's own bones, whose lengths stay, into the pose.
//!
//! | file | answers |
//! |---|---|
//! | `choice` | which pose of the rest file is meant |
//! | `names` | which joints have the same name |
//! | `matching` | which joints correspond: by name, by role, by how they hang together |
//! | `space` | how the space of the rest file lies against the rig's |
//! | `limbs` | where each bone points in the rest file |
//! | `orientation` | how joints are turned as a whole, where that can be told |
//! | `wahba` | the rotation that brings several directions onto others |
//! | `solve` | the rotations, parents before children |
//! | `standing` | where the joints are then, and how the feet stand |
//! | `fit` | what could not be represented, and what is refused |

mod choice;
mod fit;
mod limbs;
mod matching;
mod names;
mod orientation;
mod solve;
mod space;
mod standing;
mod wahba;

use glam::DQuat;

use crate::model::{LocalPose, ModelPose, Reporter, Scene};

use self::{
    choice::{Choice, choose},
    fit::{check_bodies, check_match, report},
    limbs::Limbs,
    matching::Matching,
    orientation::Laid,
    solve::solved,
    space::{congruent, rig_from_rest},
    standing::posed,
};
use super::{
    super::{
        error::SpecError,
        recognition::Recognizer,
        rig::Rig,
        spec::{RestRule, RestSpec, RigSpec},
    },
    RestSource,
    find::Rest,
    ground::put_onto_floor,
    rest_fit::RestFit,
};

/// A pose in which every bone points within this of the rig's own rest pose, and every joint is turned by no more, is that pose, in
/// degrees.
const SAME_DEGREES: f64 = 0.05;

/// Puts the pose of a rest file onto a rig. `rig` is measured from its own rest pose, without the edits of the spec.
///
/// # Errors
/// When the spec names a clip or frame that the rest file does not have, or when too little of the rig is in it.
pub(in crate::rig) fn uploaded(
    rig: &Rig<'_>,
    rest_scene: &Scene,
    spec: &RigSpec,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Result<(Rest, RestFit), SpecError> {
    let part = if rig.name == "source" { "source_rest" } else { "target_rest" };
    fit::check_skeleton(rig.name, rest_scene)?;
    let mut own = Reporter::new();
    let mut choice = choose(rig.name, rest_scene, &spec.rest, recognizer, &mut own)?;
    let mut rest = rig_in(part, rest_scene, &choice, recognizer, &mut own)?;
    let mut matching = Matching::find(rig, &rest);
    check_match(rig, &rest, &matching)?;
    let mut space = rig_from_rest(rig, &rest, &matching);
    if let Some(bind) = choice.bind.clone()
        && is_rig_itself(rig, &rest, &matching, &bind)
    {
        choice = Choice {
            pose: bind,
            reason: "the rest file is the rig itself, so the pose that its skins were bound in counts, as without it"
                .into(),
            doubt: None,
            ..choice
        };
        rest = rig_in(part, rest_scene, &choice, recognizer, &mut Reporter::new())?;
        matching = Matching::find(rig, &rest);
        space = rig_from_rest(rig, &rest, &matching);
    }
    check_bodies(rig, &rest, &matching)?;
    let first = Limbs::find(rig, &rig.rest, &matching, &rest.rest, space.rig_from_rest);
    matching.add_structure(rig, &rest, first.scale);
    let limbs = Limbs::find(rig, &rig.rest, &matching, &rest.rest, space.rig_from_rest);
    fit::check_limbs(rig, &limbs)?;

    let laid = Laid { rig, rest: &rest, matching: &matching, limbs: &limbs, rig_from_rest: space.rig_from_rest };
    let (from, known) = laid.orientations();
    let turns = solved(rig, &matching, &limbs, &known);
    let pose = if is_own(&limbs, &turns) { rig.rest_local.clone() } else { posed(&laid, &turns) };
    for warning in own.into_warnings() {
        if warning.code != "unit_guessed" {
            reporter.warn(warning.code, part, warning.detail, warning.hint);
        }
    }
    if let Some((detail, hint)) = choice.doubt {
        reporter.warn("rest_pose_chosen", part, detail, hint);
    }
    if space.is_facing_open {
        reporter.warn(
            "rest_facing_guessed",
            part,
            "the body of the rest file is turned aside and in itself; it is taken to be posed so, and to face as its file does",
            "turn the character to the front of its file if the pose comes out turned",
        );
    }
    let fit = report(&laid, from, &turns, reporter);
    let solve = spec.rest == RestSpec::Rule(RestRule::Solved);
    let rest = Rest {
        pose,
        source: if solve { RestSource::Solved } else { choice.source },
        reason: if solve { "the config asks for it".into() } else { format!("{}; {}", choice.reason, fit.in_words()) },
        spec: if solve { spec.rest.clone() } else { choice.spec },
        is_to_be_solved: solve,
    };
    Ok((rest, fit))
}

/// The rest file as a rig that rests in one of its poses.
fn rig_in<'a>(
    part: &'static str,
    scene: &'a Scene,
    choice: &Choice,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Result<Rig<'a>, SpecError> {
    let rest = Rest {
        pose: choice.pose.clone(),
        source: choice.source,
        reason: String::new(),
        spec: RestSpec::default(),
        is_to_be_solved: false,
    };
    let mut rig = Rig::at_rest(part, scene, rest, &RigSpec::default(), recognizer, reporter)?;
    put_onto_floor(&mut rig);
    Ok(rig)
}

/// Whether the rest file is the rig itself: its nodes stand as the rig's do, and its skins were bound as the rig's were, which is
/// what the rig is measured from.
fn is_rig_itself(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching, bind: &LocalPose) -> bool {
    if rig.rest_source != RestSource::Bind {
        return false;
    }
    let is_same = |own: &ModelPose, pose: &ModelPose| congruent(rig, own, pose, matching).is_some();
    let nodes = rig.skeleton().rest_pose().to_model(rig.skeleton());
    is_same(&nodes, &rest.rest) && is_same(&rig.rest, &bind.to_model(rest.skeleton()))
}

/// Whether nothing was turned.
fn is_own(limbs: &Limbs, turns: &[DQuat]) -> bool {
    let is_still = |turn: &DQuat| turn.angle_between(DQuat::IDENTITY).to_degrees() < SAME_DEGREES;
    turns.iter().all(is_still) && limbs.share_within(SAME_DEGREES) > 0.99
}
