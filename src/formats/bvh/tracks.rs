//! Rows of numbers to tracks of joints.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::{
    angles::sin_cos,
    hierarchy::{Channel, Hierarchy},
};
use crate::model::{JointTracks, Track, rotation::near};

/// Half a degree: a quaternion turns by twice its angle.
const HALF_RADIANS: f64 = std::f64::consts::PI / 360.0;
/// Positions that are less than this share of the offsets are none of their own.
const MIN_POSITIONS: f64 = 0.05;
/// Rows that all joints take their numbers from before the next ones: few enough to stay in the processor's cache meanwhile.
const ROWS_PER_BLOCK: usize = 32;

/// One entry per joint, of `frames` complete rows. With `from_offsets` positions below the root are counted from the offsets.
pub(super) fn tracks(hierarchy: &Hierarchy, values: &[f64], frames: usize, from_offsets: bool) -> Vec<JointTracks> {
    let mut begin = 0;
    let mut growing = Vec::with_capacity(hierarchy.joints.len());
    for (joint, channels) in hierarchy.joints.iter().zip(&hierarchy.channels) {
        let offset = joint.rest.translation;
        let added = if from_offsets && joint.parent.is_some() { offset } else { DVec3::ZERO };
        growing.push(Growing::new(channels, begin, offset, added, frames));
        begin += channels.len();
    }
    for rows in values.chunks(hierarchy.channel_count * ROWS_PER_BLOCK) {
        for joint in &mut growing {
            joint.add(rows.chunks_exact(hierarchy.channel_count));
        }
    }
    growing.into_iter().map(Growing::finish).collect()
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
    fn add<'r>(&mut self, rows: impl Iterator<Item = &'r [f64]>) {
        let columns = self.begin..self.begin + self.channels.len();
        for row in rows {
            let (mut position, mut rotation) = (self.offset, DQuat::IDENTITY);
            for (channel, value) in self.channels.iter().zip(&row[columns.clone()]) {
                match channel {
                    Channel::Position(axis) => position[*axis] = *value + self.added[*axis],
                    Channel::Rotation(axis) => rotation = turned(rotation, *axis, *value),
                }
            }
            if self.is_moved {
                self.translations.push(position.as_vec3());
            }
            if self.is_turned {
                rotation = near(rotation, self.previous);
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

/// A rotation and then one about an axis, which has one component beside the real one.
fn turned(DQuat { x, y, z, w }: DQuat, axis: usize, degrees: f64) -> DQuat {
    let (sin, cos) = sin_cos(degrees * HALF_RADIANS);
    match axis {
        0 => DQuat::from_xyzw(x * cos + w * sin, y * cos + z * sin, z * cos - y * sin, w * cos - x * sin),
        1 => DQuat::from_xyzw(x * cos - z * sin, y * cos + w * sin, z * cos + x * sin, w * cos - y * sin),
        _ => DQuat::from_xyzw(x * cos + y * sin, y * cos - x * sin, z * cos + w * sin, w * cos - z * sin),
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
