//! How a rest file was put onto a rig, as it is told.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::rig::{RestFit, Rig};

/// How a rest file was put onto a rig.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RestFileView {
    /// Joints that were matched by name.
    pub matched_by_name: usize,
    /// Joints that were matched by role.
    pub matched_by_role: usize,
    /// Joints that were matched by how they hang together.
    pub matched_by_structure: usize,
    /// Joints of the rig with a role that are not in the rest file; they ride their parents.
    pub missing: Vec<String>,
    /// Joints of the rest file that were not needed.
    pub surplus: usize,
    /// How far the file was turned into the rig's space, in degrees.
    pub turned_degrees: f64,
    /// The rig's bone lengths over those of the file, the unit of the file included.
    pub scale: f64,
    /// Whether both have the same proportions.
    pub same_proportions: bool,
    /// What told how joints are turned about their bones: `axes`, `common_pose` or `directions`.
    pub orientation_from: &'static str,
    /// The largest of `residuals`.
    pub residual_degrees: f64,
    /// By joint, the angle between where its bones point in the solved pose and in the file, in degrees.
    pub residuals: BTreeMap<String, f64>,
}

impl RestFileView {
    /// That of a rig, where it has a rest file.
    pub(super) fn of(rig: &Rig<'_>) -> Option<Self> {
        let fit: &RestFit = rig.rest_fit.as_ref()?;
        let label = |joint: usize| rig.skeleton().label(joint);
        let rounded = |degrees: f64| (degrees * 1000.0).round() / 1000.0;
        Some(Self {
            matched_by_name: fit.by_name,
            matched_by_role: fit.by_role,
            matched_by_structure: fit.by_structure,
            missing: fit.missing.iter().map(|joint| label(*joint)).collect(),
            surplus: fit.surplus,
            turned_degrees: rounded(fit.turned_degrees),
            scale: fit.scale,
            same_proportions: fit.is_one_build,
            orientation_from: fit.orientation_from.name(),
            residual_degrees: fit.worst().map_or(0.0, |(_, degrees)| rounded(degrees)),
            residuals: fit.residuals.iter().map(|(joint, degrees)| (label(*joint), rounded(*degrees))).collect(),
        })
    }
}
