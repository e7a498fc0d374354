//! The FBX reader, on files of the corpus and on documents made here.

mod between_keys;
mod features;
mod glb;
mod left_handed;
mod made;
mod records;
mod write;

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};
use retargetd::{
    formats::{self, ErrorKind, Format, FormatError, Limit, Limits},
    model::{Axes, Clip, Control, Reporter, Scene, Warning},
};

use crate::support::{corpus_file, shared_folder};
use made::{Channel, Document, vector};

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
    pub(super) fn worlds(scene: &ufbx::Scene) -> Vec<DMat4> {
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
        assert_eq!((scene.axes, scene.unit_meters), (Some(Axes::Y_UP_Z_FRONT), Some(1.0)), "{path}: our space");
        for clip in &scene.clips {
            assert_eq!(clip.times_seconds()[0], 0.0, "{path}: '{}' begins at 0", clip.name());
        }
    }
}

#[test]
fn heights_come_out_in_meters() {
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

/// One limb that turns, in text.
fn turning() -> Document {
    Document::chain(&[("Hips", &[])]).moved(&[Channel::of(0, "Lcl Rotation", "Y", &[(0.0, 0.0), (1.0, 9.0)])])
}

#[test]
fn numbers_that_are_none_are_named() {
    let far = [(0.0, 0.0), (0.1, 1e38)];
    let document = Document::chain(&[("Hips", &[])]).moved(&[Channel::of(0, "Lcl Translation", "X", &far)]);
    let error = read(&document.text()).expect_err("no position");
    assert!(error.detail.contains("'Hips'"), "the node is named: {error}");
    let document = Document::chain(&[("Hips", &[vector("Lcl Translation", [1e200, 0.0, 0.0])])]);
    let (scene, warnings) = read_with(&document.text(), &Limits::default());
    assert!(scene.is_ok(), "a rest transform is repaired");
    assert!(warnings.iter().any(|warning| warning.code == "rest_not_finite"), "and it says so: {warnings:?}");
}

#[test]
fn limits_hold() {
    let names: Vec<String> = (1..=40).map(|index| format!("joint{index}")).collect();
    let limbs: Vec<_> = names.iter().map(|name| (name.as_str(), [].as_slice())).collect();
    let turn = Channel::of(0, "Lcl Rotation", "Y", &[(0.0, 0.0), (10.0, 270.0)]);
    let file = Document::chain(&limbs).moved(&[turn]).text();
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
    let file = turning().text();
    let result = formats::read(&file, Format::Fbx, &Limits::default(), &control, &mut Reporter::new());
    assert_eq!(result.expect_err("canceled").kind, ErrorKind::Canceled, "the read stops");
}

proptest::proptest! {
    #[test]
    fn no_bytes_panic(at in 0..3_000_usize, byte in 0..=255_u8, cut in 0..3_000_usize) {
        for file in [turning().text(), turning().binary_of(7400), turning().text_of(6100)] {
            let mut bytes = file.clone();
            let at = at % bytes.len();
            bytes[at] = byte;
            let _ = read(&bytes);
            let _ = read(&file[..cut % file.len()]);
        }
    }
}
