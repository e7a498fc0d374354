//! Animals with other numbers of limbs moving one another.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Clip, Reporter, Scene},
    retarget::{RetargetSpec, resolve},
    rig::{Rig, SpecErrorKind},
    samples,
};

use super::{
    figure::{Figure, degrees_between, position, rotation, world},
    made_rigs::{clip_of, retargeted},
};
use crate::{
    made_animals::{Beast, Random, ant, dragon, hydra, spider},
    support::corpus_file,
};

const FRAMES: usize = 12;

/// A clip in which every leg swings to and fro in its own time, and the head nods.
fn walk(beast: &Beast, scene: &Scene) -> Clip {
    let mut phases = vec![None; scene.skeleton.len()];
    for (index, (role, joints)) in beast.roles.iter().enumerate() {
        let moves = ["leg", "head", "neck", "wing", "tail"].iter().any(|part| role.to_string().contains(part));
        joints.iter().take(2).filter(|_| moves).for_each(|joint| phases[*joint] = Some(index as f64));
    }
    clip_of(scene, FRAMES, |name, frame| {
        let joint = scene.skeleton.find(name)?;
        let angle = 0.3 * (2.0 * PI * frame as f64 / FRAMES as f64 + phases[joint]?).sin();
        Some(DQuat::from_axis_angle(DVec3::new(0.3, 0.9, 0.2).normalize(), angle))
    })
}

fn place(scene: &Scene, clip: &Clip, joint: usize, frame: usize) -> DVec3 {
    position(&world(&scene.skeleton, Some((clip, frame))), joint) * scene.unit_meters.unwrap_or(1.0)
}

/// The same animal with other names, joint axes, unit, size in the file and way of facing.
#[test]
fn an_animal_moves_itself_in_another_space_as_it_is() {
    for (name, beast) in [("spider", spider()), ("ant", ant()), ("hydra", hydra()), ("dragon", dragon())] {
        let source = beast.scene(DQuat::IDENTITY, 1.0, &mut Random(1));
        let turn = DQuat::from_rotation_x(PI / 2.0) * DQuat::from_rotation_y(PI / 2.0);
        let mut target = beast.scene(turn, 100.0, &mut Random(2));
        target.unit_meters = Some(0.01);
        target.axes = None;
        let clip = walk(&beast, &source);
        let (result, ..) = retargeted(&RetargetSpec::default(), &source, &clip, &target)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        for frame in 0..FRAMES {
            for (role, joints) in &beast.roles {
                let (first, last) = (joints[0], joints[joints.len() - 1]);
                for joint in [first, last] {
                    let wanted = turn * place(&source, &clip, joint, frame);
                    let off = wanted.distance(place(&target, &result, joint, frame));
                    assert!(off < 1e-4, "{name}: {role} is {off} m off at frame {frame}");
                }
                let rest = [&source, &target].map(|scene| world(&scene.skeleton, None));
                let now = [(&source, &clip), (&target, &result)]
                    .map(|(scene, clip)| world(&scene.skeleton, Some((clip, frame))));
                let turned = |side: usize| rotation(&now[side], last) * rotation(&rest[side], last).conjugate();
                let degrees = degrees_between(turn * turned(0) * turn.conjugate(), turned(1));
                assert!(degrees < 0.01, "{name}: {role} is turned {degrees}° otherwise at frame {frame}");
            }
        }
    }
}

/// How far the last joint of a role goes in a clip, in meters.
fn travel(beast: &Beast, scene: &Scene, clip: &Clip, role: &str) -> f64 {
    let joints = &beast.roles[&role.parse().expect("a role")];
    let last = joints[joints.len() - 1];
    let first = place(scene, clip, last, 0);
    (0..FRAMES).map(|frame| place(scene, clip, last, frame).distance(first)).fold(0.0, f64::max)
}

/// Which legs of the target move, and which are said not to.
fn moved(from: &Beast, to: &Beast) -> (Vec<String>, Vec<&'static str>) {
    let source = from.scene(DQuat::IDENTITY, 1.0, &mut Random(1));
    let target = to.scene(DQuat::from_rotation_y(1.0), 1.0, &mut Random(2));
    let clip = walk(from, &source);
    let (result, _, codes) = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("in part");
    let legs =
        to.roles.keys().map(ToString::to_string).filter(|role| role.starts_with("left_") && role.contains("leg"));
    (legs.filter(|role| travel(to, &target, &result, role) > 0.02).collect(), codes)
}

#[test]
fn legs_move_legs_from_front_to_hind() {
    let (legs, codes) = moved(&spider(), &ant());
    assert_eq!(legs, ["left_leg_1", "left_leg_2", "left_leg_3"], "a spider has a leg for each of an ant's");
    assert!(!codes.contains(&"limbs_not_mapped"), "{codes:?}");
    let (legs, codes) = moved(&ant(), &spider());
    assert_eq!(legs, ["left_leg_1", "left_leg_3", "left_leg_4"], "an ant has none for one of a spider's");
    assert!(codes.contains(&"limbs_not_mapped"), "which is said: {codes:?}");
    let (legs, codes) = moved(&dragon(), &ant());
    assert_eq!(legs, ["left_leg_1", "left_leg_3"], "four legs are the first and the last of six");
    assert!(codes.contains(&"limbs_not_mapped"), "which is said: {codes:?}");
    let (legs, _) = moved(&ant(), &dragon());
    assert_eq!(legs, ["left_front_leg", "left_hind_leg"], "and the other way round");
}

#[test]
fn the_heads_of_a_hydra_look_where_the_one_head_looks() {
    let (dragon, hydra) = (dragon(), hydra());
    let source = dragon.scene(DQuat::IDENTITY, 1.0, &mut Random(1));
    let target = hydra.scene(DQuat::IDENTITY, 1.0, &mut Random(2));
    let clip = walk(&dragon, &source);
    let (result, ..) = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("four legs each");
    for role in ["head", "left_head", "right_head"] {
        assert!(travel(&hydra, &target, &result, role) > 0.05, "{role} moves");
    }
}

#[test]
fn a_man_is_no_spider() {
    let beast = spider().scene(DQuat::IDENTITY, 1.0, &mut Random(1));
    let walk = samples::walk_scene();
    let error = retargeted(&RetargetSpec::default(), &walk, &walk.clips[0], &beast).expect_err("refused");
    assert_eq!(error.kind, SpecErrorKind::NothingToMap, "{error}");
    let text = error.to_string();
    assert!(text.contains("biped") && text.contains("creature on 8 legs"), "it says what differs: {text}");
}

/// A real spider, driven by one that is made.
#[test]
fn a_made_spider_moves_a_real_one() {
    let Some(real) = corpus_file("creatures/m2m_rig_spider.glb").map(|path| Figure::read(&path)) else { return };
    let made = spider();
    let source = made.scene(DQuat::from_rotation_y(2.0), 1.0, &mut Random(5));
    let clip = walk(&made, &source);
    let (result, _, codes) = retargeted(&RetargetSpec::default(), &source, &clip, &real.scene).expect("a mapping");
    assert!(!codes.contains(&"limbs_not_mapped"), "all eight legs have a driver: {codes:?}");
    for leg in ["leg_a_tip_l", "leg_b_tip_l", "leg_c_tip_r", "leg_d_tip_r"] {
        let joint = real.scene.skeleton.find(leg).expect("a tip");
        let travel = (0..FRAMES)
            .map(|frame| place(&real.scene, &result, joint, frame).distance(place(&real.scene, &result, joint, 0)))
            .fold(0.0, f64::max);
        assert!(travel > 0.05, "{leg} moves {travel} m");
    }
}

/// Every leg of an animal is a limb, of as many bones as it has.
#[test]
fn all_legs_of_an_animal_are_limbs() {
    for (name, beast, legs) in
        [("spider", spider(), 8), ("ant", ant(), 6), ("hydra", hydra(), 4), ("dragon", dragon(), 4)]
    {
        let source = beast.scene(DQuat::IDENTITY, 1.0, &mut Random(1));
        let target = beast.scene(DQuat::IDENTITY, 2.0, &mut Random(2));
        let clip = walk(&beast, &source);
        let spec = RetargetSpec::default();
        let rig = |scene| Rig::new("rig", scene, None, &spec.source, &mut Reporter::new()).expect("a rig");
        let mapping =
            resolve(&spec, &rig(&source), &rig(&target), &clip, &mut Reporter::new()).expect("a mapping").mapping;
        assert_eq!(mapping.limbs.len(), legs, "{name}");
        let last = |joints: &[usize]| joints[joints.len() - 1];
        for pair in &mapping.limbs {
            let role = pair.limb.whole_leg().expect("a leg of an animal");
            let leg = &beast.roles[&role];
            assert_eq!(pair.target.start, leg[0], "{name}: {role}");
            assert!(leg[2..].contains(&pair.target.end), "{name}: {role} ends at joint {}", pair.target.end);
            assert!(pair.target.ball.is_none_or(|ball| ball <= last(leg)), "{name}: {role}");
            assert!(pair.target_foot.points.iter().all(|point| point.from_end.is_finite()), "{name}: {role}");
        }
    }
}
