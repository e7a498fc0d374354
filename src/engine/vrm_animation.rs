//! A clip of any rig as what a VRM animation holds: the turns of a humanoid whose rest pose is a T pose in which no bone is turned,
//! where its hips are, its expressions and its gaze.

use std::collections::BTreeSet;

use glam::{DQuat, Quat};

use crate::{
    editing::{Gaze, is_look, moved_morphs},
    formats::Humanoid,
    model::{Clip, Control, HumanoidBone, Morph, MorphPlace, MorphTrack, Reporter, Scene, Track, VRM_EXPRESSIONS},
    rig::{Align, MorphsSpec, PoseChoice, Rig, floors, map_morphs, missing_bones, morph_meaning, posed_target},
};

use super::{Failure, FailureCode, files::in_config};

/// Both eyes' at once, where the others have one for each.
const BLINK: &str = "blink";

/// The humanoid of a rig and what it does in a clip, in +Y up, +Z front and meters.
///
/// # Errors
/// When the rig has no hips; or when the work is canceled.
pub(super) fn to_vrm_humanoid(
    rig: &Rig<'_>,
    clip: &Clip,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<(Scene, Clip), Failure> {
    let bones = rig.humanoid_bones();
    if bones.first().is_none_or(|bone| bone.parent.is_some()) {
        let detail = "a VRM animation is one of a humanoid, and no pelvis was recognized";
        return Err(Failure::new(FailureCode::NothingToMap, detail)
            .in_part("target")
            .with_hint("name the joints in target.roles; 'retargetd inspect FILE' says what was recognized"));
    }
    report_missing(&bones, reporter);
    let figure = humanoid(rig, clip, &bones, reporter);
    let expressions = expressions(rig.scene, clip, reporter)?;
    Ok(figure.animation(clip, gaze(rig, clip), expressions, control)?)
}

fn report_missing(bones: &[HumanoidBone], reporter: &mut Reporter) {
    let missing = missing_bones(bones);
    if !missing.is_empty() {
        reporter.warn(
            "humanoid_bones_missing",
            "target",
            format!(
                "bones that every VRM has were not recognized and stand still in the output: {}",
                missing.join(", ")
            ),
            "name their joints in target.roles",
        );
    }
}

/// How the humanoid of a rig stands, in a T pose and in the clip.
fn humanoid<'a>(rig: &'a Rig<'a>, clip: &Clip, bones: &'a [HumanoidBone], reporter: &mut Reporter) -> Humanoid<'a> {
    let skeleton = rig.skeleton();
    let (canonical_from_scene, unit_meters) = (rig.canonical_from_scene, rig.unit_meters);
    // The T pose of a VRM is how its nodes stand, and so is its floor.
    if rig.scene.declared_convention.is_some_and(|convention| convention.starts_with("vrm")) {
        let t_pose = skeleton.rest_pose().to_model(skeleton);
        return Humanoid { skeleton, bones, t_pose, canonical_from_scene, unit_meters, raised_meters: (0.0, 0.0) };
    }
    let posed = posed_target(None, rig, PoseChoice::T, Align::default());
    let t_pose = posed.map_or_else(|| rig.rest.clone(), |posed| posed.pose.to_model(skeleton));
    let (at_rest, in_clip) = floors(rig, clip).unwrap_or_default();
    let raised = (-at_rest * rig.unit_meters, -in_clip * rig.unit_meters);
    if (raised.0 - raised.1).abs() > 0.01 {
        reporter.warn(
                "floor_guessed",
                "target",
                format!(
                    "the rest pose does not stand where the clip does; it was raised by {:.3} m and the clip by {:.3} m, so that the \
                     feet of both come down at zero",
                    raised.0, raised.1
                ),
                "send a target that stands on its origin at rest",
            );
    }
    Humanoid { skeleton, bones, t_pose, canonical_from_scene, unit_meters, raised_meters: raised }
}

/// The rotation of what looks where the eyes do, seen from the head.
fn gaze(rig: &Rig<'_>, clip: &Clip) -> Option<Track<Quat>> {
    let scene = rig.scene;
    let gaze = Gaze::of_eyes(rig, clip)
        .or_else(|| Gaze::of_gaze_joint(rig, clip))
        .or_else(|| Gaze::of_morphs(clip, &scene.morphs, &scene.look_at.unwrap_or_default()))?;
    let turn = |[left, right]: &[crate::editing::Look; 2]| {
        let (yaw, pitch) = (f64::midpoint(left.yaw, right.yaw), f64::midpoint(left.pitch, right.pitch));
        (DQuat::from_rotation_y(yaw) * DQuat::from_rotation_x(-pitch)).as_quat()
    };
    Some(Track::Sampled(gaze.frames.iter().map(turn).collect()).compacted())
}

/// Expressions that move, and their weights: those that the clip has, and those that the other shapes of the face stand for.
fn expressions(scene: &Scene, clip: &Clip, reporter: &mut Reporter) -> Result<(Vec<Morph>, Vec<MorphTrack>), Failure> {
    let expression = |name: &str| Morph { name: name.to_owned(), rest: 0.0, place: MorphPlace::Expression(Vec::new()) };
    let meaning = |track: &&MorphTrack| morph_meaning(&scene.morphs[track.morph].name);
    let moving = clip.morphs().iter().filter(|track| !meaning(track).is_some_and(is_look));
    let (own, mut shapes): (Vec<&MorphTrack>, Vec<&MorphTrack>) =
        moving.partition(|track| matches!(scene.morphs[track.morph].place, MorphPlace::Expression(_)));
    let mut named: Vec<Morph> = own.iter().map(|track| expression(&scene.morphs[track.morph].name)).collect();
    let mut tracks: Vec<MorphTrack> =
        own.iter().enumerate().map(|(morph, track)| MorphTrack { morph, weights: track.weights.clone() }).collect();
    // What an expression does to the meshes is there as weights of theirs as well.
    let bound = |track: &MorphTrack| match &scene.morphs[track.morph].place {
        MorphPlace::Expression(binds) => binds.clone(),
        MorphPlace::Mesh { .. } | MorphPlace::Weight | MorphPlace::Property => Vec::new(),
    };
    let done: BTreeSet<usize> = own.iter().flat_map(|track| bound(track)).map(|(morph, _)| morph).collect();
    shapes.retain(|track| !done.contains(&track.morph));

    let has_blink = shapes.iter().any(|track| meaning(track) == Some(BLINK));
    let is_there = |name: &str| named.iter().any(|own| own.name == name);
    let presets = VRM_EXPRESSIONS.iter().filter(|name| (**name != BLINK || has_blink) && !is_there(name));
    let targets: Vec<Morph> = presets.map(|name| Morph { place: MorphPlace::Weight, ..expression(name) }).collect();
    let animated: Vec<usize> = shapes.iter().map(|track| track.morph).collect();
    let mapping = map_morphs(&scene.morphs, &animated, &targets, &MorphsSpec::default()).map_err(in_config)?;
    if !mapping.unused.is_empty() {
        let mut lost: Vec<&str> = mapping.unused.iter().map(|morph| scene.morphs[*morph].name.as_str()).collect();
        lost.sort_unstable();
        lost.dedup();
        let detail = format!("no expression of VRM's shows what {} morphs do: {}", lost.len(), shortened(&lost));
        reporter.warn("morphs_not_written", "vrma", detail, "take a glTF format to have all morphs");
    }
    for track in moved_morphs(clip, &mapping, &scene.morphs, &targets) {
        tracks.push(MorphTrack { morph: named.len(), weights: track.weights });
        named.push(expression(&targets[track.morph].name));
    }
    Ok((named, tracks))
}

fn shortened(names: &[&str]) -> String {
    const MAX: usize = 12;
    let more = if names.len() > MAX { format!(" and {} more", names.len() - MAX) } else { String::new() };
    format!("{}{more}", names[..names.len().min(MAX)].join(", "))
}
