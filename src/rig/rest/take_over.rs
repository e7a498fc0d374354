//! The rest pose of an uploaded file, put onto the skeleton that it is for.

use crate::model::{LocalPose, Skeleton};

/// Transfers the rest pose of an uploaded file onto a skeleton: joints of equal name take its local rotations, and its local
/// translations where the bone is of the same direction and length up to one factor.
///
/// Returns how many joints were found.
pub(super) fn take_over(skeleton: &Skeleton, pose: &mut LocalPose, other: &Skeleton, other_pose: &LocalPose) -> usize {
    let scale = size_ratio(skeleton, other);
    let mut found = 0;
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let Some(twin) = other.find(&joint.name).filter(|_| !joint.name.is_empty()) else { continue };
        found += 1;
        let theirs = other_pose.transforms()[twin];
        let ours = &mut pose.transforms_mut()[index];
        ours.rotation = theirs.rotation;
        ours.translation = theirs.translation * scale;
        ours.scale = theirs.scale;
    }
    found
}

/// Length of our bones over theirs, over the joints that both have; 1 where there is nothing to compare or they agree to a
/// thousandth.
fn size_ratio(skeleton: &Skeleton, other: &Skeleton) -> f64 {
    let (mut ours, mut theirs) = (0.0, 0.0);
    for joint in skeleton.joints().iter().filter(|joint| joint.parent.is_some() && !joint.name.is_empty()) {
        if let Some(twin) = other.find(&joint.name).filter(|twin| other.parent(*twin).is_some()) {
            ours += joint.rest.translation.length();
            theirs += other.joints()[twin].rest.translation.length();
        }
    }
    let ratio = if theirs > 0.0 && ours > 0.0 { ours / theirs } else { 1.0 };
    if (ratio - 1.0).abs() < 1e-3 { 1.0 } else { ratio }
}
