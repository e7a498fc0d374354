//! A clip of any rig as what a VRM animation holds: the turns of a humanoid whose rest pose is a T pose in which no bone is turned,
//! where its hips are, its expressions and its gaze.
//!
//! With `A` the rotation of a joint in model space in the T pose and `G` that in a frame, a bone turns by `N = W · G · A⁻¹ · W⁻¹` in the
//! axes of the format, where `W` turns the scene's axes into them; its own rotation is `Nₚ⁻¹ · N`. What joints between two bones
//! turn is in the lower bone. (VRMC_vrm_animation 1.0, "humanoid".)

use std::collections::BTreeSet;

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    editing::{Gaze, is_look, moved_morphs},
    model::{
        Axes, Clip, Control, Joint, JointTracks, ModelPose, Morph, MorphPlace, MorphTrack, Reporter, Scene, Skeleton,
        Track, Transform, VRM_EXPRESSIONS, rotation::next_to,
    },
    rig::{
        Align, HumanoidBone, MorphsSpec, PoseChoice, Rig, floors, map_morphs, missing_bones, morph_meaning,
        posed_target,
    },
};

use super::{Failure, FailureCode, files::in_config};

/// Both eyes' at once, where the others have one for each.
const BLINK: &str = "blink";
const FRAMES_PER_CHECK: usize = 64;

/// The humanoid of a rig and what it does in a clip, in +Y up, +Z front and metres.
///
/// # Errors
/// When the rig has no hips; or when the work is canceled.
pub(super) fn performance(
    rig: &Rig<'_>,
    clip: &Clip,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<(Scene, Clip), Failure> {
    let bones = rig.humanoid_bones();
    if bones.first().is_none_or(|bone| bone.parent.is_some()) {
        let detail = "a VRM animation is one of a humanoid, and no pelvis was recognised";
        return Err(Failure::new(FailureCode::NothingToMap, detail)
            .in_part("target")
            .with_hint("name the joints in target.roles; 'retargetd inspect FILE' says what was recognised"));
    }
    report_missing(&bones, reporter);
    let figure = Figure::new(rig, clip, &bones, reporter);
    let mut tracks = figure.tracks(clip, control)?;
    let mut joints = figure.joints();
    let gaze_joint = gaze(rig, clip).map(|rotation| {
        let rest = Transform::IDENTITY;
        joints.push(Joint { name: "lookAt".into(), parent: None, rest, is_joint: false, node: joints.len() });
        tracks.push(JointTracks { rotation, ..JointTracks::default() });
        joints.len() - 1
    });
    let (morphs, weights) = expressions(rig.scene, clip, reporter)?;
    let not_a_clip = |error: &dyn std::fmt::Display| Failure::new(FailureCode::Internal, error.to_string());
    let scene = Scene {
        skeleton: Skeleton::new(joints).map_err(|error| not_a_clip(&error))?,
        morphs,
        declared_roles: bones.iter().enumerate().map(|(index, bone)| (bone.name.clone(), index)).collect(),
        declared_convention: Some("vrma"),
        axes: Some(Axes::Y_UP_Z_FRONT),
        unit_metres: Some(1.0),
        gaze_joint,
        ..Scene::default()
    };
    let clip = Clip::new(clip.name().to_owned(), clip.times_seconds().to_vec(), tracks)
        .and_then(|clip| clip.with_morphs(weights))
        .map_err(|error| not_a_clip(&error))?;
    Ok((scene, clip))
}

fn report_missing(bones: &[HumanoidBone], reporter: &mut Reporter) {
    let missing = missing_bones(bones);
    if !missing.is_empty() {
        reporter.warn(
            "humanoid_bones_missing",
            "target",
            format!(
                "bones that every VRM has were not recognised and stand still in the output: {}",
                missing.join(", ")
            ),
            "name their joints in target.roles",
        );
    }
}

/// What is known of the humanoid before any frame.
struct Figure<'a> {
    rig: &'a Rig<'a>,
    bones: &'a [HumanoidBone],
    /// The T pose, in model space of the rig's scene.
    t_pose: ModelPose,
    /// How far the T pose and the clip are raised, in metres, so that the floor is at zero.
    raised: (f64, f64),
}

impl<'a> Figure<'a> {
    fn new(rig: &'a Rig<'a>, clip: &Clip, bones: &'a [HumanoidBone], reporter: &mut Reporter) -> Self {
        let skeleton = rig.skeleton();
        // The T pose of a VRM is how its nodes stand, and so is its floor.
        if rig.scene.declared_convention.is_some_and(|convention| convention.starts_with("vrm")) {
            return Self { rig, bones, t_pose: skeleton.rest_pose().to_model(skeleton), raised: (0.0, 0.0) };
        }
        let posed = posed_target(None, rig, PoseChoice::T, Align::default());
        let t_pose = posed.map_or_else(|| rig.rest.clone(), |posed| posed.pose.to_model(skeleton));
        let (at_rest, in_clip) = floors(rig, clip).unwrap_or_default();
        let raised = (-at_rest * rig.unit_metres, -in_clip * rig.unit_metres);
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
        Self { rig, bones, t_pose, raised }
    }

    fn position(&self, pose: &ModelPose, bone: &HumanoidBone) -> DVec3 {
        self.rig.work_from_scene * pose.transforms()[bone.joint].translation * self.rig.unit_metres
    }

    /// The bones as joints that are not turned.
    fn joints(&self) -> Vec<Joint> {
        let position = |bone: &HumanoidBone| self.position(&self.t_pose, bone) + DVec3::Y * self.raised.0;
        let joint = |(node, bone): (usize, &HumanoidBone)| {
            let parent = bone.parent.map_or(DVec3::ZERO, |parent| position(&self.bones[parent]));
            let rest = Transform::from_translation(position(bone) - parent);
            Joint { name: bone.name.clone(), parent: bone.parent, rest, is_joint: true, node }
        };
        self.bones.iter().enumerate().map(joint).collect()
    }

    fn tracks(&self, clip: &Clip, control: &Control) -> Result<Vec<JointTracks>, Failure> {
        let frames = clip.frame_count();
        let skeleton = self.rig.skeleton();
        let work = self.rig.work_from_scene;
        let undo: Vec<DQuat> = self
            .bones
            .iter()
            .map(|bone| self.t_pose.transforms()[bone.turned_by].rotation.conjugate() * work.conjugate())
            .collect();
        let mut turns: Vec<Vec<Quat>> = vec![Vec::with_capacity(frames); self.bones.len()];
        let mut hips: Vec<Vec3> = Vec::with_capacity(frames);
        let mut turned = vec![DQuat::IDENTITY; self.bones.len()];
        for frame in 0..frames {
            if frame % FRAMES_PER_CHECK == 0 {
                control.check()?;
            }
            let pose = clip.local_pose(skeleton, frame).to_model(skeleton);
            for (index, bone) in self.bones.iter().enumerate() {
                turned[index] = work * pose.transforms()[bone.turned_by].rotation * undo[index];
                let above = bone.parent.map_or(DQuat::IDENTITY, |parent| turned[parent].conjugate());
                let turn = (above * turned[index]).normalize().as_quat();
                let before: Option<Quat> = turns[index].last().copied();
                turns[index].push(next_to(turn, before));
            }
            hips.push((self.position(&pose, &self.bones[0]) + DVec3::Y * self.raised.1).as_vec3());
        }
        let rotation = |turns| JointTracks { rotation: Track::Sampled(turns).compacted(), ..JointTracks::default() };
        let mut tracks: Vec<JointTracks> = turns.into_iter().map(rotation).collect();
        tracks[0].translation = Track::Sampled(hips).compacted();
        Ok(tracks)
    }
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
    const MOST: usize = 12;
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    format!("{}{more}", names[..names.len().min(MOST)].join(", "))
}
