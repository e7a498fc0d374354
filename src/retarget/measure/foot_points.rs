//! Points of feet, and where they are over a clip.

use glam::{DVec2, DVec3, swizzles::Vec3Swizzles};

use super::{
    body::{Size, first_joint},
    contacts::Standing,
    motion::{Anchor, Both, Compared, Wanted},
    skin::PartTrack,
};
use crate::rig::{Rig, Role};

/// A sole further below its joint than this share of the leg is none: the rest pose stands on something else. Cartoon figures have
/// ankles at a third of their legs.
const MAX_SOLE: f64 = 0.5;

/// The feet that both sides have.
pub(super) struct Feet {
    pub(super) points: Vec<FootPoint>,
    pub(super) sizes: Both<Size>,
    pub(super) legs: Both<f64>,
    /// How high each point's joint is over the floor at rest, meters; nothing where the rig does not stand at rest.
    pub(super) ankles: Vec<Both<Option<f64>>>,
    /// Slots of the left and the right hip, of a figure on two legs.
    pub(super) hips: Option<[usize; 2]>,
}

/// A point of a foot on both sides.
pub(super) struct FootPoint {
    pub(super) part: String,
    pub(super) name: &'static str,
    pub(super) joint: usize,
    pub(super) joints: Both<usize>,
    pub(super) slot: usize,
    /// The joint itself, where the slot is of the sole below it.
    pub(super) joint_slot: usize,
    /// How the joint is turned.
    pub(super) turn_slot: usize,
    /// Whether it is one that stands; a toe tip only goes through the floor.
    pub(super) bears: bool,
}

/// One point on both sides, over the clip.
pub(super) struct Traced<'a> {
    pub(super) index: usize,
    pub(super) point: &'a FootPoint,
    pub(super) positions: Both<Vec<DVec3>>,
    pub(super) standing: Both<Standing>,
    /// Height of the floor under it: where the rig stands at rest, else where it stands in the clip.
    pub(super) levels: Both<f64>,
    /// What the mesh says of it.
    pub(super) skin: Both<Option<&'a PartTrack>>,
    /// How high the ground under the foot is above the floor, meters, frame by frame; nothing where feet stand on the floor only.
    pub(super) ground: Option<Both<Vec<f64>>>,
    /// How fast the floor runs below each side, meters a second.
    pub(super) floors: Both<DVec3>,
    /// The source's leg over the target's.
    pub(super) size: f64,
    pub(super) compared: &'a Compared,
}

impl Traced<'_> {
    /// Height over the floor, or the ground above it, meters, of the lowest vertex or of the point; infinite where others speak for it.
    pub(super) fn height(&self, is_target: bool, frame: usize) -> f64 {
        let (skin, positions, level) = if is_target {
            (self.skin.target, &self.positions.target, self.levels.target)
        } else {
            (self.skin.source, &self.positions.source, self.levels.source)
        };
        let ground = self.ground.as_ref().map(|ground| if is_target { &ground.target } else { &ground.source });
        let level = level + ground.map_or(0.0, |ground| ground[frame]);
        match skin {
            Some(track) => track.heights.get(frame).map_or(f64::INFINITY, |height| f64::from(*height) - level),
            None => positions[frame].y - level,
        }
    }

    /// How what stands moves over the floor until the next frame, meters.
    pub(super) fn step(&self, is_target: bool, frame: usize) -> DVec2 {
        let (skin, positions, floor) = if is_target {
            (self.skin.target, &self.positions.target, self.floors.target)
        } else {
            (self.skin.source, &self.positions.source, self.floors.source)
        };
        let of_skin = skin.and_then(|track| *track.steps.get(frame)?);
        let of_point = || {
            let turned = if is_target { DVec3::ZERO } else { self.turned_sole(frame) };
            (positions[frame + 1] - positions[frame] + turned).xz()
        };
        let step = of_skin.map_or_else(of_point, |step| step.way);
        let seconds = &self.compared.performed_seconds;
        step - floor.xz() * (seconds[frame + 1] - seconds[frame])
    }

    /// How a sole moves until the next frame, beside the point below the joint, because the source's foot turns: the place that touches of the
    /// target's mesh, on a foot of the source that is as large beside its leg. A foot that turns about its heel sweeps the floor with its
    /// toes on both sides, and a source without a mesh has no toes that could be looked at. Meters.
    fn turned_sole(&self, frame: usize) -> DVec3 {
        let touching = self.skin.target.and_then(|track| *track.steps.get(frame)?).map(|step| step.from);
        let Some(from) = touching else { return DVec3::ZERO };
        let Compared { source, target, .. } = self.compared;
        let slot = self.point.turn_slot;
        let at_rest = target.turn(frame, slot).conjugate() * (from - self.positions.target[frame]) * self.size;
        source.turn(frame + 1, slot) * at_rest - source.turn(frame, slot) * at_rest
    }
}

impl FootPoint {
    /// Where it is on both sides in every frame.
    pub(super) fn positions(&self, compared: &Compared) -> Both<Vec<DVec3>> {
        let motions = Both { source: &compared.source, target: &compared.target };
        motions.map(|motion| (0..compared.len()).map(|frame| motion.position(frame, self.slot)).collect())
    }

    pub(super) fn new(
        part: &str,
        name: &'static str,
        rigs: &Both<&Rig<'_>>,
        joints: Both<usize>,
        sizes: &Both<Size>,
        wanted: &mut Wanted,
    ) -> Self {
        let anchor = Both {
            source: sole(rigs.source, joints.source, &sizes.source),
            target: sole(rigs.target, joints.target, &sizes.target),
        };
        Self {
            part: part.to_owned(),
            name,
            joint: joints.target,
            joints,
            slot: wanted.point(anchor),
            joint_slot: wanted.joint(joints),
            turn_slot: wanted.turn(joints),
            bears: name != "tip",
        }
    }
}

impl Feet {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: Both<Size>, wanted: &mut Wanted) -> Option<Self> {
        let legs = Both { source: sizes.source.leg?, target: sizes.target.leg? };
        let mut points = Vec::new();
        for side in ["left", "right"] {
            let foot = format!("{side}_foot");
            let toe = format!("{side}_toe");
            let ends = [(foot.as_str(), "heel"), (toe.as_str(), "ball")];
            for (role, name) in ends {
                let joints = rigs.map(|rig| rig.role(role).first().copied());
                let (Some(source), Some(target)) = (joints.source, joints.target) else { continue };
                let both = Both { source, target };
                points.push(FootPoint::new(&foot, name, rigs, both, &sizes, wanted));
                if name == "ball" {
                    let tips = Both { source: tip(rigs.source, source), target: tip(rigs.target, target) };
                    points.push(FootPoint::new(&foot, "tip", rigs, tips, &sizes, wanted));
                }
            }
            let is_leg = |role: &&String| {
                role.starts_with(side) && role.parse::<Role>().is_ok_and(|role| role.part.is_whole_leg())
            };
            for leg in rigs.target.roles.keys().filter(is_leg) {
                let joints = rigs.map(|rig| rig.role(leg).last().copied());
                if let (Some(source), Some(target)) = (joints.source, joints.target) {
                    points.push(FootPoint::new(leg, "paw", rigs, Both { source, target }, &sizes, wanted));
                }
            }
        }
        let over_floor = |point: &FootPoint| {
            let height = |rig: &Rig<'_>, joint: usize, size: &Size| {
                size.floor.map(|floor| rig.rest_height(joint) * rig.unit_meters - floor)
            };
            Both {
                source: height(rigs.source, point.joints.source, &sizes.source),
                target: height(rigs.target, point.joints.target, &sizes.target),
            }
        };
        let ankles = points.iter().map(over_floor).collect();
        let hips = first_joint(rigs, "left_thigh").zip(first_joint(rigs, "right_thigh"));
        let hips = hips.map(|(left, right)| [left, right].map(|hip| wanted.joint(hip)));
        (!points.is_empty()).then_some(Self { points, sizes, legs, ankles, hips })
    }
}

/// The floor under a joint at rest, fixed to the joint; the joint itself where the rig does not stand at rest.
fn sole(rig: &Rig<'_>, joint: usize, size: &Size) -> Anchor {
    let rest = rig.rest.transforms()[joint];
    let (Some(floor), Some(leg)) = (size.floor, size.leg) else { return Anchor::at(joint) };
    let drop = rig.rest_height(joint) - floor / rig.unit_meters;
    if drop.abs() * rig.unit_meters > MAX_SOLE * leg {
        return Anchor::at(joint);
    }
    let below = rest.rotation.conjugate() * (rig.up() * -drop);
    let scale = DVec3::select(rest.scale.cmpeq(DVec3::ZERO), DVec3::ONE, rest.scale);
    Anchor { joint, offset: below / scale }
}

/// The end of the longest straight run of first children below a toe.
fn tip(rig: &Rig<'_>, toe: usize) -> usize {
    let joints = rig.skeleton().joints();
    let mut current = toe;
    for (index, joint) in joints.iter().enumerate().skip(toe + 1) {
        if joint.parent == Some(current) {
            current = index;
        }
    }
    current
}
