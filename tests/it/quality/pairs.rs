//! Real clips onto real characters of other families, with nothing but plain forward kinematics asked for, and with no config at
//! all: limbs point as the source's do, bones keep their length, feet are on the floor, walkers walk forward, and the target's
//! document is what it was. Without a config feet are planted, which legs pay for with a few degrees.

use std::path::{Path, PathBuf};

use glam::{DMat4, DQuat, DVec3};
use retargetd::{
    engine::{Format, Inputs, Limits, NamedBytes, Outcome, retarget},
    model::{Axes, Clip, Control},
};
use serde_json::Value;

use super::figure::{Figure, frames_of, percentile, position, read_scene, world};
use crate::support::{corpus_file, gltf_json, validate_gltf};

/// Pairs that were promised by name.
const PROMISED: [(&str, &str); 7] = [
    ("mixamo/fbx/walking_noskin.fbx", "mixamo/gltf/Xbot.glb"),
    ("bvh/cmu/12_01_walk.bvh", "mixamo/gltf/Xbot.glb"),
    ("misc-rigs/17_keypoints_walk.fbx", "unreal/makehuman_game_engine_tpose.glb"),
    ("bvh/fair1/dab_zup.bvh", "vrm0/makehuman_body_vrm0.vrm"),
    ("bvh/fair1/wave_hello_zup.bvh", "vrm1/makehuman_body_vrm1.vrm"),
    ("smpl/text2motion_smpl_skeleton.fbx", "readyplayerme/rpm_avatar_a.glb"),
    ("mixamo/fbx/zombie_walk_noprefix_noskin.fbx", "mixamo/fbx/ybot_prerotation_skin.fbx"),
];

/// Pairs whose feet are farther off by rotations alone than those of most others.
const PLANTED: [(&str, &str); 4] = [
    ("mixamo/bvh/beta_walking_mixed_orders.bvh", "poser-daz/daz_g8_names_apose.glb"),
    ("bvh/cmu/12_01_walk.bvh", "unreal/ue4_names_apose_zup_xfwd.fbx"),
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "readyplayerme/rpm_avatar_a.glb"),
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "rigify-blender/gdquest_sophia.glb"),
];

/// Plain forward kinematics.
const PLAIN: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;

/// Clips of many families; each goes onto every one of [`TARGETS`].
const SOURCES: [&str; 10] = [
    "mixamo/fbx/walking_noskin.fbx",
    "mixamo/bvh/beta_walking_mixed_orders.bvh",
    "bvh/cmu/12_01_walk.bvh",
    "bvh/fair1/dab_zup.bvh",
    "bvh/xsens/pybvh_test2_chest4.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "bvh/misc/walk01_24fps.bvh",
    "smpl/text2motion_smpl_skeleton.fbx",
    "vrma/idle_loop.vrma",
    "humanik-unity/viverse_walk.glb",
];

/// Characters of many families.
const TARGETS: [&str; 9] = [
    "mixamo/gltf/Xbot.glb",
    "unreal/ue4_names_apose.glb",
    "unreal/ue4_names_apose_zup_xfwd.fbx",
    "readyplayerme/rpm_avatar_a.glb",
    "vrm0/makehuman_body_vrm0.vrm",
    "vrm1/makehuman_body_vrm1.vrm",
    "poser-daz/daz_g8_names_apose.glb",
    "rigify-blender/gdquest_sophia.glb",
    "character-creator/cc_base_idle.glb",
];

/// Clips that travel, and forward.
const WALKERS: [&str; 5] = [
    "bvh/cmu/12_01_walk.bvh",
    "mixamo/bvh/beta_walking_mixed_orders.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "bvh/misc/walk01_24fps.bvh",
    "misc-rigs/17_keypoints_walk.fbx",
];

/// Role of a limb's start, and of its end.
const LIMBS: [(&str, &str); 10] = [
    ("left_upper_arm", "left_forearm"),
    ("left_forearm", "left_hand"),
    ("right_upper_arm", "right_forearm"),
    ("right_forearm", "right_hand"),
    ("left_thigh", "left_shin"),
    ("left_shin", "left_foot"),
    ("right_thigh", "right_shin"),
    ("right_shin", "right_foot"),
    ("spine", "neck"),
    ("neck", "head"),
];

/// 95th percentile of a limb's direction error, between two T poses and between others.
const MAX_DEGREES_T_ONTO_T: f64 = 1.0;
const MAX_DEGREES: f64 = 5.0;
/// How much the angle between the two necks may change over a clip.
const MAX_NECK_DEGREES: f64 = 5.0;
/// The same of legs whose feet are planted, from the strike of the heel until the toes leave, and of those of [`LARGE_FEET`].
const MAX_DEGREES_OF_PLANTED_LEGS: f64 = 8.5;
const MAX_DEGREES_WITH_LARGE_FEET: f64 = 24.0;
/// How far ankles may be off the floor, as a share of the leg: where the source's file knows its floor, and where it does not
/// (captures with the pelvis at the origin, whose feet hover by the thickness of shoes and markers).
const MAX_OFF_THE_FLOOR: f64 = 0.05;
const MAX_OFF_AN_UNKNOWN_FLOOR: f64 = 0.07;
/// How far toes may go through it: feet are kept as they are turned, and longer ones reach lower when they roll.
const MAX_BELOW_THE_FLOOR: f64 = 0.08;
/// Characters with feet as long as their shins. Rotations alone drive those through the floor.
const LARGE_FEET: [&str; 1] = ["gdquest_sophia.glb"];
/// Characters with hips as wide as their shoulders. Arms are swung out of those by default, and would be 20 cm in them (at a leg of 1 m).
const WIDE_BODIES: [&str; 1] = ["gdquest_sophia.glb"];
const MAX_DEGREES_BESIDE_WIDE_BODIES: f64 = 12.0;
/// Share of its way that a walker goes where it faces.
const MIN_FORWARD: f64 = 0.8;
const MAX_LENGTH_CHANGE: f64 = 1e-4;
const FRAMES_LOOKED_AT: usize = 150;

/// What is asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Steps {
    /// Forward kinematics alone: directions are exact.
    Plain,
    /// Nothing: feet are planted and stand on the floor.
    Default,
}

#[test]
fn promised_pairs() {
    check(&PROMISED, Steps::Plain);
}

#[test]
fn promised_pairs_with_planted_feet() {
    check(&PROMISED, Steps::Default);
    check(&PLANTED, Steps::Default);
}

#[test]
fn every_family_onto_every_family() {
    let pairs: Vec<(&str, &str)> =
        TARGETS.iter().flat_map(|target| SOURCES.iter().map(move |source| (*source, *target))).collect();
    check(&pairs, Steps::Plain);
}

fn check(pairs: &[(&str, &str)], steps: Steps) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut problems = Vec::new();
    let mut written: Vec<(String, PathBuf)> = Vec::new();
    for (index, (source_name, target_name)) in pairs.iter().enumerate() {
        let (Some(source), Some(target)) = (corpus_file(source_name), corpus_file(target_name)) else { return };
        let name = format!("{source_name} onto {target_name}");
        let (source, target) = (Figure::read(&source), Figure::read(&target));
        let result = match Pair::new(&source, &target, steps) {
            Ok(pair) => pair,
            Err(problem) => {
                problems.push(format!("{name}: {problem}"));
                continue;
            }
        };
        let mut found = result.problems();
        if WALKERS.contains(source_name) {
            found.extend(result.walks_forward());
        }
        problems.extend(found.into_iter().map(|problem| format!("{name}: {problem}")));
        let path = folder.path().join(format!("{index}.glb"));
        std::fs::write(&path, &result.glb).expect("a file in the temporary folder");
        written.push((name, path));
    }
    let files: Vec<&Path> = written.iter().map(|(_, path)| path.as_path()).collect();
    if let Some(reports) = validate_gltf(&files) {
        for (name, path) in &written {
            let report = &reports[path.as_path()];
            if report["codes"].as_object().is_none_or(|codes| !codes.is_empty()) {
                problems.push(format!("{name}: the Khronos validator finds errors: {report}"));
            }
        }
    }
    assert!(problems.is_empty(), "{} problems with {} pairs:\n{}", problems.len(), pairs.len(), problems.join("\n"));
}

/// One retarget, and all that is needed to look at it.
struct Pair<'a> {
    source: &'a Figure,
    target: &'a Figure,
    steps: Steps,
    glb: Vec<u8>,
    /// The result's scene: the target's nodes with the new clip first.
    scene: retargetd::model::Scene,
    /// Turn both sides to +Y up, +Z front.
    canonical_from_source: DQuat,
    canonical_from_target: DQuat,
}

impl<'a> Pair<'a> {
    fn new(source: &'a Figure, target: &'a Figure, steps: Steps) -> Result<Self, String> {
        let plain = NamedBytes { name: "plain.json", bytes: PLAIN.as_bytes() };
        let inputs = Inputs {
            source: source.named_bytes(),
            target: target.named_bytes(),
            source_rest: None,
            target_rest: None,
            config: (steps == Steps::Plain).then_some(plain),
            formats: &[Format::Glb],
        };
        let Outcome { mut outputs, report, .. } =
            retarget(&inputs, &Limits::default(), &Control::new()).map_err(|failure| format!("{failure:?}"))?;
        let glb = outputs.swap_remove(0).bytes;
        let turn = |axes: &str| axes.parse::<Axes>().expect("axes").canonical_from_this();
        Ok(Self {
            source,
            target,
            steps,
            scene: read_scene(&glb, "result.glb"),
            glb,
            canonical_from_source: turn(&report.rigs.source.axes),
            canonical_from_target: turn(&report.rigs.target.axes),
        })
    }

    fn problems(&self) -> Vec<String> {
        let checks = [Self::limbs, Self::lengths, Self::floor, Self::document];
        checks.iter().flat_map(|check| check(self)).collect()
    }

    fn clip(&self) -> &Clip {
        &self.scene.clips[0]
    }

    fn world(&self, frame: usize) -> Vec<DMat4> {
        world(&self.scene.skeleton, Some((self.clip(), frame)))
    }

    /// The result's joint of a role: its nodes are the target's, by name.
    fn joint(&self, role: &str) -> Option<usize> {
        let label = self.target.skeleton().label(*self.target.roles.get(role)?);
        (0..self.scene.skeleton.len()).find(|&joint| self.scene.skeleton.label(joint) == label)
    }

    fn limbs(&self) -> Vec<String> {
        let both_t = self.source.rest_kind() == "T" && self.target.rest_kind() == "T";
        let most = if both_t { MAX_DEGREES_T_ONTO_T } else { MAX_DEGREES };
        let clip = self.source.clip();
        let frames = frames_of(clip, FRAMES_LOOKED_AT);
        let poses: Vec<_> = frames
            .iter()
            .map(|&frame| (world(self.source.skeleton(), Some((clip, frame))), self.world(frame)))
            .collect();
        let mut problems = Vec::new();
        for (start, end) in LIMBS {
            let source = (self.source.roles.get(start), self.source.roles.get(end));
            let ((Some(&from), Some(&to)), (Some(start_joint), Some(end_joint))) =
                (source, (self.joint(start), self.joint(end)))
            else {
                continue;
            };
            let angle = |(source, target): &(Vec<DMat4>, Vec<DMat4>)| {
                let wanted = self.canonical_from_source * (position(source, to) - position(source, from));
                let found = self.canonical_from_target * (position(target, end_joint) - position(target, start_joint));
                wanted.angle_between(found).to_degrees()
            };
            let is_leg = start.ends_with("thigh") || start.ends_with("shin");
            let most = if is_leg && self.steps == Steps::Default { self.most_degrees_of_planted_legs() } else { most };
            let is_arm = start.ends_with("upper_arm") || start.ends_with("forearm");
            let is_swung =
                is_arm && self.steps == Steps::Default && WIDE_BODIES.contains(&self.target.file_name.as_str());
            let most = if is_swung { MAX_DEGREES_BESIDE_WIDE_BODIES } else { most };
            let mut angles: Vec<f64> = poses.iter().map(angle).collect();
            if start == "neck" {
                // A neck keeps how it is made: it differs from the source's by as much as at rest, and that does not change.
                let made_otherwise = percentile(angles.clone(), 0.5);
                angles.iter_mut().for_each(|angle| *angle = (*angle - made_otherwise).abs());
            }
            let most = if start == "neck" { MAX_NECK_DEGREES } else { most };
            let degrees = percentile(angles, 0.95);
            if degrees.is_nan() || degrees > most {
                problems.push(format!("{start} is {degrees:.2}° off, allowed {most}°"));
            }
        }
        problems
    }

    fn most_degrees_of_planted_legs(&self) -> f64 {
        match LARGE_FEET.contains(&self.target.file_name.as_str()) {
            true => MAX_DEGREES_WITH_LARGE_FEET,
            false => MAX_DEGREES_OF_PLANTED_LEGS,
        }
    }

    /// Bones below the pelvis keep the length that they have at rest.
    fn lengths(&self) -> Vec<String> {
        let skeleton = &self.scene.skeleton;
        let Some(pelvis) = self.joint("pelvis") else { return vec!["the target has no pelvis".to_owned()] };
        let rest = world(skeleton, None);
        let length = |world: &[DMat4], joint: usize| {
            skeleton.parent(joint).map_or(0.0, |parent| position(world, joint).distance(position(world, parent)))
        };
        let below = |joint: &usize| *joint != pelvis && skeleton.is_ancestor_or_self(pelvis, *joint);
        let bones: Vec<usize> = (0..skeleton.len()).filter(below).collect();
        let mut worst = (0.0, 0);
        for frame in frames_of(self.clip(), FRAMES_LOOKED_AT) {
            let posed = self.world(frame);
            for &joint in &bones {
                let at_rest = length(&rest, joint);
                let change = (length(&posed, joint) - at_rest).abs() / at_rest.max(1e-3);
                if change > worst.0 {
                    worst = (change, joint);
                }
            }
        }
        let problem = || format!("the bone to {} changes its length by {:.5}", skeleton.label(worst.1), worst.0);
        if worst.0 > MAX_LENGTH_CHANGE { vec![problem()] } else { Vec::new() }
    }

    fn leg(&self, world: &[DMat4]) -> Option<f64> {
        let joints = [self.joint("left_thigh")?, self.joint("left_shin")?, self.joint("left_foot")?];
        let [thigh, shin, foot] = joints.map(|joint| position(world, joint));
        Some(thigh.distance(shin) + shin.distance(foot))
    }

    /// Ankles come down to where they are at rest, and no joint of a foot goes much lower than at rest. The lowest twentieth of
    /// the frames is left out: recordings have a calibration pose that is placed elsewhere.
    fn floor(&self) -> Vec<String> {
        let ankles: Vec<usize> = ["left_foot", "right_foot"].iter().filter_map(|role| self.joint(role)).collect();
        let toes: Vec<usize> = ["left_toe", "right_toe"].iter().filter_map(|role| self.joint(role)).collect();
        let rest = world(&self.scene.skeleton, None);
        let Some(leg) = self.leg(&rest) else { return vec!["the target has no leg".to_owned()] };
        let poses: Vec<Vec<DMat4>> =
            frames_of(self.clip(), FRAMES_LOOKED_AT).into_iter().map(|frame| self.world(frame)).collect();
        let lowest = |world: &Vec<DMat4>, joints: &[usize]| {
            joints.iter().map(|&joint| position(world, joint).y).fold(f64::INFINITY, f64::min)
        };
        let off = |joints: &[usize]| {
            let heights = poses.iter().map(|posed| lowest(posed, joints)).collect();
            (percentile(heights, 0.05) - lowest(&rest, joints)) / leg
        };
        let mut problems = Vec::new();
        if LARGE_FEET.contains(&self.target.file_name.as_str()) {
            return problems;
        }
        let ankles_off = off(&ankles);
        let most = if self.source.scene.axes.is_some() { MAX_OFF_THE_FLOOR } else { MAX_OFF_AN_UNKNOWN_FLOOR };
        if ankles_off.abs() > most {
            problems.push(format!("the ankles are {:+.1} % of the leg off the floor", ankles_off * 100.0));
        }
        let toes_off = if toes.is_empty() { 0.0 } else { off(&toes) };
        if toes_off < -MAX_BELOW_THE_FLOOR {
            problems.push(format!("the toes are {:+.1} % of the leg below the floor", toes_off * 100.0));
        }
        problems
    }

    /// How much of the pelvis' way on the ground leads where the hips face.
    fn walks_forward(&self) -> Option<String> {
        let (pelvis, left, right) = (self.joint("pelvis")?, self.joint("left_thigh")?, self.joint("right_thigh")?);
        let (mut way, mut forward) = (0.0, 0.0);
        let mut before: Option<DVec3> = None;
        for frame in frames_of(self.clip(), FRAMES_LOOKED_AT) {
            let posed = self.world(frame);
            let place = position(&posed, pelvis).with_y(0.0);
            let facing = (position(&posed, left) - position(&posed, right)).cross(DVec3::Y).normalize_or_zero();
            if let Some(before) = before {
                way += (place - before).length();
                forward += (place - before).dot(facing);
            }
            before = Some(place);
        }
        let leg = self.leg(&world(&self.scene.skeleton, None))?;
        if way < leg {
            return Some(format!("the walker goes {way:.2} m only, with a leg of {leg:.2} m"));
        }
        let share = forward / way;
        (share < MIN_FORWARD).then(|| format!("the walker goes {:.0} % of its way forward", share * 100.0))
    }

    /// The target's own document is all there.
    fn document(&self) -> Vec<String> {
        if ["fbx", "bvh"].iter().any(|ending| self.target.file_name.ends_with(ending)) {
            return Vec::new();
        }
        let (before, after) = (gltf_json(&self.target.bytes), gltf_json(&self.glb));
        let mut problems = Vec::new();
        for key in ["nodes", "meshes", "materials", "images", "textures", "skins", "scenes"] {
            let names = |document: &Value| -> Vec<Value> {
                document[key].as_array().into_iter().flatten().map(|entry| entry["name"].clone()).collect()
            };
            if names(&before) != names(&after) {
                problems.push(format!("the {key} are not what they were"));
            }
        }
        problems
    }
}
