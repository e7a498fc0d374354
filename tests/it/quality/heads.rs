//! Heads that are held otherwise at rest: a face looks where the source's looks.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Joint, Scene, Skeleton, SkinPoint, SkinPoints},
    retarget::RetargetSpec,
    rig::{HowAligned, RollCue},
    samples,
};

use super::{
    figure::{Figure, degrees_between, rotation, world},
    made_rigs::{MadeRig, clip_of, retargeted},
};
use crate::support::corpus_file;

/// Where the eyes are, from the head's joint.
const EYE: DVec3 = DVec3::new(0.032, 0.08, 0.095);

/// The mannequin with a head of its own: an egg with eyes at half its height, or without.
fn with_head(has_eyes: bool) -> Scene {
    let mut rig = MadeRig::of(&samples::mannequin_scene());
    let head = rig.place("head");
    if has_eyes {
        rig = rig.with("eye_l", "head", head + EYE).with("eye_r", "head", head + EYE * DVec3::new(-1.0, 1.0, 1.0));
    }
    let mut scene = rig.scene(|_| false);
    let joint = scene.skeleton.find("head").expect("a head");
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let own = model.transforms()[joint].rotation.conjugate();
    let mut entries = Vec::new();
    for ring in 0..=13 {
        for step in 0..24 {
            let (height, angle) = (f64::from(ring) / 6.5 - 1.0, f64::from(step) * std::f64::consts::TAU / 24.0);
            let width = (1.0 - height * height).sqrt();
            let point = DVec3::new(0.075 * width * angle.sin(), 0.08 + 0.115 * height, 0.095 * width * angle.cos());
            entries.push((joint as u32, SkinPoint { position: (own * point).as_vec3(), weight: 1.0 }));
        }
    }
    scene.skin_points = SkinPoints::new(scene.skeleton.len(), &entries);
    scene
}

/// The same scene with its head turned at rest, in the model.
fn held(scene: &Scene, head: usize, turn: DQuat) -> Scene {
    turned(scene, head, |parent, rest| parent.conjugate() * turn * parent * rest)
}

fn turned(scene: &Scene, head: usize, rest: impl Fn(DQuat, DQuat) -> DQuat) -> Scene {
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let joints = scene.skeleton.joints().iter().enumerate().map(|(index, joint)| {
        let mut joint: Joint = joint.clone();
        if index == head {
            let parent = model.transforms()[joint.parent.expect("a neck")].rotation;
            joint.rest.rotation = rest(parent, joint.rest.rotation).normalize();
        }
        joint
    });
    let skeleton = Skeleton::new(joints.collect()).expect("a skeleton");
    let (axes, unit_meters, skin_points) = (scene.axes, scene.unit_meters, scene.skin_points.clone());
    Scene { skeleton, axes, unit_meters, skin_points, ..Scene::default() }
}

/// How far a face is turned in the result from one that looks straight ahead, when the source turns its head by `nod` in the model:
/// `face` is how the target's looks at rest.
fn face(
    target: &Scene,
    head: usize,
    face: DQuat,
    nod: DQuat,
    align: &str,
) -> (DQuat, HowAligned, Option<(RollCue, RollCue)>) {
    let source = samples::walk_scene();
    let model = source.skeleton.rest_pose().to_model(&source.skeleton);
    let at_rest = model.transforms()[source.skeleton.find("mixamorig:Head").expect("a head")].rotation;
    let own = at_rest.conjugate() * nod * at_rest;
    let clip = clip_of(&source, 1, |name, _| (name == "mixamorig:Head").then_some(own));
    let spec: RetargetSpec = serde_json::from_value(serde_json::json!({ "align": align })).expect("a spec");
    let (result, resolved, _) = retargeted(&spec, &source, &clip, target).expect("a retarget");
    let posed = rotation(&world(&target.skeleton, Some((&result, 0))), head);
    let rest = rotation(&world(&target.skeleton, None), head);
    let told = resolved.alignment.iter().find(|joint| joint.name == "head").expect("a head");
    (posed * rest.conjugate() * face, told.how, told.roll_from)
}

fn rotations() -> [DQuat; 4] {
    let degrees = |degrees: f64| degrees.to_radians();
    [
        DQuat::IDENTITY,
        DQuat::from_rotation_x(degrees(20.0)),
        DQuat::from_rotation_x(degrees(-25.0)),
        DQuat::from_rotation_y(degrees(30.0)) * DQuat::from_rotation_x(degrees(10.0)),
    ]
}

#[test]
fn a_head_that_looks_elsewhere_at_rest_looks_where_the_source_s_does() {
    let level = with_head(true);
    let head = level.skeleton.find("head").expect("a head");
    let nod = DQuat::from_rotation_y(0.5) * DQuat::from_rotation_x(0.3);
    for turn in rotations() {
        let target = held(&level, head, turn);
        for align in ["auto", "full"] {
            let (found, how, cues) = face(&target, head, turn, nod, align);
            let off = degrees_between(found, nod);
            assert!(off < 4.0, "{align}, {turn}: the face is {off:.2}° off");
            assert_eq!(how == HowAligned::Full, align == "full" || turn != DQuat::IDENTITY, "{align}, {turn}");
            assert_eq!(cues, Some((RollCue::Convention, RollCue::Eyes)), "what it was found from");
        }
        let (found, ..) = face(&target, head, turn, nod, "off");
        assert!(degrees_between(found, nod * turn) < 0.01, "not aligned, it looks as far off as at rest");
    }
}

#[test]
fn eyes_in_a_mesh_tell_how_far_a_head_looks_down() {
    let files = [
        "mixamo/gltf/Xbot.glb",
        "mixamo/fbx/samba_dancing_skin.fbx",
        "readyplayerme/rpm_avatar.fbx",
        "readyplayerme/rpm_avatar_a.glb",
        "biped/rocketbox_male_adult_01.fbx",
    ];
    for path in files.iter().filter_map(|path| corpus_file(path)) {
        let figure = Figure::read(&path);
        let head = *figure.roles.get("head").expect("a head");
        for degrees in [-40.0_f64, 0.0, 40.0] {
            let turn = DQuat::from_rotation_x(degrees.to_radians());
            let target = held(&figure.scene, head, turn);
            let (found, how, _) = face(&target, head, turn, DQuat::IDENTITY, "auto");
            let off = degrees_between(found, DQuat::IDENTITY);
            let name = &figure.file_name;
            // Where the middle of a head is depends on its hair and its chin.
            assert!(off < 10.0 + degrees.abs() / 4.0, "{name}, {degrees}°: the face is {off:.2}° off");
            let wanted = if degrees == 0.0 { HowAligned::Kept } else { HowAligned::Full };
            assert_eq!(how, wanted, "{name}, {degrees}°: only what is plainly off is turned");
        }
    }
}

/// Hair and helmets are as much of a mesh as the face is.
#[test]
fn a_mesh_without_eyes_does_not_turn_a_head() {
    let turn = DQuat::from_rotation_x(35.0_f64.to_radians());
    let scene = with_head(false);
    let head = scene.skeleton.find("head").expect("a head");
    for align in ["auto", "full"] {
        let (found, how, cues) = face(&held(&scene, head, turn), head, turn, DQuat::IDENTITY, align);
        assert!(degrees_between(found, turn) < 0.01, "{align}: it stays as it is at rest");
        assert_eq!((how, cues), (HowAligned::Kept, None), "{align}: and nothing else is said");
    }
}

/// The joint is rolled, the face is not: the result is the same.
#[test]
fn the_axes_of_the_head_s_joint_do_not_matter() {
    let nod = DQuat::from_rotation_y(0.4);
    for has_eyes in [true, false] {
        let plain = with_head(has_eyes);
        let other = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -0.4, 1.1);
        let head = plain.skeleton.find("head").expect("a head");
        let mut target = turned(&plain, head, |_, rest| rest * other);
        // What hangs from the joint stays where it is.
        let joints = target.skeleton.joints().iter().map(|joint| {
            let mut joint = joint.clone();
            if joint.name.starts_with("eye_") {
                joint.rest.translation = other.conjugate() * joint.rest.translation;
            }
            joint
        });
        let points = plain.skin_points.of(head).iter().map(|point| {
            let position = other.conjugate().as_quat() * point.position;
            (head as u32, SkinPoint { position, ..*point })
        });
        let entries: Vec<(u32, SkinPoint)> = points.collect();
        target.skeleton = Skeleton::new(joints.collect()).expect("a skeleton");
        target.skin_points = SkinPoints::new(target.skeleton.len(), &entries);
        for align in ["auto", "direction", "full"] {
            let (wanted, ..) = face(&plain, head, DQuat::IDENTITY, nod, align);
            let (found, ..) = face(&target, head, DQuat::IDENTITY, nod, align);
            let off = degrees_between(found, wanted);
            assert!(off < 0.01, "{align}: {off:.4}°");
        }
    }
}
