//! How large the target's feet are, and whether they are the source's but for their size.

use glam::DVec3;

use crate::{retarget::stages::builder::StackBuilder, rig::Sole};

/// Feet whose parts differ by less than this share of the largest are of one shape: where the floor of a rest pose is, nobody knows
/// better.
pub(in crate::retarget) const ALIKE: f64 = 2e-2;

/// Size of the target's foot over the source's, where both are of one shape; that of the legs where neither has a size.
pub(in crate::retarget) fn size_ratio(
    stack: &StackBuilder<'_>,
    limb: usize,
    source: &Sole,
    target: &Sole,
) -> Option<f64> {
    ratio_of(source, target, stack.rest(limb).length_ratio)
}

/// Lengths and heights of a foot.
pub(in crate::retarget) fn foot_parts(sole: &Sole) -> [Option<f64>; 5] {
    let length = |bone: Option<DVec3>| bone.map(DVec3::length);
    [length(sole.end_to_ball), Some(sole.heel), sole.ball, sole.tip, length(sole.ball_to_tip)]
}

fn ratio_of(source: &Sole, target: &Sole, leg_ratio: f64) -> Option<f64> {
    let (source, target) = (foot_parts(source), foot_parts(target));
    let largest = |parts: &[Option<f64>]| parts.iter().flatten().fold(0.0, |most: f64, part| most.max(part.abs()));
    let (source_size, target_size) = (largest(&source), largest(&target));
    let ratio = if source_size > 0.0 { target_size / source_size } else { leg_ratio };
    let is_same = |(source, target): (Option<f64>, Option<f64>)| match (source, target) {
        (Some(source), Some(target)) => (source * ratio - target).abs() <= ALIKE * target_size,
        (source, target) => source.is_none() == target.is_none(),
    };
    let have_size = source_size > 0.0 || target_size <= 0.0;
    (have_size && source.into_iter().zip(target).all(is_same)).then_some(ratio)
}
