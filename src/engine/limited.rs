//! What limits took back, as users see it.

use serde::Serialize;

use crate::{model::Skeleton, retarget::LimitedJoint};

/// What a `limits` op took back at one joint of the target.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitedView {
    /// The joint.
    pub joint: String,
    /// Frames in which it bent or twisted too far and was turned back.
    pub frames: usize,
    /// The largest angle by which it was, degrees.
    pub worst_degrees: f64,
    /// The frame of that, from 0.
    pub worst_frame: usize,
}

/// The joints that were turned back, degrees to the thousandth.
pub(super) fn limited_view(limited: &[LimitedJoint], skeleton: &Skeleton) -> Vec<LimitedView> {
    let view = |&LimitedJoint { joint, frames, worst_degrees, worst_frame }: &LimitedJoint| LimitedView {
        joint: skeleton.label(joint),
        frames,
        worst_degrees: (worst_degrees * 1e3).round() / 1e3,
        worst_frame,
    };
    limited.iter().map(view).collect()
}
