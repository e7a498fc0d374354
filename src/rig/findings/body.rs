//! The body as a whole: whether there is one, how large it is, and where it stands.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    super::{Hints, RestPoseKind, Rig, RigKind, Role, RoleFinding, leg_rows::is_whole_leg, recognize},
    Finding, FindingCode, places,
};
use crate::model::{LocalPose, ModelPose, Skeleton};

/// People and their caricatures are between these heights, in meters.
const PLAUSIBLE_METERS: std::ops::RangeInclusive<f64> = 0.3..=4.0;
/// Feet this far from the floor, as a share of the figure's height, do not stand on it. An ankle is at 5 %.
const OFF_FLOOR_SHARE: f64 = 0.12;
/// What is left beside a body is looked at when it has at least this many joints.
const FEWEST_JOINTS: usize = 12;
/// Joints of equal roles that are closer than this share of the figure are in one body.
const SAME_PLACE_SHARE: f64 = 0.1;

pub(super) fn examine(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let whole = |code, detail: String| Finding { code, place: String::new(), detail };
    if !rig.recognition.is_body() {
        let joints = rig.skeleton().joints().iter().filter(|joint| joint.is_joint).count();
        let detail = format!("{joints} joints, of which {} have a role", rig.roles.values().flatten().count());
        found.push(whole(FindingCode::NoBody, detail));
        return;
    }
    if rig.recognition.rest_pose == RestPoseKind::Other && rig.recognition.kind == RigKind::Biped {
        let detail =
            format!("the pose that is measured from ({}) is none of T, A and arms down", rig.rest_source.name());
        found.push(whole(FindingCode::RestPoseUnclear, detail));
    }
    examine_size(rig, found);
    if let Some(other) = second_body(rig) {
        let detail = "below this node is a body too".to_owned();
        found.push(Finding { code: FindingCode::SeveralBodies, place: places::label(rig, other), detail });
    }
}

fn examine_size(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let heights = rig.roles.iter().filter(|(role, _)| *role != "root").flat_map(|(_, joints)| joints);
    let heights: Vec<f64> = heights.map(|joint| rig.rest_height(*joint)).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let size = high - low;
    if !size.is_finite() || size <= 0.0 {
        return;
    }
    let meters = size * rig.unit_meters;
    let whole = |code, detail: String| Finding { code, place: String::new(), detail };
    match rig.scene.unit_meters {
        None => {
            let detail = format!("{size:.3} units high, taken for {meters:.2} m");
            found.push(whole(FindingCode::UnitUnknown, detail));
        }
        Some(_) if rig.recognition.kind == RigKind::Biped && !PLAUSIBLE_METERS.contains(&meters) => {
            let detail = format!("{} high{}", length(meters), likely_unit(meters));
            found.push(whole(FindingCode::SizeImplausible, detail));
        }
        Some(_) => {}
    }
    let feet = ["left_toe", "right_toe", "left_foot", "right_foot"];
    let legs = rig.roles.keys().map(String::as_str).filter(|role| is_whole_leg(role));
    let lowest = feet
        .into_iter()
        .chain(legs)
        .filter_map(|role| rig.role(role).last())
        .map(|joint| (rig.rest_height(*joint), *joint));
    if let Some((height, foot)) = lowest.min_by(|first, second| first.0.total_cmp(&second.0))
        && height.abs() > size * OFF_FLOOR_SHARE
    {
        let side = if height > 0.0 { "above" } else { "below" };
        let detail = format!("{} {side} the file's floor", length(height.abs() * rig.unit_meters));
        found.push(Finding { code: FindingCode::FeetOffFloor, place: places::label(rig, foot), detail });
    }
}

/// Which unit was probably meant, where one makes a person of the figure.
fn likely_unit(meters: f64) -> String {
    const FACTORS: [(f64, &str); 6] = [
        (0.01, "a hundredth"),
        (100.0, "a hundred times"),
        (0.1, "a tenth"),
        (10.0, "ten times"),
        (0.001, "a thousandth"),
        (1000.0, "a thousand times"),
    ];
    let fits = FACTORS.iter().find(|(factor, _)| (0.9..2.3).contains(&(meters * factor)));
    fits.map_or_else(String::new, |(factor, words)| format!("; {words} of it would be {:.2} m", meters * factor))
}

fn length(meters: f64) -> String {
    if meters < 0.1 { format!("{:.1} cm", meters * 100.0) } else { format!("{meters:.2} m") }
}

/// The top of another tree that is a body by itself.
fn second_body(rig: &Rig<'_>) -> Option<usize> {
    let skeleton = rig.skeleton();
    let pelvis = *rig.role("pelvis").first().or_else(|| rig.role("spine").first())?;
    // The body's own tree is what hangs from the top joint above its pelvis; joints only, since one armature may hold two.
    let mut top = pelvis;
    while let Some(parent) = skeleton.parent(top).filter(|parent| skeleton.joints()[*parent].is_joint) {
        top = parent;
    }
    let own: Vec<usize> = rig.roles.values().flatten().copied().collect();
    let belongs = |joint: usize| {
        skeleton.is_ancestor_or_self(top, joint) || own.iter().any(|own| skeleton.is_ancestor_or_self(*own, joint))
    };
    let left: Vec<usize> = (0..skeleton.len()).filter(|joint| !belongs(*joint)).collect();
    if left.iter().filter(|joint| skeleton.joints()[**joint].is_joint).count() < FEWEST_JOINTS {
        return None;
    }
    let (rest, order) = without(skeleton, &left, &rig.rest_local)?;
    let pose: ModelPose = rest.rest_pose().to_model(&rest);
    let other = recognize(&rest, &pose, &Hints::default());
    let first = other.roles.values().flat_map(|finding| finding.joints.first()).min()?;
    let is_body = other.is_body() && has_extent(&other.roles, &pose);
    (is_body && !is_layer(rig, &other.roles, &pose)).then(|| order[*first])
}

/// Whether a second set of joints lies in the body itself: control rigs have one layer of joints over another.
fn is_layer(rig: &Rig<'_>, roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose) -> bool {
    let place = |joint: usize, pose: &ModelPose| pose.transforms()[joint].translation;
    let all = || rig.roles.values().flatten().map(|joint| place(*joint, &rig.rest));
    let size = all().fold(0.0_f64, |size, point| all().next().map_or(size, |first| size.max(first.distance(point))));
    let distances = roles.iter().filter_map(|(role, finding)| {
        let own = *rig.role(&role.to_string()).first()?;
        Some(place(own, &rig.rest).distance(place(*finding.joints.first()?, pose)))
    });
    let (near, far): (Vec<f64>, Vec<f64>) = distances.partition(|distance| *distance < size * SAME_PLACE_SHARE);
    near.len() > far.len()
}

fn has_extent(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose) -> bool {
    let places: Vec<DVec3> =
        roles.values().flat_map(|finding| &finding.joints).map(|joint| pose.transforms()[*joint].translation).collect();
    places.iter().any(|place| place.distance(places[0]) > 1e-6)
}

/// The joints that are left, as a skeleton of their own, and which they were.
fn without(skeleton: &Skeleton, left: &[usize], rest: &LocalPose) -> Option<(Skeleton, Vec<usize>)> {
    let mut place = vec![None; skeleton.len()];
    let mut joints = Vec::with_capacity(left.len());
    for joint in left {
        place[*joint] = Some(joints.len());
        let own = skeleton.joints()[*joint].clone();
        let parent = own.parent.and_then(|parent| place[parent]);
        joints.push(crate::model::Joint { parent, rest: rest.transforms()[*joint], ..own });
    }
    Some((Skeleton::new(joints).ok()?, left.to_vec()))
}
