//! What must hold of every retarget whatever the rigs, through all ops of the default stack, on real clips: there and back again,
//! whatever the frame rate, wherever the clip is cut, and the other way round in a mirror.

use glam::{DVec3, Quat, Vec3};
use retargetd::{
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track},
    retarget::{MetricName, Resolved, Stack, parse_spec, resolve},
    rig::Rig,
    samples,
};

use super::figure::{
    Figure, degrees_between, measured, moved, percentile, position, rig_of, rotations, value, with_roots_moved, world,
};
use crate::support::corpus_file;

const PLAIN: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const DEFAULT: &str = "{}";

/// In legs: what may differ when a clip has half the frames, in 95 of 100 values and at worst.
const MAX_BY_FRAME_RATE: f64 = 0.02;
const WORST_BY_FRAME_RATE: f64 = 0.05;
/// The same of a clip that is cut, farther from the cut than this.
const FELT_SECONDS: f64 = 1.0;
const MAX_BY_CUT: f64 = 0.02;
const WORST_BY_CUT: f64 = 0.05;
/// As a share of the height.
const MAX_BY_MIRROR: f64 = 1e-4;

/// Clips onto characters of another family.
const PAIRS: [(&str, &str); 5] = [
    ("bvh/cmu/12_01_walk.bvh", "mixamo/gltf/Xbot.glb"),
    ("mixamo/bvh/beta_walking_mixed_orders.bvh", "unreal/ue4_names_apose.glb"),
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "mixamo/gltf/Xbot.glb"),
    ("bvh/rokoko/jesse_dance.bvh", "vrm1/makehuman_body_vrm1.vrm"),
    ("mixamo/fbx/samba_dancing_skin.fbx", "readyplayerme/rpm_avatar_a.glb"),
];

pub(crate) fn retargeted(spec: &str, source: &Scene, clip: &Clip, target: &Scene) -> Clip {
    let spec = parse_spec(spec.as_bytes()).expect("a spec");
    let mut reporter = Reporter::new();
    let source = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a source");
    let target = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a target");
    let Resolved { mapping, ops, .. } = resolve(&spec, &source, &target, clip, &mut reporter).expect("a mapping");
    let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
    stack.run(clip, &Control::new()).expect("a result").clip
}

/// The figures of a pair; nothing without the corpus.
fn figures((source, target): (&str, &str)) -> Option<(Figure, Figure)> {
    let (source, target) = (corpus_file(source)?, corpus_file(target)?);
    Some((Figure::read(&source), Figure::read(&target)))
}

/// Every frame of a clip that a condition holds for, in the order of the clip.
fn chosen(clip: &Clip, is_wanted: impl Fn(usize) -> bool) -> Clip {
    let frames: Vec<usize> = (0..clip.frame_count()).filter(|frame| is_wanted(*frame)).collect();
    let times = frames.iter().map(|&frame| clip.times_seconds()[frame]).collect();
    let tracks = clip.joints().iter().map(|tracks| JointTracks {
        translation: pick(&tracks.translation, &frames),
        rotation: pick(&tracks.rotation, &frames),
        scale: pick(&tracks.scale, &frames),
    });
    Clip::new(clip.name().into(), times, tracks.collect()).expect("a valid clip")
}

fn pick<T: Copy>(track: &Track<T>, frames: &[usize]) -> Track<T> {
    match track {
        Track::Sampled(values) => Track::Sampled(frames.iter().map(|&frame| values[frame]).collect()),
        other => other.clone(),
    }
}

/// How far joints of the body are apart between two clips on one skeleton, frame by frame, in shares of the leg.
fn distances(
    figure: &Figure,
    frames: impl Iterator<Item = ((usize, usize), bool)>,
    first: &Clip,
    second: &Clip,
) -> Vec<f64> {
    let skeleton = figure.skeleton();
    let role = |role: &str| figure.roles[role];
    let rest = world(skeleton, None);
    let leg = position(&rest, role("left_thigh")).distance(position(&rest, role("left_shin")))
        + position(&rest, role("left_shin")).distance(position(&rest, role("left_foot")));
    let mut distances = Vec::new();
    for ((one, other), _) in frames.filter(|(_, is_wanted)| *is_wanted) {
        let (one, other) = (world(skeleton, Some((first, one))), world(skeleton, Some((second, other))));
        for role in ["pelvis", "left_shin", "right_shin", "left_foot", "right_foot", "left_hand", "right_hand", "head"]
        {
            if let Some(&joint) = figure.roles.get(role) {
                distances.push(position(&one, joint).distance(position(&other, joint)) / leg);
            }
        }
    }
    distances
}

/// 95 of 100 values, and the largest.
fn spread(distances: Vec<f64>) -> (f64, f64) {
    let worst = distances.iter().copied().fold(0.0, f64::max);
    (percentile(distances, 0.95), worst)
}

#[test]
fn there_and_back_again_rotations_are_what_they_were() {
    for pair in PAIRS {
        let Some((source, target)) = figures(pair) else { return };
        let clip = source.clip();
        let there = retargeted(PLAIN, &source.scene, clip, &target.scene);
        let back = retargeted(PLAIN, &target.scene, &there, &source.scene);
        let mut degrees = Vec::new();
        for frame in (0..clip.frame_count()).step_by(5) {
            let before = rotations(source.skeleton(), clip, frame);
            let after = rotations(source.skeleton(), &back, frame);
            for role in LIMBS {
                if let (Some(&joint), true) = (source.roles.get(role), target.roles.contains_key(role)) {
                    degrees.push(degrees_between(before[joint], after[joint]));
                }
            }
        }
        let (most, worst) = spread(degrees);
        assert!(most <= 1.0, "{pair:?}: {most}° (95 %), {worst}° at worst");
    }
}

const LIMBS: [&str; 13] = [
    "pelvis",
    "left_upper_arm",
    "left_forearm",
    "left_hand",
    "right_upper_arm",
    "right_forearm",
    "right_hand",
    "left_thigh",
    "left_shin",
    "left_foot",
    "right_thigh",
    "right_shin",
    "right_foot",
];

#[test]
fn half_the_frames_give_half_the_result() {
    for pair in PAIRS {
        let Some((source, target)) = figures(pair) else { return };
        let clip = source.clip();
        if clip.times_seconds()[1] - clip.times_seconds()[0] > 1.0 / 50.0 {
            continue;
        }
        let whole = retargeted(DEFAULT, &source.scene, clip, &target.scene);
        let half = retargeted(DEFAULT, &source.scene, &chosen(clip, |frame| frame % 2 == 0), &target.scene);
        let frames = (0..half.frame_count()).step_by(3).map(|frame| ((2 * frame, frame), true));
        let (most, worst) = spread(distances(&target, frames, &whole, &half));
        assert!(most < MAX_BY_FRAME_RATE && worst < WORST_BY_FRAME_RATE, "{pair:?}: {most} (95 %), {worst} at worst");
    }
}

/// Contacts are looked for over the whole clip, and feet are led to them beforehand: a cut is felt for a while. The soles of the
/// dancer hover at another height toward the end; that height is taken off, and what is left of him without the end is lower.
#[test]
fn a_cut_changes_only_what_is_near_it() {
    for pair in PAIRS.into_iter().filter(|pair| !pair.0.contains("jesse_dance")) {
        let Some((source, target)) = figures(pair) else { return };
        let clip = source.clip();
        let whole = retargeted(DEFAULT, &source.scene, clip, &target.scene);
        let count = clip.frame_count();
        for (from, to) in [(0, count * 2 / 3), (count / 3, count), (count / 5, count)] {
            let part =
                retargeted(DEFAULT, &source.scene, &chosen(clip, |frame| (from..to).contains(&frame)), &target.scene);
            let times = clip.times_seconds();
            let is_far = |frame: usize| {
                let from_start = from == 0 || times[frame] - times[from] > FELT_SECONDS;
                from_start && (to == count || times[to - 1] - times[frame] > FELT_SECONDS)
            };
            let frames = (from..to).step_by(3).map(|frame| ((frame, frame - from), is_far(frame)));
            let distances = distances(&target, frames, &whole, &part);
            if distances.is_empty() {
                continue;
            }
            let (most, worst) = spread(distances);
            assert!(
                most < MAX_BY_CUT && worst < WORST_BY_CUT,
                "{pair:?} {from}..{to}: {most} (95 %), {worst} at worst"
            );
        }
    }
}

/// The helper joint of Unreal rigs that lies on the right hand, of a mirrored figure too.
const ALWAYS_RIGHT: &str = "ik_hand_gun";

#[test]
fn a_mirror_commutes() {
    let mut compared = 0;
    for pair in PAIRS {
        let Some((source, target)) = figures(pair) else { return };
        let clip = source.clip();
        let (Some(mirrored_source), Some(mirrored_target)) = (mirrored(&source.scene), mirrored(&target.scene)) else {
            continue;
        };
        compared += 1;
        let plain = bare(&target.scene);
        let ours = retargeted(DEFAULT, &bare(&source.scene), clip, &plain);
        let index = source.scene.clips.iter().position(|other| std::ptr::eq(other, clip)).expect("its own");
        let theirs = retargeted(DEFAULT, &mirrored_source, &mirrored_source.clips[index], &mirrored_target);
        let mut worst = 0.0_f64;
        for frame in (0..clip.frame_count()).step_by(7) {
            let ours = world(&plain.skeleton, Some((&ours, frame)));
            let theirs = world(&mirrored_target.skeleton, Some((&theirs, frame)));
            for joint in 0..ours.len() {
                if plain.skeleton.joints()[joint].name.as_str() == ALWAYS_RIGHT {
                    continue;
                }
                let (ours, theirs) = (position(&ours, joint), position(&theirs, joint));
                worst = worst.max(ours.distance(theirs * DVec3::new(-1.0, 1.0, 1.0)));
            }
        }
        let height = position(&world(&plain.skeleton, None), target.roles["head"]).length();
        assert!(worst < MAX_BY_MIRROR * height, "{pair:?}: {worst} at a height of {height}");
    }
    assert!(compared > 2, "pairs whose joints say which side they are on: {compared}");
}

/// The skeleton and its clips, without a mesh.
fn bare(scene: &Scene) -> Scene {
    Scene {
        skeleton: scene.skeleton.clone(),
        clips: scene.clips.clone(),
        axes: scene.axes,
        unit_meters: scene.unit_meters,
        ..Scene::default()
    }
}

/// The scene in a mirror, left joints named right and the other way round; nothing where names do not say it plainly.
fn mirrored(scene: &Scene) -> Option<Scene> {
    let mut has_sides = false;
    let mut other_side = |name: &str| {
        for (one, other) in [("Left", "Right"), ("Right", "Left")] {
            if name.contains(one) {
                has_sides = true;
                return name.replace(one, other);
            }
        }
        let mut letters = name.chars();
        let begins = letters.next().zip(letters.next().filter(char::is_ascii_uppercase));
        for (one, other) in [('L', "R"), ('R', "L")] {
            if let Some(stem) = name.strip_prefix(one).filter(|_| begins.is_some_and(|(first, _)| first == one)) {
                has_sides = true;
                return format!("{other}{stem}");
            }
        }
        for (one, other) in [("_l", "_r"), ("_r", "_l")] {
            if let Some(stem) = name.strip_suffix(one) {
                has_sides = true;
                return format!("{stem}{other}");
            }
        }
        name.to_owned()
    };
    let place = |place: DVec3| place * DVec3::new(-1.0, 1.0, 1.0);
    let joints = scene.skeleton.joints().iter().map(|joint| {
        let mut rest = joint.rest;
        rest.translation = place(rest.translation);
        (rest.rotation.y, rest.rotation.z) = (-rest.rotation.y, -rest.rotation.z);
        Joint { name: other_side(&joint.name), rest, ..joint.clone() }
    });
    let skeleton = Skeleton::new(joints.collect()).expect("a valid skeleton");
    let clips = scene.clips.iter().map(|clip| {
        let tracks = clip.joints().iter().map(|tracks| JointTracks {
            translation: mapped(&tracks.translation, |value: Vec3| value * Vec3::new(-1.0, 1.0, 1.0)),
            rotation: mapped(&tracks.rotation, |value: Quat| Quat::from_xyzw(value.x, -value.y, -value.z, value.w)),
            scale: tracks.scale.clone(),
        });
        Clip::new(clip.name().into(), clip.times_seconds().to_vec(), tracks.collect()).expect("a valid clip")
    });
    let clips = clips.collect();
    has_sides.then(|| Scene { skeleton, clips, axes: scene.axes, unit_meters: scene.unit_meters, ..Scene::default() })
}

fn mapped<T: Copy>(track: &Track<T>, change: impl Fn(T) -> T) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(change(*value)),
        Track::Sampled(values) => Track::Sampled(values.iter().map(|value| change(*value)).collect()),
    }
}

/// The walk by joints down to the ankles, with the pelvis at the origin at rest, so many meters higher than it was made.
fn walk_of_ankles(higher: f32) -> Scene {
    let walk = with_roots_moved(&samples::walk_scene(), |_| Vec3::Y * higher);
    let joints = walk.skeleton.joints();
    let kept: Vec<usize> = (0..joints.len()).filter(|joint| !joints[*joint].name.contains("Toe")).collect();
    let joint = |&index: &usize| {
        let mut joint = joints[index].clone();
        joint.parent = joint.parent.map(|parent| kept.binary_search(&parent).expect("what is above is kept"));
        if joint.parent.is_none() {
            joint.rest.translation = DVec3::ZERO;
        }
        joint
    };
    let skeleton = Skeleton::new(kept.iter().map(joint).collect()).expect("a skeleton");
    let clip = &walk.clips[0];
    let tracks = kept.iter().map(|joint| clip.joints()[*joint].clone()).collect();
    let clip = Clip::new(clip.name().into(), clip.times_seconds().to_vec(), tracks).expect("a clip");
    Scene { skeleton, clips: vec![clip], ..Scene::default() }
}

/// Nothing but its ankles says where such a source stands, which hover over the origin.
#[test]
fn ankles_that_hover_say_where_the_floor_is() {
    let target = samples::mannequin_scene();
    for higher in [0.04, 0.06, 0.3] {
        let source = walk_of_ankles(higher);
        let (from, onto) = (rig_of("source", &source), rig_of("target", &target));
        let measures = measured(&from, &onto, &moved(&from, &onto));
        let float = value(&measures, MetricName::FloorFloat);
        assert!(float < 1.0, "{higher} m higher: feet of the target are {float} cm off the floor");
    }
}
