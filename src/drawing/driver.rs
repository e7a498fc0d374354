//! Where the joints of a motion are, seen from a body that always faces one way.

use glam::{DMat3, DVec3};

use crate::formats::JointPaths;

use super::{
    config::{MotionSpec, UpAxis},
    error::DrawingError,
};

/// A motion as drawings need it: +Y up, lengths multiplied by the scale of its config.
#[derive(Clone, Debug, PartialEq)]
pub struct Driver {
    /// Of all joints, in the order of the file.
    pub names: Vec<String>,
    /// From one frame to the next.
    pub frame_seconds: f64,
    /// At least one.
    pub frames: Vec<DriverFrame>,
}

/// One frame of it.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverFrame {
    /// Where the root is. In the first frame the body faces +X.
    pub root: DVec3,
    /// Where the body faces, horizontal and of unit length.
    pub forward: DVec3,
    /// Where joints are, seen from the root of a body that faces +X in every frame.
    pub joints: Vec<DVec3>,
}

impl Driver {
    /// # Errors
    /// When the config names joints or frames that the motion does not have.
    pub(super) fn new(paths: &JointPaths, spec: &MotionSpec) -> Result<Self, DrawingError> {
        let find = |place: String, name: &str| {
            let index = paths.names.iter().position(|known| known == name);
            index.ok_or_else(|| {
                DrawingError::unknown(place, "joint in the motion", name, paths.names.iter().map(String::as_str))
            })
        };
        let ground = find("/groundplane_joint".into(), &spec.groundplane_joint)?;
        let pairs = spec.forward_perp_joint_vectors.iter().enumerate().map(|(index, [from, to])| {
            let place = |end: usize| format!("/forward_perp_joint_vectors/{index}/{end}");
            Ok([find(place(0), from)?, find(place(1), to)?])
        });
        let pairs = pairs.collect::<Result<Vec<[usize; 2]>, DrawingError>>()?;
        let count = paths.frames.len();
        let end = spec.end_frame_idx.filter(|end| *end != 0).unwrap_or(count).min(count);
        let kept = paths.frames.get(spec.start_frame_idx..end).filter(|kept| !kept.is_empty()).ok_or_else(|| {
            let detail = format!("frame {} is none of the {count} that the motion has", spec.start_frame_idx);
            DrawingError::new("/start_frame_idx", detail, "frames are counted from 0")
        })?;
        // +Y up; a quarter turn about X, then one about Y.
        let up = match spec.up {
            UpAxis::Y => DMat3::IDENTITY,
            UpAxis::Z => {
                DMat3::from_rotation_y(-std::f64::consts::FRAC_PI_2)
                    * DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2)
            }
        };
        let upright: Vec<DVec3> = kept[0].iter().map(|joint| up * *joint).collect();
        let first = forward(&upright, &pairs);
        let turn = DMat3::from_rotation_y(first.z.atan2(first.x)) * up;
        let floor = turn * (kept[0][ground] - kept[0][0]) * spec.scale;
        let frames = kept.iter().map(|joints| {
            let root = turn * (joints[0] - kept[0][0]) * spec.scale - DVec3::Y * floor.y;
            let offsets: Vec<DVec3> = joints.iter().map(|joint| turn * (*joint - joints[0]) * spec.scale).collect();
            let forward = forward(&offsets, &pairs);
            let facing = DMat3::from_rotation_y(forward.z.atan2(forward.x));
            DriverFrame { root, forward, joints: offsets.into_iter().map(|joint| facing * joint).collect() }
        });
        let frames: Vec<DriverFrame> = frames.collect();
        Ok(Self { names: paths.names.clone(), frame_seconds: spec.frame_time.unwrap_or(paths.frame_seconds), frames })
    }

    /// How far two joints are from one another in the last frame.
    pub(super) fn last_distance(&self, one: usize, other: usize) -> f64 {
        self.frames.last().map_or(0.0, |frame| frame.joints[one].distance(frame.joints[other]))
    }

    /// The first joint of that name.
    pub(super) fn joint(&self, place: impl Into<String>, name: &str) -> Result<usize, DrawingError> {
        let index = self.names.iter().position(|known| known == name);
        index.ok_or_else(|| {
            DrawingError::unknown(place, "joint in the motion", name, self.names.iter().map(String::as_str))
        })
    }
}

/// Where a body faces: across the mean direction of its pairs of joints, from its left to its right.
fn forward(joints: &[DVec3], pairs: &[[usize; 2]]) -> DVec3 {
    let across: DVec3 = pairs.iter().map(|[from, to]| (joints[*to] - joints[*from]).normalize_or_zero()).sum();
    DVec3::Y.cross(across).normalize_or(DVec3::X)
}
