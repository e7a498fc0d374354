//! A body that sits or lies: whether its trunk is on the floor where the source's is.
//!
//! Feet say nothing of it: they are off the floor, or lie on it, whether the body hovers or not.

use super::{
    body::{Size, first_joint},
    metric::{Finding, Reading, Series},
    motion::{Anchor, Both, Compared, Kinematics, Motion, Performer, Wanted},
};
use crate::rig::{Rig, floors, trunk_ends};

/// A pelvis that is higher carries no trunk that rests, as a share of how high it is where the rig stands.
const UPRIGHT_SHARE: f64 = 0.85;
/// A trunk whose lowest point is higher does not rest on the floor, in legs; of figures whose trunks are low as they stand, at such a share
/// of that.
const RESTS_LEGS: f64 = 0.06;
const RESTS_SHARE: f64 = 0.15;
/// So long before and after, a body goes down and gets up: its pelvis is on the way between heights that differ from body to body.
const ON_THE_WAY_SECONDS: f64 = 0.5;
/// A leg whose ankle is higher over the floor does not lie on it, in legs.
const LIES_LEGS: f64 = 0.3;
const CENTIMETERS: f64 = 100.0;
const STANDS: &str = "the source's body neither sits nor lies on the floor in this clip";

/// What is looked at.
pub(super) struct Trunk {
    /// Slot of the pelvis.
    pelvis: usize,
    /// Slots of the ankles.
    ankles: Vec<usize>,
    joints: Both<usize>,
    legs: Both<f64>,
}

/// When the source's trunk is on the floor.
#[derive(Default)]
pub(super) struct Resting {
    joint: usize,
    /// In centimeters at 1 m leg length, how far the target's is off the floor then; not a number in other frames. Empty where it never is.
    floats: Vec<f64>,
    /// Whether it is on the floor at most half a second away, by frame of the clip; empty where it never is.
    is_near: Vec<bool>,
    /// Height of the target's floor, meters, and below which ankle legs lie.
    lying_height_meters: f64,
}

/// The end points of a trunk, and how thick it is about them, meters.
struct Ends {
    anchors: Vec<Anchor>,
    radii_meters: Vec<f64>,
    floor_meters: f64,
}

impl Trunk {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: &Both<Size>, wanted: &mut Wanted) -> Option<Self> {
        let pelvis = first_joint(rigs, "pelvis")?;
        let legs = Both { source: sizes.source.leg?, target: sizes.target.leg? };
        let ankles = ["left_foot", "right_foot"].iter().filter_map(|foot| first_joint(rigs, foot));
        let ankles = ankles.map(|ankle| wanted.joint(ankle)).collect();
        Some(Self { pelvis: wanted.joint(pelvis), ankles, joints: pelvis, legs })
    }

    /// `compared` has every frame. `has_ground` says whether feet stand above the floor, too, as on stairs.
    pub(super) fn resting(
        &self,
        performers: &Both<Performer<'_>>,
        compared: &Compared,
        has_ground: bool,
    ) -> Option<Resting> {
        let rig = performers.source.rig;
        let (rest_floor, floor) = floors(rig, performers.source.clip)?;
        let upright = (rig.rest_height(self.joints.source) - rest_floor) * rig.unit_meters;
        // Who walks down from the floor does not lie on it: what ankles are below it, it is lower.
        let sunk = |motion: &Motion, frame: usize, floor_meters: f64| {
            if !has_ground {
                return 0.0;
            }
            let lowest = self.ankles.iter().map(|ankle| motion.position(frame, *ankle).y).fold(f64::INFINITY, f64::min);
            (lowest - floor_meters).min(0.0)
        };
        let source_floor_meters = floor * rig.unit_meters;
        let is_low = |frame: &usize| {
            let sunk = sunk(&compared.source, *frame, source_floor_meters);
            let height = compared.source.position(*frame, self.pelvis).y - source_floor_meters - sunk;
            height < UPRIGHT_SHARE * upright
        };
        let low: Vec<usize> = (0..compared.len()).filter(is_low).collect();
        if low.is_empty() {
            return None;
        }
        let (_, target_floor) = floors(performers.target.rig, performers.target.clip)?;
        let source = Ends::of(&performers.source, floor)?;
        let target = Ends::of(&performers.target, target_floor)?;
        let standing = source.standing_height(rig, rest_floor);
        let most = (RESTS_LEGS * self.legs.source).min(RESTS_SHARE * standing).max(0.0);
        let of_source = source.heights(&performers.source, &low, compared);
        let over = |(frame, height): (usize, f64)| (frame, height - sunk(&compared.source, frame, source_floor_meters));
        let down = low.into_iter().zip(of_source).map(over).filter(|(_, height)| *height <= most);
        let down: Vec<(usize, f64)> = down.collect();
        if down.is_empty() {
            return None;
        }
        let frames: Vec<usize> = down.iter().map(|(frame, _)| *frame).collect();
        let of_target = target.heights(&performers.target, &frames, compared);
        let target_floor_meters = target.floor_meters;
        let mut floats = vec![f64::NAN; compared.len()];
        for ((frame, source), target) in down.iter().zip(of_target) {
            let target = target - sunk(&compared.target, *frame, target_floor_meters);
            let (source, target) = (source / self.legs.source, target / self.legs.target);
            // As high as the source's, or as deep, is as good as on the floor.
            floats[*frame] = (target - source.max(0.0)).max(source.min(0.0) - target).max(0.0) * CENTIMETERS;
        }
        let lying_height_meters = target.floor_meters + LIES_LEGS * self.legs.target;
        Some(Resting { joint: self.joints.target, floats, is_near: near(&frames, compared), lying_height_meters })
    }
}

/// Whether one of some frames is at most half a second away, by frame of the clip.
fn near(frames: &[usize], compared: &Compared) -> Vec<bool> {
    let times = &compared.performed_seconds;
    let mut is_near = vec![false; compared.frames.indices.last().map_or(0, |last| last + 1)];
    let mut next = 0;
    for (frame, index) in compared.frames.indices.iter().enumerate() {
        while next < frames.len() && times[frames[next]] < times[frame] - ON_THE_WAY_SECONDS {
            next += 1;
        }
        is_near[*index] = frames.get(next).is_some_and(|&near| times[near] <= times[frame] + ON_THE_WAY_SECONDS);
    }
    is_near
}

impl Ends {
    /// Over a floor at a height in the scene's unit; nothing where no trunk is known.
    fn of(performer: &Performer<'_>, floor: f64) -> Option<Self> {
        let rig = performer.rig;
        let (anchors, radii_meters): (Vec<Anchor>, Vec<f64>) = trunk_ends(rig)
            .into_iter()
            .map(|(anchor, radius)| (Anchor::of(rig, anchor), radius * rig.unit_meters))
            .unzip();
        (!anchors.is_empty()).then_some(Self { anchors, radii_meters, floor_meters: floor * rig.unit_meters })
    }

    /// How high the lowest is over the floor where the rig stands, meters.
    fn standing_height(&self, rig: &Rig<'_>, rest_floor: f64) -> f64 {
        let height = |(anchor, radius): (&Anchor, &f64)| {
            let place = rig.rest.transforms()[anchor.joint].transform_point(anchor.offset);
            (place.dot(rig.up()) - rest_floor) * rig.unit_meters - radius
        };
        self.anchors.iter().zip(&self.radii_meters).map(height).fold(f64::INFINITY, f64::min)
    }

    /// How high the lowest is over the floor in some frames, meters.
    fn heights(&self, performer: &Performer<'_>, frames: &[usize], compared: &Compared) -> Vec<f64> {
        let indices: Vec<usize> = frames.iter().map(|&frame| compared.frames.indices[frame]).collect();
        let motion: Motion = Kinematics::of_points(performer, &self.anchors).run(&indices);
        let lowest = |frame: usize| {
            let height = |(point, radius): (usize, &f64)| motion.position(frame, point).y - radius;
            self.radii_meters.iter().enumerate().map(height).fold(f64::INFINITY, f64::min) - self.floor_meters
        };
        (0..indices.len()).map(lowest).collect()
    }
}

impl Resting {
    /// Whether the trunk is on the floor at a frame of the clip, or comes from there or goes there.
    pub(super) fn is_near(&self, index: usize) -> bool {
        self.is_near.get(index).copied().unwrap_or_default()
    }

    /// Whether a leg of the target lies there with its ankle at such a height, in meters.
    pub(super) fn lies(&self, index: usize, ankle_meters: f64) -> bool {
        self.is_near(index) && ankle_meters < self.lying_height_meters
    }

    /// How far the target's trunk is off the floor where the source's is on it.
    pub(super) fn float(&self, compared: &Compared) -> Finding {
        let series = Series { part: "trunk".to_owned(), joint: self.joint, values: self.floats.clone() };
        Reading::of_series(&[series], &compared.frames.indices, 0.95).ok_or(STANDS)
    }
}
