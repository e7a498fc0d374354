//! The planes onto which groups of joints are seen, the angles and depths in them.

use glam::{DVec2, DVec3};

use super::{BodyMotion, DrawingError, ProjectionGroup, ProjectionMethod, RetargetSpec, principal::least_varying};

/// A plane onto which joints are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// From the front: its normal is X.
    Frontal,
    /// From the side: its normal is Z.
    Sagittal,
}

impl Plane {
    /// The plane of a group of joints.
    fn of(group: &ProjectionGroup, motion: &BodyMotion) -> Self {
        match group.method {
            ProjectionMethod::Frontal => Self::Frontal,
            ProjectionMethod::Sagittal => Self::Sagittal,
            ProjectionMethod::Pca => {
                let mut is_in = vec![false; motion.joints()];
                for joint in group.bvh_joint_names.iter().filter_map(|name| motion.joint(name)) {
                    is_in[joint] = true;
                }
                let joints: Vec<usize> = (0..motion.joints()).filter(|&joint| is_in[joint]).collect();
                let frames = 0..motion.frames();
                let points: Vec<DVec3> =
                    frames.flat_map(|frame| joints.iter().map(move |&joint| motion.place(frame, joint))).collect();
                let flat = least_varying(&points);
                if flat.x.abs() > flat.z.abs() { Self::Frontal } else { Self::Sagittal }
            }
        }
    }

    /// A direction as it is seen: right and up.
    #[must_use]
    pub fn seen(self, direction: DVec3) -> DVec2 {
        match self {
            Self::Frontal => DVec2::new(-direction.z, direction.y),
            Self::Sagittal => DVec2::new(direction.x, direction.y),
        }
    }

    /// How far a place is before the plane.
    #[must_use]
    pub fn depth(self, place: DVec3) -> f64 {
        match self {
            Self::Frontal => place.x,
            Self::Sagittal => place.z,
        }
    }
}

/// The planes of a retarget spec's groups and of the joints in them.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    /// Of each group.
    pub(super) of_groups: Vec<Plane>,
    /// Of each joint of the body; of the last group that names it.
    pub(super) of_joints: Vec<Option<Plane>>,
    /// Names in groups that the body does not have.
    pub(super) unknown: Vec<String>,
}

impl Planes {
    pub(super) fn new(spec: &RetargetSpec, motion: &BodyMotion) -> Self {
        let mut planes = Self { of_groups: vec![], of_joints: vec![None; motion.joints()], unknown: vec![] };
        for group in &spec.bvh_projection_bodypart_groups {
            let plane = Plane::of(group, motion);
            planes.of_groups.push(plane);
            for name in &group.bvh_joint_names {
                match motion.joint(name) {
                    Some(joint) => planes.of_joints[joint] = Some(plane),
                    None => planes.unknown.push(name.clone()),
                }
            }
        }
        planes
    }

    /// A joint of the body and its plane.
    pub(super) fn joint(&self, motion: &BodyMotion, name: &str, place: &str) -> Result<(usize, Plane), DrawingError> {
        let joint = motion.joint(name).ok_or_else(|| DrawingError::unknown_name(place, name, &motion.joint_names))?;
        let plane = self.of_joints[joint].ok_or_else(|| {
            let detail = format!("the joint {name:?} is in no projection group");
            DrawingError::new(place, detail, "name it in one of bvh_projection_bodypart_groups")
        })?;
        Ok((joint, plane))
    }
}

/// A direction as an angle: degrees counterclockwise from +Y, 0 to 360.
pub(super) fn angle_degrees(direction: DVec2) -> f64 {
    (direction.y.atan2(direction.x).to_degrees() - 90.0).rem_euclid(360.0)
}
