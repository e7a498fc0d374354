//! Bodies that are not two of a kind: other numbers of phalanges, missing fingers, animals, and no bodies at all.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Clip, Scene, Track},
    retarget::RetargetSpec,
    rig::SpecErrorKind,
    samples,
};

use super::{
    figure::{Figure, degrees_between, frames_of, percentile, position, rotation, world},
    made_rigs::{MadeRig, clip_of, retargeted},
};
use crate::support::corpus_file;

fn joint(scene: &Scene, name: &str) -> usize {
    scene.skeleton.find(name).unwrap_or_else(|| panic!("a joint named {name}"))
}

/// A clip in which the left index finger curls by 30°, 33° and 21°: 84° together, as fingers naturally do.
fn curling(scene: &Scene) -> Clip {
    let rest = world(&scene.skeleton, None);
    let hand = rotation(&rest, joint(scene, "hand_l"));
    let turn = |name: &str, frame: usize| {
        let degrees = match name {
            "index_01_l" | "ring_01_l" => 30.0,
            "index_02_l" | "ring_02_l" => 33.0,
            "index_03_l" | "ring_03_l" => 21.0,
            _ => return None,
        };
        // One axis for all joints, so that angles add up.
        let axis = rotation(&rest, joint(scene, name)).conjugate() * (hand * DVec3::Z);
        Some(DQuat::from_axis_angle(axis, f64::to_radians(degrees * frame as f64)))
    };
    clip_of(scene, 2, turn)
}

/// How far a joint is turned against another one, against what it is at rest, at the last frame.
fn turned(scene: &Scene, clip: &Clip, of: &str, against: &str) -> f64 {
    let relative =
        |world: &[glam::DMat4]| rotation(world, joint(scene, against)).conjugate() * rotation(world, joint(scene, of));
    let (rest, now) = (world(&scene.skeleton, None), world(&scene.skeleton, Some((clip, clip.frame_count() - 1))));
    degrees_between(relative(&rest), relative(&now))
}

fn two_phalanges() -> Scene {
    MadeRig::of(&samples::mannequin_scene()).without(|name| name == "index_03_l").scene(|_| false)
}

#[test]
fn curls_are_spread_over_fewer_and_over_more_phalanges() {
    let (three, two) = (samples::mannequin_scene(), two_phalanges());
    let clip = curling(&three);
    let fewer = retargeted(&RetargetSpec::default(), &three, &clip, &two).expect("a mapping").0;
    let first = turned(&two, &fewer, "index_01_l", "hand_l");
    let whole = turned(&two, &fewer, "index_02_l", "hand_l");
    assert!((whole - 84.0).abs() < 0.1, "the whole curl stays: {whole}°");
    assert!((first - 84.0 / 2.2).abs() < 0.5, "the knuckle takes 1 part in 2.2: {first}°");
    let more = retargeted(&RetargetSpec::default(), &two, &fewer, &three).expect("a mapping").0;
    for (name, degrees) in [("index_01_l", 30.0), ("index_02_l", 63.0), ("index_03_l", 84.0)] {
        let found = turned(&three, &more, name, "hand_l");
        assert!((found - degrees).abs() < 0.5, "{name} is turned {found}° instead of {degrees}°");
    }
}

#[test]
fn a_finger_that_the_source_lacks_moves_as_the_one_beside_it() {
    let whole = samples::mannequin_scene();
    let source = MadeRig::of(&whole).without(|name| name.starts_with("pinky_")).scene(|_| false);
    let result = retargeted(&RetargetSpec::default(), &source, &curling(&source), &whole).expect("a mapping");
    let (ring, pinky) =
        (turned(&whole, &result.0, "ring_03_l", "hand_l"), turned(&whole, &result.0, "pinky_03_l", "hand_l"));
    // Its rest pose is turned to lie beside the ring finger, which counts as well.
    assert!((ring - 84.0).abs() < 0.1 && (pinky - ring).abs() < 15.0, "ring {ring}°, pinky {pinky}°");
    let again = retargeted(&result.1.spec, &source, &curling(&source), &whole).expect("the resolved spec");
    assert_eq!(again.0, result.0, "the resolved spec gives the same");
}

#[test]
fn what_is_no_body_is_mapped_by_its_names() {
    let crane = |factor: f64| {
        let names = ["base", "tower", "jib", "trolley", "hook"];
        let mut rig = MadeRig::of(&samples::mannequin_scene()).without(|name| name != "root");
        for (index, name) in names.iter().enumerate() {
            let parent = if index == 0 { "root" } else { names[index - 1] };
            rig = rig.with(name, parent, DVec3::new(0.3, 1.0, 0.2) * (index as f64 * factor));
        }
        rig.scene(|_| false)
    };
    let (source, target) = (crane(1.0), crane(2.0));
    let turn = |name: &str, frame: usize| {
        (name != "root").then(|| DQuat::from_rotation_y(frame as f64 * 0.1 + name.len() as f64 * 0.05 * frame as f64))
    };
    let mut joints = clip_of(&source, 8, turn).into_parts();
    let base = joint(&source, "base");
    let places = (0..8).map(|frame| glam::Vec3::new(0.1 * frame as f32, 0.0, 0.05));
    joints.2[base].translation = Track::Sampled(places.collect());
    let clip = Clip::new(joints.0, joints.1, joints.2).expect("a clip");
    let result = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("a mapping");
    for frame in 0..8 {
        let one = world(&source.skeleton, Some((&clip, frame)));
        let other = world(&target.skeleton, Some((&result.0, frame)));
        for name in ["base", "tower", "jib", "trolley", "hook"] {
            let (from, to) = (joint(&source, name), joint(&target, name));
            let degrees = degrees_between(rotation(&one, from), rotation(&other, to));
            assert!(degrees < 0.01, "{name} is {degrees}° off");
            let meters = (position(&one, from) * 2.0).distance(position(&other, to));
            assert!(meters < 1e-4, "{name} of a crane twice as large is {meters} m off at frame {frame}");
        }
    }
    let again = retargeted(&result.1.spec, &source, &clip, &target).expect("the resolved spec");
    assert_eq!(again.0, result.0, "the resolved spec gives the same");
}

#[test]
fn a_fox_is_no_man() {
    let Some(fox) = corpus_file("creatures/Fox.glb").map(|path| Figure::read(&path)) else { return };
    let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
    let spec = RetargetSpec::default();
    let onto_man = retargeted(&spec, &fox.scene, fox.clip(), &mannequin).expect_err("refused");
    let onto_fox = retargeted(&spec, &walk, &walk.clips[0], &fox.scene).expect_err("refused");
    for error in [onto_man, onto_fox] {
        assert_eq!(error.kind, SpecErrorKind::NothingToMap, "{error}");
        let text = error.to_string();
        assert!(text.contains("quadruped") && text.contains("biped"), "it says what differs: {text}");
    }
}

/// Joints of one fox and of the other that mean the same: a bone's start and end. Not the spine, whose slope is each animal's
/// own: it stands on both ends of it.
const FOX_BONES: [[&str; 4]; 12] = [
    ["b_Neck_04", "b_Head_05", "Spine_3", "Head"],
    ["b_LeftUpperArm_09", "b_LeftForeArm_010", "Front_Leg_Upper_L", "Front_Leg_Lower_L"],
    ["b_LeftForeArm_010", "b_LeftHand_011", "Front_Leg_Lower_L", "Front_Leg_Ankle_L"],
    ["b_RightUpperArm_06", "b_RightForeArm_07", "Front_Leg_Upper_R", "Front_Leg_Lower_R"],
    ["b_RightForeArm_07", "b_RightHand_08", "Front_Leg_Lower_R", "Front_Leg_Ankle_R"],
    ["b_LeftLeg01_015", "b_LeftLeg02_016", "Back_Leg_Upper_L", "Back_Leg_Lower_L"],
    ["b_LeftLeg02_016", "b_LeftFoot01_017", "Back_Leg_Lower_L", "Back_Leg_Ankle_L"],
    ["b_LeftFoot01_017", "b_LeftFoot02_018", "Back_Leg_Ankle_L", "Back_Leg_Foot_1_L"],
    ["b_RightLeg01_019", "b_RightLeg02_020", "Back_Leg_Upper_R", "Back_Leg_Lower_R"],
    ["b_RightLeg02_020", "b_RightFoot01_021", "Back_Leg_Lower_R", "Back_Leg_Ankle_R"],
    ["b_RightFoot01_021", "b_RightFoot02_022", "Back_Leg_Ankle_R", "Back_Leg_Foot_1_R"],
    ["b_Tail01_012", "b_Tail02_013", "Tail_Base", "Tail_Mid"],
];

/// How much lower a paw may come than it should, in heights of the pelvis.
const MAX_OFF_THE_GROUND: f64 = 0.08;

#[test]
fn a_fox_moves_another_fox() {
    let read = |name: &str| corpus_file(name).map(|path| Figure::read(&path));
    let (Some(small), Some(model), Some(clips)) =
        (read("creatures/Fox.glb"), read("creatures/m2m_fox_model.glb"), read("creatures/m2m_fox_clips.glb"))
    else {
        return;
    };
    let walk = small.scene.clips.iter().find(|clip| clip.name() == "Walk").expect("a walk");
    let run = clips.scene.clips.iter().find(|clip| clip.name() == "Run").expect("a run");
    assert_bones_agree(&small, walk, &model, |bone| [bone[0], bone[1], bone[2], bone[3]]);
    assert_bones_agree(&clips, run, &small, |bone| [bone[2], bone[3], bone[0], bone[1]]);
}

fn assert_bones_agree(
    source: &Figure,
    clip: &Clip,
    target: &Figure,
    of: impl Fn(&[&'static str; 4]) -> [&'static str; 4],
) {
    let result = retargeted(&RetargetSpec::default(), &source.scene, clip, &target.scene).expect("a mapping").0;
    let mut problems = Vec::new();
    for bone in &FOX_BONES {
        let [from, to, start, end] = of(bone);
        let (from, to) = (joint(&source.scene, from), joint(&source.scene, to));
        let joints = (joint(&target.scene, start), joint(&target.scene, end));
        let angle = |frame: usize| {
            let one = world(source.skeleton(), Some((clip, frame)));
            let other = world(target.skeleton(), Some((&result, frame)));
            let wanted = position(&one, to) - position(&one, from);
            wanted.angle_between(position(&other, joints.1) - position(&other, joints.0)).to_degrees()
        };
        let degrees = percentile(frames_of(clip, 60).into_iter().map(angle).collect(), 0.95);
        if degrees > 5.0 {
            problems.push(format!("{start} is {degrees:.1}° off"));
        }
    }
    let paws = of(&["b_LeftHand_011", "b_LeftFoot02_018", "Front_Leg_Foot_L", "Back_Leg_Foot_1_L"]);
    // How low a paw comes against its rest, in heights of the pelvis.
    let lowest = |figure: &Figure, clip: &Clip, paw: &str| {
        let paw = joint(&figure.scene, paw);
        let height = |clip: Option<(&Clip, usize)>| position(&world(figure.skeleton(), clip), paw).y;
        let heights = frames_of(clip, 60).into_iter().map(|frame| height(Some((clip, frame)))).collect();
        let pelvis = position(&world(figure.skeleton(), None), figure.roles["pelvis"]).y;
        (percentile(heights, 0.05) - height(None)) / pelvis
    };
    for (from, to) in [(paws[0], paws[2]), (paws[1], paws[3])] {
        let (wanted, found) = (lowest(source, clip, from), lowest(target, &result, to));
        if (found - wanted).abs() > MAX_OFF_THE_GROUND {
            problems.push(format!("{to} comes {:.3} of the height lower than it should", wanted - found));
        }
    }
    assert!(problems.is_empty(), "{} onto {}: {}", source.file_name, target.file_name, problems.join(", "));
}
