//! The config of a retarget: which joints of a motion turn which of a drawing, and in which plane.

use std::collections::BTreeSet;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::read;
use crate::drawing::error::DrawingError;

/// How a motion is put onto a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingRetargetSpec {
    /// Where the drawing's root is in the first frame; 1 is the width of its picture.
    pub char_starting_location: [f64; 3],
    /// Groups of the motion's joints, each with a plane of its own.
    pub projection_groups: Vec<ProjectionGroup>,
    /// Groups of the drawing's joints that are drawn together.
    pub bodypart_groups: Vec<BodypartGroup>,
    /// Where the drawing goes.
    pub root_offset: RootOffset,
    /// For each joint of the drawing that is turned: the two joints of the motion whose direction it has, in the order of the file.
    pub mapping: Vec<(String, [String; 2])>,
    /// Checks of the drawing that a mapping can fail.
    pub runtime_checks: Vec<RuntimeCheck>,
}

/// As the file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    char_starting_location: [f64; 3],
    bvh_projection_bodypart_groups: Vec<ProjectionGroup>,
    char_bodypart_groups: Vec<BodypartGroup>,
    char_bvh_root_offset: RootOffset,
    char_joint_bvh_joints_mapping: Map<String, Value>,
    #[serde(default)]
    char_runtime_checks: Vec<RuntimeCheck>,
}

/// Joints of a motion that are projected onto one plane.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectionGroup {
    /// Of the motion.
    pub bvh_joint_names: Vec<String>,
    /// Which plane.
    pub method: ProjectionMethod,
    /// Its name.
    pub name: String,
}

/// Which plane joints are projected onto.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProjectionMethod {
    /// Seen from ahead of the body.
    Frontal,
    /// Seen from its side.
    Sagittal,
    /// Of these two, the one in which the joints move more.
    Pca,
}

/// Joints of a drawing that are drawn together.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodypartGroup {
    /// Joints of the motion whose mean depth is that of the group; at least one.
    pub bvh_depth_drivers: Vec<String>,
    /// Of the drawing, from the back to the front.
    pub char_joints: Vec<String>,
}

/// How far a drawing goes for a step of its motion.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RootOffset {
    /// The projection group in whose plane it goes.
    pub bvh_projection_bodypart_group_for_offset: String,
    /// Chains of the motion whose length is compared with those of the drawing.
    pub bvh_joints: Vec<Vec<String>>,
    /// Those of the drawing.
    pub char_joints: Vec<Vec<String>>,
}

/// A check of a drawing at rest.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "Vec<String>")]
pub struct RuntimeCheck {
    /// The joint that has to be above the line; otherwise it is not turned.
    pub target: String,
    /// Where the line begins and ends.
    pub line: [String; 2],
}

impl TryFrom<Vec<String>> for RuntimeCheck {
    type Error = String;

    fn try_from(words: Vec<String>) -> Result<Self, String> {
        match <[String; 4]>::try_from(words) {
            Ok([kind, target, from, to]) if kind == "above" => Ok(Self { target, line: [from, to] }),
            Ok([kind, ..]) => Err(format!("there is no check '{kind}'; there is 'above'")),
            Err(words) => Err(format!("a check is 'above' and three joints, and not {} words", words.len())),
        }
    }
}

/// Reads the config of a retarget.
///
/// # Errors
/// When it is no YAML, lacks what it needs, has a field that is not known, or holds a value that cannot be used.
pub fn read_retarget(bytes: &[u8]) -> Result<DrawingRetargetSpec, DrawingError> {
    let written: Written = read(bytes, "the retarget config")?;
    let mut names = BTreeSet::new();
    for (index, group) in written.bvh_projection_bodypart_groups.iter().enumerate() {
        if !names.insert(group.name.as_str()) {
            let place = format!("/bvh_projection_bodypart_groups/{index}/name");
            return Err(DrawingError::new(place, format!("there are two groups '{}'", group.name), ""));
        }
    }
    if let Some(index) = written.char_bodypart_groups.iter().position(|group| group.bvh_depth_drivers.is_empty()) {
        let place = format!("/char_bodypart_groups/{index}/bvh_depth_drivers");
        return Err(DrawingError::new(
            place,
            "there are no joints that say how near the group is",
            "name at least one",
        ));
    }
    let mapping = written.char_joint_bvh_joints_mapping.into_iter().map(|(joint, pair)| {
        let place = format!("/char_joint_bvh_joints_mapping/{joint}");
        let pair: [String; 2] = serde_json::from_value(pair)
            .map_err(|_| DrawingError::new(place, "it is not two joints of the motion", "write [proximal, distal]"))?;
        Ok((joint, pair))
    });
    Ok(DrawingRetargetSpec {
        char_starting_location: written.char_starting_location,
        projection_groups: written.bvh_projection_bodypart_groups,
        bodypart_groups: written.char_bodypart_groups,
        root_offset: written.char_bvh_root_offset,
        mapping: mapping.collect::<Result<_, DrawingError>>()?,
        runtime_checks: written.char_runtime_checks,
    })
}
