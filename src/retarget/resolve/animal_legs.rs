//! Legs of animals as limbs: where the paw begins, and about which joint the leg bends.

use crate::rig::limb_joints::LegJoints;
use crate::rig::{Limb, auto_map::role_pair, floor::Stance, leg_rows::driving_leg, rig::Rig};

/// The mesh of a paw comes down to this share of the pelvis' height above the floor.
const MESH_TOUCHES: f64 = 0.03;
/// The joint of a paw without a mesh is at most this share of the pelvis' height above the floor.
const JOINT_TOUCHES: f64 = 0.1;
/// A vertex that hangs on a joint by less does not belong to it.
const HELD: f64 = 0.3;

/// The joints of a leg of the source and of the leg of the target that it drives. Both have the same shape: what belongs together is
/// found for the mapping. Nothing for legs of fewer than two bones.
pub(in crate::retarget) fn animal_leg(limb: Limb, source: &Rig<'_>, target: &Rig<'_>) -> Option<[LegJoints; 2]> {
    let role = limb.whole_leg()?;
    let driving = driving_leg(source, target, role)?.to_string();
    let pair = role_pair(source, &driving, target, limb.name())?;
    let count = pair.source.len();
    if count != pair.target.len() || count < 3 {
        return None;
    }
    let end = paw(source, &pair.source).max(paw(target, &pair.target)).clamp(2, count - 1);
    let middle = bend(target, &pair.target[..=end]);
    let joints = |leg: &[usize]| LegJoints {
        chain: [leg[0], leg[middle], leg[end - 1], leg[end]],
        beyond: leg.get(end + 1).copied(),
    };
    Some([joints(&pair.source), joints(&pair.target)])
}

/// The place of the first joint of a leg whose part of the body comes down to the floor at rest.
fn paw(side: &Rig<'_>, leg: &[usize]) -> usize {
    let last = leg.len() - 1;
    let Some(&pelvis) = side.role("pelvis").first() else { return last };
    let floor = Stance::of(side, pelvis).floor;
    let height = side.rest_height(pelvis) - floor;
    let mesh = |joint: usize| {
        let points = side.scene.skin_points.of(joint).iter().filter(|point| f64::from(point.weight) >= HELD);
        let rest = &side.rest.transforms()[joint];
        let heights = points.map(|point| rest.transform_point(point.position.as_dvec3()).dot(side.up()) - floor);
        heights.reduce(f64::min)
    };
    let has_mesh = leg.iter().any(|joint| mesh(*joint).is_some());
    let touches = |joint: usize| match mesh(joint) {
        Some(lowest) => lowest <= MESH_TOUCHES * height,
        None => !has_mesh && side.rest_height(joint) - floor <= JOINT_TOUCHES * height,
    };
    // The upper bones of what lies on its belly touch, too.
    leg.iter().skip(2).position(|joint| touches(*joint)).map_or(last, |found| found + 2)
}

/// The place of the joint about which a leg bends: the one that leaves two bones as long as can be.
fn bend(side: &Rig<'_>, leg: &[usize]) -> usize {
    let place = |joint: usize| side.rest.transforms()[joint].translation;
    let shorter = |at: usize| {
        let [upper, lower] = [leg[0], leg[leg.len() - 1]].map(|end| place(end).distance(place(leg[at])));
        upper.min(lower)
    };
    (1..leg.len() - 1).max_by(|one, other| shorter(*one).total_cmp(&shorter(*other)).then(other.cmp(one))).unwrap_or(1)
}
