//! The walker's body: 1.80 m, 65 joints, Mixamo's names, T pose.

use glam::{DVec3, dvec3};

use super::figure::{BoneAxes, Figure, Row, Sides};

/// The walker in its rest pose, meters.
pub(super) fn figure() -> Figure {
    let mut rows = Vec::new();
    let mut add = |name: &'static str, parent: &'static str, position: DVec3, end: DVec3| {
        rows.push(Row { name, parent, position, end });
    };
    let (hips, spine, chest) = (dvec3(0.0, 0.99, 0.0), dvec3(0.0, 1.08, -0.01), dvec3(0.0, 1.20, -0.015));
    let (upper_chest, neck, head) = (dvec3(0.0, 1.32, -0.015), dvec3(0.0, 1.48, -0.02), dvec3(0.0, 1.57, 0.0));
    let crown = dvec3(0.0, 1.80, 0.02);
    add("mixamorig:Hips", "", hips, hips + DVec3::Y);
    add("mixamorig:Spine", "mixamorig:Hips", spine, chest);
    add("mixamorig:Spine1", "mixamorig:Spine", chest, upper_chest);
    add("mixamorig:Spine2", "mixamorig:Spine1", upper_chest, neck);
    add("mixamorig:Neck", "mixamorig:Spine2", neck, head);
    add("mixamorig:Head", "mixamorig:Neck", head, crown);
    add("mixamorig:HeadTop_End", "mixamorig:Head", crown, DVec3::ZERO);

    let (collar, shoulder, elbow) = (dvec3(0.05, 1.43, -0.01), dvec3(0.17, 1.44, -0.02), dvec3(0.45, 1.44, -0.025));
    let wrist = dvec3(0.71, 1.44, -0.015);
    add("mixamorig:LeftShoulder", "mixamorig:Spine2", collar, shoulder);
    add("mixamorig:LeftArm", "mixamorig:LeftShoulder", shoulder, elbow);
    add("mixamorig:LeftForeArm", "mixamorig:LeftArm", elbow, wrist);
    add("mixamorig:LeftHand", "mixamorig:LeftForeArm", wrist, wrist + dvec3(0.1, 0.0, 0.0));
    for finger in &FINGERS {
        let mut parent = "mixamorig:LeftHand";
        let mut position = wrist + finger.base;
        let direction = finger.direction.normalize();
        for (name, length) in finger.names.into_iter().zip(finger.lengths) {
            let end = if length > 0.0 { position + direction * length } else { DVec3::ZERO };
            add(name, parent, position, end);
            (parent, position) = (name, end);
        }
    }

    let (hip, knee, ankle) = (dvec3(0.09, 0.94, 0.0), dvec3(0.09, 0.51, 0.012), dvec3(0.09, 0.085, -0.015));
    let (ball, toe) = (dvec3(0.09, 0.02, 0.115), dvec3(0.09, 0.015, 0.19));
    add("mixamorig:LeftUpLeg", "mixamorig:Hips", hip, knee);
    add("mixamorig:LeftLeg", "mixamorig:LeftUpLeg", knee, ankle);
    add("mixamorig:LeftFoot", "mixamorig:LeftLeg", ankle, ball);
    add("mixamorig:LeftToeBase", "mixamorig:LeftFoot", ball, toe);
    add("mixamorig:LeftToe_End", "mixamorig:LeftToeBase", toe, DVec3::ZERO);
    Figure::new(&rows, &Sides { left: ":Left", right: ":Right" }, BoneAxes::YAlongBone)
}

struct Finger {
    names: [&'static str; 4],
    base: DVec3,
    direction: DVec3,
    lengths: [f64; 4],
}

const FINGERS: [Finger; 5] = [
    Finger {
        names: [
            "mixamorig:LeftHandThumb1",
            "mixamorig:LeftHandThumb2",
            "mixamorig:LeftHandThumb3",
            "mixamorig:LeftHandThumb4",
        ],
        base: dvec3(0.03, -0.012, 0.03),
        direction: dvec3(0.68, -0.22, 0.7),
        lengths: [0.042, 0.034, 0.027, 0.0],
    },
    Finger {
        names: [
            "mixamorig:LeftHandIndex1",
            "mixamorig:LeftHandIndex2",
            "mixamorig:LeftHandIndex3",
            "mixamorig:LeftHandIndex4",
        ],
        base: dvec3(0.095, 0.0, 0.03),
        direction: dvec3(1.0, 0.0, 0.06),
        lengths: [0.04, 0.025, 0.02, 0.0],
    },
    Finger {
        names: [
            "mixamorig:LeftHandMiddle1",
            "mixamorig:LeftHandMiddle2",
            "mixamorig:LeftHandMiddle3",
            "mixamorig:LeftHandMiddle4",
        ],
        base: dvec3(0.098, 0.002, 0.008),
        direction: dvec3(1.0, 0.0, 0.01),
        lengths: [0.045, 0.03, 0.022, 0.0],
    },
    Finger {
        names: [
            "mixamorig:LeftHandRing1",
            "mixamorig:LeftHandRing2",
            "mixamorig:LeftHandRing3",
            "mixamorig:LeftHandRing4",
        ],
        base: dvec3(0.092, 0.0, -0.013),
        direction: dvec3(1.0, 0.0, -0.05),
        lengths: [0.042, 0.027, 0.02, 0.0],
    },
    Finger {
        names: [
            "mixamorig:LeftHandPinky1",
            "mixamorig:LeftHandPinky2",
            "mixamorig:LeftHandPinky3",
            "mixamorig:LeftHandPinky4",
        ],
        base: dvec3(0.083, -0.002, -0.033),
        direction: dvec3(1.0, 0.0, -0.1),
        lengths: [0.033, 0.02, 0.018, 0.0],
    },
];
