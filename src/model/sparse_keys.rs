//! Keys of a clip whose tracks have key times of their own, with what is between them.

use std::ops::{Add, Mul};

use glam::{Quat, Vec3};

/// The keys of every joint's tracks, for formats in which each track has key times of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseKeys {
    /// One entry per joint, in the skeleton's order.
    pub joints: Vec<JointKeys>,
}

/// The keys of one joint's tracks. A track that is not sampled has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointKeys {
    /// Of the translation.
    pub translation: KeyCurve<Vec3>,
    /// Of the rotation.
    pub rotation: KeyCurve<Quat>,
    /// Of the scale.
    pub scale: KeyCurve<Vec3>,
}

/// The keys of one track.
///
/// Without tangents values between keys lie on the straight way, of rotations on the shortest arc; with them on the cubic of Hermite,
/// whose values, if rotations, are made unit ones.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyCurve<T> {
    /// The clip's frames that have a key: rising, the first one 0.
    pub frames: Vec<usize>,
    /// The value at each.
    pub values: Vec<T>,
    /// Changes per second before and after each key; empty where the curve is linear.
    pub tangents: Vec<[T; 2]>,
}

impl<T> Default for KeyCurve<T> {
    fn default() -> Self {
        Self { frames: Vec::new(), values: Vec::new(), tangents: Vec::new() }
    }
}

impl<T> KeyCurve<T> {
    /// Whether values between keys lie on a cubic.
    #[must_use]
    pub const fn is_cubic(&self) -> bool {
        !self.tangents.is_empty()
    }

    /// The curve with its values and tangents changed; `linear` is a linear map.
    #[must_use]
    pub fn map(&self, linear: impl Fn(T) -> T) -> Self
    where
        T: Copy,
    {
        Self {
            frames: self.frames.clone(),
            values: self.values.iter().map(|value| linear(*value)).collect(),
            tangents: self.tangents.iter().map(|pair| pair.map(&linear)).collect(),
        }
    }
}

impl SparseKeys {
    /// How many keys there are in all.
    #[must_use]
    pub fn count(&self) -> usize {
        let keys =
            |joint: &JointKeys| joint.translation.frames.len() + joint.rotation.frames.len() + joint.scale.frames.len();
        self.joints.iter().map(keys).sum()
    }

    /// How many bytes a glTF file holds them in: times and values in single precision, times of every track on their own.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let joint =
            |joint: &JointKeys| bytes(&joint.translation, 3) + bytes(&joint.rotation, 4) + bytes(&joint.scale, 3);
        self.joints.iter().map(joint).sum()
    }
}

fn bytes<T>(curve: &KeyCurve<T>, width: usize) -> usize {
    let values_per_key = if curve.is_cubic() { 3 } else { 1 };
    curve.frames.len() * size_of::<f32>() * (1 + width * values_per_key)
}

/// The cubic of Hermite between two values.
///
/// `share` is that of the way, 0 to 1; the tangents are changes over the whole way.
#[must_use]
pub fn hermite<T>(share: f64, values: [T; 2], tangents: [T; 2]) -> T
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let rest = 1.0 - share;
    values[0] * ((1.0 + 2.0 * share) * rest * rest)
        + tangents[0] * (share * rest * rest)
        + values[1] * (share * share * (3.0 - 2.0 * share))
        + tangents[1] * (-share * share * rest)
}
