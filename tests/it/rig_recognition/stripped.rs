//! Real rigs with all names taken away: the shape alone must say what their joints mean.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use retargetd::{
    formats::{self, Limits},
    model::{Control, Joint, ModelPose, Reporter, Scene, Skeleton, Transform},
    rig::{Hints, Part, Recognition, Rig, RigKind, RigSpec, Role, RoleFinding, Side, recognize},
};

use crate::support::{corpus_file, files_below};

/// Limbs, spine and head: what must be right without names.
const COUNTED: [Part; 11] = [
    Part::Pelvis,
    Part::Spine,
    Part::Neck,
    Part::Head,
    Part::UpperArm,
    Part::Forearm,
    Part::Hand,
    Part::Thigh,
    Part::Shin,
    Part::Foot,
    Part::Clavicle,
];

/// A file of the corpus that holds a skeleton.
pub(super) struct Sample {
    pub(super) path: String,
    pub(super) scene: Scene,
}

/// Every file of the corpus that holds a character, but for those that are made to be broken.
pub(super) fn samples() -> Vec<Sample> {
    let Some(root) = corpus_file("README.md").and_then(|file| file.parent().map(std::path::Path::to_owned)) else {
        return Vec::new();
    };
    let is_rig = |path: &str| {
        let ending = path.rsplit('.').next().unwrap_or_default();
        !["hostile/", "fbx-semantics/", "animated-drawings/"].iter().any(|folder| path.starts_with(folder))
            && ["glb", "gltf", "fbx", "bvh", "vrm", "vrma"].contains(&ending)
    };
    let mut found = Vec::new();
    for file in files_below(&root) {
        let path = file.strip_prefix(&root).expect("below it").to_string_lossy().replace('\\', "/");
        if !is_rig(&path) {
            continue;
        }
        let bytes = std::fs::read(&file).expect("a file of the corpus can be read");
        let read = formats::sniff(&bytes, &path).and_then(|format| {
            formats::read(&bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new())
        });
        // glTF with files beside it is read elsewhere.
        if let Ok(scene) = read
            && !scene.skeleton.is_empty()
        {
            found.push(Sample { path, scene });
        }
    }
    found
}

/// The same skeleton with joints that are called `joint_0`, `joint_1` and so on, which rests where `positions` say.
fn stripped(skeleton: &Skeleton, positions: &[DVec3]) -> (Skeleton, ModelPose) {
    let joint = |(index, joint): (usize, &Joint)| {
        let above = joint.parent.map_or(DVec3::ZERO, |parent| positions[parent]);
        let rest = Transform::from_translation(positions[index] - above);
        Joint { name: format!("joint_{index}"), rest, ..joint.clone() }
    };
    let joints = skeleton.joints().iter().enumerate().map(joint).collect();
    let skeleton = Skeleton::new(joints).expect("names do not matter");
    let rest = skeleton.rest_pose().to_model(&skeleton);
    (skeleton, rest)
}

fn positions(pose: &ModelPose) -> Vec<DVec3> {
    pose.transforms().iter().map(|transform| transform.translation).collect()
}

/// What is seen of a skeleton without names.
fn seen(skeleton: &Skeleton, positions: &[DVec3]) -> Recognition {
    let (skeleton, rest) = stripped(skeleton, positions);
    recognize(&skeleton, &rest, &Hints::default())
}

fn joints(recognition: &Recognition) -> BTreeMap<Role, Vec<usize>> {
    let counted = recognition.roles.iter().filter(|(role, _)| COUNTED.contains(&role.part));
    counted.map(|(role, finding)| (*role, finding.joints.clone())).collect()
}

/// Whether a role without names is what it is with them: the same first joint, and all of the spine.
fn is_right(role: Role, named: &[usize], seen: Option<&Vec<usize>>) -> bool {
    seen.is_some_and(|seen| if role.part == Part::Spine { seen == named } else { seen[0] == named[0] })
}

#[test]
#[expect(clippy::print_stdout, reason = "the table is for people, where they ask for it")]
fn nine_of_ten_roles_of_skinned_bipeds_are_right_without_names() {
    let (mut right, mut all, mut sure, mut sure_right) = (0, 0, 0, 0);
    let mut table = Vec::new();
    for Sample { path, scene } in samples().iter().filter(|sample| !sample.scene.skins.is_empty()) {
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        if rig.recognition.kind != RigKind::Biped || rig.recognition.by_shape {
            continue;
        }
        let seen = seen(&scene.skeleton, &positions(&rig.rest));
        let by_role = joints(&seen);
        let named = joints(&rig.recognition);
        let wrong: Vec<String> = named
            .iter()
            .filter(|(role, joints)| !is_right(**role, joints, by_role.get(role)))
            .map(|(role, _)| role.to_string())
            .collect();
        for (role, finding) in seen.roles.iter().filter(|(role, _)| COUNTED.contains(&role.part)) {
            if finding.confidence > 0.8 {
                sure += 1;
                sure_right += usize::from(named.get(role).is_some_and(|named| named[0] == finding.joints[0]));
            }
        }
        right += named.len() - wrong.len();
        all += named.len();
        table.push(format!("{:2} of {:2}  {path}  {}", named.len() - wrong.len(), named.len(), wrong.join(", ")));
    }
    if all == 0 {
        return;
    }
    let table = table.join("\n");
    println!("{table}\n{right} of {all}; {sure_right} of {sure} with confidence above 0.8");
    assert!(right as f64 >= 0.94 * all as f64, "{right} of {all} roles are right:\n{table}");
    assert!(sure_right as f64 >= 0.995 * sure as f64, "{sure_right} of {sure} sure ones are right:\n{table}");
}

#[test]
fn shape_does_not_depend_on_axes_unit_or_place() {
    let turn = DQuat::from_euler(glam::EulerRot::YXZ, 2.5, 1.2, -0.4);
    let changes: [(&str, DQuat, f64); 4] = [
        ("Z up", DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2), 1.0),
        ("facing back", DQuat::from_rotation_y(std::f64::consts::PI), 1.0),
        ("centimeters", DQuat::IDENTITY, 100.0),
        ("leaning, in inches", turn, 39.37),
    ];
    let files = ["unreal/makehuman_game_engine_tpose.glb", "unreal/ue4_names_apose.glb", "decentraland/walk.glb"];
    for Sample { path, scene } in samples().iter().filter(|sample| files.contains(&sample.path.as_str())) {
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let places = positions(&rig.rest);
        let expected = joints(&seen(&scene.skeleton, &places));
        assert!(expected.len() > 15, "{path}: a body: {expected:?}");
        for (what, rotation, scale) in changes {
            let moved = places.iter().map(|place| rotation * *place * scale + DVec3::new(3.0, 7.0, -2.0));
            let seen = joints(&seen(&scene.skeleton, &moved.collect::<Vec<_>>()));
            assert_eq!(seen, expected, "{path}: {what}");
        }
    }
}

#[test]
fn shape_is_seen_in_every_rest_pose() {
    let file = "unreal/makehuman_game_engine_tpose.glb";
    for Sample { path, scene } in samples().iter().filter(|sample| sample.path == file) {
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let skeleton = &scene.skeleton;
        let expected = joints(&seen(skeleton, &positions(&rig.rest)));
        for degrees in [-30.0_f64, 20.0, 45.0, 80.0] {
            let mut places = positions(&rig.rest);
            for side in Side::BOTH {
                let shoulder = rig.recognition.roles[&Role::new(side, Part::UpperArm)].joints[0];
                let sign = if side == Side::Left { -1.0 } else { 1.0 };
                let turn = DQuat::from_rotation_z(sign * degrees.to_radians());
                let center = places[shoulder];
                for (joint, place) in places.iter_mut().enumerate() {
                    if skeleton.is_ancestor_or_self(shoulder, joint) {
                        *place = center + turn * (*place - center);
                    }
                }
            }
            let seen = joints(&seen(skeleton, &places));
            assert_eq!(seen, expected, "{path}: arms {degrees} degrees down");
        }
    }
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are for people, where they ask for them")]
fn eyes_jaws_and_bones_of_the_palm_that_are_seen_are_there() {
    const SEEN: [Part; 6] = [
        Part::Eye,
        Part::Jaw,
        Part::IndexMetacarpal,
        Part::MiddleMetacarpal,
        Part::RingMetacarpal,
        Part::PinkyMetacarpal,
    ];
    let (mut right, mut wrong, mut invented, mut missed) = (0, Vec::new(), Vec::new(), 0);
    for Sample { path, scene } in samples() {
        let rig = Rig::new("source", &scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        if rig.recognition.kind != RigKind::Biped || rig.recognition.by_shape {
            continue;
        }
        let seen = seen(&scene.skeleton, &positions(&rig.rest));
        let label = |finding: &RoleFinding| scene.skeleton.label(finding.joints[0]);
        for (role, finding) in seen.roles.iter().filter(|(role, _)| SEEN.contains(&role.part)) {
            match rig.recognition.roles.get(role) {
                Some(named) if named.joints[0] == finding.joints[0] => right += 1,
                Some(named) => wrong.push(format!("{path}: {role} is {}, not {}", label(finding), label(named))),
                None => invented.push(format!("{path}: {role} is {}", label(finding))),
            }
            assert!(finding.confidence < 0.8, "{path}: {role} is but a guess");
        }
        let named = rig.recognition.roles.keys().filter(|role| SEEN.contains(&role.part));
        missed += named.filter(|role| !seen.roles.contains_key(role)).count();
    }
    println!("{right} right, {missed} not seen\nwrong: {wrong:#?}\nnot named so: {invented:#?}");
    let all = right + wrong.len() + invented.len();
    assert!(right * 10 >= 9 * all, "{right} of {all} are right:\n{}\n{}", wrong.join("\n"), invented.join("\n"));
}
