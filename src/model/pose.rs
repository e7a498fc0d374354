//! Poses, local and in model space. Two types, so that one cannot be taken for the other.

use super::{Skeleton, Transform};

/// One `parent_from_joint` transform per joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LocalPose {
    transforms: Vec<Transform>,
}

/// One `model_from_joint` transform per joint; model space is the scene's space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelPose {
    transforms: Vec<Transform>,
}

impl LocalPose {
    /// Takes one transform per joint, in the skeleton's order.
    #[must_use]
    pub const fn new(transforms: Vec<Transform>) -> Self {
        Self { transforms }
    }

    /// The transforms, in the skeleton's order.
    #[must_use]
    pub fn transforms(&self) -> &[Transform] {
        &self.transforms
    }

    /// The transforms, to be changed.
    pub fn transforms_mut(&mut self) -> &mut [Transform] {
        &mut self.transforms
    }

    /// Accumulates parents over children. Both must have the same number of joints; surplus ones on either side are left out.
    #[must_use]
    pub fn to_model(&self, skeleton: &Skeleton) -> ModelPose {
        let mut transforms: Vec<Transform> = Vec::with_capacity(self.transforms.len());
        for (joint, local) in skeleton.joints().iter().zip(&self.transforms) {
            let model = joint.parent.map_or(*local, |parent| transforms[parent].then_child(local));
            transforms.push(model);
        }
        ModelPose { transforms }
    }
}

impl ModelPose {
    /// Takes one transform per joint, in the skeleton's order.
    #[must_use]
    pub const fn new(transforms: Vec<Transform>) -> Self {
        Self { transforms }
    }

    /// The transforms, in the skeleton's order.
    #[must_use]
    pub fn transforms(&self) -> &[Transform] {
        &self.transforms
    }

    /// The transforms, to be changed.
    pub fn transforms_mut(&mut self) -> &mut [Transform] {
        &mut self.transforms
    }

    /// The local pose that gives this model pose.
    #[must_use]
    pub fn to_local(&self, skeleton: &Skeleton) -> LocalPose {
        let local = |(joint, model): (&super::Joint, &Transform)| {
            joint.parent.map_or(*model, |parent| self.transforms[parent].relative(model))
        };
        LocalPose { transforms: skeleton.joints().iter().zip(&self.transforms).map(local).collect() }
    }
}
