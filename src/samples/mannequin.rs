//! The mannequin's body: 1.65 m, long legs and short arms, Unreal 5 names and bone axes, A pose.

use std::f64::consts::FRAC_PI_4;

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::{
    capsules::Shape,
    figure::{BoneAxes, Figure, Row, Sides},
};

const UPPER_ARM: DVec3 = dvec3(0.145, 1.345, -0.015);
const UPPER_ARM_LENGTH: f64 = 0.245;
const LOWER_ARM_LENGTH: f64 = 0.21;
const HIP: DVec3 = dvec3(0.085, 0.925, 0.0);
const KNEE: DVec3 = dvec3(0.095, 0.5, 0.012);
const ANKLE: DVec3 = dvec3(0.1, 0.085, -0.02);
const BALL: DVec3 = dvec3(0.107, 0.022, 0.1);
/// The middle of the rounded back of the sole.
const HEEL: DVec3 = dvec3(0.1, 0.032, -0.045);
const TOE: DVec3 = dvec3(0.11, 0.022, 0.165);
const CROWN: DVec3 = dvec3(0.0, 1.65, 0.015);

/// The arm hangs 45° down.
fn arm_direction() -> DVec3 {
    dvec3(FRAC_PI_4.cos(), -FRAC_PI_4.sin(), 0.0)
}

fn elbow() -> DVec3 {
    UPPER_ARM + arm_direction() * UPPER_ARM_LENGTH
}

fn wrist() -> DVec3 {
    elbow() + dvec3(arm_direction().x, arm_direction().y, 0.08).normalize() * LOWER_ARM_LENGTH
}

/// The mannequin in its rest pose, meters.
pub(super) fn figure() -> Figure {
    let mut rows = Vec::new();
    let mut add = |name: &'static str, parent: &'static str, position: DVec3, end: DVec3| {
        rows.push(Row { name, parent, position, end });
    };
    let trunk = [
        ("pelvis", dvec3(0.0, 0.955, 0.0)),
        ("spine_01", dvec3(0.0, 0.985, 0.0)),
        ("spine_02", dvec3(0.0, 1.045, 0.003)),
        ("spine_03", dvec3(0.0, 1.115, -0.002)),
        ("spine_04", dvec3(0.0, 1.185, -0.012)),
        ("spine_05", dvec3(0.0, 1.265, -0.02)),
        ("neck_01", dvec3(0.0, 1.385, -0.02)),
        ("neck_02", dvec3(0.0, 1.42, -0.01)),
        ("head", dvec3(0.0, 1.455, 0.0)),
    ];
    add("root", "", DVec3::ZERO, DVec3::ZERO);
    let mut parent = "root";
    for (place, (name, position)) in trunk.iter().enumerate() {
        let end = trunk.get(place + 1).map_or(CROWN, |next| next.1);
        add(name, parent, *position, end);
        parent = name;
    }

    let (elbow, wrist) = (elbow(), wrist());
    add("clavicle_l", "spine_05", dvec3(0.02, 1.345, 0.01), UPPER_ARM);
    add("upperarm_l", "clavicle_l", UPPER_ARM, elbow);
    add("upperarm_twist_01_l", "upperarm_l", UPPER_ARM.lerp(elbow, 1.0 / 3.0), DVec3::ZERO);
    add("upperarm_twist_02_l", "upperarm_l", UPPER_ARM.lerp(elbow, 2.0 / 3.0), DVec3::ZERO);
    add("lowerarm_l", "upperarm_l", elbow, wrist);
    add("lowerarm_twist_02_l", "lowerarm_l", elbow.lerp(wrist, 1.0 / 3.0), DVec3::ZERO);
    add("lowerarm_twist_01_l", "lowerarm_l", elbow.lerp(wrist, 2.0 / 3.0), DVec3::ZERO);
    add("hand_l", "lowerarm_l", wrist, wrist + (wrist - elbow));
    for finger in &FINGERS {
        let mut parent = "hand_l";
        for (segment, name) in finger.names.iter().enumerate() {
            add(name, parent, finger.point(segment), finger.point(segment + 1));
            parent = name;
        }
    }

    add("thigh_l", "pelvis", HIP, KNEE);
    add("thigh_twist_01_l", "thigh_l", HIP.lerp(KNEE, 1.0 / 3.0), DVec3::ZERO);
    add("thigh_twist_02_l", "thigh_l", HIP.lerp(KNEE, 2.0 / 3.0), DVec3::ZERO);
    add("calf_l", "thigh_l", KNEE, ANKLE);
    add("calf_twist_02_l", "calf_l", KNEE.lerp(ANKLE, 1.0 / 3.0), DVec3::ZERO);
    add("calf_twist_01_l", "calf_l", KNEE.lerp(ANKLE, 2.0 / 3.0), DVec3::ZERO);
    add("foot_l", "calf_l", ANKLE, BALL);
    add("ball_l", "foot_l", BALL, TOE);
    Figure::new(&rows, &Sides { left: "_l", right: "_r" }, BoneAxes::XAlongBoneMirrored)
}

/// A finger, in the axes of the hand: along it, to the side of the thumb, and to its back.
struct Finger {
    names: &'static [&'static str],
    /// Where the first joint is, seen from the wrist.
    base: DVec3,
    direction: DVec3,
    lengths: &'static [f64],
}

impl Finger {
    /// The place of a segment's joint; one more than there are is the finger's tip.
    fn point(&self, segment: usize) -> DVec3 {
        let along = (wrist() - elbow()).normalize();
        let thumb = DVec3::Z.reject_from_normalized(along).normalize();
        let back = thumb.cross(along);
        let place = self.base + self.direction.normalize() * self.lengths[..segment].iter().sum::<f64>();
        wrist() + along * place.x + thumb * place.y + back * place.z
    }
}

const FINGERS: [Finger; 5] = [
    Finger {
        names: &["thumb_01_l", "thumb_02_l", "thumb_03_l"],
        base: dvec3(0.02, 0.018, -0.006),
        direction: dvec3(0.75, 0.62, -0.2),
        lengths: &[0.036, 0.028, 0.022],
    },
    Finger {
        names: &["index_metacarpal_l", "index_01_l", "index_02_l", "index_03_l"],
        base: dvec3(0.022, 0.014, 0.0),
        direction: dvec3(1.0, 0.13, 0.0),
        lengths: &[0.055, 0.034, 0.021, 0.017],
    },
    Finger {
        names: &["middle_metacarpal_l", "middle_01_l", "middle_02_l", "middle_03_l"],
        base: dvec3(0.023, 0.004, 0.001),
        direction: dvec3(1.0, 0.03, 0.0),
        lengths: &[0.056, 0.037, 0.024, 0.018],
    },
    Finger {
        names: &["ring_metacarpal_l", "ring_01_l", "ring_02_l", "ring_03_l"],
        base: dvec3(0.022, -0.006, 0.0),
        direction: dvec3(1.0, -0.08, 0.0),
        lengths: &[0.053, 0.034, 0.022, 0.017],
    },
    Finger {
        names: &["pinky_metacarpal_l", "pinky_01_l", "pinky_02_l", "pinky_03_l"],
        base: dvec3(0.02, -0.015, -0.002),
        direction: dvec3(1.0, -0.2, 0.0),
        lengths: &[0.05, 0.027, 0.017, 0.015],
    },
];

/// The capsules of the whole body.
pub(super) fn shapes() -> Vec<Shape> {
    let mut shapes = Vec::new();
    let mut add = |joint: &str, end: DVec3, from: DVec2, to: DVec2, helpers: &[&str]| {
        shapes.push(Shape {
            joint: joint.to_owned(),
            start: None,
            end,
            from_radii: from,
            to_radii: to,
            helpers: helpers.iter().map(|&name| name.to_owned()).collect(),
        });
    };
    // Radii are to the side and to the front.
    add("pelvis", dvec3(0.0, 0.985, 0.0), dvec2(0.135, 0.095), dvec2(0.125, 0.088), &[]);
    add("spine_01", dvec3(0.0, 1.045, 0.003), dvec2(0.118, 0.085), dvec2(0.112, 0.082), &[]);
    add("spine_02", dvec3(0.0, 1.115, -0.002), dvec2(0.112, 0.082), dvec2(0.118, 0.085), &[]);
    add("spine_03", dvec3(0.0, 1.185, -0.012), dvec2(0.118, 0.085), dvec2(0.13, 0.092), &[]);
    add("spine_04", dvec3(0.0, 1.265, -0.015), dvec2(0.13, 0.092), dvec2(0.135, 0.093), &[]);
    add("spine_05", dvec3(0.0, 1.325, -0.015), dvec2(0.135, 0.093), dvec2(0.085, 0.062), &[]);
    add("neck_01", dvec3(0.0, 1.42, -0.01), dvec2(0.05, 0.052), dvec2(0.045, 0.048), &[]);
    add("neck_02", dvec3(0.0, 1.455, 0.0), dvec2(0.045, 0.048), dvec2(0.045, 0.048), &[]);
    add("head", dvec3(0.0, 1.575, 0.012), dvec2(0.058, 0.07), dvec2(0.075, 0.09), &[]);
    let mut both = |joint: &str, end: DVec3, from: DVec2, to: DVec2, helpers: &[&str]| {
        add(joint, end, from, to, helpers);
        let right = |name: &str| format!("{}_r", name.trim_end_matches("_l"));
        let helpers: Vec<String> = helpers.iter().map(|name| right(name)).collect();
        let helpers: Vec<&str> = helpers.iter().map(String::as_str).collect();
        add(&right(joint), end * dvec3(-1.0, 1.0, 1.0), from, to, &helpers);
    };
    let round = |radius: f64| DVec2::splat(radius);
    both("clavicle_l", UPPER_ARM, round(0.045), round(0.056), &[]);
    both("upperarm_l", elbow(), round(0.052), round(0.038), &["upperarm_twist_01_l", "upperarm_twist_02_l"]);
    both("lowerarm_l", wrist(), round(0.038), round(0.027), &["lowerarm_twist_02_l", "lowerarm_twist_01_l"]);
    both("hand_l", FINGERS[2].point(1), dvec2(0.02, 0.026), dvec2(0.014, 0.036), &[]);
    both("thigh_l", KNEE, round(0.083), round(0.054), &["thigh_twist_01_l", "thigh_twist_02_l"]);
    both("calf_l", ANKLE, round(0.054), round(0.036), &["calf_twist_02_l", "calf_twist_01_l"]);
    both("foot_l", BALL, dvec2(0.036, 0.042), dvec2(0.042, 0.016), &[]);
    for finger in &FINGERS {
        let thickness = if finger.names.len() == 3 { 0.011 } else { 0.0095 };
        for (segment, name) in finger.names.iter().enumerate() {
            if !name.contains("metacarpal") {
                both(name, finger.point(segment + 1), round(thickness), round(thickness * 0.9), &[]);
            }
        }
    }
    // The sole, from the heel to the ball: without it there is nothing behind the ankle to land on. Below the joint of the ball only
    // the toes touch the floor, and nothing of them moves with the foot: they stay where they are when the heel lifts.
    for (side, foot, toes) in [(1.0, "foot_l", "ball_l"), (-1.0, "foot_r", "ball_r")] {
        let mirror = dvec3(side, 1.0, 1.0);
        let mut add = |joint: &str, start: DVec3, end: DVec3, from_radii: DVec2, to_radii: DVec2| {
            let (start, end) = (Some(start * mirror), end * mirror);
            shapes.push(Shape { joint: joint.to_owned(), start, end, from_radii, to_radii, helpers: Vec::new() });
        };
        add(foot, HEEL, BALL, dvec2(0.033, 0.032), dvec2(0.042, 0.016));
        add(toes, BALL, TOE, dvec2(0.042, 0.022), dvec2(0.034, 0.017));
    }
    shapes
}
