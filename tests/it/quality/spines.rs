//! Spines of other shapes and other numbers of joints.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Reporter, Scene},
    retarget::RetargetSpec,
    rig::{HowAligned, PoseChoice, Rig, posed_target},
    samples,
};

use super::{
    figure::{degrees_between, rotation, world},
    made_rigs::{MadeRig, clip_of, retargeted},
};

/// The mannequin with so many spine joints, spaced evenly along a curve whose middle is `bow` meters in front of the straight line
/// from its lowest spine joint to its neck.
fn spined(joints: usize, bow: f64) -> Scene {
    let mut rig = MadeRig::of(&samples::mannequin_scene());
    let (start, end) = (rig.place("spine_01"), rig.place("neck_01"));
    let place = |joint: usize| {
        let share = joint as f64 / joints as f64;
        start.lerp(end, share) + DVec3::Z * bow * (share * std::f64::consts::PI).sin()
    };
    let name = |joint: usize| format!("spine_{:02}", joint + 11);
    for joint in 0..joints {
        let parent = joint.checked_sub(1).map_or_else(|| "pelvis".to_owned(), name);
        rig = rig.with(&name(joint), &parent, place(joint));
    }
    for carried in ["clavicle_l", "clavicle_r", "neck_01"] {
        rig = rig.hung_from(carried, &name(joints - 1));
    }
    rig.without(|name| name.starts_with("spine_0")).scene(|_| false)
}

fn spec(align: &str) -> RetargetSpec {
    serde_json::from_value(serde_json::json!({ "align": align })).expect("a spec")
}

fn chest(scene: &Scene) -> usize {
    scene.skeleton.parent(scene.skeleton.find("neck_01").expect("a neck")).expect("a chest")
}

/// The source stays as it rests. What comes out: how far the chest is turned from the target's own rest pose, and the spine.
fn at_rest(source: &Scene, target: &Scene, align: &str) -> (f64, Vec<DVec3>, Vec<(HowAligned, f64)>) {
    let still = clip_of(source, 1, |_, _| Some(DQuat::IDENTITY));
    let (result, resolved, _) = retargeted(&spec(align), source, &still, target).expect("a retarget");
    let (posed, rest) = (world(&target.skeleton, Some((&result, 0))), world(&target.skeleton, None));
    let turned = degrees_between(rotation(&posed, chest(target)), rotation(&rest, chest(target)));
    let spine = resolved.alignment.iter().filter(|joint| joint.name == "spine");
    let left = spine.map(|joint| (joint.how, joint.direction_degrees.expect("a direction"))).collect();
    let joints = (0..target.skeleton.len()).filter(|joint| target.skeleton.label(*joint).starts_with("spine_"));
    (turned, joints.map(|joint| posed[joint].w_axis.truncate()).collect(), left)
}

/// How far the places of a chain are from a curve, at most.
fn off_the_curve(places: &[DVec3], curve: &[DVec3]) -> f64 {
    let to_bone = |place: DVec3, bone: &[DVec3]| {
        let way = bone[1] - bone[0];
        let share = ((place - bone[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0);
        place.distance(bone[0] + way * share)
    };
    let nearest = |place: &DVec3| curve.windows(2).map(|bone| to_bone(*place, bone)).fold(f64::INFINITY, f64::min);
    places.iter().map(nearest).fold(0.0, f64::max)
}

#[test]
fn the_same_curve_stays_whatever_the_number_of_its_joints() {
    for (from, to) in [(3, 5), (5, 3), (4, 7), (6, 6)] {
        for align in ["auto", "direction", "full"] {
            let (source, target) = (spined(from, 0.06), spined(to, 0.06));
            let (turned, ..) = at_rest(&source, &target, align);
            assert!(turned < 4.0, "{from} onto {to}, {align}: the chest is turned by {turned:.2}°");
        }
    }
}

#[test]
fn a_straight_spine_bends_as_a_bent_one_does() {
    let (bent, straight) = (spined(5, 0.09), spined(4, 0.0));
    let twin = spined(40, 0.09);
    let curve: Vec<DVec3> = (0..twin.skeleton.len())
        .filter(|joint| twin.skeleton.label(*joint).starts_with("spine_"))
        .map(|joint| world(&twin.skeleton, None)[joint].w_axis.truncate())
        .collect();
    let (_, plain, _) = at_rest(&bent, &straight, "off");
    assert!(off_the_curve(&plain, &curve) > 0.06, "without alignment it stays straight");
    for align in ["auto", "full"] {
        let (_, places, left) = at_rest(&bent, &straight, align);
        let off = off_the_curve(&places, &curve);
        assert!(off < 0.03, "{align}: {off:.3} m off the curve");
        assert!(left.iter().all(|(how, degrees)| *how != HowAligned::Whole && *degrees < 0.01), "{left:?}");
    }
}

/// A spine that is bent no more than riggers' joints are apart keeps its own bends, and what is left is told by joint.
#[test]
fn small_differences_are_told_and_not_taken_over() {
    let (bent, straight) = (spined(5, 0.03), spined(4, 0.0));
    let (turned, _, left) = at_rest(&bent, &straight, "auto");
    assert!(turned < 1.0, "the chest keeps how it is: {turned:.2}°");
    let most = left.iter().map(|(_, degrees)| *degrees).fold(0.0, f64::max);
    assert!((5.0..25.0).contains(&most), "{most:.2}°");
    assert!(left[1..].iter().all(|(how, _)| *how == HowAligned::Whole), "{left:?}");
    let (_, _, left) = at_rest(&bent, &straight, "full");
    assert!(left.iter().all(|(how, degrees)| *how != HowAligned::Whole && *degrees < 0.01), "{left:?}");
}

/// A T pose stands straight up; the bends of a body that stands stay its own.
#[test]
fn a_bent_spine_is_straight_in_a_t_pose() {
    for (bow, is_straight) in [(0.12, true), (0.03, false)] {
        let scene = spined(5, bow);
        let spec = RetargetSpec::default();
        let rig = Rig::new("target", &scene, None, &spec.target, &mut Reporter::new()).expect("a rig");
        let posed = posed_target(None, &rig, PoseChoice::T, spec.align).expect("a pose");
        let model = posed.pose.to_model(&scene.skeleton);
        let place = |joint: usize| model.transforms()[joint].translation;
        let most = rig.role("spine").windows(2).map(|bone| (place(bone[1]) - place(bone[0])).angle_between(DVec3::Y));
        let most = most.fold(0.0, f64::max).to_degrees();
        assert_eq!(most < 0.1, is_straight, "{bow} m: {most:.2}°");
    }
}

/// The mannequin with its head as far from its neck as it is, but ahead of it by such an angle.
fn hunched(degrees: f64) -> Scene {
    let rig = MadeRig::of(&samples::mannequin_scene());
    let [neck, middle, head] = ["neck_01", "neck_02", "head"].map(|name| rig.place(name));
    let ahead = DVec3::new(0.0, degrees.to_radians().cos(), degrees.to_radians().sin());
    let at = |place: DVec3| neck + ahead * neck.distance(place);
    rig.moved("neck_02", at(middle)).moved("head", at(head)).scene(|_| false)
}

/// A creature whose head sits ahead of its chest holds it level: a neck that leads forward is how it is made, and no bow.
#[test]
fn the_neck_of_a_hunched_creature_folds_no_other_neck() {
    let target = samples::mannequin_scene();
    let neck = target.skeleton.find("neck_01").expect("a neck");
    for (degrees, least, most) in [(30.0, 0.0, 1.0), (65.0, 0.0, 1.0), (100.0, 60.0, 100.0)] {
        let source = hunched(degrees);
        let still = clip_of(&source, 1, |_, _| Some(DQuat::IDENTITY));
        let (result, ..) = retargeted(&spec("auto"), &source, &still, &target).expect("a retarget");
        let (posed, rest) = (world(&target.skeleton, Some((&result, 0))), world(&target.skeleton, None));
        let turned = degrees_between(rotation(&posed, neck), rotation(&rest, neck));
        assert!((least..most).contains(&turned), "{degrees} degrees ahead: the neck is turned by {turned:.1}");
    }
}
