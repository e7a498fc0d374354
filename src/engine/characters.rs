//! Every character of a file at once: one pass for each, and their results as one clip.

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::{
    model::{Control, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{Measures, RetargetSpec, Verdict},
    rig::{ALL_CHARACTERS, Rig, RigSpec, SpecErrorKind, SpecField},
};

use super::{
    Failure, FailureCode,
    files::{Files, RigPair, in_config, one_field},
    knowledge::Knowledge,
    transfer::{MovedJoints, Transfer},
};

/// One of several characters that were moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CharacterView {
    /// Its topmost joint in the target.
    pub target: String,
    /// The topmost joint of the character of the source that moves it; absent where the source has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// How many of its joints are driven.
    pub driven_joints: usize,
    /// How well it went; absent when the spec asks for no measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What the verdict is about.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub verdict_reason: String,
}

/// A spec for one character.
pub(super) struct Part {
    pub(super) spec: RetargetSpec,
    /// The topmost joint in the target.
    top: usize,
}

/// A spec for each character, where a spec asks for all of them; else nothing.
///
/// # Errors
/// When it names joints of one of them, when the files have no characters, or not the same number.
pub(super) fn parts(spec: &RetargetSpec, files: &Files, knowledge: &Knowledge) -> Result<Vec<Part>, Failure> {
    let asks = |side: &RigSpec| side.character.as_deref() == Some(ALL_CHARACTERS);
    if !asks(&spec.source) && !asks(&spec.target) {
        return Ok(Vec::new());
    }
    check_names_none(spec)?;
    if !asks(&spec.target) {
        let detail = "all characters of the source can only move as many of the target";
        return Err(refused(
            "/source/character",
            detail,
            "set target.character to \"all\", too, or choose one of the source",
        ));
    }
    let targets = tops("target", &files.target.scene, &spec.target, knowledge)?;
    let sources =
        if asks(&spec.source) { Some(tops("source", &files.source.scene, &spec.source, knowledge)?) } else { None };
    if let Some(sources) = sources.as_ref().filter(|sources| sources.len() != targets.len()) {
        let detail = format!("the source has {} characters and the target {}", sources.len(), targets.len());
        return Err(refused("/source/character", detail, "choose one character of the source, or one of each"));
    }
    let name = |skeleton: &Skeleton, joint: usize| format!("#{}", skeleton.joints()[joint].node);
    let part = |(index, top): (usize, usize)| {
        let mut own = spec.clone();
        own.target.character = Some(name(&files.target.scene.skeleton, top));
        if let Some(sources) = &sources {
            own.source.character = Some(name(&files.source.scene.skeleton, sources[index]));
        }
        Part { spec: own, top }
    };
    Ok(targets.into_iter().enumerate().map(part).collect())
}

/// Refuses what can only be meant of one character.
fn check_names_none(spec: &RetargetSpec) -> Result<(), Failure> {
    let sides = [("source", &spec.source), ("target", &spec.target)];
    let of_a_side = |(name, side): (&str, &RigSpec)| {
        let given = [
            ("root", side.root.is_some()),
            ("ground", side.ground.is_some()),
            ("pose", !side.pose.is_empty()),
            ("keep_pose", !side.keep_pose.is_empty()),
            ("points_at", !side.points_at.is_empty()),
            ("chains", !side.chains.is_empty()),
            ("roles", !side.roles.is_empty()),
        ];
        let is_all = side.character.as_deref() == Some(ALL_CHARACTERS);
        let found = given.into_iter().find(|(_, given)| is_all && *given);
        found.map(|(field, _)| format!("/{name}/{field}"))
    };
    let whole = [("/map", spec.map.is_some()), ("/layer", spec.layer.is_some()), ("/tune", spec.tune.is_some())];
    let whole = whole.into_iter().find(|(_, given)| *given).map(|(field, _)| field.to_owned());
    match sides.into_iter().find_map(of_a_side).or(whole) {
        None => Ok(()),
        Some(pointer) => {
            let detail = format!("'{}' is about one character, and all of them are asked for", &pointer[1..]);
            Err(refused(&pointer, detail, "leave it out, or move one character after the other"))
        }
    }
}

fn tops(name: &'static str, scene: &Scene, spec: &RigSpec, knowledge: &Knowledge) -> Result<Vec<usize>, Failure> {
    let open = RigSpec { character: None, ..spec.clone() };
    let rig = Rig::with_recognizer(name, scene, None, &open, knowledge.recognizer(), &mut Reporter::new())
        .map_err(in_config)?;
    let tops = rig.characters(knowledge.recognizer());
    if tops.is_empty() {
        let detail = format!("no character was recognized in the {name} file");
        return Err(refused(&format!("/{name}/character"), detail, "leave it out, and name chains or roles"));
    }
    Ok(tops)
}

fn refused(pointer: &str, detail: impl Into<String>, hint: &str) -> Failure {
    in_config(one_field(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail))).with_hint(hint)
}

/// Moves the characters after the first, and puts everything together: the clip of all, the number of joints, and the measures of the
/// character that it went worst with. Gives what is told of each; nothing where there are no parts.
///
/// # Errors
/// When one of them cannot be moved, or the work is canceled.
pub(super) fn together(
    parts: &[Part],
    (files, knowledge): (&Files, &Knowledge),
    (leader, whole): (&Rig<'_>, &mut Transfer<'_>),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<CharacterView>, Failure> {
    let Some((first, others)) = parts.split_first() else { return Ok(Vec::new()) };
    let skeleton = &files.target.scene.skeleton;
    let mut joints = whole.clip.joints().to_vec();
    let mut views = vec![view(first, files, whole)];
    for part in others {
        let mut own = Reporter::new();
        let RigPair { spec, source, target } = files.sides(part.spec.clone(), knowledge, &mut own)?;
        let clip = files.choose_clip(&spec, &mut Reporter::new())?;
        let moved = MovedJoints::new(spec, (&source, &target), clip, control, &mut own)?.transfer;
        reporter.absorb(&skeleton.label(part.top), own);
        views.push(view(part, files, &moved));
        for (joint, tracks) in moved.clip.joints().iter().enumerate() {
            if skeleton.is_ancestor_or_self(part.top, joint) {
                joints[joint] = tracks.clone();
            }
        }
        // One source leads them all to one place; they stay as far from one another as they are at rest.
        if part.spec.source.character.as_deref() == first.spec.source.character.as_deref() {
            let track = &mut joints[part.top].translation;
            *track = moved_aside(track, &target, part.top, apart(leader, &target));
        }
        whole.driven_joints += moved.driven_joints;
        whole.measures = worse(whole.measures.take(), moved.measures);
    }
    let clip = whole.clip.clone().with_joints(joints);
    whole.clip = clip.map_err(|error| Failure::new(FailureCode::Internal, error.to_string()))?;
    Ok(views)
}

/// From where one figure stands at rest to where another does, level; in the scene's space.
fn apart(one: &Rig<'_>, other: &Rig<'_>) -> DVec3 {
    let place = |rig: &Rig<'_>| rig.role("pelvis").first().map(|joint| rig.rest.transforms()[*joint].translation);
    let between = place(one).zip(place(other)).map_or(DVec3::ZERO, |(one, other)| other - one);
    between - one.up() * between.dot(one.up())
}

/// The translations of the topmost joint of a figure that is moved as a whole; what it hangs from does not move.
fn moved_aside(track: &Track<Vec3>, rig: &Rig<'_>, top: usize, shift: DVec3) -> Track<Vec3> {
    let above = rig.skeleton().parent(top).map_or(Transform::IDENTITY, |parent| rig.rest.transforms()[parent]);
    let shift = above.rotation.conjugate() * shift / above.scale;
    match track {
        Track::Rest => Track::Constant((rig.skeleton().joints()[top].rest.translation + shift).as_vec3()),
        moving => moving.map(|place| (place.as_dvec3() + shift).as_vec3()),
    }
}

fn view(part: &Part, files: &Files, moved: &Transfer<'_>) -> CharacterView {
    let measures = moved.measures.as_ref();
    let label = |scene: &Scene, name: &str| {
        let node = name.strip_prefix('#').and_then(|node| node.parse::<usize>().ok());
        let joint = scene.skeleton.joints().iter().position(|joint| Some(joint.node) == node);
        joint.map_or_else(|| name.to_owned(), |joint| scene.skeleton.label(joint))
    };
    let source = part.spec.source.character.as_deref();
    CharacterView {
        target: files.target.scene.skeleton.label(part.top),
        source: source.map(|name| label(&files.source.scene, name)),
        driven_joints: moved.driven_joints,
        verdict: measures.map(|measures| measures.verdict),
        verdict_reason: measures.map_or_else(String::new, |measures| measures.verdict_reason.clone()),
    }
}

fn worse(one: Option<Measures>, other: Option<Measures>) -> Option<Measures> {
    match (one, other) {
        (Some(one), Some(other)) => {
            let rank = |measures: &Measures| (measures.verdict, measures.score);
            let is_worse = rank(&other).partial_cmp(&rank(&one)) == Some(std::cmp::Ordering::Greater);
            Some(if is_worse { other } else { one })
        }
        (one, other) => one.or(other),
    }
}
