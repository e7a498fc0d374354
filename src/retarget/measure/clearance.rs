//! How much of a difference to the source keeps a foot or a hand of the target out of the floor, which is no error.

use glam::{DQuat, DVec3};

use super::{
    body::Size,
    motion::{Both, Compared, Wanted},
};
use crate::{
    retarget::mapping::Mapping,
    rig::{Limb, Rig, hands::hand_ends},
};

/// How deep a foot or a hand may be in the floor before it is kept out by right, at a leg of 1 m.
const INTO_THE_FLOOR_METERS: f64 = 0.02;
/// Rounds of halving in which it is found how much of a difference is needed.
const HALVINGS: usize = 7;

/// What of a foot of the target can be in the floor, however its toes are bent, or of a hand as it is in the rest pose.
pub(super) struct Clearance {
    /// Slots of ankle or wrist.
    end: usize,
    turn: usize,
    /// From there, in the rest pose that turns are counted from, and how far it goes on about each; canonical, meters.
    points: Vec<(DVec3, f64)>,
    /// How far the farthest is.
    reach: f64,
    /// What is higher is not in the floor; canonical, meters.
    lowest: f64,
}

impl Clearance {
    /// Nothing where it is not known where the floor is, or the foot.
    pub(super) fn of_foot(
        rig: &Rig<'_>,
        size: &Size,
        mapping: &Mapping,
        foot: Both<usize>,
        wanted: &mut Wanted,
    ) -> Option<Self> {
        let pair = mapping.limbs.iter().find(|pair| pair.limb.is_leg() && pair.target.end == foot.target)?;
        let rest = rig.canonical_from_scene * mapping.target_rest.transforms()[foot.target].rotation;
        let points = pair.target_foot.points.iter().filter(|point| !point.gives_way && point.toes < 0.5);
        let points = points.map(|point| (rest * point.from_end * rig.unit_meters, 0.0)).collect();
        Self::of_points(points, size, (foot, foot), wanted)
    }

    /// Of a hand that turns with a joint. Nothing where it is not known where the floor is, or the hand.
    pub(super) fn of_hand(
        rig: &Rig<'_>,
        size: &Size,
        mapping: &Mapping,
        (arm, wrist, turning): (Limb, Both<usize>, Both<usize>),
        wanted: &mut Wanted,
    ) -> Option<Self> {
        let rest = mapping.target_rest.transforms();
        let point = |(anchor, radius): (crate::rig::Anchor, f64)| {
            let joint = rest[anchor.joint];
            let from_wrist = joint.translation + joint.rotation * anchor.offset - rest[wrist.target].translation;
            (rig.canonical_from_scene * from_wrist * rig.unit_meters, radius * rig.unit_meters)
        };
        Self::of_points(hand_ends(rig, arm).into_iter().map(point).collect(), size, (wrist, turning), wanted)
    }

    fn of_points(
        points: Vec<(DVec3, f64)>,
        size: &Size,
        (end, turning): (Both<usize>, Both<usize>),
        wanted: &mut Wanted,
    ) -> Option<Self> {
        let lowest = size.floor? - INTO_THE_FLOOR_METERS * size.leg?;
        let reach = points.iter().map(|(point, radius)| point.length() + radius).fold(0.0, f64::max);
        (!points.is_empty()).then(|| Self { end: wanted.joint(end), turn: wanted.turn(turning), points, reach, lowest })
    }

    /// The share of the way from how the source's foot is turned to how the target's is that keeps the foot, its ankle where it is, out of the
    /// floor: all of it where that is not enough.
    pub(super) fn flatter(&self, compared: &Compared, frame: usize) -> f64 {
        let [source, target] = [false, true].map(|is_target| compared.side(is_target).turn(frame, self.turn));
        let ankle = compared.target.position(frame, self.end);
        least_share(|share| self.is_clear(ankle, source.slerp(target, share)))
    }

    /// The same of where the bones of an arm point, from the source's directions to the target's, with the hand turned as it is. The slots are
    /// those of shoulder, elbow and wrist.
    pub(super) fn raised(&self, slots: [usize; 3], compared: &Compared, frame: usize) -> f64 {
        let turned = compared.target.turn(frame, self.turn);
        least_share(|share| {
            let [_, wrist] = turned_arm(slots, compared, frame, share);
            self.is_clear(wrist, turned)
        })
    }

    fn is_clear(&self, end: DVec3, turned: DQuat) -> bool {
        let is_above = |(point, radius): &(DVec3, f64)| end.y + (turned * *point).y - radius > self.lowest;
        end.y - self.reach > self.lowest || self.points.iter().all(is_above)
    }
}

/// Elbow and wrist of the target's arm, where its bones point a share of the way from where the source's do to where they do. The slots are those
/// of shoulder, elbow and wrist.
pub(super) fn turned_arm(slots: [usize; 3], compared: &Compared, frame: usize, share: f64) -> [DVec3; 2] {
    let places = |is_target: bool| slots.map(|slot| compared.side(is_target).position(frame, slot));
    let ([from, bend, to], [shoulder, elbow, wrist]) = (places(false), places(true));
    let turned_elbow = shoulder + turned_bone(bend - from, elbow - shoulder, share);
    [turned_elbow, turned_elbow + turned_bone(to - bend, wrist - elbow, share)]
}

/// A bone of the target that points a share of the way from where the source's does to where it does.
fn turned_bone(source: DVec3, target: DVec3, share: f64) -> DVec3 {
    let along = source.normalize_or_zero().lerp(target.normalize_or_zero(), share);
    along.normalize_or_zero() * target.length()
}

/// The least share of a difference with which all is clear; 1 where none is enough.
pub(super) fn least_share(is_clear: impl Fn(f64) -> bool) -> f64 {
    if is_clear(0.0) {
        return 0.0;
    }
    let (mut from, mut to) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = (from + to) / 2.0;
        *(if is_clear(middle) { &mut to } else { &mut from }) = middle;
    }
    to
}
