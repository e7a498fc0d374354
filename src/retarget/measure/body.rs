//! How large a body is, and where its parts are: what lengths are told in, and what metrics look at.

use glam::DVec3;

use super::motion::Both;
use crate::rig::{Rig, standing_floor};

/// Lengths of one rig at rest, in meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    /// Hip to ankle along the bones; nothing without legs.
    pub(super) leg: Option<f64>,
    /// Leg and pelvis to head; nothing without legs or a head.
    pub(super) body: Option<f64>,
    /// Height of the floor under the rest pose, where it stands.
    pub(super) floor: Option<f64>,
}

impl Size {
    pub(super) fn of(rig: &Rig<'_>) -> Self {
        let leg = leg_length(rig).filter(|length| *length > 1e-6);
        let first = |role: &str| rig.role(role).first().map(|&joint| position(rig, joint));
        let trunk = first("pelvis").zip(first("head")).map(|(pelvis, head)| pelvis.distance(head));
        Self {
            leg,
            body: leg.zip(trunk).map(|(leg, trunk)| leg + trunk),
            floor: standing_floor(rig).map(|floor| floor * rig.unit_meters),
        }
    }
}

/// Where a joint is at rest, in meters.
fn position(rig: &Rig<'_>, joint: usize) -> DVec3 {
    rig.rest.transforms()[joint].translation * rig.unit_meters
}

fn leg_length(rig: &Rig<'_>) -> Option<f64> {
    let along = |joints: &[usize]| -> f64 {
        joints.windows(2).map(|pair| position(rig, pair[0]).distance(position(rig, pair[1]))).sum()
    };
    let leg = |side: &str| {
        let joint = |part: &str| rig.role(&format!("{side}_{part}")).first().copied();
        match (joint("thigh"), joint("shin"), joint("foot")) {
            (Some(thigh), Some(shin), Some(foot)) => Some(along(&[thigh, shin, foot])),
            _ => {
                let whole = ["hind_leg", "leg_1"].map(|part| rig.role(&format!("{side}_{part}")));
                whole.into_iter().find(|whole| whole.len() > 1).map(along)
            }
        }
    };
    let legs: Vec<f64> = ["left", "right"].into_iter().filter_map(leg).collect();
    (!legs.is_empty()).then(|| legs.iter().sum::<f64>() / legs.len() as f64)
}

/// The bones from a joint to one below it at rest, in meters; the way between them where that is not below.
pub(super) fn bones_length(rig: &Rig<'_>, from: usize, to: usize) -> f64 {
    let path = rig.skeleton().path(from, to).unwrap_or_else(|| vec![from, to]);
    path.windows(2).map(|pair| position(rig, pair[0]).distance(position(rig, pair[1]))).sum()
}

/// The first joint of a role on both sides.
pub(super) fn first_joint(rigs: &Both<&Rig<'_>>, role: &str) -> Option<Both<usize>> {
    let [source, target] = [rigs.source, rigs.target].map(|rig| rig.role(role).first().copied());
    Some(Both { source: source?, target: target? })
}

/// The last joint of a role on both sides: what carries all of a split limb's turn.
pub(super) fn last_joint(rigs: &Both<&Rig<'_>>, role: &str) -> Option<Both<usize>> {
    let [source, target] = [rigs.source, rigs.target].map(|rig| rig.role(role).last().copied());
    Some(Both { source: source?, target: target? })
}
