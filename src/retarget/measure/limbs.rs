//! Where limbs point, and how they are turned about themselves.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::{
    body::{Size, first_joint, last_joint},
    clearance::Clearance,
    collisions::Collisions,
    hands::Hands,
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, Wanted},
    statistics::{mean, percentile},
    trunk::Resting,
};
use crate::{
    model::{
        ModelPose,
        rotation::{degrees, twist_angle},
    },
    retarget::mapping::{LimbPair, Mapping},
    rig::{Limb, Rig, hands::Wrist, standing_floor},
};

/// Limbs whose direction is compared: role of the start, roles of the end in order of preference.
const LIMBS: [(&str, &[&str]); 10] = [
    ("spine", &["neck", "head"]),
    ("neck", &["head"]),
    ("left_upper_arm", &["left_forearm"]),
    ("left_forearm", &["left_hand"]),
    ("right_upper_arm", &["right_forearm"]),
    ("right_forearm", &["right_hand"]),
    ("left_thigh", &["left_shin"]),
    ("left_shin", &["left_foot"]),
    ("right_thigh", &["right_shin"]),
    ("right_shin", &["right_foot"]),
];

/// Ends of limbs, which have a turn of their own, with what gives their axis.
const ENDS: [(&str, &[&str]); 4] = [
    ("left_hand", &["left_middle_metacarpal", "left_middle", "left_index", "left_ring"]),
    ("right_hand", &["right_middle_metacarpal", "right_middle", "right_index", "right_ring"]),
    ("left_foot", &["left_toe"]),
    ("right_foot", &["right_toe"]),
];

/// Limbs that are legs.
const LEGS: [[&str; 2]; 2] = [["left_thigh", "left_shin"], ["right_thigh", "right_shin"]];

/// Limbs that are arms.
const ARMS: [(Limb, [&str; 2]); 2] =
    [(Limb::LeftArm, ["left_upper_arm", "left_forearm"]), (Limb::RightArm, ["right_upper_arm", "right_forearm"])];

/// Joints whose whole turn is compared.
const WHOLE: [&str; 6] = ["pelvis", "head", "left_hand", "right_hand", "left_foot", "right_foot"];

/// Limbs that have a twist; the spine's and the neck's are spread over joints that need not correspond.
const TWISTS: [&str; 8] = [
    "left_upper_arm",
    "left_forearm",
    "right_upper_arm",
    "right_forearm",
    "left_thigh",
    "left_shin",
    "right_thigh",
    "right_shin",
];

/// The direction error of one limb over the clip, in degrees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LimbDirection {
    /// Mean.
    pub mean_degrees: f64,
    /// 95th percentile.
    pub p95_degrees: f64,
    /// Largest.
    pub max_degrees: f64,
    /// Frame of the largest.
    pub worst_frame: usize,
}

/// What is looked at.
pub(super) struct Limbs {
    limbs: Vec<Part>,
    wholes: Vec<Whole>,
    arms: Vec<Arm>,
}

/// An arm of the target that may have to be kept out of floor and body.
struct Arm {
    side: &'static str,
    roles: [&'static str; 2],
    /// Slots of shoulder, elbow and wrist.
    slots: [usize; 3],
    clearance: Clearance,
}

struct Part {
    role: &'static str,
    joint: usize,
    start: usize,
    end: usize,
    turn: usize,
    has_direction: bool,
    has_twist: bool,
    /// By how much the directions of the two rigs differ in the rest poses that motion is measured from. A neck keeps how it is made, so
    /// that much is no error; other limbs are aligned.
    rest_degrees: f64,
}

struct Whole {
    role: &'static str,
    joint: usize,
    turn: usize,
    /// Of a foot whose sole lies on the floor where the rig stands: where its upper side looks in the rest pose that turns are counted from, in
    /// canonical space.
    upper_side: Option<DVec3>,
    /// Of a foot.
    clearance: Option<Clearance>,
    /// Whether the source says how it is turned.
    is_known: bool,
}

/// The series of this family.
pub(super) struct LimbSeries {
    pub(super) directions: Vec<Series>,
    pub(super) twists: Vec<Series>,
    pub(super) wholes: Vec<Series>,
}

impl Limbs {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, size: &Size, mapping: &Mapping, wanted: &mut Wanted) -> Self {
        let mut limbs = Vec::new();
        let limb = |role: &'static str, ends: &[&str], has_direction: bool, wanted: &mut Wanted| {
            let end = ends.iter().find_map(|end| first_joint(rigs, end))?;
            let (start, turned) = (first_joint(rigs, role)?, last_joint(rigs, role)?);
            Some(Part {
                role,
                joint: start.target,
                start: wanted.joint(start),
                end: wanted.joint(end),
                turn: wanted.turn(turned),
                has_direction,
                has_twist: !has_direction || TWISTS.contains(&role),
                rest_degrees: if role == "neck" { rest_degrees(mapping, start, end) } else { 0.0 },
            })
        };
        for (role, ends) in LIMBS {
            limbs.extend(limb(role, ends, true, wanted));
        }
        for (role, ends) in ENDS {
            limbs.extend(limb(role, ends, false, wanted));
        }
        let whole = |role: &'static str| {
            let joint = last_joint(rigs, role)?;
            let is_foot = role.ends_with("_foot");
            let upper_side = is_foot.then(|| upper_side(rigs.target, mapping, joint.target)).flatten();
            let clearance = if is_foot { Clearance::of_foot(rigs.target, size, mapping, joint, wanted) } else { None };
            let is_stiff = |pair: &LimbPair| pair.has_stiff_foot && pair.target.end == joint.target;
            let is_known = !mapping.limbs.iter().any(is_stiff);
            Some(Whole { role, joint: joint.target, turn: wanted.turn(joint), upper_side, clearance, is_known })
        };
        let wholes = WHOLE.into_iter().filter_map(whole).collect();
        let arm = |&(arm, roles): &(Limb, [&'static str; 2])| Arm::find(rigs, size, mapping, (arm, roles), wanted);
        Self { limbs, wholes, arms: ARMS.iter().filter_map(arm).collect() }
    }

    /// The frames of the clip in which feet of the source stand with all of their points, and those in which its trunk is on the floor.
    pub(super) fn series(
        &self,
        compared: &Compared,
        (flat, resting): (&BTreeMap<String, Vec<bool>>, &Resting),
        (hands, collisions): (Option<&Hands>, Option<&Collisions>),
    ) -> LimbSeries {
        let series = |role: &str, joint: usize, value: &dyn Fn(usize) -> f64| Series {
            part: role.to_owned(),
            joint,
            values: (0..compared.len()).map(value).collect(),
        };
        let both = match self.arms.as_slice() {
            [left, right] => Some([left.slots, right.slots]),
            _ => None,
        };
        let together =
            |frame: usize| hands.zip(both).map_or(0.0, |(hands, arms)| hands.together(arms, compared, frame));
        let together: Vec<f64> = (0..compared.len()).map(together).collect();
        // What keeps a hand out of the floor or on the body, or an arm out of the body, or brings hands together, is no error.
        let kept_out = |arm: &Arm| -> Vec<f64> {
            let share = |frame: usize| {
                let aside = collisions.map_or(0.0, |body| {
                    let touching = body.touching(arm.side, arm.slots, compared, frame);
                    touching.max(body.aside(arm.side, arm.slots, compared, frame))
                });
                aside.max(arm.clearance.raised(arm.slots, compared, frame)).max(together[frame])
            };
            (0..compared.len()).map(share).collect()
        };
        let kept_out: Vec<Vec<f64>> = self.arms.iter().map(kept_out).collect();
        let direction = |limb: &Part| {
            let leg = LEGS.iter().find(|leg| leg.contains(&limb.role)).and_then(|leg| self.leg(leg));
            let arm = self.arms.iter().zip(&kept_out).find(|(arm, _)| arm.roles.contains(&limb.role));
            let value = |frame: usize| {
                let share = arm.map_or(0.0, |(_, shares)| shares[frame]);
                let degrees = limb.direction_degrees(compared, frame) * (1.0 - share);
                let lying = leg.and_then(|leg| lying_degrees(leg, compared, resting, frame));
                // What has no direction stays without one.
                lying.filter(|_| degrees.is_finite()).map_or(degrees, |lying| (degrees - lying).max(0.0))
            };
            series(limb.role, limb.joint, &value)
        };
        let is_flat =
            |role: &str, frame: usize| flat.get(role).is_some_and(|flat| flat[compared.frames.indices[frame]]);
        let whole = |whole: &Whole| {
            series(whole.role, whole.joint, &|frame| whole.degrees(compared, frame, is_flat(whole.role, frame)))
        };
        let twist = |limb: &Part| {
            let foot = self.wholes.iter().find(|whole| whole.role == limb.role);
            let tilt = |frame: usize| foot.filter(|_| is_flat(limb.role, frame))?.tilt_degrees(compared, frame);
            // A foot that lies flat is not rolled, however the source's foot was tilted in its rest pose.
            let twist = |frame: usize| limb.twist_degrees(compared, frame).min(tilt(frame).unwrap_or(f64::INFINITY));
            series(limb.role, limb.joint, &twist)
        };
        LimbSeries {
            directions: self.limbs.iter().filter(|limb| limb.has_direction).map(direction).collect(),
            twists: self.limbs.iter().filter(|limb| limb.has_twist).map(twist).collect(),
            wholes: self.wholes.iter().map(whole).collect(),
        }
    }
}

impl Limbs {
    /// The points from which to which a leg is.
    fn leg(&self, roles: &[&str; 2]) -> Option<[usize; 2]> {
        let [thigh, shin] = roles.map(|role| self.limbs.iter().find(|limb| limb.role == role));
        Some([thigh?.start, shin?.end])
    }
}

/// By how many degrees a leg of the target is steeper or flatter than the source's while the body sits or lies and its foot is on the floor:
/// hips are as high over it as bodies are thick, so that much is no error. Nothing in other frames.
fn lying_degrees(leg: [usize; 2], compared: &Compared, resting: &Resting, frame: usize) -> Option<f64> {
    if !resting.lies(compared.frames.indices[frame], compared.target.position(frame, leg[1]).y) {
        return None;
    }
    let steepness = |is_target: bool| {
        let side = compared.side(is_target);
        let line = side.position(frame, leg[1]) - side.position(frame, leg[0]);
        line.y.atan2(line.x.hypot(line.z)).to_degrees()
    };
    Some((steepness(true) - steepness(false)).abs())
}

impl Arm {
    fn find(
        rigs: &Both<&Rig<'_>>,
        size: &Size,
        mapping: &Mapping,
        (arm, roles): (Limb, [&'static str; 2]),
        wanted: &mut Wanted,
    ) -> Option<Self> {
        let [upper, lower] = roles.map(|role| first_joint(rigs, role));
        let (upper, lower) = (upper?, lower?);
        let wrist = Both { source: Wrist::of(rigs.source, arm)?, target: Wrist::of(rigs.target, arm)? };
        // A hand without a joint of its own turns with the forearm.
        let turning = if wrist.target.turns_hand { wrist.map(|wrist| wrist.joint) } else { lower };
        let wrist = wrist.map(|wrist| wrist.joint);
        let clearance = Clearance::of_hand(rigs.target, size, mapping, (arm, wrist, turning), wanted)?;
        let slots = [upper, lower, wrist].map(|joint| wanted.joint(joint));
        Some(Self { side: arm.side_of_arm()?, roles, slots, clearance })
    }
}

impl Part {
    fn direction(&self, compared: &Compared, is_target: bool, frame: usize) -> DVec3 {
        let side = compared.side(is_target);
        side.position(frame, self.end) - side.position(frame, self.start)
    }

    fn direction_degrees(&self, compared: &Compared, frame: usize) -> f64 {
        let (source, target) = (self.direction(compared, false, frame), self.direction(compared, true, frame));
        (angle(source, target) - self.rest_degrees).abs()
    }

    /// The turn that is left between the two about the target limb's axis; swing comes off first, as far as directions differ.
    fn twist_degrees(&self, compared: &Compared, frame: usize) -> f64 {
        let axis = self.direction(compared, true, frame).normalize_or_zero();
        let left = difference(compared, frame, self.turn);
        let along = left.xyz().dot(axis);
        if axis == DVec3::ZERO || along.hypot(left.w) < 1e-6 {
            return f64::NAN;
        }
        (2.0 * along.abs().atan2(left.w.abs())).to_degrees()
    }
}

impl Whole {
    /// How much the turns differ. A foot that stands with heel and ball is right where it lies on the floor and heads where the source's does,
    /// however the source's foot was tilted in its rest pose; one that would be turned into the floor is right where it is as flat as it has to be.
    /// Of a foot of which the source says nothing only its tilt is looked at, while it stands.
    fn degrees(&self, compared: &Compared, frame: usize, is_flat: bool) -> f64 {
        if !self.is_known {
            return self.tilt_degrees(compared, frame).filter(|_| is_flat).unwrap_or(f64::NAN);
        }
        let difference = difference(compared, frame, self.turn);
        let whole = degrees(difference);
        let heading = || twist_angle(difference, DVec3::Y).abs().to_degrees();
        if let Some(tilt) = self.tilt_degrees(compared, frame).filter(|_| is_flat) {
            return whole.min(tilt.max(heading()));
        }
        match self.clearance.as_ref().map_or(0.0, |clearance| clearance.flatter(compared, frame)) {
            share if share > 0.0 => whole.min((whole * (1.0 - share)).max(heading())),
            _ => whole,
        }
    }

    /// How far the sole of a foot is from lying on the floor; nothing of what is no foot, or does not stand at rest.
    fn tilt_degrees(&self, compared: &Compared, frame: usize) -> Option<f64> {
        let upper_side = self.upper_side?;
        Some(angle(compared.target.turn(frame, self.turn) * upper_side, DVec3::Y))
    }
}

/// See [`Whole::upper_side`]; nothing where the rig does not stand.
fn upper_side(rig: &Rig<'_>, mapping: &Mapping, foot: usize) -> Option<DVec3> {
    standing_floor(rig)?;
    let rest = |pose: &ModelPose| pose.transforms()[foot].rotation;
    let aligned_from_standing = rest(&mapping.target_rest) * rest(&rig.rest).conjugate();
    Some(rig.canonical_from_scene * (aligned_from_standing * rig.up()))
}

/// The angle between the lines from one joint to another of both rest poses, the target's aligned; 0 where one has no length.
fn rest_degrees(mapping: &Mapping, start: Both<usize>, end: Both<usize>) -> f64 {
    let line = |rest: &ModelPose, start: usize, end: usize| {
        let rest = rest.transforms();
        rest[end].translation - rest[start].translation
    };
    let source = mapping.target_from_source() * line(&mapping.source_rest, start.source, end.source);
    let degrees = angle(source, line(&mapping.target_rest, start.target, end.target));
    if degrees.is_nan() { 0.0 } else { degrees }
}

/// `Δ_T · Δ_S⁻¹`.
fn difference(compared: &Compared, frame: usize, turn: usize) -> DQuat {
    compared.target.turn(frame, turn) * compared.source.turn(frame, turn).conjugate()
}

/// The angle between two directions, exact for small ones too; NaN where one has no length.
pub(super) fn angle(first: DVec3, second: DVec3) -> f64 {
    if first.length_squared() < 1e-18 || second.length_squared() < 1e-18 {
        return f64::NAN;
    }
    first.cross(second).length().atan2(first.dot(second)).to_degrees()
}

/// The 95th percentile of some series.
pub(super) fn percentile_finding(series: &[Series], frames: &[usize], nothing: &'static str) -> Finding {
    Reading::of_series(series, frames, 0.95).ok_or(nothing)
}

/// The direction errors limb by limb.
pub(super) fn directions(series: &[Series], frames: &[usize]) -> BTreeMap<String, LimbDirection> {
    let direction = |series: &Series| {
        let numbered = series.values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let worst = numbered.max_by(|first, second| first.1.total_cmp(second.1));
        let (worst_frame, max_degrees) = worst.map_or((0, 0.0), |(index, value)| (frames[index], *value));
        let mut finite: Vec<f64> = series.values.iter().copied().filter(|value| value.is_finite()).collect();
        let direction = LimbDirection {
            mean_degrees: mean(&series.values),
            p95_degrees: percentile(&mut finite, 0.95),
            max_degrees,
            worst_frame,
        };
        (series.part.clone(), direction)
    };
    series.iter().map(direction).collect()
}
