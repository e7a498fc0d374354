//! Which frames of each track are needed, where the frames between them can be found by interpolation.

/// The needed frames of every joint's tracks, for formats in which each track has key times of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SparseKeys {
    /// One entry per joint, in the skeleton's order.
    pub joints: Vec<JointKeys>,
}

/// The needed frames of one joint's tracks: rising, the first one 0. Empty where the track is not sampled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JointKeys {
    /// Of the translation.
    pub translation: Vec<usize>,
    /// Of the rotation.
    pub rotation: Vec<usize>,
    /// Of the scale.
    pub scale: Vec<usize>,
}

impl SparseKeys {
    /// How many keys there are in all.
    #[must_use]
    pub fn count(&self) -> usize {
        self.joints.iter().map(|keys| keys.translation.len() + keys.rotation.len() + keys.scale.len()).sum()
    }
}
