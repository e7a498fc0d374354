//! The mean bodies: joints of SMPL, SMPL+H and SMPL-X in the zero pose, a T pose.
//!
//! Places are those of the neutral models with all shape parameters zero, rounded to a tenth of a millimeter, as they stand
//! in many published skeleton descriptions made from them. The hands are those of SMPL-X's left hand and its mirror image.
//! Jaw and eyes stand about where a face has them: no child tells their place, only their rotation is of use.

use glam::{DQuat, DVec3};

use crate::model::{Joint, Skeleton, Transform};

/// A family of body models, by the joints that it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Body {
    /// The 22 joints that all share.
    Plain,
    /// With one joint for each hand: 24.
    Smpl,
    /// With fifteen joints in each hand: 52.
    SmplH,
    /// With jaw, eyes and fingers: 55.
    SmplX,
}

impl Body {
    /// The family that has that many joints.
    pub(super) const fn of_joint_count(joints: usize) -> Option<Self> {
        match joints {
            22 => Some(Self::Plain),
            24 => Some(Self::Smpl),
            52 => Some(Self::SmplH),
            55 => Some(Self::SmplX),
            _ => None,
        }
    }

    /// Its joints in the order of its parameters: name, parent, and place in the parent's space; meters, +X to the left, +Y up,
    /// +Z to the front. The pelvis stands where the model's origin has it.
    pub(super) fn joints(self) -> Vec<(String, Option<usize>, DVec3)> {
        let places = if self == Self::SmplX { &SMPL_X_PLACES } else { &SMPL_PLACES };
        let body = BODY.iter().zip(places);
        let mut joints: Vec<(String, Option<usize>, DVec3)> =
            body.map(|((name, parent), place)| ((*name).to_owned(), *parent, DVec3::from_array(*place))).collect();
        match self {
            Self::Plain => {}
            Self::Smpl => joints.extend(HANDS.map(|(name, wrist, place)| (name.to_owned(), Some(wrist), place))),
            Self::SmplH => add_fingers(&mut joints),
            Self::SmplX => {
                joints.extend(FACE.map(|(name, place)| (name.to_owned(), Some(HEAD), place)));
                add_fingers(&mut joints);
            }
        }
        joints
    }

    /// Its skeleton at rest.
    pub(super) fn skeleton(self) -> Skeleton {
        skeleton_of(self.joints())
    }
}

/// A skeleton of joints that all stand unturned.
pub(super) fn skeleton_of(joints: Vec<(String, Option<usize>, DVec3)>) -> Skeleton {
    let joints = joints.into_iter().enumerate().map(|(node, (name, parent, translation))| Joint {
        name,
        parent,
        rest: Transform { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE },
        is_joint: true,
        node,
    });
    // The tables have parents before children and finite places.
    Skeleton::new(joints.collect()).unwrap_or_default()
}

fn add_fingers(joints: &mut Vec<(String, Option<usize>, DVec3)>) {
    for (side, wrist, mirror) in [("L", LEFT_WRIST, 1.0), ("R", RIGHT_WRIST, -1.0)] {
        for (finger, phalanges) in FINGERS {
            for (index, place) in phalanges.iter().enumerate() {
                let parent = if index == 0 { wrist } else { joints.len() - 1 };
                let place = DVec3::new(place[0] * mirror, place[1], place[2]);
                joints.push((format!("{side}_{finger}{}", index + 1), Some(parent), place));
            }
        }
    }
}

pub(super) const PELVIS: usize = 0;
pub(super) const LEFT_HIP: usize = 1;
pub(super) const RIGHT_HIP: usize = 2;
pub(super) const SPINE: usize = 3;
pub(super) const LEFT_KNEE: usize = 4;
pub(super) const RIGHT_KNEE: usize = 5;
pub(super) const LEFT_ANKLE: usize = 7;
pub(super) const RIGHT_ANKLE: usize = 8;
pub(super) const CHEST: usize = 9;
pub(super) const NECK: usize = 12;
pub(super) const HEAD: usize = 15;
pub(super) const LEFT_SHOULDER: usize = 16;
pub(super) const RIGHT_SHOULDER: usize = 17;
pub(super) const LEFT_ELBOW: usize = 18;
pub(super) const RIGHT_ELBOW: usize = 19;
pub(super) const LEFT_WRIST: usize = 20;
pub(super) const RIGHT_WRIST: usize = 21;

const BODY: [(&str, Option<usize>); 22] = [
    ("Pelvis", None),
    ("L_Hip", Some(PELVIS)),
    ("R_Hip", Some(PELVIS)),
    ("Spine1", Some(PELVIS)),
    ("L_Knee", Some(LEFT_HIP)),
    ("R_Knee", Some(RIGHT_HIP)),
    ("Spine2", Some(SPINE)),
    ("L_Ankle", Some(LEFT_KNEE)),
    ("R_Ankle", Some(RIGHT_KNEE)),
    ("Spine3", Some(6)),
    ("L_Foot", Some(LEFT_ANKLE)),
    ("R_Foot", Some(RIGHT_ANKLE)),
    ("Neck", Some(CHEST)),
    ("L_Collar", Some(CHEST)),
    ("R_Collar", Some(CHEST)),
    ("Head", Some(NECK)),
    ("L_Shoulder", Some(13)),
    ("R_Shoulder", Some(14)),
    ("L_Elbow", Some(LEFT_SHOULDER)),
    ("R_Elbow", Some(RIGHT_SHOULDER)),
    ("L_Wrist", Some(LEFT_ELBOW)),
    ("R_Wrist", Some(RIGHT_ELBOW)),
];

const SMPL_PLACES: [[f64; 3]; 22] = [
    [-0.0018, -0.2233, 0.0282],
    [0.0695, -0.0914, -0.0068],
    [-0.0677, -0.0905, -0.0043],
    [-0.0025, 0.1090, -0.0267],
    [0.0343, -0.3752, -0.0045],
    [-0.0383, -0.3826, -0.0089],
    [0.0055, 0.1352, 0.0011],
    [-0.0136, -0.3980, -0.0437],
    [0.0158, -0.3984, -0.0423],
    [0.0015, 0.0529, 0.0254],
    [0.0264, -0.0558, 0.1193],
    [-0.0254, -0.0481, 0.1233],
    [-0.0028, 0.2139, -0.0429],
    [0.0788, 0.1217, -0.0341],
    [-0.0818, 0.1188, -0.0386],
    [0.0052, 0.0650, 0.0513],
    [0.0910, 0.0305, -0.0089],
    [-0.0960, 0.0326, -0.0091],
    [0.2596, -0.0128, -0.0275],
    [-0.2537, -0.0133, -0.0214],
    [0.2492, 0.0090, -0.0012],
    [-0.2553, 0.0078, -0.0056],
];

const SMPL_X_PLACES: [[f64; 3]; 22] = [
    [0.0031, -0.3514, 0.0120],
    [0.0582, -0.0928, -0.0260],
    [-0.0633, -0.1039, -0.0213],
    [-0.0028, 0.1099, -0.0276],
    [0.0547, -0.3788, -0.0094],
    [-0.0442, -0.3624, -0.0168],
    [0.0094, 0.1319, -0.0059],
    [-0.0435, -0.4031, -0.0319],
    [0.0154, -0.4107, -0.0202],
    [-0.0113, 0.0522, 0.0284],
    [0.0473, -0.0580, 0.1182],
    [-0.0388, -0.0583, 0.1190],
    [-0.0122, 0.1652, -0.0316],
    [0.0464, 0.0849, -0.0072],
    [-0.0477, 0.0843, -0.0134],
    [0.0248, 0.1605, 0.0207],
    [0.1192, 0.0577, -0.0155],
    [-0.1026, 0.0535, -0.0127],
    [0.2541, -0.0722, -0.0425],
    [-0.2711, -0.0365, -0.0265],
    [0.2520, 0.0232, -0.0025],
    [-0.2493, -0.0045, -0.0153],
];

const HANDS: [(&str, usize, DVec3); 2] = [
    ("L_Hand", LEFT_WRIST, DVec3::new(0.0840, -0.0082, -0.0149)),
    ("R_Hand", RIGHT_WRIST, DVec3::new(-0.0846, -0.0061, -0.0103)),
];

const FACE: [(&str, DVec3); 3] = [
    ("Jaw", DVec3::new(0.0, -0.018, 0.020)),
    ("L_Eye", DVec3::new(0.032, 0.033, 0.062)),
    ("R_Eye", DVec3::new(-0.032, 0.033, 0.062)),
];

/// The left hand, finger by finger in the order of the parameters.
const FINGERS: [(&str, [[f64; 3]; 3]); 5] = [
    ("Index", [[0.1019, -0.0087, 0.0194], [0.0319, 0.0022, 0.0030], [0.0225, -0.0024, 0.0001]]),
    ("Middle", [[0.1094, -0.0063, -0.0040], [0.0306, 0.0008, -0.0040], [0.0235, -0.0020, -0.0041]]),
    ("Pinky", [[0.0840, -0.0145, -0.0437], [0.0155, -0.0011, -0.0120], [0.0155, -0.0017, -0.0112]]),
    ("Ring", [[0.0974, -0.0093, -0.0273], [0.0280, 0.0015, -0.0053], [0.0228, -0.0015, -0.0071]]),
    ("Thumb", [[0.0406, -0.0180, 0.0256], [0.0170, 0.0010, 0.0250], [0.0205, -0.0052, 0.0155]]),
];
