//! How a human body drives a drawing for which nobody wrote a config: by the names that *Animated Drawings* gives the joints of a figure.

use super::{
    BodyMotion, BodypartGroup, DrawingError, Ordered, PlanarRig, ProjectionGroup, ProjectionMethod, RetargetSpec,
    RootOffset,
};

/// A joint of a drawing, and the two joints of the body whose direction its bone takes; of both sides where it begins with `*`.
const BONES: [(&str, &str, &str); 6] = [
    ("torso", "pelvis", "chest"),
    ("neck", "chest", "head"),
    ("*elbow", "*upper_arm", "*forearm"),
    ("*hand", "*forearm", "*hand"),
    ("*knee", "*thigh", "*shin"),
    ("*foot", "*shin", "*foot"),
];
/// Groups of joints that come onto one plane: their name, how, and joints of the body.
const PLANES: [(&str, ProjectionMethod, &[&str]); 3] = [
    ("arms", ProjectionMethod::Pca, &["*upper_arm", "*forearm", "*hand"]),
    ("legs", ProjectionMethod::Pca, &["*thigh", "*shin", "*foot"]),
    ("trunk", ProjectionMethod::Frontal, &["pelvis", "chest", "head"]),
];
/// Limbs that are drawn apart from the trunk: the joint of the body whose depth counts, and the joints of the drawing.
const LIMBS: [(&str, [&str; 2]); 2] = [("*hand", ["*elbow", "*hand"]), ("*foot", ["*knee", "*foot"])];
const SIDES: [&str; 2] = ["left_", "right_"];
/// The root of a drawing, which carries nothing.
const ROOT: &str = "root";

/// The joints of a body by which drawings are driven, the root first.
#[must_use]
pub fn body_joints() -> Vec<String> {
    let mut names = vec!["pelvis".to_owned(), "chest".to_owned(), "head".to_owned()];
    names.extend(
        ["upper_arm", "forearm", "hand", "thigh", "shin", "foot"].iter().flat_map(|name| sided(&format!("*{name}"))),
    );
    names
}

/// A name on both sides, or by itself.
fn sided(name: &str) -> Vec<String> {
    match name.strip_prefix('*') {
        Some(name) => SIDES.iter().map(|side| format!("{side}{name}")).collect(),
        None => vec![name.to_owned()],
    }
}

impl RetargetSpec {
    /// How a body whose joints are named as [`body_joints`] does, or some of them, drives a drawing.
    ///
    /// # Errors
    ///
    /// Where the drawing has fewer than four of the bones of a human figure that the body has, too.
    pub fn of_humanoid(rig: &PlanarRig, motion: &BodyMotion) -> Result<Self, DrawingError> {
        let mut mapping = Vec::new();
        for (joint, from, to) in BONES {
            for ((joint, from), to) in sided(joint).into_iter().zip(both(from)).zip(both(to)) {
                if rig.joint(&joint).is_some() && motion.joint(&from).is_some() && motion.joint(&to).is_some() {
                    mapping.push((joint, (from, to)));
                }
            }
        }
        if mapping.len() < 4 {
            let detail = format!("{} bones of a human figure are in the drawing and in the body", mapping.len());
            let fix = "name joints torso, neck, left_elbow, left_hand, left_knee, left_foot and so on, or give a scene with a retarget config";
            return Err(DrawingError::new("skeleton", detail, fix));
        }
        let has = |name: &String| motion.joint(name).is_some();
        let planes = PLANES.map(|(name, method, joints)| ProjectionGroup {
            bvh_joint_names: joints.iter().flat_map(|joint| sided(joint)).filter(has).collect(),
            method,
            name: name.to_owned(),
        });
        let spec = Self::of_parts(
            planes.into_iter().filter(|group| !group.bvh_joint_names.is_empty()).collect(),
            parts(rig, motion),
            root_offset(rig, motion),
            Ordered(mapping),
        );
        Ok(spec)
    }
}

/// The name on both sides, or twice by itself.
fn both(name: &str) -> Vec<String> {
    let names = sided(name);
    if names.len() == 1 { vec![names[0].clone(), names[0].clone()] } else { names }
}

/// The limbs by themselves, all else with the trunk.
fn parts(rig: &PlanarRig, motion: &BodyMotion) -> Vec<BodypartGroup> {
    let mut limbs = Vec::new();
    for (driver, joints) in LIMBS {
        let joints = joints.map(sided);
        for (side, driver) in sided(driver).into_iter().enumerate() {
            let own: Vec<String> =
                joints.iter().map(|joint| joint[side].clone()).filter(|joint| rig.joint(joint).is_some()).collect();
            if motion.joint(&driver).is_some() && !own.is_empty() {
                limbs.push(BodypartGroup { bvh_depth_drivers: vec![driver], char_joints: own });
            }
        }
    }
    let in_limb = |name: &&String| limbs.iter().any(|limb| limb.char_joints.contains(name));
    let rest: Vec<String> = rig.joint_names.iter().filter(|name| *name != ROOT && !in_limb(name)).cloned().collect();
    let trunk = BodypartGroup { bvh_depth_drivers: vec!["pelvis".to_owned()], char_joints: rest };
    std::iter::once(trunk).chain(limbs).collect()
}

/// The root goes as far as the legs are long, or where there are none, the trunk.
fn root_offset(rig: &PlanarRig, motion: &BodyMotion) -> RootOffset {
    let chains = |joints: [&str; 3], is_there: &dyn Fn(&String) -> bool| -> Vec<Vec<String>> {
        let chain = |side: &&str| joints.iter().map(|joint| format!("{side}{joint}")).collect::<Vec<_>>();
        SIDES.iter().map(chain).filter(|chain| chain.iter().all(is_there)).collect()
    };
    let body = chains(["thigh", "shin", "foot"], &|name| motion.joint(name).is_some());
    let drawing = chains(["hip", "knee", "foot"], &|name| rig.joint(name).is_some());
    let (bvh_joints, char_joints, group) = if body.is_empty() || drawing.len() != body.len() {
        (vec![vec!["pelvis".to_owned(), "chest".to_owned()]], vec![vec![ROOT.to_owned(), "torso".to_owned()]], "trunk")
    } else {
        (body, drawing, "legs")
    };
    RootOffset { bvh_joints, char_joints, bvh_projection_bodypart_group_for_offset: group.to_owned() }
}
