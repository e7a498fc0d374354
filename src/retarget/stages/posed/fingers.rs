//! A finger's joint that is bent and spread more or less. (docs/algorithm/joints.md.)

use glam::{DQuat, DVec3};

use crate::model::rotation::twist_angle;

use crate::model::Transform;

use super::figure::{Figure, scaled};

/// One joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct FingerStep {
    pub(super) slot: usize,
    /// Its rotation below its parent at rest.
    pub(super) rest: DQuat,
    /// How bending and spreading are told apart; nothing for thumbs, which are bent as a whole.
    pub(super) axes: Option<FingerAxes>,
    pub(super) curl: f64,
    pub(super) spread: f64,
    /// Radians.
    pub(super) curl_offset: f64,
}

/// Axes in the joint's own space at rest; unit vectors, each perpendicular to the others.
#[derive(Clone, Copy, Debug)]
pub(super) struct FingerAxes {
    /// Along the bone.
    pub(super) along: DVec3,
    /// What it bends about, toward the palm.
    pub(super) flexion: DVec3,
}

impl FingerStep {
    pub(super) fn apply(&self, figure: &mut Figure<'_>) {
        let local = figure.local(self.slot);
        let change = (self.rest.conjugate() * local.rotation).normalize();
        let changed = match self.axes {
            None => scaled(change, self.curl),
            Some(FingerAxes { along, flexion }) => {
                let twist = DQuat::from_axis_angle(along, twist_angle(change, along));
                let swing = change * twist.conjugate();
                let swing = if swing.w < 0.0 { -swing } else { swing }.to_scaled_axis();
                let bent = swing.dot(flexion);
                let across = swing - flexion * bent;
                let bent = bent * self.curl + self.curl_offset;
                DQuat::from_scaled_axis(flexion * bent + across * self.spread) * twist
            }
        };
        figure.set_local(self.slot, Transform { rotation: (self.rest * changed).normalize(), ..local });
    }
}
