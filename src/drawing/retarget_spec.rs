//! Which joints of the body turn which bones of the drawing.

use serde::{Deserialize, Serialize};

use super::{
    DrawingError, Ordered,
    yaml::{self, NotUsed, nullable},
};

/// How a group of joints comes onto a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProjectionMethod {
    /// Seen from the front.
    Frontal,
    /// Seen from the side.
    Sagittal,
    /// Whichever of both shows more of the motion.
    Pca,
}

/// Joints of the body that come onto one plane.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ProjectionGroup {
    /// The joints.
    pub bvh_joint_names: Vec<String>,
    /// How they come onto it.
    pub method: ProjectionMethod,
    /// The name of the group.
    pub name: String,
}

/// Joints of the drawing that are drawn together.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BodypartGroup {
    /// Joints of the body whose mean depth tells when the group is drawn.
    pub bvh_depth_drivers: Vec<String>,
    /// The joints of the drawing, in the order of drawing.
    pub char_joints: Vec<String>,
}

/// What moves the root of the drawing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RootOffset {
    /// Chains of the body whose lengths are compared.
    pub bvh_joints: Vec<Vec<String>>,
    /// Chains of the drawing that they are compared with.
    pub char_joints: Vec<Vec<String>>,
    /// The group in whose plane the root moves.
    pub bvh_projection_bodypart_group_for_offset: String,
}

/// How a motion drives a drawing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RetargetSpec {
    /// Where the root is at the first frame.
    pub char_starting_location: [f64; 3],
    /// The planes.
    pub bvh_projection_bodypart_groups: Vec<ProjectionGroup>,
    /// The order of drawing.
    pub char_bodypart_groups: Vec<BodypartGroup>,
    /// What moves the root.
    pub char_bvh_root_offset: RootOffset,
    /// For a joint of the drawing the two joints of the body whose direction its bone takes.
    pub char_joint_bvh_joints_mapping: Ordered<(String, String)>,
    /// Relations of the drawing's joints at rest without which a bone is not driven.
    #[serde(default, deserialize_with = "nullable")]
    pub char_runtime_checks: Vec<Vec<String>>,
    #[serde(flatten, skip_serializing)]
    not_used: NotUsed,
}

impl RetargetSpec {
    /// Reads and checks the text of a retarget config.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong.
    pub fn read(text: &str) -> Result<Self, DrawingError> {
        let spec: Self = yaml::parse(text)?;
        spec.check()?;
        Ok(spec)
    }

    /// Checks what a document says.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong.
    pub fn check(&self) -> Result<(), DrawingError> {
        let spec = self;
        let groups = &spec.bvh_projection_bodypart_groups;
        for (index, group) in groups.iter().enumerate() {
            if groups[..index].iter().any(|other| other.name == group.name) {
                let place = format!("bvh_projection_bodypart_groups[{index}].name");
                let detail = format!("two groups are named {:?}", group.name);
                return Err(DrawingError::new(place, detail, "rename one of them"));
            }
        }
        for (index, group) in spec.char_bodypart_groups.iter().enumerate() {
            if group.bvh_depth_drivers.is_empty() {
                let place = format!("char_bodypart_groups[{index}].bvh_depth_drivers");
                return Err(DrawingError::new(place, "there is none", "name at least one joint of the body"));
            }
        }
        for (index, check) in spec.char_runtime_checks.iter().enumerate() {
            if check.len() != 4 || check[0] != "above" {
                let place = format!("char_runtime_checks[{index}]");
                let fix = "write [above, target, reference, reference]";
                return Err(DrawingError::new(place, "this is not a known check", fix));
            }
        }
        spec.offset_group()?;
        Ok(())
    }

    /// One that begins at the origin of the scene and checks nothing.
    pub(super) fn of_parts(
        bvh_projection_bodypart_groups: Vec<ProjectionGroup>,
        char_bodypart_groups: Vec<BodypartGroup>,
        char_bvh_root_offset: RootOffset,
        char_joint_bvh_joints_mapping: Ordered<(String, String)>,
    ) -> Self {
        Self {
            char_starting_location: [0.0; 3],
            bvh_projection_bodypart_groups,
            char_bodypart_groups,
            char_bvh_root_offset,
            char_joint_bvh_joints_mapping,
            char_runtime_checks: Vec::new(),
            not_used: NotUsed::new(),
        }
    }

    /// The index of the group in whose plane the root moves.
    pub(super) fn offset_group(&self) -> Result<usize, DrawingError> {
        let name = &self.char_bvh_root_offset.bvh_projection_bodypart_group_for_offset;
        let mut groups = self.bvh_projection_bodypart_groups.iter();
        groups.position(|group| group.name == *name).ok_or_else(|| {
            let place = "char_bvh_root_offset.bvh_projection_bodypart_group_for_offset";
            DrawingError::new(place, format!("there is no group {name:?}"), "name one of the projection groups")
        })
    }

    /// The fields that nothing reads.
    #[must_use]
    pub fn not_used(&self) -> Vec<String> {
        self.not_used.keys().cloned().collect()
    }
}
