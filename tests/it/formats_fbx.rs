//! The FBX reader, on files of the corpus and on text made here.

use std::{
    f64::consts::{FRAC_PI_2, PI},
    path::{Path, PathBuf},
};

use glam::{DMat4, DQuat, DVec3};
use retargetd::{
    formats::{self, ErrorKind, Format, FormatError, Limit, Limits},
    model::{Axes, Clip, Control, Reporter, Scene, Warning},
};

use crate::support::{corpus_file, shared_folder};

fn read_with(bytes: &[u8], limits: &Limits) -> (Result<Scene, FormatError>, Vec<Warning>) {
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, Format::Fbx, limits, &Control::new(), &mut reporter);
    (scene, reporter.into_warnings())
}

fn read(bytes: &[u8]) -> Result<Scene, FormatError> {
    read_with(bytes, &Limits::default()).0
}

fn corpus(path: &str) -> Option<Scene> {
    let bytes = std::fs::read(corpus_file(path)?).expect("the file can be read");
    Some(read(&bytes).unwrap_or_else(|error| panic!("{path}: {error}")))
}

/// All files of that ending below a folder of the corpus; empty where the corpus is not there.
fn files_below(folder: &str, ending: &str) -> Vec<PathBuf> {
    let Some(folder) = corpus_file(folder) else { return Vec::new() };
    let (mut open, mut files) = (vec![folder], Vec::new());
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending)) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn short(path: &Path) -> String {
    path.strip_prefix(shared_folder().join("corpus")).unwrap_or(path).display().to_string()
}

mod oracle {
    //! The parser's own world matrices, with scale inheritance done by the parser.

    use super::*;

    pub(super) fn load(bytes: &[u8]) -> ufbx::SceneRoot {
        let options = ufbx::LoadOpts {
            target_axes: ufbx::CoordinateAxes::right_handed_y_up(),
            target_unit_meters: 1.0,
            space_conversion: ufbx::SpaceConversion::ModifyGeometry,
            pivot_handling: ufbx::PivotHandling::AdjustToPivot,
            ..ufbx::LoadOpts::default()
        };
        ufbx::load_memory(bytes, options).expect("the parser reads it")
    }

    /// The worst distance of our joints from the parser's nodes as a part of the size, and the worst difference of axes.
    pub(super) fn compare(ours: &Scene, clip: Option<(&Clip, usize)>, theirs: &ufbx::Scene) -> (f64, f64) {
        let local = match clip {
            Some((clip, frame)) => clip.local_pose(&ours.skeleton, frame),
            None => ours.skeleton.rest_pose(),
        };
        let model = local.to_model(&ours.skeleton);
        let worlds = worlds(theirs);
        assert_eq!(worlds.len(), model.transforms().len(), "as many nodes");
        let size = worlds.iter().map(|world| world.w_axis.truncate().length()).fold(1e-9, f64::max);
        let mut worst = (0.0_f64, 0.0_f64);
        for (mine, world) in model.transforms().iter().zip(worlds) {
            let mine = mine.to_matrix();
            worst.0 = worst.0.max(mine.w_axis.truncate().distance(world.w_axis.truncate()) / size);
            for axis in 0..3 {
                let (a, b) = (mine.col(axis).truncate(), world.col(axis).truncate());
                worst.1 = worst.1.max((a - b).length() / b.length().max(1e-6));
            }
        }
        worst
    }

    /// The same over five frames of a clip, whose first one is at `begin`.
    pub(super) fn worst_of_clip(
        ours: &Scene,
        clip: &Clip,
        parsed: &ufbx::Scene,
        stack: &ufbx::AnimStack,
        begin: f64,
    ) -> (f64, f64) {
        let mut worst = (0.0_f64, 0.0_f64);
        for frame in (0..5).map(|part| part * (clip.frame_count() - 1) / 4) {
            let time = begin + clip.times_seconds()[frame];
            let evaluated = ufbx::evaluate_scene(parsed, &stack.anim, time, ufbx::EvaluateOpts::default());
            let found = compare(ours, Some((clip, frame)), &evaluated.expect("the parser evaluates it"));
            worst = (worst.0.max(found.0), worst.1.max(found.1));
        }
        worst
    }

    /// World matrices in our order: depth first, children in file order.
    fn worlds(scene: &ufbx::Scene) -> Vec<DMat4> {
        let mut open: Vec<&ufbx::Node> = scene.root_node.children.into_iter().collect();
        open.reverse();
        let mut worlds = Vec::new();
        while let Some(node) = open.pop() {
            let m = &node.node_to_world;
            worlds.push(DMat4::from_cols(
                DVec3::new(m.m00, m.m10, m.m20).extend(0.0),
                DVec3::new(m.m01, m.m11, m.m21).extend(0.0),
                DVec3::new(m.m02, m.m12, m.m22).extend(0.0),
                DVec3::new(m.m03, m.m13, m.m23).extend(1.0),
            ));
            let below: Vec<&ufbx::Node> = node.children.into_iter().collect();
            open.extend(below.into_iter().rev());
        }
        worlds
    }

    /// Where the sampled times begin: with the stack, or with its first key.
    pub(super) fn begins(stack: &ufbx::AnimStack) -> [f64; 2] {
        let mut first = f64::INFINITY;
        for layer in &stack.layers {
            for property in &layer.anim_props {
                for curve in property.anim_value.curves.iter().flatten() {
                    first = curve.keyframes.iter().map(|key| key.time).fold(first, f64::min);
                }
            }
        }
        [stack.time_begin, first]
    }
}

/// Files whose joints are stretched. They are where they are, but their axes are not sheared as in the file.
const STRETCHED: [&str; 2] = [
    // The armature is stretched by 1.35 along one axis, above joints at all angles.
    "odd-transforms/armature_nonuniform_scale.fbx",
    // Control bones are scaled [1, 23, 1], with turned bones below them. Others stretch in the clip alone.
    "rigify-blender/rigify_full_controls_leafbones.fbx",
];

#[test]
fn world_transforms_are_those_of_the_parser() {
    let files = files_below("", "fbx").into_iter().filter(|path| !short(path).starts_with("hostile/"));
    for path in files {
        let name = short(&path);
        let bytes = std::fs::read(&path).expect("the file can be read");
        let (scene, warnings) = read_with(&bytes, &Limits::default());
        let scene = scene.unwrap_or_else(|error| panic!("{name}: {error}"));
        let parsed = oracle::load(&bytes);
        let is_stretched = STRETCHED.contains(&name.as_str());
        let says = |code: &str| warnings.iter().any(|warning| warning.code == code);
        assert_eq!(says("stretched_skeleton"), is_stretched, "{name}: it is said where it is so, and nowhere else");
        assert!(!says("shear_lost"), "{name}: no joint is elsewhere");
        let most = if is_stretched { (5e-5, f64::INFINITY) } else { (5e-6, 5e-5) };
        let rest = oracle::compare(&scene, None, &parsed);
        assert!(rest.0 < most.0 && rest.1 < most.1, "{name}: rest {rest:?}");
        assert_eq!(scene.clips.len(), parsed.anim_stacks.len(), "{name}: one clip per stack");
        for (clip, stack) in scene.clips.iter().zip(&parsed.anim_stacks) {
            assert_eq!(clip.name(), &*stack.element.name, "{name}: in file order");
            let begins = oracle::begins(stack).into_iter().filter(|begin| begin.is_finite());
            let worst = begins.map(|begin| oracle::worst_of_clip(&scene, clip, &parsed, stack, begin));
            let best = worst.min_by(|a, b| a.0.total_cmp(&b.0)).expect("every stack has a begin");
            assert!(best.0 < most.0 && best.1 < most.1, "{name}, clip '{}': {best:?}", clip.name());
        }
    }
}

/// Path, nodes of joints, clips, frames of the longest clip, as the corpus describes them.
const CORPUS: [(&str, usize, usize, usize); 29] = [
    ("biped/rocketbox_male_adult_01.fbx", 81, 1, 2),
    ("biped/source_valvebiped_names_apose.fbx", 53, 0, 0),
    ("bvh/100style/100style_character.fbx", 28, 1, 1),
    ("cc0-stylised/kenney_medium_maya.fbx", 58, 1, 17),
    ("cc0-stylised/quaternius_alien.fbx", 11, 10, 61),
    ("creatures/oculus_hand_left.fbx", 48, 0, 0),
    ("creatures/spider_noskin.fbx", 0, 0, 0),
    ("humanik-unity/maya_character.fbx", 62, 1, 1),
    ("humanik-unity/maya_human_ik_unit_metre.fbx", 62, 1, 1),
    ("misc-rigs/17_keypoints_walk.fbx", 22, 1, 3135),
    ("misc-rigs/animation_with_skeleton_generic_names.fbx", 16, 1, 14),
    ("misc-rigs/huesitos.fbx", 11, 1, 40),
    ("misc-rigs/m2m_cmu_91_48.fbx", 43, 1, 110),
    // 43 keys, of which two lie after the end of the take.
    ("misc-rigs/ozz_pab_walk.fbx", 67, 1, 41),
    ("mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx", 65, 0, 0),
    ("mixamo/fbx/retarget_original_rig.fbx", 65, 2, 148),
    // Some curves have keys between the frames.
    ("mixamo/fbx/samba_dancing_skin.fbx", 67, 2, 640),
    ("mixamo/fbx/turn_left_45_noskin.fbx", 65, 1, 41),
    ("mixamo/fbx/walking_noskin.fbx", 65, 1, 30),
    ("mixamo/fbx/ybot_prerotation_skin.fbx", 65, 2, 2),
    ("mixamo/fbx/zombie_walk_noprefix_noskin.fbx", 57, 1, 36),
    ("odd-transforms/armature_nonuniform_scale.fbx", 53, 0, 0),
    ("poser-daz/daz_g8_names_apose.fbx", 69, 0, 0),
    ("readyplayerme/rpm_avatar.fbx", 82, 0, 0),
    ("readyplayerme/rpm_talking_noskin.fbx", 82, 1, 179),
    ("rigify-blender/rigify_full_controls_leafbones.fbx", 301, 1, 44),
    ("roblox-r15/g9_roblox_facs.fbx", 57, 1, 53),
    ("smpl/text2motion_smpl_skeleton.fbx", 24, 1, 196),
    ("unreal/ue4_names_apose_zup_xfwd.fbx", 68, 0, 0),
];

#[test]
fn the_corpus_reads_as_described() {
    for (path, joints, clips, frames) in CORPUS {
        let Some(scene) = corpus(path) else { continue };
        let found = scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count();
        let longest = scene.clips.iter().map(Clip::frame_count).max().unwrap_or(0);
        assert_eq!((found, scene.clips.len(), longest), (joints, clips, frames), "{path}: joints, clips, frames");
        assert_eq!((scene.axes, scene.unit_metres), (Some(Axes::Y_UP_Z_FRONT), Some(1.0)), "{path}: our space");
        for clip in &scene.clips {
            assert_eq!(clip.times_seconds()[0], 0.0, "{path}: '{}' begins at 0", clip.name());
        }
    }
}

#[test]
fn heights_come_out_in_metres() {
    for (path, joint, height) in [
        ("mixamo/fbx/walking_noskin.fbx", "mixamorig:Head", 1.5),
        ("mixamo/fbx/samba_dancing_skin.fbx", "mixamorig:Head", 1.5),
        ("unreal/ue4_names_apose_zup_xfwd.fbx", "head", 1.4),
        ("biped/rocketbox_male_adult_01.fbx", "Bip01 Head", 1.6),
        ("humanik-unity/maya_human_ik_unit_metre.fbx", "Character1_Head", 1.5),
    ] {
        let Some(scene) = corpus(path) else { continue };
        let Some(head) = scene.skeleton.find(joint) else {
            let names: Vec<&str> = scene.skeleton.joints().iter().map(|joint| joint.name.as_str()).collect();
            panic!("{path}: '{joint}' is not among {names:?}");
        };
        let at = scene.skeleton.rest_pose().to_model(&scene.skeleton).transforms()[head].translation;
        assert!((at.y - height).abs() < 0.2, "{path}: the head is at {at}");
    }
}

#[test]
fn the_first_take_of_mixamo_is_empty_and_the_second_is_not() {
    let Some(scene) = corpus("mixamo/fbx/samba_dancing_skin.fbx") else { return };
    let animated: Vec<bool> = scene.clips.iter().map(Clip::is_animated).collect();
    assert_eq!(animated, [false, true], "a stack without curves is a clip of one still frame");
    assert_eq!(scene.skins.len(), 2, "two meshes are bound");
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    for (joint, bind) in scene.bind_pose.iter().enumerate() {
        let Some(bind) = bind else { continue };
        let distance = bind.translation.distance(model.transforms()[joint].translation);
        assert!(distance < 1e-3, "{}: bound {distance} m from its rest", scene.skeleton.label(joint));
    }
}

#[test]
fn a_characterization_declares_roles() {
    let Some(scene) = corpus("bvh/100style/100style_character.fbx") else { return };
    assert_eq!(scene.declared_convention, Some("humanik"), "named");
    let role = |role: &str| scene.declared_roles.iter().find(|(name, _)| name == role).map(|(_, joint)| *joint);
    let elbow = role("LeftForeArm").expect("declared");
    assert_eq!(scene.skeleton.joints()[elbow].name, "BVH:LeftElbow", "with its namespace");
}

#[test]
fn hostile_files_end_in_a_scene_or_a_reason() {
    for path in files_below("hostile", "fbx") {
        let bytes = std::fs::read(&path).expect("the file can be read");
        let (result, _) = read_with(&bytes, &Limits::default());
        if let Err(error) = result {
            assert!(!error.detail.is_empty() && !error.hint.is_empty(), "{}: {error:?}", short(&path));
        }
    }
    for (name, kind) in [
        ("empty/empty.fbx", ErrorKind::Malformed),
        ("fbx/ascii_unbalanced.fbx", ErrorKind::Malformed),
        ("fbx/node_end_past_eof.fbx", ErrorKind::Malformed),
        ("fbx/array_length_4GiB_deflate.fbx", ErrorKind::Malformed),
        ("fbx/version_99999.fbx", ErrorKind::UnsupportedFeature),
        ("git_lfs_pointer.fbx", ErrorKind::UnsupportedFormat),
        ("mislabelled/glb_named.fbx", ErrorKind::UnsupportedFormat),
        ("truncated/walk_50pct.fbx", ErrorKind::Malformed),
        ("ufbx-synthetic/synthetic_node_cycle_fail_7700_ascii.fbx", ErrorKind::Malformed),
        ("ufbx-synthetic/synthetic_node_depth_fail_7500_ascii.fbx", ErrorKind::Malformed),
        ("ufbx-synthetic/synthetic_unsupported_cube_fail_2000_binary.fbx", ErrorKind::UnsupportedFeature),
    ] {
        let Some(file) = corpus_file(&format!("hostile/{name}")) else { continue };
        let error = read(&std::fs::read(file).expect("the file can be read")).expect_err(name);
        assert_eq!(error.kind, kind, "{name}: {error}");
    }
}

/// Id, name, kind, id of the parent (0 for none), properties.
type Model<'a> = (u32, &'a str, &'a str, u32, &'a str);
/// Id of the model, property, axis, key times in seconds, values; straight lines between them.
type Curve<'a> = (u32, &'a str, &'a str, &'a [f64], &'a [f64]);

/// FBX text of one animation stack with one layer.
fn text(settings: &str, models: &[Model<'_>], curves: &[Curve<'_>]) -> Vec<u8> {
    let mut objects = String::new();
    let mut connections = String::new();
    for (id, name, kind, parent, properties) in models {
        objects += &format!(
            "Model: {id}, \"Model::{name}\", \"{kind}\" {{\n Version: 232\n Properties70: {{\n{properties}\n }}\n}}\n"
        );
        connections += &format!("C: \"OO\",{id},{parent}\n");
        if *kind == "LimbNode" {
            let attribute = id + 1_000;
            objects += &format!(
                "NodeAttribute: {attribute}, \"NodeAttribute::\", \"LimbNode\" {{\n TypeFlags: \"Skeleton\"\n}}\n"
            );
            connections += &format!("C: \"OO\",{attribute},{id}\n");
        }
    }
    objects +=
        "AnimationStack: 9000, \"AnimStack::Take\", \"\" {\n}\nAnimationLayer: 9001, \"AnimLayer::Base\", \"\" {\n}\n";
    connections += "C: \"OO\",9001,9000\n";
    for (index, (model, property, axis, times, values)) in curves.iter().enumerate() {
        let (node, curve) = (7000 + index, 8000 + index);
        let count = times.len();
        let join = |numbers: Vec<String>| numbers.join(",");
        let ticks = join(times.iter().map(|time| ((time * 46_186_158_000.0).round() as i64).to_string()).collect());
        let default = if *property == "Lcl Scaling" { 1 } else { 0 };
        let defaults: String =
            ["X", "Y", "Z"].map(|axis| format!("  P: \"d|{axis}\", \"Number\", \"\", \"A\",{default}\n")).concat();
        let values = join(values.iter().map(|value| format!("{value:e}")).collect());
        objects += &format!(
            "AnimationCurveNode: {node}, \"AnimCurveNode::\", \"\" {{\n Properties70: {{\n{defaults} }}\n}}\nAnimationCurve: {curve}, \"AnimCurve::\", \"\" {{\n \
             KeyVer: 4008\n KeyTime: *{count} {{\n a: {ticks}\n }}\n KeyValueFloat: *{count} {{\n a: {values}\n }}\n \
             KeyAttrFlags: *1 {{\n a: 4\n }}\n KeyAttrDataFloat: *4 {{\n a: 0,0,0,0\n }}\n KeyAttrRefCount: *1 {{\n a: {count}\n \
             }}\n}}\n"
        );
        connections += &format!(
            "C: \"OO\",{node},9001\nC: \"OP\",{node},{model},\"{property}\"\nC: \"OP\",{curve},{node},\"d|{axis}\"\n"
        );
    }
    format!(
        "; FBX 7.4.0 project file\nFBXHeaderExtension:  {{\n FBXHeaderVersion: 1003\n FBXVersion: 7400\n}}\nGlobalSettings:  {{\n \
         Version: 1000\n Properties70:  {{\n{settings}\n }}\n}}\nObjects:  {{\n{objects}}}\nConnections:  {{\n{connections}}}\n"
    )
    .into_bytes()
}

fn vector(name: &str, x: f64, y: f64, z: f64) -> String {
    format!("  P: \"{name}\", \"{name}\", \"\", \"A\",{x:e},{y:e},{z:e}\n")
}

fn integer(name: &str, value: i64) -> String {
    format!("  P: \"{name}\", \"int\", \"Integer\", \"\",{value}\n")
}

/// Centimetres, +Y up, 30 frames per second.
fn plain() -> String {
    integer("UpAxis", 1) + &integer("FrontAxis", 2) + &integer("CoordAxis", 0) + &integer("TimeMode", 6)
}

#[test]
fn axes_units_and_pre_rotations_are_resolved() {
    // +Z up in inches: 3ds Max.
    let settings = integer("UpAxis", 2)
        + &integer("UpAxisSign", 1)
        + &integer("FrontAxis", 1)
        + &integer("FrontAxisSign", -1)
        + &integer("CoordAxis", 0)
        + &integer("CoordAxisSign", 1)
        + "  P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",2.54\n";
    let hips = vector("Lcl Translation", 1.0, 0.0, 40.0)
        + &integer("RotationActive", 1)
        + &vector("PreRotation", 0.0, 0.0, 90.0);
    let spine = vector("Lcl Translation", 10.0, 0.0, 0.0)
        + &integer("RotationOrder", 5)
        + &vector("Lcl Rotation", 90.0, 90.0, 0.0);
    let file = text(&settings, &[(1, "Hips", "LimbNode", 0, &hips), (2, "ns:Spine", "Null", 1, &spine)], &[]);
    let scene = read(&file).expect("it is read");
    let joints: Vec<(&str, bool)> =
        scene.skeleton.joints().iter().map(|joint| (joint.name.as_str(), joint.is_joint)).collect();
    assert_eq!(joints, [("Hips", true), ("ns:Spine", false)], "names as they are; only limb nodes are joints");
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let expected = [DVec3::new(1.0, 40.0, 0.0), DVec3::new(1.0, 40.0, -10.0)].map(|inches| inches * 0.0254);
    for (transform, expected) in model.transforms().iter().zip(expected) {
        assert!(
            transform.translation.distance(expected) < 1e-9,
            "{} where {expected} should be",
            transform.translation
        );
    }
    // Order 5 is ZYX, which turns about Z first and about X last.
    let expected = DQuat::from_rotation_x(FRAC_PI_2) * DQuat::from_rotation_y(FRAC_PI_2);
    let found = scene.skeleton.joints()[1].rest.rotation;
    assert!(found.angle_between(expected) < 1e-9, "{found} where {expected} should be");
}

#[test]
fn a_wide_turn_between_two_keys_gets_frames() {
    let file =
        text(&plain(), &[(1, "Hips", "LimbNode", 0, "")], &[(1, "Lcl Rotation", "Y", &[1.0, 2.0], &[0.0, 270.0])]);
    let (scene, warnings) = read_with(&file, &Limits::default());
    let scene = scene.expect("it is read");
    let clip = &scene.clips[0];
    assert_eq!((clip.name(), clip.frame_count()), ("Take", 31), "a second at 30 frames per second");
    assert_eq!(warnings.iter().map(|warning| warning.code).collect::<Vec<_>>(), ["keys_densified"], "and it says so");
    let found = clip.local_pose(&scene.skeleton, 20).transforms()[0].rotation;
    assert!(found.angle_between(DQuat::from_rotation_y(PI)) < 1e-4, "two thirds of the way around: {found}");
    let tracks = &clip.joints()[0];
    assert!(!tracks.translation.is_animated() && !tracks.scale.is_animated(), "only what has curves is animated");
}

#[test]
fn a_child_that_ignores_its_parents_scale_keeps_its_size() {
    let child = vector("Lcl Translation", 0.0, 100.0, 0.0) + &integer("InheritType", 2);
    let models = [
        (1, "Parent", "LimbNode", 0, ""),
        (2, "Child", "LimbNode", 1, child.as_str()),
        (3, "Leaf", "LimbNode", 2, child.as_str()),
    ];
    let file = text(&plain(), &models, &[(1, "Lcl Scaling", "Y", &[0.0, 1.0], &[1.0, 4.0])]);
    let scene = read(&file).expect("it is read");
    let clip = &scene.clips[0];
    let model = clip.local_pose(&scene.skeleton, clip.frame_count() - 1).to_model(&scene.skeleton);
    let [parent, child, leaf] = [0, 1, 2].map(|joint| model.transforms()[joint]);
    assert!(parent.scale.abs_diff_eq(DVec3::new(1.0, 4.0, 1.0), 1e-5), "the parent is stretched: {}", parent.scale);
    assert!(child.scale.abs_diff_eq(DVec3::ONE, 1e-5), "the child is not: {}", child.scale);
    assert!(child.translation.abs_diff_eq(DVec3::Y * 4.0, 1e-5), "but it moves: {}", child.translation);
    assert!(leaf.translation.abs_diff_eq(DVec3::Y * 5.0, 1e-5), "the leaf moves with it: {}", leaf.translation);
}

#[test]
fn numbers_that_are_none_are_named() {
    let file =
        text(&plain(), &[(1, "Hips", "LimbNode", 0, "")], &[(1, "Lcl Translation", "X", &[0.0, 0.1], &[0.0, 1e38])]);
    let error = read(&file).expect_err("no position");
    assert!(error.detail.contains("'Hips'"), "the node is named: {error}");
    let far = vector("Lcl Translation", 1e200, 0.0, 0.0);
    let (scene, warnings) = read_with(&text(&plain(), &[(1, "Hips", "LimbNode", 0, &far)], &[]), &Limits::default());
    assert!(scene.is_ok(), "a rest transform is repaired");
    assert!(warnings.iter().any(|warning| warning.code == "rest_not_finite"), "and it says so: {warnings:?}");
}

#[test]
fn limits_hold() {
    let chain: Vec<(u32, String)> = (1..=40).map(|id| (id, format!("joint{id}"))).collect();
    let models: Vec<Model<'_>> = chain.iter().map(|(id, name)| (*id, name.as_str(), "LimbNode", id - 1, "")).collect();
    let file = text(&plain(), &models, &[(1, "Lcl Rotation", "Y", &[0.0, 10.0], &[0.0, 270.0])]);
    assert!(read(&file).is_ok(), "it fits the default limits");
    let with = |limits: Limits| read_with(&file, &limits).0;
    for (limits, limit) in [
        (Limits { decoded_bytes: 20_000, ..Limits::default() }, Limit::DecodedBytes),
        (Limits { hierarchy_depth: 20, ..Limits::default() }, Limit::HierarchyDepth),
        (Limits { nodes: 20, ..Limits::default() }, Limit::Nodes),
        (Limits { clips: 0, ..Limits::default() }, Limit::Clips),
        (Limits { samples: 300, ..Limits::default() }, Limit::Samples),
    ] {
        let error = with(limits).expect_err("past the limit");
        let is_it = matches!(error.kind, ErrorKind::LimitExceeded { limit: found, .. } if found == limit);
        assert!(is_it, "{limit:?}: {error:?}");
    }
    let short = with(Limits { frames_per_clip: 300, ..Limits::default() }).expect("the keys still fit");
    assert_eq!(short.clips[0].frame_count(), 2, "without the frames between them");
}

#[test]
fn cancellation_is_heard() {
    let control = Control::new();
    control.cancel();
    let file = text(&plain(), &[(1, "Hips", "LimbNode", 0, "")], &[]);
    let result = formats::read(&file, Format::Fbx, &Limits::default(), &control, &mut Reporter::new());
    assert_eq!(result.expect_err("canceled").kind, ErrorKind::Canceled, "the read stops");
}

proptest::proptest! {
    #[test]
    fn no_bytes_panic(at in 0..3_000_usize, byte in 0..=255_u8, cut in 0..3_000_usize) {
        let file = text(&plain(), &[(1, "Hips", "LimbNode", 0, "")], &[(1, "Lcl Rotation", "Y", &[0.0, 1.0], &[0.0, 9.0])]);
        let mut bytes = file.clone();
        let at = at % bytes.len();
        bytes[at] = byte;
        let _ = read(&bytes);
        let _ = read(&file[..cut % file.len()]);
    }
}
