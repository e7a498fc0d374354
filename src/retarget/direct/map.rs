//! `A · q · B` with constants as one linear map of q: four by four numbers, which keep its length.

use std::mem::MaybeUninit;

use glam::{DQuat, DVec4, Quat};

use super::super::lanes::LANES;

/// Rotations that are mapped at once. Where one of them is no unit quaternion or on the other hemisphere, all of them are mapped one by one.
pub(super) const BLOCK: usize = 8 * LANES;

/// Squares of lengths differ from one by less than this where quaternions are unit ones but for the rounding of single precision.
pub(super) const MIN_SQUARE: f32 = 1.0 - 1e-6;
pub(super) const MAX_SQUARE: f32 = 1.0 + 1e-6;
/// Unit quaternions of which no component differs by more from frame to frame lie on one hemisphere: (4 · 0.7²) < 2.
pub(super) const MAX_STEP: f32 = 0.7;

/// The map as its diagonals: component i of the result is the sum over k of `diagonals[k][i]` times component `i ^ k`.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotationMap {
    pub(super) diagonals: [[f64; 4]; 4],
}

impl RotationMap {
    pub(super) fn new(first: DQuat, after: DQuat) -> Self {
        let unit = |axis: usize| DQuat::from_vec4(DVec4::AXES[axis]);
        let columns: [[f64; 4]; 4] = std::array::from_fn(|axis| (first * unit(axis) * after).to_array());
        Self { diagonals: std::array::from_fn(|k| std::array::from_fn(|i| columns[i ^ k][i])) }
    }

    pub(super) fn negated(self) -> Self {
        Self { diagonals: self.diagonals.map(|diagonal| diagonal.map(|value| -value)) }
    }

    /// One value. The vectors of [`super::wide`] do the same in the same order.
    #[inline(always)]
    pub(super) fn apply(&self, rotation: Quat) -> DQuat {
        let q = rotation.as_dquat().to_array();
        let [zero, one, two, three] = &self.diagonals;
        let value = |i: usize| (zero[i] * q[i] + one[i] * q[i ^ 1]) + (two[i] * q[i ^ 2] + three[i] * q[i ^ 3]);
        DQuat::from_array(std::array::from_fn(value))
    }
}

/// Whether values are unit quaternions, each on the hemisphere of the one before.
pub(super) fn are_tidy(before: Quat, samples: &[Quat]) -> bool {
    let mut previous = before;
    samples.iter().all(|sample| {
        let step = (*sample - previous).to_array();
        previous = *sample;
        let [x, y, z, w] = sample.to_array().map(|value| value * value);
        let square = (x + y) + (z + w);
        (MIN_SQUARE..=MAX_SQUARE).contains(&square) && step.iter().all(|value| value.abs() <= MAX_STEP)
    })
}

/// Maps values one by one.
pub(super) fn map_each(map: &RotationMap, samples: &[Quat], mapped: &mut [MaybeUninit<Quat>]) {
    for (sample, mapped) in samples.iter().zip(mapped) {
        mapped.write(map.apply(*sample).as_quat());
    }
}
