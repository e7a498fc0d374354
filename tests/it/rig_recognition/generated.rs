//! Generated skeletons: every spelling of sides under every prefix, and what a hostile or odd file could hold.

use std::collections::BTreeMap;

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Hints, Part, Recognition, RigKind, Role, Side, parse_template, recognize},
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

fn recognized(skeleton: &Skeleton) -> Recognition {
    recognize(skeleton, &skeleton.rest_pose().to_model(skeleton), &Hints::default())
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
            let recognition = recognized(&skeleton);
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
    let recognition = recognized(&skeleton);
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
        recognize(&skeleton, &rest, &Hints { declared: &declared, convention: Some("vrm"), ..Hints::default() });
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
        let recognition = recognized(&flat(names));
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
    assert_eq!(recognized(&skeleton).kind, RigKind::Other, "an arm is no body");
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
    let recognition = recognized(&skeleton);
    assert_eq!(recognition.kind, RigKind::Biped, "the whole one");
    let inside = recognition.roles.values().flat_map(|finding| &finding.joints).all(|joint| *joint >= kept);
    assert!(inside, "no joint of the other");
}

#[test]
fn joints_without_meaning_are_seen_by_their_shape() {
    type Naming = fn(&str, Side) -> String;
    let namings: [(&str, Naming); 3] = [
        ("no names", |_, _| String::new()),
        ("one name for all", |_, _| "joint".to_owned()),
        ("words of another language", |part, side| {
            let words = [("Hips", "taz"), ("Spine", "kregoslup"), ("Head", "glowa"), ("ForeArm", "przedramie")];
            let word = words.iter().find(|(english, _)| *english == part).map_or("kosc", |(_, word)| *word);
            format!("{word}_{side:?}").replace("Left", "lewa").replace("Right", "prawa")
        }),
    ];
    for (what, naming) in namings {
        let skeleton = figure(naming);
        let recognition = recognized(&skeleton);
        assert_eq!(recognition.kind, RigKind::Biped, "{what}");
        assert!(recognition.by_shape, "{what}: said, so that users look at it");
        let named = figure(|part, side| format!("{side:?}{part}").replace("Center", ""));
        let expected = recognized(&named);
        for (role, finding) in &expected.roles {
            let seen = &recognition.roles[role];
            assert_eq!(seen.joints, finding.joints, "{what}: {role}");
            assert!(seen.confidence < 0.9, "{what}: one witness is not two: {role} {}", seen.confidence);
            assert!(finding.confidence > 0.95, "two witnesses that agree are sure: {role} {}", finding.confidence);
        }
        assert_eq!(recognition.roles.len(), expected.roles.len(), "{what}: nothing more");
    }
}

#[test]
fn names_that_contradict_the_shape_are_doubted() {
    // Every joint of the legs is named as the one below it.
    let lie = |part: &str| match part {
        "Thigh" => "Calf".to_owned(),
        "Calf" => "Foot".to_owned(),
        "Foot" => "Toe".to_owned(),
        "Toe" => "Thigh".to_owned(),
        part => part.to_owned(),
    };
    let skeleton = figure(|part, side| format!("{side:?}{}", lie(part)).replace("Center", ""));
    let recognition = recognized(&skeleton);
    let truth = recognized(&figure(|part, side| format!("{side:?}{part}").replace("Center", "")));
    for (role, finding) in &recognition.roles {
        let is_right = truth.roles[role].joints == finding.joints;
        assert!(is_right || finding.confidence < 0.9, "{role} is wrong and sure of it: {finding:?}");
    }
    let doubted = recognition.roles.values().filter(|finding| finding.confidence < 0.9).count();
    assert!(doubted >= 4, "the legs are doubted: {:?}", recognition.roles);
    assert!(recognition.roles[&Role::new(Side::Left, Part::UpperArm)].confidence > 0.95, "the arms are not");
}

#[test]
fn a_template_of_the_users_names_what_no_lexicon_knows() {
    let code = |part: &str, side: Side| {
        let number = FIGURE.iter().position(|bone| bone.0 == part).expect("a bone of the figure");
        format!(
            "HX{number:02}{}",
            match side {
                Side::Left => "p",
                Side::Right => "q",
                Side::Center => "",
            }
        )
    };
    let document = serde_json::json!({
        "name": "house_rig", "kind": "biped", "prefixes": ["HX"], "sides": [["p"], ["q"]],
        "roles": {
            "pelvis": ["00"], "spine": ["01", "02"], "neck": ["03"], "head": ["04"], "clavicle": ["05{side}"],
            "upper_arm": ["06{side}"], "forearm": ["07{side}"], "hand": ["08{side}"], "thigh": ["09{side}"],
            "shin": ["10{side}"], "foot": ["11{side}"], "toe": ["12{side}"],
        },
    });
    let templates = [parse_template(document).expect("a template")];
    let skeleton = figure(code);
    let rest = skeleton.rest_pose().to_model(&skeleton);
    let recognition =
        recognize(&skeleton, &rest, &Hints { recognizer: templates.as_slice().into(), ..Hints::default() });
    assert_eq!(recognition.recognised_as.as_deref(), Some("house_rig"), "by its own name");
    assert!(!recognition.by_shape, "the template says what the names mean");
    assert_eq!(recognition.roles.len(), 4 + 16, "every joint");
    let foot = &recognition.roles[&Role::new(Side::Right, Part::Foot)];
    assert_eq!(skeleton.joints()[foot.joints[0]].name, "HX11q", "each where it belongs");
    assert!(foot.confidence > 0.95, "as sure as any name: {foot:?}");
}

#[test]
fn helpers_props_and_wings_are_told() {
    let plain = figure(|part, side| format!("{side:?}{part}").replace("Center", ""));
    let index = |name: &str| plain.find(name).expect("a joint of the figure");
    let mut joints = plain.joints().to_vec();
    let mut hang = |name: &str, parent: &str, place: [f64; 3]| {
        let parent = joints.iter().position(|joint| joint.name == parent).expect("it is there");
        let rest = Transform::from_translation(DVec3::from_array(place));
        joints.push(Joint { name: name.to_owned(), parent: Some(parent), rest, is_joint: true, node: joints.len() });
    };
    hang("LeftForeArmTwist", "LeftForeArm", [0.1, 0.0, 0.0]);
    hang("bone_7", "RightUpperArm", [-0.15, 0.0, 0.0]);
    hang("Sword", "RightHand", [-0.05, 0.0, 0.0]);
    hang("SwordTip", "Sword", [0.0, 0.0, 0.6]);
    hang("Wing1_L", "Chest", [0.05, 0.05, -0.1]);
    hang("Wing2_L", "Wing1_L", [0.3, 0.2, -0.1]);
    let skeleton = Skeleton::new(joints).expect("parents come first");
    let recognition = recognized(&skeleton);
    let name = |joint: usize| skeleton.joints()[joint].name.as_str();
    let twists: Vec<(&str, String, f64)> = recognition
        .twists
        .iter()
        .map(|helper| (name(helper.joint), helper.role.to_string(), (helper.fraction * 100.0).round() / 100.0))
        .collect();
    assert_eq!(
        twists,
        [("LeftForeArmTwist", "left_forearm".to_owned(), 0.4), ("bone_7", "right_upper_arm".to_owned(), 0.5)],
        "by name, and a nameless leaf in the middle of a segment"
    );
    let props: Vec<(&str, Side)> = recognition.props.iter().map(|prop| (name(prop.joint), prop.side)).collect();
    assert_eq!(props, [("Sword", Side::Right)], "the topmost joint of what the hand holds");
    let wing = &recognition.roles[&Role::new(Side::Left, Part::Wing)];
    assert_eq!(wing.joints.iter().map(|joint| name(*joint)).collect::<Vec<_>>(), ["Wing1_L", "Wing2_L"], "outward");
    assert_eq!(
        recognition.roles[&Role::new(Side::Left, Part::Hand)].joints,
        [index("LeftHand")],
        "and nothing else moves"
    );
}
