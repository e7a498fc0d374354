//! Skins: what they bind, in which pose, and how.

use std::collections::BTreeSet;

use super::{FileFacts, Finding, FindingCode, places};
use crate::{
    model::Reporter,
    rig::{
        Part, Recognizer, Rig, Role,
        rest::{BindPose, bind_pose},
    },
};

/// Parts of a body that a skin binds in every rig that is whole.
const SKINNED: [Part; 9] = [
    Part::UpperArm,
    Part::Forearm,
    Part::Hand,
    Part::Thigh,
    Part::Shin,
    Part::Foot,
    Part::FrontLeg,
    Part::HindLeg,
    Part::Leg,
];
/// Joint indices of a vertex that every engine takes.
const COMMON_INFLUENCES: usize = 4;
/// A joint whose nearest vertex is farther away than this share of the body's height has its mesh elsewhere: limbs of
/// known rigs are thinner than that, those of blocks too.
const OFF_SHARE: f64 = 0.2;
/// Rotations closer than this are the same.
const SAME_RADIANS: f64 = 0.02;

pub(super) fn examine(rig: &Rig<'_>, facts: FileFacts<'_>, found: &mut Vec<Finding>) {
    let scene = rig.scene;
    let whole = |code, detail: String| Finding { code, place: String::new(), detail };
    if scene.skins.is_empty() {
        if facts.can_have_skins {
            found.push(whole(FindingCode::NoSkin, format!("{} nodes, no skin", rig.skeleton().len())));
        }
        return;
    }
    if scene.skins.len() > 1 {
        let sizes: Vec<String> = scene.skins.iter().take(8).map(|skin| skin.joints.len().to_string()).collect();
        let detail = format!("{} skins, of {} joints", scene.skins.len(), sizes.join(", "));
        found.push(whole(FindingCode::SeveralSkins, detail));
    }
    examine_binds(rig, found);
    examine_bind_pose(rig, found);
    examine_bound(rig, found);
    found.extend(mesh_off_joints(rig));
    let most = scene.skins.iter().map(|skin| skin.most_influences).max().unwrap_or(0);
    if most > COMMON_INFLUENCES {
        let skin = scene.skins.iter().find(|skin| skin.most_influences == most);
        let place = skin.map_or_else(String::new, |skin| skin.name.clone());
        let detail = format!("a vertex may be bound to {most} joints");
        found.push(Finding { code: FindingCode::TooManyInfluences, place, detail });
    }
}

fn examine_binds(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    for (index, skin) in rig.scene.skins.iter().enumerate() {
        let place = if skin.name.is_empty() { format!("skin {index}") } else { skin.name.clone() };
        let joints = skin.joints.len();
        if skin.has_no_inverse_binds {
            let detail = format!("a skin of {joints} joints has no inverse bind matrices");
            found.push(Finding { code: FindingCode::InverseBindsMissing, place, detail });
        } else if skin.has_identity_binds {
            let detail = format!("all {joints} inverse bind matrices are the identity");
            found.push(Finding { code: FindingCode::InverseBindsIdentity, place, detail });
        }
    }
}

/// Which of the two poses counts, and how far apart they are.
fn examine_bind_pose(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let mut reporter = Reporter::new();
    let bind = bind_pose(rig.scene, Recognizer::default(), &mut reporter, "");
    if let Some(ignored) = reporter.warnings().iter().find(|warning| warning.code == "bind_pose_ignored") {
        let detail = ignored.detail.clone();
        found.push(Finding { code: FindingCode::BindPoseIgnored, place: String::new(), detail });
    }
    let BindPose::Other(bind) = bind else { return };
    let nodes = rig.skeleton().rest_pose();
    let pairs = bind.transforms().iter().zip(nodes.transforms()).enumerate();
    let mut angles: Vec<(usize, f64)> =
        pairs.map(|(joint, (bind, node))| (joint, bind.rotation.angle_between(node.rotation))).collect();
    angles.retain(|(_, angle)| *angle > SAME_RADIANS);
    angles.sort_by(|first, second| second.1.total_cmp(&first.1).then(first.0.cmp(&second.0)));
    let joints: Vec<usize> = angles.iter().map(|(joint, _)| *joint).collect();
    let most = angles.first().map_or(0.0, |(_, angle)| angle.to_degrees());
    found.extend(places::about(rig, FindingCode::BindPoseDiffers, &joints, |count| {
        format!("{count} turned against the bind pose, by up to {most:.0}°")
    }));
}

/// Whether a role is one of the parts that a skin binds in every rig that is whole.
fn is_skinned(role: &str) -> bool {
    role.parse::<Role>().is_ok_and(|role| SKINNED.contains(&role.part))
}

/// Whether most joints of a body have the vertices that they move elsewhere; nothing where none of them moves any.
pub(crate) fn mesh_off_joints(rig: &Rig<'_>) -> Option<Finding> {
    let limbs = rig.roles.iter().filter(|(role, _)| rig.recognition.is_body() && is_skinned(role));
    let joints: Vec<usize> = limbs.flat_map(|(_, joints)| joints.iter().copied()).collect();
    let heights = joints.iter().map(|joint| rig.rest_height(*joint));
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), height| (low.min(height), high.max(height)));
    let distance = |joint: usize| {
        let model_from_joint = rig.rest.transforms()[joint];
        let points = rig.scene.skin_points.of(joint).iter().map(|point| point.position.as_dvec3());
        let places = points.map(|point| model_from_joint.transform_point(point));
        places.map(|place| place.distance(model_from_joint.translation)).reduce(f64::min)
    };
    let known: Vec<(usize, f64)> = joints.iter().filter_map(|joint| Some((*joint, distance(*joint)?))).collect();
    let off: Vec<usize> =
        known.iter().filter(|(_, distance)| *distance > OFF_SHARE * (high - low)).map(|(joint, _)| *joint).collect();
    if off.len() * 2 <= known.len() {
        return None;
    }
    let farthest = known.iter().map(|(_, distance)| *distance).fold(0.0, f64::max) * rig.unit_meters;
    places::about(rig, FindingCode::MeshOffJoints, &off, |count| {
        format!("{count} of the body whose nearest vertex is up to {farthest:.2} m away")
    })
}

/// What moves no mesh.
fn examine_bound(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let skeleton = rig.skeleton();
    let bound: BTreeSet<usize> = rig.scene.skins.iter().flat_map(|skin| skin.joints.iter().copied()).collect();
    // A limb is in the skin when anything below it is, up to the next part: split limbs bind their helpers only.
    let mut bound_below = vec![false; skeleton.len()];
    for joint in (0..skeleton.len()).rev() {
        bound_below[joint] |= bound.contains(&joint);
        if let Some(parent) = skeleton.parent(joint).filter(|_| bound_below[joint]) {
            bound_below[parent] = true;
        }
    }
    if rig.recognition.is_body() {
        let missing = rig.roles.iter().filter(|(role, joints)| {
            is_skinned(role) && !joints.is_empty() && !joints.iter().any(|joint| moves_mesh(rig, &bound, *joint))
        });
        let joints: Vec<usize> = missing.map(|(_, joints)| joints[0]).collect();
        found.extend(places::about(rig, FindingCode::RoleUnskinned, &joints, |count| {
            format!("{count} of the body that no skin binds")
        }));
    }
    let is_top = |joint: &usize| skeleton.parent(*joint).is_none_or(|parent| bound_below[parent]);
    let idle = (0..skeleton.len()).filter(|joint| skeleton.joints()[*joint].is_joint && !bound_below[*joint]);
    // One joint at the end of a bound bone only says where the bone ends.
    let is_end = |joint: &usize| {
        let below = |other: usize| skeleton.parent(other) == Some(*joint);
        skeleton.parent(*joint).is_some_and(|parent| bound.contains(&parent)) && !(*joint..skeleton.len()).any(below)
    };
    let tops: Vec<usize> = idle.filter(is_top).filter(|joint| !is_end(joint)).collect();
    found.extend(places::about(rig, FindingCode::JointsUnskinned, &tops, |_| {
        format!("{} of joints that no skin binds", if tops.len() == 1 { "a tree" } else { "trees" })
    }));
}

/// Whether a joint or a helper directly below it is bound.
fn moves_mesh(rig: &Rig<'_>, bound: &BTreeSet<usize>, joint: usize) -> bool {
    let skeleton = rig.skeleton();
    let is_helper = |other: &usize| {
        let has_role = rig.roles.values().flatten().any(|role| role == other);
        skeleton.parent(*other) == Some(joint) && !has_role
    };
    bound.contains(&joint) || bound.iter().any(is_helper)
}
