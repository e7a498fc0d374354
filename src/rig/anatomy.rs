//! Which joint carries which on the body, whatever the hierarchy of the file says.
//!
//! Exports that keep only the joints of the skin hang thighs, arms and feet from the armature; 3ds Max Biped hangs the thighs
//! from the spine and the arms from the neck. Rotations do not care, because they are measured in the model; places do.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::model::{Skeleton, Transform};

use super::rig::Rig;

/// A target joint that the body carries where the file's hierarchy does not: a thigh below the armature rides the pelvis.
///
/// `model_from_joint = model_from_on ∘ on_from_joint` for the place, and for the rotation too where nothing drives the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ride {
    /// The joint that is placed.
    pub joint: usize,
    /// The joint that places it; not below it.
    pub on: usize,
    /// Where the joint lies at rest, as seen from `on`, in the target scene's unit.
    pub on_from_joint: Transform,
}

impl Ride {
    /// Whether the joint does not hang from what places it, not even by way of other parts of the body.
    pub(crate) fn hangs_apart(&self, skeleton: &Skeleton) -> bool {
        !skeleton.is_ancestor_or_self(self.on, self.joint)
    }
}

/// What carries a part, in order of preference, without sides. The first that the rig has counts; its last joint carries.
const CARRIERS: [(&str, &[&str]); 26] = [
    ("spine", &["pelvis"]),
    ("neck", &["spine", "pelvis"]),
    ("head", &["neck", "spine", "pelvis"]),
    ("jaw", &["head"]),
    ("eye", &["head"]),
    ("clavicle", &["spine", "pelvis"]),
    ("upper_arm", &["clavicle", "spine", "pelvis"]),
    ("forearm", &["upper_arm"]),
    ("hand", &["forearm"]),
    ("thigh", &["pelvis"]),
    ("shin", &["thigh"]),
    ("foot", &["shin"]),
    ("toe", &["foot"]),
    ("thumb", &["hand"]),
    ("index_metacarpal", &["hand"]),
    ("middle_metacarpal", &["hand"]),
    ("ring_metacarpal", &["hand"]),
    ("pinky_metacarpal", &["hand"]),
    ("index", &["index_metacarpal", "hand"]),
    ("middle", &["middle_metacarpal", "hand"]),
    ("ring", &["ring_metacarpal", "hand"]),
    ("pinky", &["pinky_metacarpal", "hand"]),
    ("front_leg", &["spine", "pelvis"]),
    ("hind_leg", &["pelvis"]),
    ("tail", &["pelvis"]),
    ("root", &[]),
];

/// Joints of a role that the bones of a limb are not split into: several of them hang side by side from one carrier.
const SIDE_BY_SIDE: [&str; 2] = ["eye", "root"];

/// For every joint with a role, the joint that carries it on the body; parts without a carrier on this rig have none.
pub(crate) fn carriers(rig: &Rig<'_>) -> BTreeMap<usize, usize> {
    let mut carriers = BTreeMap::new();
    for (role, joints) in &rig.roles {
        let (side, part) = super::named_pair::split(role);
        let Some((_, above)) = CARRIERS.iter().find(|entry| entry.0 == part) else { continue };
        let hangs_from = |carrier: &&usize| {
            joints.first().is_some_and(|joint| rig.skeleton().is_ancestor_or_self(**carrier, *joint))
        };
        let first = above.iter().find_map(|part| {
            let own_side = rig.role(&format!("{side}{part}")).last();
            let center = rig.role(part).last();
            // The eyes of a hydra's middle head do not hang from those at its sides.
            let both = own_side.into_iter().chain(center);
            both.clone().find(hangs_from).or(own_side).or(center).copied()
        });
        let mut carrier = first;
        for &joint in joints {
            if let Some(carrier) = carrier.filter(|carrier| *carrier != joint) {
                carriers.insert(joint, carrier);
            }
            carrier = if SIDE_BY_SIDE.contains(&part) { first } else { Some(joint) };
        }
    }
    carriers
}

/// The joints of a target whose parents in the file do not carry them as the body does, each with what it rides instead.
///
/// Joints of no role between a joint and its carrier are part of the way; those of another role move the joint as it should
/// not.
pub(crate) fn rides(target: &Rig<'_>) -> Vec<Ride> {
    let skeleton = target.skeleton();
    let rest = target.rest.transforms();
    let mut ridden: Vec<Option<usize>> = vec![None; skeleton.len()];
    let mut rides = Vec::new();
    let carriers = carriers(target);
    for (&joint, &on) in &carriers {
        let is_carried = skeleton.path(on, joint).is_some_and(|path| {
            let between = &path[1..path.len() - 1];
            !between.iter().any(|joint| carriers.contains_key(joint))
        });
        if !is_carried && !follows(skeleton, &ridden, on, joint) {
            ridden[joint] = Some(on);
            rides.push(Ride { joint, on, on_from_joint: rest[on].relative(&rest[joint]) });
        }
    }
    rides
}

/// What each of so many joints rides.
pub(crate) fn by_joint(count: usize, rides: &[Ride]) -> Vec<Option<Ride>> {
    let mut by_joint = vec![None; count];
    rides.iter().for_each(|ride| by_joint[ride.joint] = Some(*ride));
    by_joint
}

/// All joints, each after its parent and after what it rides; else in the skeleton's order.
pub(crate) fn carried_order(skeleton: &Skeleton, rides: &[Option<Ride>]) -> Vec<usize> {
    order_after(skeleton.len(), |joint| [skeleton.parent(joint), rides[joint].map(|ride| ride.on)])
}

/// All of so many joints, each after those that have to come before it; else in their order. Where they go round in a circle, it is cut.
pub(crate) fn order_after<const MOST: usize>(
    count: usize,
    before: impl Fn(usize) -> [Option<usize>; MOST],
) -> Vec<usize> {
    let mut order = Vec::with_capacity(count);
    let mut is_placed = vec![false; count];
    let mut open = Vec::new();
    for joint in 0..count {
        open.push(joint);
        while let Some(&joint) = open.last() {
            let is_missing = |before: &usize| !is_placed[*before] && !open.contains(before);
            match before(joint).into_iter().flatten().find(is_missing) {
                Some(before) if !is_placed[joint] => open.push(before),
                _ => {
                    if !std::mem::replace(&mut is_placed[joint], true) {
                        order.push(joint);
                    }
                    open.pop();
                }
            }
        }
    }
    order
}

/// Whether a joint's place follows from another's, by parents and by what rides what.
pub(crate) fn is_carried(skeleton: &Skeleton, rides: &[Ride], joint: usize, carrier: usize) -> bool {
    let ridden: Vec<_> = by_joint(skeleton.len(), rides).into_iter().map(|ride| ride.map(|ride| ride.on)).collect();
    follows(skeleton, &ridden, joint, carrier)
}

/// Whether a joint's place follows from another's, by parents and by what has been found to ride what.
fn follows(skeleton: &Skeleton, ridden: &[Option<usize>], joint: usize, another: usize) -> bool {
    let mut open = vec![joint];
    let mut seen = vec![false; skeleton.len()];
    while let Some(joint) = open.pop() {
        if joint == another {
            return true;
        }
        if !std::mem::replace(&mut seen[joint], true) {
            open.extend(skeleton.parent(joint));
            open.extend(ridden[joint]);
        }
    }
    false
}

/// Joints of a target's skins that neither move nor hang from anything that does, each with the nearest part of the body to
/// ride: an export that hangs limbs from the armature hangs hip and breast helpers there too, and the mesh would stay behind
/// with them. Nothing where all limbs hang from the body.
pub(crate) fn loose_joints(target: &Rig<'_>, driven: &[bool], limbs: &[Ride]) -> Vec<Ride> {
    let skeleton = target.skeleton();
    if !limbs.iter().any(|ride| ride.hangs_apart(skeleton)) {
        return Vec::new();
    }
    let mut moves = driven.to_vec();
    limbs.iter().for_each(|ride| moves[ride.joint] = true);
    let mut carries = moves.clone();
    for joint in (0..skeleton.len()).rev() {
        if let Some(parent) = skeleton.parent(joint) {
            carries[parent] |= carries[joint];
        }
    }
    let mut is_bound = vec![false; skeleton.len()];
    target.scene.skins.iter().flat_map(|skin| &skin.joints).for_each(|joint| is_bound[*joint] = true);
    let place = |joint: usize| target.rest.transforms()[joint].translation;
    let bones: Vec<(usize, usize)> = carriers(target).into_iter().map(|(end, start)| (start, end)).collect();
    let rest = target.rest.transforms();
    let mut rides = Vec::new();
    for joint in 0..skeleton.len() {
        if let Some(parent) = skeleton.parent(joint) {
            moves[joint] |= moves[parent];
        }
        if moves[joint] || carries[joint] || !is_bound[joint] {
            continue;
        }
        let distance = |(start, end): (usize, usize)| distance_to_bone(place(joint), place(start), place(end));
        let bones = bones.iter().copied().filter(|(start, _)| moves[*start]);
        if let Some((on, _)) = bones.min_by(|first, second| distance(*first).total_cmp(&distance(*second))) {
            moves[joint] = true;
            rides.push(Ride { joint, on, on_from_joint: rest[on].relative(&rest[joint]) });
        }
    }
    rides
}

fn distance_to_bone(place: DVec3, start: DVec3, end: DVec3) -> f64 {
    let along = end - start;
    let share = (place - start).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    place.distance(start + along * share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_come_after_what_they_need_and_a_circle_ends() {
        assert_eq!(order_after(4, |_| [None]), [0, 1, 2, 3]);
        let foot_first = |joint: usize| if joint == 0 { [Some(3), Some(2)] } else { [None, None] };
        assert_eq!(order_after(4, foot_first), [3, 2, 0, 1]);
        assert_eq!(order_after(3, |joint| [Some((joint + 1) % 3)]), [2, 1, 0], "each after the next");
        assert_eq!(order_after(2, |joint| [Some(joint)]), [0, 1], "each after itself");
    }
}
