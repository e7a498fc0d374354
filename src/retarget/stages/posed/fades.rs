//! Forward kinematics that are faded out toward the rest pose.

use crate::model::Transform;

use super::figure::{Figure, scaled};

/// The joints of an op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FadeStep {
    pub(in crate::retarget) joints: Vec<FadedJoint>,
    /// Their slots, and those of `below`.
    pub(in crate::retarget) slots: Vec<usize>,
    /// Driven joints below, which keep how they are turned.
    pub(in crate::retarget) below: Vec<usize>,
}

/// One joint; parents come before their children.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FadedJoint {
    pub(in crate::retarget) slot: usize,
    /// Where it is at an alpha of 0, below its parent.
    pub(in crate::retarget) rest: Transform,
    /// Whether its change is measured in the model, and not below its parent.
    pub(in crate::retarget) in_model: bool,
    /// Whether its position fades too.
    pub(in crate::retarget) moves: bool,
}

impl FadeStep {
    /// The same as a constant alpha of forward kinematics: `L_T = L_T^R · ((L_T^R)⁻¹ · P_T⁻¹ · G_T)^alpha`, with `P_T` faded already.
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let alpha = figure.alpha;
        figure.keep(&self.slots);
        for joint in &self.joints {
            if joint.in_model {
                let kept = figure.kept(joint.slot).rotation;
                figure.turn_to(joint.slot, kept);
            }
            let local = figure.local(joint.slot);
            let change = (joint.rest.rotation.conjugate() * local.rotation).normalize();
            let rotation = (joint.rest.rotation * scaled(change, alpha)).normalize();
            let translation =
                if joint.moves { joint.rest.translation.lerp(local.translation, alpha) } else { local.translation };
            figure.set_local(joint.slot, Transform { rotation, translation, ..local });
        }
        figure.turn_back(&self.below);
    }
}
