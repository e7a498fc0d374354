//! Rest poses turned until they look alike, direction and roll; poses as files; the retarget-pose editor. What comes out is
//! looked at from outside: world matrices of what was written.

mod moments;

use glam::{DMat4, DQuat, DVec3, Quat};
use retargetd::{
    engine::{Format, Inputs, Limits, NamedBytes, Outcome, retarget},
    formats::{self, TargetClips, WriteOptions},
    model::{
        Clip, Control, Joint, JointTracks, ModelPose, Reporter, Scene, Skeleton, Skin, SkinPoint, SkinPoints, Track,
        Transform,
    },
    retarget::{Plan, Resolved, RetargetSpec, parse_value, resolve, run},
    rig::{HowAligned, RestSource, Rig, RollCue},
    samples,
};
use serde_json::{Value, json};

use crate::{
    quality::figure::{Figure, degrees_between, position, read_scene, rotation, world},
    support::corpus_file,
};

fn spec(document: Value) -> RetargetSpec {
    parse_value(document).expect("a valid spec")
}

fn rig<'a>(name: &'static str, scene: &'a Scene, spec: &RetargetSpec) -> Rig<'a> {
    let side = if name == "source" { &spec.source } else { &spec.target };
    Rig::new(name, scene, None, side, &mut Reporter::new()).expect("a rig")
}

fn resolved(source: &Scene, target: &Scene, clip: &Clip, spec: &RetargetSpec) -> Resolved {
    let (source, target) = (rig("source", source, spec), rig("target", target, spec));
    resolve(spec, &source, &target, clip, &mut Reporter::new()).expect("a mapping")
}

fn retargeted(source: &Scene, target: &Scene, clip: &Clip, spec: &RetargetSpec) -> Clip {
    let Resolved { mapping, .. } = resolved(source, target, clip, spec);
    run(&Plan::new(&source.skeleton, &target.skeleton, &mapping), clip, &Control::new()).expect("a result")
}

fn role(scene: &Scene, role: &str) -> usize {
    rig("source", scene, &RetargetSpec::default()).role(role)[0]
}

/// One frame: the rest pose, but for one joint that is turned in the model.
fn turned(scene: &Scene, joint: usize, turn: DQuat) -> Clip {
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let parent = scene.skeleton.parent(joint).map_or(DQuat::IDENTITY, |parent| model.transforms()[parent].rotation);
    let local = parent.conjugate() * turn * model.transforms()[joint].rotation;
    let tracks = |index: usize| JointTracks {
        rotation: if index == joint { Track::Constant(local.normalize().as_quat()) } else { Track::Rest },
        ..JointTracks::default()
    };
    Clip::new("turned".into(), vec![0.0], (0..scene.skeleton.len()).map(tracks).collect()).expect("a clip")
}

fn direction(world: &[glam::DMat4], from: usize, to: usize) -> DVec3 {
    (position(world, to) - position(world, from)).normalize()
}

/// The case of the Cinema 4D joint-table script: a forearm bent by 45° on a T pose, on a character whose rest is an A pose.
#[test]
fn a_forearm_bent_by_45_degrees_is_bent_by_45_degrees() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    for (side, sign) in [("left", -1.0), ("right", 1.0)] {
        let joint = |scene: &Scene, part: &str| role(scene, &format!("{side}_{part}"));
        let bend = DQuat::from_rotation_y(sign * 45.0_f64.to_radians());
        let clip = turned(&source, joint(&source, "forearm"), bend);
        let result = retargeted(&source, &target, &clip, &RetargetSpec::default());
        let from = world(&source.skeleton, Some((&clip, 0)));
        let to = world(&target.skeleton, Some((&result, 0)));
        for (start, end) in [("upper_arm", "forearm"), ("forearm", "hand")] {
            let wanted = direction(&from, joint(&source, start), joint(&source, end));
            let found = direction(&to, joint(&target, start), joint(&target, end));
            let degrees = wanted.angle_between(found).to_degrees();
            assert!(degrees < 1.0, "{side}_{start} is {degrees:.3}° off");
        }
        let fore =
            |scene: &Scene, world: &[glam::DMat4]| direction(world, joint(scene, "forearm"), joint(scene, "hand"));
        let straight = fore(&source, &world(&source.skeleton, None));
        let bent = fore(&target, &to);
        let degrees = straight.angle_between(bent).to_degrees();
        assert!((degrees - 45.0).abs() < 1.0, "{side}: the forearm is bent by {degrees:.2}° against the T pose");
        assert!(bent.z > 0.5, "{side}: forward");
    }
}

/// The same scene with one joint and all below it rolled at rest about the line to another joint.
fn rolled(scene: &Scene, from: usize, to: usize, degrees: f64) -> Scene {
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let place = |joint: usize| model.transforms()[joint].translation;
    let turn = DQuat::from_axis_angle((place(to) - place(from)).normalize(), degrees.to_radians());
    let parent = scene.skeleton.parent(from).map_or(DQuat::IDENTITY, |parent| model.transforms()[parent].rotation);
    let joints = scene.skeleton.joints().iter().enumerate().map(|(index, joint)| {
        let mut joint = joint.clone();
        if index == from {
            joint.rest.rotation = (parent.conjugate() * turn * parent * joint.rest.rotation).normalize();
        }
        joint
    });
    Scene {
        skeleton: Skeleton::new(joints.collect()).expect("a skeleton"),
        axes: scene.axes,
        unit_meters: scene.unit_meters,
        ..Scene::default()
    }
}

#[test]
fn a_palm_that_faces_elsewhere_at_rest_faces_as_the_source_s_does() {
    let source = samples::walk_scene();
    let target = samples::mannequin_scene();
    let (hand, middle) = (role(&target, "left_hand"), role(&target, "left_middle"));
    let clip = turned(&source, 0, DQuat::IDENTITY);
    let knuckles = |scene: &Scene, world: &[glam::DMat4]| {
        let across = direction(world, role(scene, "left_pinky"), role(scene, "left_index"));
        let along = direction(world, role(scene, "left_hand"), role(scene, "left_middle"));
        (across - along * across.dot(along)).normalize()
    };
    let wanted = knuckles(&source, &world(&source.skeleton, Some((&clip, 0))));
    for degrees in [0.0, 60.0, -90.0, 150.0] {
        let other = rolled(&target, hand, middle, degrees);
        let off = |align: &str| {
            let result = retargeted(&source, &other, &clip, &spec(json!({ "align": align })));
            knuckles(&other, &world(&other.skeleton, Some((&result, 0)))).angle_between(wanted).to_degrees()
        };
        assert!(off("full") < 0.5 && off("auto") < 0.5, "rolled by {degrees}°: {} {}", off("full"), off("auto"));
        assert!(
            degrees == 0.0 || off("direction") > degrees.abs() / 2.0,
            "the shortest way leaves it: {}",
            off("direction")
        );
    }
}

#[test]
fn what_is_left_is_told_by_joint() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let clip = &source.clips[0];
    let joint = |align: Value, name: &str| {
        let found = resolved(&source, &target, clip, &spec(align)).alignment;
        found.into_iter().find(|joint| joint.name == name).expect("the joint was compared")
    };
    let hand = joint(json!({}), "left_hand");
    assert_eq!(hand.how, HowAligned::Full, "knuckles on both sides");
    assert_eq!(hand.roll_from, Some((RollCue::Knuckles, RollCue::Knuckles)), "so it is told");
    assert!(hand.direction_degrees.is_some_and(|degrees| degrees < 1e-4), "{:?}", hand.direction_degrees);
    assert!(hand.roll_degrees.is_some_and(|degrees| degrees.abs() < 1e-4), "{:?}", hand.roll_degrees);
    let arm = joint(json!({"align": "off"}), "left_upper_arm");
    assert_eq!(arm.how, HowAligned::Off, "as asked");
    assert!(arm.direction_degrees.is_some_and(|degrees| (degrees - 45.0).abs() < 5.0), "T against A: {arm:?}");
    let kept = target.skeleton.label(role(&target, "left_upper_arm"));
    let arm = joint(json!({"target": {"keep_pose": [kept]}}), &kept);
    assert_eq!((arm.how, arm.turned_degrees), (HowAligned::Kept, 0.0), "it keeps its pose in model space");
}

#[test]
fn a_joint_points_at_what_the_spec_says() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let label = |scene: &Scene, name: &str| scene.skeleton.label(role(scene, name));
    let pointing = spec(json!({
        "source": {"points_at": {label(&source, "left_hand"): label(&source, "left_pinky")}},
        "target": {"points_at": {label(&target, "left_hand"): label(&target, "left_pinky")}},
    }));
    let rest = resolved(&source, &target, &source.clips[0], &pointing).mapping.target_rest;
    let place = |joint: usize| rest.transforms()[joint].translation;
    let found = (place(role(&target, "left_pinky")) - place(role(&target, "left_hand"))).normalize();
    let at_rest = world(&source.skeleton, None);
    let wanted = direction(&at_rest, role(&source, "left_hand"), role(&source, "left_pinky"));
    assert!(found.angle_between(wanted).to_degrees() < 0.01, "the little finger, not the middle one");
    let unknown = spec(json!({"target": {"points_at": {"no such joint": "hand_l"}}}));
    let error = Rig::new("target", &target, None, &unknown.target, &mut Reporter::new()).expect_err("no such joint");
    assert_eq!(error.fields[0].pointer, "/target/points_at/no such joint", "where");
}

/// A mitten: the hand has no fingers, and its mesh is a flat plate.
#[test]
fn a_hand_without_fingers_is_turned_by_its_mesh() {
    let mut target = samples::mannequin_scene();
    let hand = role(&target, "left_hand");
    let fingers: Vec<usize> = (0..target.skeleton.len())
        .filter(|joint| *joint != hand && target.skeleton.is_ancestor_or_self(hand, *joint))
        .collect();
    let middle = role(&target, "left_middle");
    let model = target.skeleton.rest_pose().to_model(&target.skeleton);
    let own = |joint: usize| {
        let hand = &model.transforms()[hand];
        hand.rotation.conjugate() * (model.transforms()[joint].translation - hand.translation)
    };
    let along = own(middle).normalize();
    let across = own(role(&target, "left_index")) - own(role(&target, "left_pinky"));
    let across = (across - along * across.dot(along)).normalize();
    // Bent off its bone by 20° and rolled by 30°.
    let tilt = DQuat::from_axis_angle(along, 30.0_f64.to_radians());
    let wide = tilt * across;
    let leaning = DQuat::from_axis_angle(across, 20.0_f64.to_radians()) * along;
    let mut entries = Vec::new();
    for step in 0..20 {
        for column in [-2.0, -1.0, 0.0, 1.0, 2.0] {
            let point = leaning * (0.01 * f64::from(step)) + wide * (0.02 * column);
            entries.push((hand as u32, SkinPoint { position: point.as_vec3(), weight: 1.0 }));
        }
    }
    let keep: Vec<Joint> = target
        .skeleton
        .joints()
        .iter()
        .enumerate()
        .filter(|(index, _)| !fingers.contains(index))
        .map(|(_, joint)| Joint {
            parent: joint.parent.map(|parent| parent - fingers.iter().filter(|finger| **finger < parent).count()),
            ..joint.clone()
        })
        .collect();
    target.skeleton = Skeleton::new(keep).expect("a skeleton");
    let hand = role(&target, "left_hand");
    for entry in &mut entries {
        entry.0 = hand as u32;
    }
    target.skin_points = SkinPoints::new(target.skeleton.len(), &entries);
    let source = samples::walk_scene();
    let full = spec(json!({"align": "full"}));
    let found = resolved(&source, &target, &source.clips[0], &full);
    let turn = found.mapping.target_rest.transforms()[hand].rotation;
    let at_rest = world(&source.skeleton, None);
    let wanted = direction(&at_rest, role(&source, "left_hand"), role(&source, "left_middle"));
    let pointing = (turn * leaning).angle_between(wanted).to_degrees();
    assert!(pointing < 1.0, "the plate points as the source's hand does: {pointing}°");
    let knuckles = direction(&at_rest, role(&source, "left_pinky"), role(&source, "left_index"));
    let knuckles = (knuckles - wanted * knuckles.dot(wanted)).normalize();
    let wide = (wide - leaning * wide.dot(leaning)).normalize();
    let off = (turn * wide).dot(knuckles).abs().min(1.0).acos().to_degrees();
    assert!(off < 2.0, "the plate lies flat, whichever way up: {off}°");
}

fn posed(name: &str, bytes: &[u8], to: &str, target: Value, format: Format) -> Outcome {
    let file = NamedBytes { name, bytes };
    let config = json!({"pose": {"to": to}, "target": target}).to_string();
    let config = NamedBytes { name: "config.json", bytes: config.as_bytes() };
    let inputs = Inputs {
        source: file,
        target: file,
        source_rest: None,
        target_rest: None,
        config: Some(config),
        formats: &[format],
    };
    retarget(&inputs, &Limits::default(), &Control::new()).expect("a pose")
}

/// Limbs with the direction that they have in a T pose, on the left; the right is its mirror image.
const LIMBS: [(&str, &str, DVec3); 5] = [
    ("upper_arm", "forearm", DVec3::X),
    ("forearm", "hand", DVec3::X),
    ("hand", "middle", DVec3::X),
    ("thigh", "shin", DVec3::NEG_Y),
    ("shin", "foot", DVec3::NEG_Y),
];

#[test]
fn characters_of_all_families_take_a_t_pose() {
    let files = [
        "unreal/ue4_names_apose.glb",
        "unreal/ue4_names_apose_zup_xfwd.fbx",
        "readyplayerme/rpm_avatar_a.glb",
        "vrm0/makehuman_body_vrm0.vrm",
        "vrm1/makehuman_body_vrm1.vrm",
        "biped/rocketbox_male_adult_01.fbx",
        "poser-daz/daz_g8_names_apose.glb",
        "rigify-blender/gdquest_sophia.glb",
        "character-creator/cc_base_idle.glb",
        "mixamo/gltf/Xbot.glb",
        "bvh/cmu/jumping_jacks_max_names.bvh",
    ];
    for path in files.iter().filter_map(|path| corpus_file(path)) {
        let figure = Figure::read(&path);
        let name = &figure.file_name;
        for (to, down) in [("t", 0.0_f64), ("a", 45.0)] {
            let outcome = posed(name, &figure.bytes, to, json!({}), Format::Glb);
            let scene = read_scene(&outcome.outputs[0].bytes, "pose.glb");
            let clip = &scene.clips[0];
            for pose in [world(&scene.skeleton, None), world(&scene.skeleton, Some((clip, 0)))] {
                let forward =
                    if name.contains("vrm0") { DQuat::from_rotation_y(std::f64::consts::PI) } else { DQuat::IDENTITY };
                for (start, end, wanted) in LIMBS {
                    for (side, mirror) in [("left", 1.0), ("right", -1.0)] {
                        let joint = |part: &str| {
                            let label = figure.skeleton().label(*figure.roles.get(&format!("{side}_{part}"))?);
                            (0..scene.skeleton.len()).find(|joint| scene.skeleton.label(*joint) == label)
                        };
                        let (Some(from), Some(to)) = (joint(start), joint(end)) else { continue };
                        let lowered = if wanted == DVec3::X {
                            DQuat::from_rotation_z(-down.to_radians())
                        } else {
                            DQuat::IDENTITY
                        };
                        let wanted = lowered * wanted * DVec3::new(mirror, 1.0, 1.0);
                        let wanted = if wanted.x.abs() > 0.1 {
                            DVec3::new(wanted.x.abs() * mirror, wanted.y, 0.0)
                        } else {
                            wanted
                        };
                        let degrees = direction(&pose, from, to).angle_between(forward * wanted).to_degrees();
                        assert!(degrees < 1.0, "{name} to {to:?}: {side}_{start} is {degrees:.2}° off");
                    }
                }
            }
        }
    }
}

#[test]
fn a_pose_can_be_edited() {
    let target = samples::mannequin_scene();
    let forearm = role(&target, "left_forearm");
    let name = target.skeleton.label(forearm);
    let before = world(&target.skeleton, None);
    let pose = |edits: Value| {
        let spec = spec(json!({"target": {"pose": edits}}));
        let rig = rig("target", &target, &spec);
        rig.rest.transforms()[forearm].rotation
    };
    let at_rest = rotation(&before, forearm);
    let model = pose(json!([{"edit": "rotate", "joint": name, "degrees": [0, 30, 0]}]));
    let wanted = DQuat::from_rotation_y(30.0_f64.to_radians()) * at_rest;
    assert!(degrees_between(model, wanted) < 1e-6, "about the character's own up");
    let local = pose(json!([{"edit": "rotate", "joint": name, "degrees": [10, 20, 30], "axes": "local"}]));
    let turn = DQuat::from_rotation_z(30.0_f64.to_radians())
        * DQuat::from_rotation_y(20.0_f64.to_radians())
        * DQuat::from_rotation_x(10.0_f64.to_radians());
    assert!(degrees_between(local, at_rest * turn) < 1e-6, "about its own X, then Y, then Z");
    let reset = pose(json!([
        {"edit": "rotate", "joint": name, "degrees": [10, 20, 30]}, {"edit": "reset", "joints": [name]}
    ]));
    assert!(degrees_between(reset, at_rest) < 1e-9, "taken back");

    let walk = samples::walk_scene();
    let from_clip = spec(json!({"source": {"pose": [{"edit": "from_clip", "clip": 0, "frame": 7}]}}));
    let edited = rig("source", &walk, &from_clip);
    let hand = role(&walk, "left_hand");
    let frame = world(&walk.skeleton, Some((&walk.clips[0], 7)));
    assert!(position(&frame, hand).distance(edited.rest.transforms()[hand].translation) < 1e-5, "as in that frame");
    let past = spec(json!({"source": {"pose": [{"edit": "from_clip", "clip": 0, "frame": 9999}]}}));
    let error = Rig::new("source", &walk, None, &past.source, &mut Reporter::new()).expect_err("past the end");
    assert_eq!(error.fields[0].pointer, "/source/pose/0/frame", "where");
    let endless = parse_value(json!({"target": {"pose": [{"edit": "rotate", "joint": "a", "degrees": [0, 1e9, 0]}]}}));
    assert_eq!(endless.expect_err("too far").fields[0].pointer, "/target/pose/0/degrees/1", "where");
}

/// Joints of a capture that has no rest pose: every offset lies along one axis.
#[test]
fn a_body_without_any_pose_gets_a_t_pose() {
    let walk = samples::walk_scene();
    let joints = walk.skeleton.joints().iter().map(|joint| {
        let mut joint = joint.clone();
        joint.rest.rotation = DQuat::IDENTITY;
        joint.rest.translation = DVec3::Y * joint.rest.translation.length();
        joint
    });
    let still = JointTracks { rotation: Track::Constant(Quat::IDENTITY), ..JointTracks::default() };
    let clip = Clip::new("still".into(), vec![0.0], vec![still; walk.skeleton.len()]).expect("a clip");
    let scene = Scene {
        skeleton: Skeleton::new(joints.collect()).expect("a skeleton"),
        clips: vec![clip],
        unit_meters: Some(1.0),
        ..Scene::default()
    };
    let mut reporter = Reporter::new();
    let rig = Rig::new("source", &scene, None, &RetargetSpec::default().source, &mut reporter).expect("a rig");
    assert!(reporter.warnings().iter().any(|warning| warning.code == "rest_pose_solved"), "it is said");
    assert_eq!((rig.rest_source.name(), rig.recognition.rest_pose.name()), ("solved", "T"), "a T pose");
    let place = |role: &str| rig.rest.transforms()[rig.role(role)[0]].translation;
    let limb = |from: &str, to: &str| (place(to) - place(from)).normalize();
    for (from, to, wanted) in [
        ("left_upper_arm", "left_forearm", DVec3::X),
        ("left_forearm", "left_hand", DVec3::X),
        ("right_upper_arm", "right_hand", DVec3::NEG_X),
        ("left_thigh", "left_foot", DVec3::NEG_Y),
        ("right_shin", "right_foot", DVec3::NEG_Y),
        ("spine", "neck", DVec3::Y),
    ] {
        let degrees = limb(from, to).angle_between(wanted).to_degrees();
        assert!(degrees < 1.0, "{from} is {degrees:.2}° off");
    }
}

/// Feet are on the floor by their mesh: a character that was modeled above it comes down.
#[test]
fn soles_count_and_not_joints() {
    let Some(path) = corpus_file("mixamo/gltf/Xbot.glb") else { return };
    let figure = Figure::read(&path);
    let lowest = |scene: &Scene, rest: &retargetd::model::ModelPose| {
        let heights = (0..scene.skeleton.len()).flat_map(|joint| {
            let transform = rest.transforms()[joint];
            scene.skin_points.of(joint).iter().map(move |point| transform.transform_point(point.position.as_dvec3()).y)
        });
        heights.fold(f64::INFINITY, f64::min)
    };
    let source = samples::walk_scene();
    let found = resolved(&source, &figure.scene, &source.clips[0], &RetargetSpec::default()).mapping.target_rest;
    let before = figure.scene.skeleton.rest_pose().to_model(&figure.scene.skeleton);
    let (before, after) = (lowest(&figure.scene, &before), lowest(&figure.scene, &found));
    assert!((before - after).abs() < 0.002, "the aligned pose stands where the rest pose does: {before} {after}");
}

/// Its nodes are a frame of a run, in which the pelvis is low.
#[test]
fn a_bind_pose_is_put_onto_the_floor() {
    let Some(path) = corpus_file("cc0-stylised/kenney_medium_maya.fbx") else { return };
    let scene = Figure::read(&path).scene;
    let rig = rig("target", &scene, &RetargetSpec::default());
    assert_eq!(rig.rest_source.name(), "bind", "it has one");
    let soles = ["left_foot", "left_toe", "right_foot", "right_toe"].iter().flat_map(|role| {
        let joint = rig.role(role)[0];
        let points = scene.skin_points.of(joint).iter().map(|point| point.position.as_dvec3());
        points.map(|point| rig.rest.transforms()[joint].transform_point(point).dot(rig.up())).collect::<Vec<f64>>()
    });
    let lowest = soles.fold(f64::INFINITY, f64::min) / rig.rest_height(rig.role("pelvis")[0]);
    assert!(lowest.abs() < 0.001, "{lowest}");
    let node = scene.skeleton.rest_pose().to_model(&scene.skeleton).transforms()[rig.role("pelvis")[0]].translation;
    assert!(node.dot(rig.up()) < rig.rest_height(rig.role("pelvis")[0]) * 0.95, "the nodes have it lower");
}

/// A dancer in the middle of a step, with one arm that the config moves and holds.
#[test]
fn a_real_character_is_edited_and_keeps_what_it_is_told() {
    let Some(path) = corpus_file("mixamo/fbx/samba_dancing_skin.fbx") else { return };
    let target = Figure::read(&path).scene;
    let (arm, other) = (role(&target, "left_upper_arm"), role(&target, "right_upper_arm"));
    let name = target.skeleton.label(arm);
    let edits = spec(json!({"target": {
        "pose": [
            {"edit": "from_clip", "clip": 1, "frame": 30},
            {"edit": "rotate", "joint": name, "degrees": [0, 0, 20]},
            {"edit": "reset", "joints": ["mixamorig:Head"]},
        ],
        "keep_pose": [name],
    }}));
    let frame = target.clips[1].local_pose(&target.skeleton, 30).to_model(&target.skeleton);
    let turned = DQuat::from_rotation_z(20.0_f64.to_radians()) * frame.transforms()[arm].rotation;
    let source = samples::walk_scene();
    let found = resolved(&source, &target, &source.clips[0], &edits);
    let rest = |joint: usize| found.mapping.target_rest.transforms()[joint].rotation;
    assert!(degrees_between(rest(arm), turned) < 1e-3, "as the edits leave it");
    let told = |joint: usize| found.alignment.iter().find(|told| told.joint == joint).expect("it is told");
    assert_eq!((told(arm).how, told(arm).turned_degrees), (HowAligned::Kept, 0.0), "held");
    assert!(told(other).turned_degrees > 10.0, "the other is turned from the dance");
    assert!(told(other).direction_degrees.is_some_and(|degrees| degrees < 1e-3), "to where the source's points");
    let head = role(&target, "head");
    let local = |pose: &retargetd::model::ModelPose| pose.to_local(&target.skeleton).transforms()[head].rotation;
    let edited = rig("target", &target, &edits).rest;
    let own = rig("target", &target, &RetargetSpec::default()).rest;
    assert!(degrees_between(local(&edited), local(&own)) < 1e-3, "the head is as it was on its neck");
}

/// Exporters end a hand somewhere, often a hair's breadth above the wrist: that is not where the hand points.
#[test]
fn a_stub_at_a_wrist_is_no_direction_of_a_hand() {
    let walk = samples::walk_scene();
    let hands = [role(&walk, "left_hand"), role(&walk, "right_hand")];
    let below =
        |joint: usize| hands.iter().any(|hand| joint != *hand && walk.skeleton.is_ancestor_or_self(*hand, joint));
    let model = walk.skeleton.rest_pose().to_model(&walk.skeleton);
    for (up, what) in [(0.001, "a stub"), (0.1, "a hand that stands up")] {
        let mut joints: Vec<Joint> = Vec::new();
        let mut place = vec![None; walk.skeleton.len()];
        for (index, joint) in walk.skeleton.joints().iter().enumerate().filter(|(index, _)| !below(*index)) {
            place[index] = Some(joints.len());
            joints.push(Joint { parent: joint.parent.and_then(|parent| place[parent]), ..joint.clone() });
        }
        for hand in hands {
            let mut end = Joint {
                name: "End".into(),
                parent: place[hand],
                is_joint: false,
                ..walk.skeleton.joints()[hand].clone()
            };
            end.rest.rotation = DQuat::IDENTITY;
            end.rest.translation = model.transforms()[hand].rotation.conjugate() * DVec3::Y * up;
            joints.push(end);
        }
        let source = Scene {
            skeleton: Skeleton::new(joints).expect("parents come first"),
            clips: Vec::new(),
            skins: Vec::new(),
            ..walk.clone()
        };
        let target = samples::mannequin_scene();
        let still = vec![JointTracks::default(); source.skeleton.len()];
        let still = Clip::new("still".into(), vec![0.0], still).expect("a clip");
        let Resolved { alignment, .. } = resolved(&source, &target, &still, &RetargetSpec::default());
        let of = |name: &str| alignment.iter().find(|joint| joint.name == name).map(|joint| joint.turned_degrees);
        let bent = of("left_hand").zip(of("left_forearm")).map_or(0.0, |(hand, forearm)| (hand - forearm).abs());
        assert!(bent < 30.0, "{what}: the hand is turned by {bent} degrees more than the forearm");
    }
}

#[test]
fn hands_of_an_animation_without_fingers_stay_in_line() {
    let Some(source) = corpus_file("vrma/idle_loop.vrma") else { return };
    let Some(target) = corpus_file("mixamo/gltf/Xbot.glb") else { return };
    let read =
        |path: &std::path::Path, name: &str| read_scene(&std::fs::read(path).expect("a file of the corpus"), name);
    let (source, target) = (read(&source, "idle.vrma"), read(&target, "xbot.glb"));
    let result = retargeted(&source, &target, &source.clips[0], &RetargetSpec::default());
    let pose = result.local_pose(&target.skeleton, 0).to_model(&target.skeleton);
    let at = |name: &str| pose.transforms()[role(&target, name)].translation;
    for side in ["left", "right"] {
        let [elbow, wrist, knuckle] = ["forearm", "hand", "middle"].map(|part| at(&format!("{side}_{part}")));
        let bent = (wrist - elbow).angle_between(knuckle - wrist).to_degrees();
        assert!(bent < 40.0, "the {side} hand is bent by {bent} degrees");
    }
}
