//! Rows of numbers to tracks of joints.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::{
    angles::sines_and_cosines,
    hierarchy::{Channel, Hierarchy},
};
use crate::model::{JointTracks, Track, rotation::near};

/// Half a degree: a quaternion turns by twice its angle.
const HALF_RADIANS: f64 = std::f64::consts::PI / 360.0;
/// Positions that are less than this share of the offsets are none of their own.
const MIN_POSITIONS: f64 = 0.05;
/// Rows that all joints take their numbers from before the next ones: few enough to stay in the processor's cache meanwhile.
pub(super) const ROWS_PER_BLOCK: usize = 32;

/// The tracks of all joints, as far as rows were added.
pub(super) struct GrowingTracks<'a> {
    joints: Vec<Growing<'a>>,
    channel_count: usize,
}

impl<'a> GrowingTracks<'a> {
    /// With room for so many frames. With `from_offsets` positions below the root are counted from the offsets.
    pub(super) fn new(hierarchy: &'a Hierarchy, frames: usize, from_offsets: bool) -> Self {
        let mut begin = 0;
        let mut joints = Vec::with_capacity(hierarchy.joints.len());
        for (joint, channels) in hierarchy.joints.iter().zip(&hierarchy.channels) {
            let offset = joint.rest.translation;
            let added = if from_offsets && joint.parent.is_some() { offset } else { DVec3::ZERO };
            joints.push(Growing::new(channels, begin, offset, added, frames));
            begin += channels.len();
        }
        Self { joints, channel_count: hierarchy.channel_count }
    }

    /// Adds at most [`ROWS_PER_BLOCK`] complete rows.
    pub(super) fn add(&mut self, rows: &[f64]) {
        self.joints.iter_mut().for_each(|joint| joint.add(rows, self.channel_count));
    }

    /// One entry per joint.
    pub(super) fn finish(self) -> Vec<JointTracks> {
        self.joints.into_iter().map(Growing::finish).collect()
    }
}

/// The tracks of a joint, row by row.
struct Growing<'a> {
    channels: &'a [Channel],
    /// Where the joint's numbers begin in a row.
    begin: usize,
    offset: DVec3,
    /// What position channels are counted from.
    added: DVec3,
    /// Empty where there are no position channels.
    translations: Vec<Vec3>,
    rotations: Vec<Quat>,
    is_moved: bool,
    is_turned: bool,
    previous: DQuat,
}

impl<'a> Growing<'a> {
    fn new(channels: &'a [Channel], begin: usize, offset: DVec3, added: DVec3, frames: usize) -> Self {
        let is_moved = channels.iter().any(|channel| matches!(channel, Channel::Position(_)));
        let is_turned = channels.iter().any(|channel| matches!(channel, Channel::Rotation(_)));
        Self {
            channels,
            begin,
            offset,
            added,
            translations: Vec::with_capacity(if is_moved { frames } else { 0 }),
            rotations: Vec::with_capacity(if is_turned { frames } else { 0 }),
            is_moved,
            is_turned,
            previous: DQuat::IDENTITY,
        }
    }

    /// Position channels replace the offset, component by component, but for what they are counted from. The rotation is the product of
    /// the turns in the order of the channels, on the hemisphere of the one before.
    fn add(&mut self, rows: &[f64], channel_count: usize) {
        let count = rows.len() / channel_count;
        let (mut positions, mut turned) = ([self.offset; ROWS_PER_BLOCK], Turned::IDENTITY);
        for (column, channel) in (self.begin..).zip(self.channels) {
            let values = rows.iter().skip(column).step_by(channel_count);
            match channel {
                Channel::Position(axis) => {
                    positions
                        .iter_mut()
                        .zip(values)
                        .for_each(|(place, value)| place[*axis] = *value + self.added[*axis]);
                }
                Channel::Rotation(axis) => {
                    let mut half_angles = [0.0; ROWS_PER_BLOCK];
                    half_angles.iter_mut().zip(values).for_each(|(half, value)| *half = *value * HALF_RADIANS);
                    turned.turn(*axis, &half_angles);
                }
            }
        }
        if self.is_moved {
            self.translations.extend(positions[..count].iter().map(|position| position.as_vec3()));
        }
        if self.is_turned {
            for row in 0..count {
                let rotation = near(turned.get(row), self.previous);
                self.previous = rotation;
                // A product of a few unit quaternions is one.
                self.rotations.push(rotation.as_quat());
            }
        }
    }

    fn finish(self) -> JointTracks {
        JointTracks {
            translation: if self.is_moved { Track::Sampled(self.translations).compacted() } else { Track::Rest },
            rotation: if self.is_turned { Track::Sampled(self.rotations).compacted() } else { Track::Rest },
            scale: Track::Rest,
        }
    }
}

/// The rotations of a block of rows.
struct Turned {
    x: [f64; ROWS_PER_BLOCK],
    y: [f64; ROWS_PER_BLOCK],
    z: [f64; ROWS_PER_BLOCK],
    w: [f64; ROWS_PER_BLOCK],
}

impl Turned {
    const IDENTITY: Self =
        Self { x: [0.0; ROWS_PER_BLOCK], y: [0.0; ROWS_PER_BLOCK], z: [0.0; ROWS_PER_BLOCK], w: [1.0; ROWS_PER_BLOCK] };

    /// Each rotation and then one about an axis, which has one component beside the real one.
    fn turn(&mut self, axis: usize, half_angles: &[f64; ROWS_PER_BLOCK]) {
        let (sines, cosines) = sines_and_cosines(half_angles);
        // Forward along the circle of axes, the other two are `next` and `last`.
        let (own, next, last) = match axis {
            0 => (&mut self.x, &mut self.y, &mut self.z),
            1 => (&mut self.y, &mut self.z, &mut self.x),
            _ => (&mut self.z, &mut self.x, &mut self.y),
        };
        for row in 0..ROWS_PER_BLOCK {
            let (sine, cosine) = (sines[row], cosines[row]);
            let (a, b, c, w) = (own[row], next[row], last[row], self.w[row]);
            own[row] = a * cosine + w * sine;
            next[row] = b * cosine + c * sine;
            last[row] = c * cosine - b * sine;
            self.w[row] = w * cosine - a * sine;
        }
    }

    fn get(&self, row: usize) -> DQuat {
        DQuat::from_xyzw(self.x[row], self.y[row], self.z[row], self.w[row])
    }
}

/// Whether the positions of joints below the root are counted from their offsets, against all custom: at the first frame they
/// are next to nothing, while the offsets are not. Taken as they stand, the whole body would lie in one point.
pub(super) fn positions_count_from_offsets(hierarchy: &Hierarchy, values: &[f64]) -> bool {
    let (mut begin, mut joints) = (0, 0);
    let (mut positions, mut offsets) = (0.0, 0.0);
    for (joint, channels) in hierarchy.joints.iter().zip(&hierarchy.channels) {
        let mut position = DVec3::ZERO;
        let mut has_position = false;
        for (channel, value) in channels.iter().zip(&values[begin..begin + channels.len()]) {
            if let Channel::Position(axis) = channel {
                position[*axis] = *value;
                has_position = true;
            }
        }
        if has_position && joint.parent.is_some() {
            joints += 1;
            positions += position.length();
            offsets += joint.rest.translation.length();
        }
        begin += channels.len();
    }
    joints > 2 && positions < MIN_POSITIONS * offsets
}
