//! What the rest file says of each joint: the directions from it to the joints below it, against the rig's own.

use glam::{DQuat, DVec3};

use crate::model::ModelPose;

use super::{
    super::super::{alignment::split, rig::Rig},
    matching::{Anchor, Matching},
};

/// Bones shorter than this share of the figure have no direction.
const SHORTEST_SHARE: f64 = 1e-3;
/// Bones whose lengths agree to this share are of one build.
const LENGTH_TOLERANCE: f64 = 0.05;
/// In two files of one character so large a share of the bones agrees in length.
const ONE_BUILD_SHARE: f64 = 0.8;
/// What a joint without a role says of its parent counts this much against one with a role.
const NO_ROLE_WEIGHT: f64 = 0.05;

/// One bone of the rig, and where it points in the rest file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limb {
    /// The joint that it begins at, and the one that it leads to.
    pub(super) from: usize,
    pub(super) to: usize,
    /// From one to the other at rest, in the rig's space and unit.
    pub(super) own: DVec3,
    /// The same in the rest file, turned into the rig's space; in the file's unit.
    pub(super) wanted: DVec3,
    pub(super) weight: f64,
    /// Whether both joints have a role, or nothing of the rig has one.
    pub(super) is_named: bool,
    /// Whether where it points belongs to the pose: in two bodies of different build, where hips and collar bones lie does not.
    pub(super) is_pose: bool,
}

impl Limb {
    /// The angle between where the bone points once it has been turned and where it is wanted, in degrees.
    pub(super) fn off_degrees(&self, turn: DQuat) -> f64 {
        (turn * self.own).angle_between(self.wanted).to_degrees()
    }

    /// Our length over theirs.
    fn ratio(&self) -> f64 {
        self.own.length() / self.wanted.length()
    }
}

/// All bones that both files have.
#[derive(Clone, Debug)]
pub(super) struct Limbs {
    /// By the joint that they begin at, rising.
    pub(super) limbs: Vec<Limb>,
    /// Our lengths over theirs, the unit included.
    pub(super) scale: f64,
    /// Whether both have the same proportions, as two files of one character have.
    pub(super) is_one_build: bool,
}

impl Limbs {
    /// Those of a pose of the rest file, against a pose of the rig. `rig_from_rest` turns the one's space into the other's.
    pub(super) fn find(
        rig: &Rig<'_>,
        own_pose: &ModelPose,
        matching: &Matching,
        pose: &ModelPose,
        rig_from_rest: DQuat,
    ) -> Self {
        let places: Vec<Option<DVec3>> = matching
            .anchors
            .iter()
            .map(|anchor: &Option<Anchor>| anchor.map(|anchor| rig_from_rest * anchor.place(pose)))
            .collect();
        let own = |joint: usize| own_pose.transforms()[joint].translation;
        let (our_size, their_size) = (
            size((0..places.len()).filter(|joint| places[*joint].is_some()).map(own)),
            size(places.iter().copied().flatten()),
        );
        let limb = |(from, to): (usize, usize)| {
            let (own, wanted) = (own(to) - own(from), places[to]? - places[from]?);
            let has_length = own.length() > SHORTEST_SHARE * our_size && wanted.length() > SHORTEST_SHARE * their_size;
            has_length.then_some(Limb { from, to, own, wanted, weight: 1.0, is_named: true, is_pose: true })
        };
        let mut limbs: Vec<Limb> = bones(rig, &places).into_iter().filter_map(limb).collect();
        let scale = middle(limbs.iter().map(Limb::ratio).collect());
        let alike = limbs.iter().filter(|limb| (limb.ratio() / scale - 1.0).abs() < LENGTH_TOLERANCE).count();
        let is_one_build = alike as f64 >= ONE_BUILD_SHARE * limbs.len() as f64;
        weigh(rig, &mut limbs, is_one_build, our_size);
        if !is_one_build {
            limbs.extend(trunks(rig).filter_map(limb));
        }
        limbs.sort_by_key(|limb| limb.from);
        Self { limbs, scale, is_one_build }
    }

    /// Those that begin at a joint.
    pub(super) fn of(&self, joint: usize) -> impl Iterator<Item = &Limb> + Clone {
        let (begin, end) = [joint, joint + 1].map(|from| self.limbs.partition_point(|limb| limb.from < from)).into();
        self.limbs[begin..end].iter()
    }

    /// The share of the bones that point where they do at rest, to so many degrees.
    pub(super) fn share_within(&self, degrees: f64) -> f64 {
        let within = self.limbs.iter().filter(|limb| limb.off_degrees(DQuat::IDENTITY) <= degrees).count();
        within as f64 / self.limbs.len().max(1) as f64
    }

    /// The mean angle between where the bones point and where they do at rest, in degrees.
    pub(super) fn mean_degrees(&self) -> f64 {
        let sum: f64 = self.limbs.iter().map(|limb| limb.off_degrees(DQuat::IDENTITY)).sum();
        sum / self.limbs.len().max(1) as f64
    }
}

/// The first and the last joint of a trunk or neck, which two bodies of different build bend otherwise along the way.
fn trunks(rig: &Rig<'_>) -> impl Iterator<Item = (usize, usize)> {
    let first = |role: &str| rig.role(role).first().copied();
    let trunk = first("spine").zip(first("neck").or_else(|| first("head")));
    trunk.into_iter().chain(first("neck").zip(first("head")))
}

/// Pairs of joints that correspond to something: from the nearest one above, and along limbs whose ends hang elsewhere.
fn bones(rig: &Rig<'_>, places: &[Option<DVec3>]) -> Vec<(usize, usize)> {
    let mut bones = Vec::new();
    for joint in (0..places.len()).filter(|joint| places[*joint].is_some()) {
        let mut above = rig.skeleton().parent(joint);
        while let Some(parent) = above.filter(|parent| places[*parent].is_none()) {
            above = rig.skeleton().parent(parent);
        }
        bones.extend(above.map(|above| (above, joint)));
    }
    for side in ["left_", "right_"] {
        for (upper, lower) in [("thigh", "shin"), ("shin", "foot"), ("upper_arm", "forearm"), ("forearm", "hand")] {
            let first = |part: &str| rig.role(&format!("{side}{part}")).first().copied();
            let Some((from, to)) = first(upper).zip(first(lower)) else { continue };
            let both = places[from].is_some() && places[to].is_some();
            if both && !rig.skeleton().is_ancestor_or_self(from, to) {
                bones.push((from, to));
            }
        }
    }
    bones
}

/// What counts, and how much.
fn weigh(rig: &Rig<'_>, limbs: &mut [Limb], is_one_build: bool, size: f64) {
    let mut roles: Vec<Option<&str>> = vec![None; rig.skeleton().len()];
    for (role, joints) in &rig.roles {
        joints.iter().for_each(|joint| roles[*joint] = Some(role));
    }
    let has_roles = roles.iter().any(Option::is_some);
    for limb in limbs {
        let (from, to) = (roles[limb.from], roles[limb.to]);
        let is_named = from.is_some() && to.is_some();
        limb.is_named = is_named || !has_roles;
        limb.weight = if limb.is_named { 1.0 } else { NO_ROLE_WEIGHT } * (limb.own.length() / size).max(0.01);
        limb.is_pose = is_one_build || (is_named && from.zip(to).is_some_and(|(from, to)| shows_pose(from, to)));
    }
}

/// Whether the direction from one role to another is that of a pose, and not of how a body is built.
fn shows_pose(from: &str, to: &str) -> bool {
    let ((_, from), (_, to)) = (split(from), split(to));
    !matches!(
        (from, to),
        ("pelvis" | "root", _)
            | (_, "clavicle")
            | ("clavicle", _)
            | ("foot", _)
            | ("head" | "eye" | "jaw", _)
            | (_, "eye" | "jaw")
    ) && to != "thumb"
        && !matches!(from, "spine" | "neck")
}

fn size(places: impl Iterator<Item = DVec3>) -> f64 {
    let (low, high) =
        places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
    if low.is_finite() { (high - low).length() } else { 0.0 }
}

/// The middle one; 1 where there is none.
fn middle(mut values: Vec<f64>) -> f64 {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(1.0)
}
