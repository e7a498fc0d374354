//! Joints in topological order.

use super::{LocalPose, Transform};

/// One node of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The name in the file; may be empty, may repeat.
    pub name: String,
    /// Index of the parent, always smaller than the joint's own.
    pub parent: Option<usize>,
    /// `parent_from_joint` of the file's own node transform.
    pub rest: Transform,
    /// Whether the file says that this node is a joint (of a skin, a limb node, a BVH joint). Other nodes (armatures,
    /// meshes, cameras) are kept because they carry transforms and animation.
    pub is_joint: bool,
    /// The node's index in the file, for messages and for writing back.
    pub node: usize,
}

/// All nodes of a scene as one forest, parents before children.
///
/// The order is guaranteed by construction: a `Skeleton` that exists has no cycle, no missing parent and no forward
/// reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    joints: Vec<Joint>,
}

/// Why a list of joints is no skeleton.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SkeletonError {
    /// A parent index is not smaller than the joint's own.
    #[error("joint {joint} names joint {parent} as its parent, but a parent must come before its children")]
    ParentNotBefore {
        /// Index of the joint.
        joint: usize,
        /// The parent that it names.
        parent: usize,
    },
    /// A rest transform holds a NaN or an infinity.
    #[error("the rest transform of joint {joint} ('{name}') is not finite")]
    RestNotFinite {
        /// Index of the joint.
        joint: usize,
        /// Its name.
        name: String,
    },
}

impl Skeleton {
    /// Takes joints that are in topological order already.
    ///
    /// # Errors
    /// When a parent does not come before its child, or a rest transform is not finite.
    pub fn new(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        for (index, joint) in joints.iter().enumerate() {
            if let Some(parent) = joint.parent
                && parent >= index
            {
                return Err(SkeletonError::ParentNotBefore { joint: index, parent });
            }
            if !joint.rest.is_finite() {
                return Err(SkeletonError::RestNotFinite { joint: index, name: joint.name.clone() });
            }
        }
        Ok(Self { joints })
    }

    /// The joints, parents before children.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// How many joints there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// The parent of a joint.
    #[must_use]
    pub fn parent(&self, joint: usize) -> Option<usize> {
        self.joints[joint].parent
    }

    /// The first joint of that exact name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// What a message or an answer calls a joint: its name where that is unique, else `#<node index>`.
    #[must_use]
    pub fn label(&self, joint: usize) -> String {
        let name = &self.joints[joint].name;
        let unique = !name.is_empty() && self.joints.iter().filter(|other| other.name == *name).count() == 1;
        if unique { name.clone() } else { format!("#{}", self.joints[joint].node) }
    }

    /// The children of every joint, in index order.
    #[must_use]
    pub fn children(&self) -> Vec<Vec<usize>> {
        let mut children = vec![Vec::new(); self.joints.len()];
        for (index, joint) in self.joints.iter().enumerate() {
            if let Some(parent) = joint.parent {
                children[parent].push(index);
            }
        }
        children
    }

    /// Whether `ancestor` is `joint` itself or above it.
    #[must_use]
    pub fn is_ancestor_or_self(&self, ancestor: usize, joint: usize) -> bool {
        let mut current = Some(joint);
        while let Some(index) = current {
            if index == ancestor {
                return true;
            }
            current = self.joints[index].parent;
        }
        false
    }

    /// Some joints and all that they hang from, rising: parents come before their children.
    #[must_use]
    pub fn with_ancestors(&self, joints: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut needed = vec![false; self.len()];
        for joint in joints {
            let mut current = Some(joint);
            while let Some(index) = current.filter(|index| !needed[*index]) {
                needed[index] = true;
                current = self.joints[index].parent;
            }
        }
        (0..self.len()).filter(|joint| needed[*joint]).collect()
    }

    /// The path from `start` down to `end`, both included, or nothing when `end` is not below `start`.
    #[must_use]
    pub fn path(&self, start: usize, end: usize) -> Option<Vec<usize>> {
        let mut path = vec![end];
        let mut current = end;
        while current != start {
            current = self.joints[current].parent?;
            path.push(current);
        }
        path.reverse();
        Some(path)
    }

    /// The node transforms as a pose.
    #[must_use]
    pub fn rest_pose(&self) -> LocalPose {
        LocalPose::new(self.joints.iter().map(|joint| joint.rest).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str, parent: Option<usize>) -> Joint {
        Joint { name: name.into(), parent, rest: Transform::IDENTITY, is_joint: true, node: 7 }
    }

    #[test]
    fn a_parent_after_its_child_is_refused() {
        let error = Skeleton::new(vec![joint("a", Some(0))]).expect_err("a joint cannot be its own parent");
        assert_eq!(error, SkeletonError::ParentNotBefore { joint: 0, parent: 0 }, "the error names both");
    }

    #[test]
    fn paths_and_labels() {
        let skeleton =
            Skeleton::new(vec![joint("a", None), joint("b", Some(0)), joint("b", Some(1)), joint("c", Some(0))])
                .expect("valid");
        assert_eq!(skeleton.path(0, 2), Some(vec![0, 1, 2]), "from start to end");
        assert_eq!(skeleton.path(3, 2), None, "not connected");
        assert_eq!(skeleton.label(0), "a", "unique names are labels");
        assert_eq!(skeleton.label(1), "#7", "repeated names fall back to the node index");
    }
}
