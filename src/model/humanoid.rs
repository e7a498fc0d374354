//! The humanoid of VRM, as joints of a skeleton.

/// A bone of VRM 1.0's humanoid, and what of a rig it stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HumanoidBone {
    /// Its name, such as `leftUpperArm`.
    pub name: String,
    /// Index of the bone above it in the list; nothing for the hips.
    pub parent: Option<usize>,
    /// The joint where it begins.
    pub joint: usize,
    /// The joint that has all of its rotation: of a limb that is split into joints for bend and twist, the last one.
    pub turned_by: usize,
}
