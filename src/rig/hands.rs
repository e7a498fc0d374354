//! Where a hand begins, and how far it reaches on all sides: the ends of palm and fingers, from the skinned mesh where there is one, else
//! guessed from joints.

use glam::DVec3;

use super::{
    limb::{Limb, LimbJoints},
    limb_joints::{LegJoints, limb_joints},
    rig::Rig,
    rig_memory::Question,
    volumes::{Anchor, Body, all_sides},
};
use crate::model::SkinPoint;

/// What is farther from the wrist at rest, and than the elbow, is no hand but what it holds, in legs.
const HAND_LEGS: f64 = 0.4;
/// A vertex that a joint moves by a smaller share is where other joints put it, too.
const MIN_WEIGHT: f32 = 0.5;
/// Fewer vertices do not say where a hand ends.
const FEW_POINTS: usize = 8;
/// How thick wrists and fingers usually are, from the middle of the bone, in legs.
const WRIST_LEGS: f64 = 0.025;
const FINGER_LEGS: f64 = 0.01;
/// How long a hand usually is from the wrist, in legs.
const LENGTH_LEGS: f64 = 0.2;

/// What a hand begins with that has no joint of its own: fingers hang from the forearm then.
const PALM: [&str; 6] = ["middle_metacarpal", "index_metacarpal", "ring_metacarpal", "middle", "index", "ring"];

/// The joint at which a hand begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrist {
    pub(crate) joint: usize,
    /// Whether it turns the whole hand, which moves with the forearm else.
    pub(crate) turns_hand: bool,
}

impl Wrist {
    /// Nothing where it was not recognized, and for what is no arm.
    pub(crate) fn of(side: &Rig<'_>, arm: Limb) -> Option<Self> {
        let prefix = arm.side_of_arm()?;
        let first = |part: &str| side.role(&format!("{prefix}{part}")).first().copied();
        let own = first("hand").map(|joint| Self { joint, turns_hand: true });
        own.or_else(|| PALM.iter().find_map(|part| first(part)).map(|joint| Self { joint, turns_hand: false }))
    }
}

/// An arm down to its wrist; `unit` is plan units per unit of the side.
pub(crate) fn arm_joints(side: &Rig<'_>, arm: Limb, unit: f64) -> Option<LimbJoints> {
    let prefix = arm.side_of_arm()?;
    let first = |part: &str| side.role(&format!("{prefix}{part}")).first().copied();
    let (start, middle, wrist) = (first("upper_arm")?, first("forearm")?, Wrist::of(side, arm)?);
    limb_joints(arm, &LegJoints { chain: [start, middle, middle, wrist.joint], beyond: None }, side, unit)
}

/// Where does a hand of it end?
#[derive(PartialEq)]
struct WhereItsHandEnds {
    arm: Limb,
}

impl Question for WhereItsHandEnds {
    type Answer = Vec<(Anchor, f64)>;
}

/// Points that are fixed to the joints of a hand, each with how far the hand goes on about it, in the scene's unit. Nothing for what is no arm.
pub(crate) fn hand_ends(side: &Rig<'_>, arm: Limb) -> Vec<(Anchor, f64)> {
    side.recall(WhereItsHandEnds { arm }, |_| find_hand_ends(side, arm))
}

fn find_hand_ends(side: &Rig<'_>, arm: Limb) -> Vec<(Anchor, f64)> {
    let (Some(prefix), Some(Wrist { joint: wrist, turns_hand }), Some(body)) =
        (arm.side_of_arm(), Wrist::of(side, arm), Body::of(side, 1.0))
    else {
        return Vec::new();
    };
    let skeleton = side.skeleton();
    let forearms = side.role(&format!("{prefix}forearm"));
    let forearm = forearms.first().map(|joint| body.at(*joint));
    let most = forearm.map_or(0.0, |elbow| elbow.distance(body.at(wrist))).max(HAND_LEGS * body.leg);
    let is_near = |joint: &usize| body.at(*joint).distance(body.at(wrist)) < most && !forearms.contains(joint);
    let top = if turns_hand { wrist } else { forearms.last().copied().unwrap_or(wrist) };
    let below = (top..skeleton.len()).filter(|joint| skeleton.is_ancestor_or_self(top, *joint));
    let joints: Vec<usize> = below.filter(is_near).collect();
    // What a forearm moves that is nearer to the wrist goes with the hand: cuffs, and the paws of comic figures.
    let of_hand = |place: DVec3| forearm.is_some_and(|elbow| place.distance(body.at(wrist)) < place.distance(elbow));
    let of_cuffs = forearms.iter().flat_map(|joint| ends_of_mesh(&body, side, *joint, of_hand));
    let of_hand = joints.iter().flat_map(|joint| ends_of_mesh(&body, side, *joint, |_| true));
    let of_mesh: Vec<(Anchor, f64)> = of_hand.chain(of_cuffs).collect();
    if of_mesh.len() >= FEW_POINTS {
        return of_mesh;
    }
    let thickness = |joint: usize| if joint == wrist { WRIST_LEGS } else { FINGER_LEGS } * body.leg;
    let mut ends: Vec<(Anchor, f64)> =
        joints.iter().map(|&joint| (body.anchor(joint, body.at(joint)), thickness(joint))).collect();
    if let ([_], Some(forearm)) = (joints.as_slice(), forearm) {
        let tip = body.at(wrist) + (body.at(wrist) - forearm).normalize_or_zero() * LENGTH_LEGS * body.leg;
        ends.push((body.anchor(wrist, tip), FINGER_LEGS * body.leg));
    }
    ends
}

/// The vertices of a joint that are the farthest along its axes and between them, of those whose places at rest count.
fn ends_of_mesh(
    body: &Body<'_, '_>,
    side: &Rig<'_>,
    joint: usize,
    counts: impl Fn(DVec3) -> bool,
) -> Vec<(Anchor, f64)> {
    let rest = side.rest.transforms()[joint];
    let place = |point: &SkinPoint| rest.transform_point(point.position.as_dvec3());
    let is_own = |point: &&SkinPoint| point.weight >= MIN_WEIGHT && counts(place(point));
    let points: Vec<&SkinPoint> = side.scene.skin_points.of(joint).iter().filter(is_own).collect();
    let farthest = |direction: DVec3| {
        let along = |index: &usize| points[*index].position.as_dvec3().dot(direction);
        (0..points.len()).max_by(|one, other| along(one).total_cmp(&along(other)).then(other.cmp(one)))
    };
    let mut found: Vec<usize> = all_sides().filter_map(farthest).collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|index| (body.anchor(joint, place(points[index])), 0.0)).collect()
}
