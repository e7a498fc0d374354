//! Animals with more limbs than a human or a dog has, made by code and found by their shape alone.

use std::collections::BTreeMap;

use glam::{DQuat, EulerRot};
use retargetd::rig::{Hints, Part, Recognition, RigKind, Role, recognize};

use crate::made_animals::{Beast, Random, ant, bird, dragon, hydra, spider};

/// What must be right to the last joint.
const LOOKED_AT: [Part; 15] = [
    Part::Thigh,
    Part::Shin,
    Part::Foot,
    Part::Toe,
    Part::Jaw,
    Part::Eye,
    Part::Pelvis,
    Part::Spine,
    Part::Neck,
    Part::Head,
    Part::Tail,
    Part::Leg,
    Part::FrontLeg,
    Part::HindLeg,
    Part::Wing,
];

fn seen(beast: &Beast, turn: DQuat, scale: f64, seed: u64) -> Recognition {
    let skeleton = beast.skeleton(turn, scale, &mut Random(seed));
    recognize(&skeleton, &skeleton.rest_pose().to_model(&skeleton), &Hints::default())
}

#[test]
fn animals_are_seen_in_any_space_and_unit() {
    let animals: [(&str, Beast, RigKind); 5] = [
        ("spider", spider(), RigKind::Other),
        ("ant", ant(), RigKind::Other),
        ("hydra", hydra(), RigKind::Quadruped),
        ("dragon", dragon(), RigKind::Quadruped),
        ("bird", bird(), RigKind::Biped),
    ];
    let mut wrong = Vec::new();
    for (name, beast, kind) in animals {
        let mut random = Random(7);
        let odd = DQuat::from_axis_angle(random.direction(), 2.0);
        let spaces = [
            ("as it is", DQuat::IDENTITY, 1.0),
            ("Z up, centimeters", DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2), 100.0),
            ("facing back", DQuat::from_rotation_y(std::f64::consts::PI), 0.01),
            ("facing aside, inches", DQuat::from_rotation_y(1.2), 39.37),
            ("leaning", odd, 1.0),
            ("upside down", DQuat::from_euler(EulerRot::ZYX, std::f64::consts::PI, 0.3, 0.0), 10.0),
        ];
        for (space, turn, scale) in spaces {
            let recognition = seen(&beast, turn, scale, 3);
            let found: BTreeMap<Role, Vec<usize>> = recognition
                .roles
                .iter()
                .filter(|(role, _)| LOOKED_AT.contains(&role.part))
                .map(|(role, finding)| (*role, finding.joints.clone()))
                .collect();
            if recognition.kind != kind || !recognition.is_body() || found != beast.roles {
                let other = |(role, joints): (&Role, &Vec<usize>), there: &BTreeMap<Role, Vec<usize>>| {
                    (there.get(role) != Some(joints)).then(|| format!("{role} {joints:?}"))
                };
                let missing: Vec<String> = beast.roles.iter().filter_map(|entry| other(entry, &found)).collect();
                let surplus: Vec<String> = found.iter().filter_map(|entry| other(entry, &beast.roles)).collect();
                wrong.push(format!("{name}, {space}: {:?} lacks {missing:?}, has {surplus:?}", recognition.kind));
                continue;
            }
            let body = recognition.body.expect("it stands");
            let forward = turn * glam::DVec3::Z;
            assert!(body.forward.dot(forward) > 0.9, "{name}, {space}: faces {} instead of {forward}", body.forward);
            assert!(!recognition.sides_guessed, "{name}, {space}: it has a face and a tail");
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
