//! A pose that is being edited.

use glam::{DQuat, DVec3};

use crate::model::Transform;

use super::super::posing::{Pose, Posing};

/// The target at one frame, and the source beside it. Joints below an edited one are carried along.
pub(in crate::retarget) struct Figure<'a> {
    pub(in crate::retarget) source: &'a Pose,
    /// How much of the op is taken; steps need it only where the blend of the result is not it.
    pub(in crate::retarget) alpha: f64,
    posing: &'a Posing,
    pose: &'a mut Pose,
    /// What [`Self::keep`] remembers; as long as the pose.
    kept: &'a mut [Transform],
    /// Slots before this one have an up-to-date model transform.
    valid: usize,
}

impl<'a> Figure<'a> {
    pub(in crate::retarget) fn new(
        source: &'a Pose,
        posing: &'a Posing,
        pose: &'a mut Pose,
        kept: &'a mut [Transform],
    ) -> Self {
        let valid = pose.model.len();
        Self { source, alpha: 1.0, posing, pose, kept, valid }
    }

    /// `plan_from_joint`.
    pub(in crate::retarget) fn model(&mut self, slot: usize) -> Transform {
        while self.valid <= slot {
            self.pose.model[self.valid] =
                self.posing.parent_of(self.pose, self.valid).then_child(&self.pose.local[self.valid]);
            self.valid += 1;
        }
        self.pose.model[slot]
    }

    /// `plan_from_parent`.
    pub(in crate::retarget) fn parent(&mut self, slot: usize) -> Transform {
        if slot > 0 {
            self.model(slot - 1);
        }
        self.posing.parent_of(self.pose, slot)
    }

    /// `parent_from_joint`.
    pub(in crate::retarget) fn local(&self, slot: usize) -> Transform {
        self.pose.local[slot]
    }

    pub(in crate::retarget) fn set_local(&mut self, slot: usize, local: Transform) {
        self.pose.local[slot] = local;
        self.valid = self.valid.min(slot);
    }

    /// Gives a joint a rotation in plan space.
    pub(in crate::retarget) fn turn_to(&mut self, slot: usize, rotation: DQuat) {
        let parent = self.parent(slot);
        let local = self.local(slot);
        self.set_local(slot, Transform { rotation: (parent.rotation.conjugate() * rotation).normalize(), ..local });
    }

    /// Gives a joint a position in plan space.
    pub(in crate::retarget) fn move_to(&mut self, slot: usize, position: DVec3) {
        let parent = self.parent(slot);
        let local = self.local(slot);
        let translation = parent.relative(&Transform::from_translation(position)).translation;
        self.set_local(slot, Transform { translation, ..local });
    }

    /// Remembers where joints are.
    pub(in crate::retarget) fn keep(&mut self, slots: &[usize]) {
        for &slot in slots {
            self.kept[slot] = self.model(slot);
        }
    }

    /// Where a joint was when [`Self::keep`] was asked.
    pub(in crate::retarget) fn kept(&self, slot: usize) -> Transform {
        self.kept[slot]
    }

    /// Turns joints back to how they were turned when [`Self::keep`] was asked; they stay where they are carried.
    pub(in crate::retarget) fn turn_back(&mut self, slots: &[usize]) {
        for &slot in slots {
            let kept = self.kept[slot];
            self.turn_to(slot, kept.rotation);
        }
    }

    /// Puts joints back where they were when [`Self::keep`] was asked.
    pub(in crate::retarget) fn put_back(&mut self, slots: &[usize]) {
        for &slot in slots {
            let kept = self.kept[slot];
            self.turn_to(slot, kept.rotation);
            self.move_to(slot, kept.translation);
        }
    }
}

/// A rotation by a multiple of its angle, the short way; beyond 1 and below 0 too.
pub(in crate::retarget) fn scaled(rotation: DQuat, factor: f64) -> DQuat {
    #[expect(clippy::float_cmp, reason = "exactly one means that there is nothing to scale")]
    if factor == 1.0 {
        return rotation;
    }
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    DQuat::from_scaled_axis(rotation.to_scaled_axis() * factor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Joint, JointTracks, Skeleton};

    #[test]
    fn what_hangs_below_is_carried_along() {
        let joint = |name: &str, parent, x| Joint {
            name: name.to_owned(),
            parent,
            rest: Transform::from_translation(DVec3::new(x, 0.0, 0.0)),
            is_joint: true,
            node: 0,
        };
        let joints = vec![joint("a", None, 0.0), joint("b", Some(0), 1.0), joint("c", Some(1), 1.0)];
        let skeleton = Skeleton::new(joints).expect("a skeleton");
        let posing = Posing::new(&skeleton, Transform::IDENTITY, [2]);
        let mut pose = posing.pose();
        posing.fill(&mut pose, &vec![JointTracks::default(); 3], 0);
        let source = pose.clone();
        let mut kept = vec![Transform::IDENTITY; 3];
        let mut figure = Figure::new(&source, &posing, &mut pose, &mut kept);
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        figure.turn_to(1, quarter);
        assert!((figure.model(2).translation - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-12, "carried along");
        figure.move_to(2, DVec3::new(5.0, 0.0, 0.0));
        assert!((figure.model(2).translation - DVec3::new(5.0, 0.0, 0.0)).length() < 1e-12, "moved");
        assert!((figure.local(2).translation - DVec3::new(0.0, -4.0, 0.0)).length() < 1e-12, "below its parent");
    }

    #[test]
    fn angles_are_scaled_the_short_way() {
        let turn = DQuat::from_rotation_y(0.5);
        assert!(
            scaled(-turn, 2.0).angle_between(DQuat::from_rotation_y(1.0)) < 1e-7,
            "either sign is the same rotation"
        );
        assert!(scaled(turn, -1.0).angle_between(DQuat::from_rotation_y(-0.5)) < 1e-7, "backward");
        assert!(scaled(DQuat::IDENTITY, 3.0).angle_between(DQuat::IDENTITY) < 1e-7, "nothing stays nothing");
    }
}
