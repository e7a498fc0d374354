//! Generated skeletons: every spelling of sides under every prefix, and what a hostile or odd file could hold.

use std::collections::BTreeMap;

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Hints, Part, Recognition, RigKind, Role, Side, recognise},
};

/// A joint of a small figure: part name without a side, whether it has sides, parent, and place relative to it on the left.
type Bone = (&'static str, bool, Option<usize>, [f64; 3]);

const FIGURE: &[Bone] = &[
    ("Hips", false, None, [0.0, 1.0, 0.0]),
    ("Spine", false, Some(0), [0.0, 0.2, 0.0]),
    ("Chest", false, Some(1), [0.0, 0.2, 0.0]),
    ("Neck", false, Some(2), [0.0, 0.15, 0.0]),
    ("Head", false, Some(3), [0.0, 0.1, 0.0]),
    ("Clavicle", true, Some(2), [0.05, 0.1, 0.0]),
    ("UpperArm", true, Some(5), [0.1, 0.0, 0.0]),
    ("ForeArm", true, Some(6), [0.3, 0.0, 0.0]),
    ("Hand", true, Some(7), [0.25, 0.0, 0.0]),
    ("Thigh", true, Some(0), [0.1, -0.05, 0.0]),
    ("Calf", true, Some(9), [0.0, -0.45, 0.0]),
    ("Foot", true, Some(10), [0.0, -0.42, 0.0]),
    ("Toe", true, Some(11), [0.0, -0.06, 0.15]),
];

/// Builds the figure with names from a function of part and side.
fn figure(name: impl Fn(&str, Side) -> String) -> Skeleton {
    let mut joints: Vec<Joint> = Vec::new();
    let mut index_of: BTreeMap<(usize, Side), usize> = BTreeMap::new();
    for (bone, (part, sided, parent, place)) in FIGURE.iter().enumerate() {
        let sides: &[Side] = if *sided { &Side::BOTH } else { &[Side::Center] };
        for side in sides {
            let mirror = if *side == Side::Right { -1.0 } else { 1.0 };
            let parent = parent
                .map(|parent| *index_of.get(&(parent, *side)).unwrap_or_else(|| &index_of[&(parent, Side::Center)]));
            index_of.insert((bone, *side), joints.len());
            joints.push(Joint {
                name: name(part, *side),
                parent,
                rest: Transform::from_translation(DVec3::new(place[0] * mirror, place[1], place[2])),
                is_joint: true,
                node: joints.len(),
            });
        }
    }
    Skeleton::new(joints).expect("parents come first")
}

fn recognised(skeleton: &Skeleton) -> Recognition {
    recognise(skeleton, &skeleton.rest_pose().to_model(skeleton), &Hints::default())
}

#[test]
fn sides_are_read_in_every_spelling_under_every_prefix() {
    let prefixes = [
        "",
        "mixamorig:",
        "mixamorig9:",
        "mixamorig_",
        "Avatar_",
        "Hero:",
        "Hero_",
        "CC_Base_",
        "DEF-",
        "Bip01 ",
        "J_Bip_",
    ];
    type Spelling = fn(&str, bool) -> String;
    let spellings: [(&str, Spelling); 10] = [
        ("LeftX", |part, left| format!("{}{part}", if left { "Left" } else { "Right" })),
        ("leftX", |part, left| format!("{}{part}", if left { "left" } else { "right" })),
        ("left_x", |part, left| format!("{}_{}", if left { "left" } else { "right" }, part.to_lowercase())),
        ("X_L", |part, left| format!("{part}_{}", if left { "L" } else { "R" })),
        ("x_l", |part, left| format!("{}_{}", part.to_lowercase(), if left { "l" } else { "r" })),
        ("X.L", |part, left| format!("{part}.{}", if left { "L" } else { "R" })),
        ("L_X", |part, left| format!("{}_{part}", if left { "L" } else { "R" })),
        ("lX", |part, left| format!("{}{part}", if left { "l" } else { "r" })),
        ("l-x", |part, left| format!("{}-{}", if left { "l" } else { "r" }, part.to_lowercase())),
        ("X Left", |part, left| format!("{part} {}", if left { "Left" } else { "Right" })),
    ];
    for prefix in prefixes {
        for (spelling, sided) in spellings {
            let skeleton = figure(|part, side| match side {
                Side::Center => format!("{prefix}{part}"),
                side => format!("{prefix}{}", sided(part, side == Side::Left)),
            });
            let recognition = recognised(&skeleton);
            let context = format!("'{prefix}' with {spelling}");
            assert_eq!(recognition.kind, RigKind::Biped, "{context}");
            assert_eq!(recognition.roles.len(), 4 + 16, "{context}: every joint but none twice");
            for (role, finding) in &recognition.roles {
                let x = skeleton.rest_pose().to_model(&skeleton).transforms()[finding.joints[0]].translation.x;
                let side = if x > 0.0 { Side::Left } else { Side::Right };
                assert!(role.side == Side::Center || role.side == side, "{context}: {role} at x = {x}");
            }
            assert_eq!(recognition.roles[&Role::center(Part::Spine)].joints, [1, 2], "{context}");
            assert_eq!(recognition.rest_pose.name(), "T", "{context}");
        }
    }
}

#[test]
fn feet_overrule_sides_that_are_named_the_wrong_way_round() {
    let skeleton = figure(|part, side| match side {
        Side::Center => part.to_owned(),
        Side::Left => format!("{part}_R"),
        Side::Right => format!("{part}_L"),
    });
    let recognition = recognised(&skeleton);
    let hand = &recognition.roles[&Role::new(Side::Left, Part::Hand)];
    assert_eq!(skeleton.joints()[hand.joints[0]].name, "Hand_R", "the hand on the left");
    assert!(recognition.sides_swapped, "said for all");
    assert!(hand.reasons.iter().any(|reason| reason.contains("feet")), "and for each: {:?}", hand.reasons);
    let forward = recognition.body.expect("a body").forward;
    assert!((forward - DVec3::Z).length() < 1e-9, "the toes point forward: {forward}");
}

#[test]
fn declared_roles_win_over_names() {
    let skeleton = figure(|part, side| match side {
        Side::Center => part.to_owned(),
        Side::Left => format!("{part}_L"),
        Side::Right => format!("{part}_R"),
    });
    let index = |name: &str| skeleton.find(name).expect("a joint of the figure");
    // Nonsense on purpose, and a joint that does not exist.
    let declared = [("hips".to_owned(), index("Hips")), ("head".to_owned(), index("Neck")), ("jaw".to_owned(), 999)];
    let rest = skeleton.rest_pose().to_model(&skeleton);
    let recognition =
        recognise(&skeleton, &rest, &Hints { declared: &declared, convention: Some("vrm"), templates: &[] });
    let head = &recognition.roles[&Role::center(Part::Head)];
    assert_eq!((head.joints.as_slice(), head.confidence), (&[index("Neck")][..], 1.0), "declared, so certain");
    assert!(!recognition.roles.contains_key(&Role::center(Part::Jaw)), "an index out of range is nothing");
    assert_eq!(recognition.recognised_as.as_deref(), Some("vrm"), "by its declaration");
}

#[test]
fn odd_skeletons_are_no_body_and_no_trouble() {
    let flat = |names: &[&str]| {
        let joint = |(node, name): (usize, &&str)| Joint {
            name: (*name).to_owned(),
            parent: None,
            rest: Transform::IDENTITY,
            is_joint: true,
            node,
        };
        Skeleton::new(names.iter().enumerate().map(joint).collect()).expect("no parents")
    };
    for names in [&[][..], &["", "", ""], &["Hips"], &["LeftArm", "LeftArm", "LeftArm"], &["左", "\u{0}", "ﬀ_L"]] {
        let recognition = recognised(&flat(names));
        assert_eq!(recognition.kind, RigKind::Other, "{names:?}");
        assert!(recognition.body.is_none(), "{names:?}");
    }
    // Deep and wide, all with one name: must neither overflow the stack nor take forever.
    let count = 20_000;
    let joint = |node: usize| Joint {
        name: if node.is_multiple_of(2) { "LeftForeArm" } else { "LeftArm" }.to_owned(),
        parent: (node > 0).then(|| if node.is_multiple_of(3) { 0 } else { node - 1 }),
        rest: Transform::IDENTITY,
        is_joint: true,
        node,
    };
    let skeleton = Skeleton::new((0..count).map(joint).collect()).expect("parents come first");
    assert_eq!(recognised(&skeleton).kind, RigKind::Other, "an arm is no body");
}

#[test]
fn the_largest_of_two_bodies_is_taken() {
    let named = |suffix: &str| {
        let suffix = suffix.to_owned();
        figure(move |part, side| match side {
            Side::Center => format!("{part}{suffix}"),
            Side::Left => format!("Left{part}{suffix}"),
            Side::Right => format!("Right{part}{suffix}"),
        })
    };
    let (small, large) = (named(".001"), named(""));
    let kept = 11; // The small one has no right arm's end and no legs.
    let mut joints: Vec<Joint> = small.joints()[..kept].to_vec();
    let shifted = large.joints().iter().cloned().map(|mut joint| {
        joint.parent = joint.parent.map(|parent| parent + kept);
        joint.node += kept;
        joint
    });
    joints.extend(shifted);
    let skeleton = Skeleton::new(joints).expect("parents come first");
    let recognition = recognised(&skeleton);
    assert_eq!(recognition.kind, RigKind::Biped, "the whole one");
    let inside = recognition.roles.values().flat_map(|finding| &finding.joints).all(|joint| *joint >= kept);
    assert!(inside, "no joint of the other");
}
