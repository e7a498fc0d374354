//! Where joints are in every frame, in double precision and as the text says: for those who measure angles of bones that point at them.

use glam::{DMat3, DVec3};

use crate::{
    formats::{Budget, FormatError},
    model::Reporter,
};

use super::{
    angles::sin_cos,
    hierarchy::{self, Channel},
    motion,
    scanner::Scanner,
};

/// Joints and end sites of a BVH over time, in its own axes and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct JointPaths {
    /// In the order of the file; an end site is called `<parent>_end`.
    pub names: Vec<String>,
    /// Of each joint; nothing of the root.
    pub parents: Vec<Option<usize>>,
    /// From one frame to the next.
    pub frame_seconds: f64,
    /// Of each frame, the position of each joint. There is at least one frame.
    pub frames: Vec<Vec<DVec3>>,
}

/// Reads where joints are. The root is where its position channels say, whatever its offset; those of other joints count for nothing.
///
/// # Errors
/// When the file cannot be read, or has no motion.
pub(in crate::formats) fn positions(
    bytes: &[u8],
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<JointPaths, FormatError> {
    let mut scanner = Scanner::new(bytes);
    let hierarchy = hierarchy::read(&mut scanner, budget, reporter)?;
    let rows = motion::rows(&mut scanner, &hierarchy, budget, reporter)?;
    let rows = rows.filter(|rows| !rows.values.is_empty());
    let rows = rows.ok_or_else(|| FormatError::malformed("bvh", "MOTION", "the file has no frames"))?;
    let joints = &hierarchy.joints;
    let frame = |row: &[f64]| {
        let (mut positions, mut turns) = (Vec::with_capacity(joints.len()), Vec::<DMat3>::with_capacity(joints.len()));
        let mut values = row.iter();
        for (joint, channels) in joints.iter().zip(&hierarchy.channels) {
            let (mut turn, mut place) = (DMat3::IDENTITY, DVec3::ZERO);
            for (channel, value) in channels.iter().zip(&mut values) {
                match channel {
                    Channel::Position(axis) => place[*axis] = *value,
                    Channel::Rotation(axis) => turn *= about(*axis, value.to_radians()),
                }
            }
            let (position, turn) = match joint.parent {
                None => (place, turn),
                Some(parent) => {
                    let above: DVec3 = positions[parent];
                    (above + turns[parent] * joint.rest.translation, turns[parent] * turn)
                }
            };
            positions.push(position);
            turns.push(turn);
        }
        positions
    };
    Ok(JointPaths {
        names: joints.iter().map(|joint| joint.name.clone()).collect(),
        parents: joints.iter().map(|joint| joint.parent).collect(),
        frame_seconds: rows.frame_seconds,
        frames: rows.values.chunks_exact(hierarchy.channel_count).map(frame).collect(),
    })
}

fn about(axis: usize, radians: f64) -> DMat3 {
    let (sin, cos) = sin_cos(radians);
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut columns = [DVec3::ZERO; 3];
    columns[axis][axis] = 1.0;
    columns[next][next] = cos;
    columns[next][last] = sin;
    columns[last][next] = -sin;
    columns[last][last] = cos;
    DMat3::from_cols(columns[0], columns[1], columns[2])
}
