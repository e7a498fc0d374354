//! What the report says of a rig.

use serde::Serialize;

use crate::{formats::Format, model::Scene, rig::Rig};

use super::rest_file::RestFileView;

/// What was found out about a rig.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RigFacts {
    /// Wire name of the file's format.
    pub format: &'static str,
    /// The convention that the rig was recognized as, where it was.
    pub recognised_as: Option<String>,
    /// How sure that is, 0 to 1.
    pub confidence: f64,
    /// How the rest pose holds the arms: `T`, `A`, `arms_down` or `other`.
    pub rest_pose: &'static str,
    /// Where the rest pose came from: `upload`, `clip_frame`, `bind`, `nodes`, `standing_frame`, `solved`.
    pub rest_pose_from: &'static str,
    /// Why it was taken from there.
    pub rest_pose_reason: String,
    /// How the rest file was put onto the rig, where one was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_file: Option<RestFileView>,
    /// Up and front axes.
    pub axes: String,
    /// Meters per unit of length.
    pub unit_meters: f64,
}

impl RigFacts {
    pub(super) fn of(side: &Rig<'_>, format: Format) -> Self {
        Self {
            format: format.info().name,
            recognised_as: side.recognition.recognised_as.clone(),
            confidence: side.recognition.confidence,
            rest_pose: side.recognition.rest_pose.name(),
            rest_pose_from: side.rest_source.name(),
            rest_pose_reason: side.rest_reason.clone(),
            rest_file: RestFileView::of(side),
            axes: side.axes.to_string(),
            unit_meters: side.unit_meters,
        }
    }
}

pub(super) fn joint_count(scene: &Scene) -> usize {
    scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count()
}
