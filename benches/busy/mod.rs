//! A clip in which every joint turns.

use glam::{Quat, Vec3};
use retargetd::model::{Clip, JointTracks, Skeleton, Track};

/// So that no track of rotations is constant. The top joint walks on; 60 frames per second.
pub(crate) fn busy_clip(skeleton: &Skeleton, frames: usize) -> Clip {
    let turning = |joint: usize| -> Vec<Quat> {
        let rest = skeleton.joints()[joint].rest.rotation.as_quat();
        let axis = Vec3::new(1.0, joint as f32 * 0.37, 0.5).normalize();
        (0..frames).map(|frame| rest * Quat::from_axis_angle(axis, (frame as f32 * 0.05).sin() * 0.5)).collect()
    };
    let tracks = (0..skeleton.len()).map(|joint| {
        let root = skeleton.parent(joint).is_none();
        let path = |frame: usize| Vec3::new(0.0, 0.95, frame as f32 * 0.02);
        JointTracks {
            rotation: Track::Sampled(turning(joint)),
            translation: if root { Track::Sampled((0..frames).map(path).collect()) } else { Track::Rest },
            scale: Track::Rest,
        }
    });
    let times = (0..frames).map(|frame| frame as f64 / 60.0).collect();
    Clip::new("bench".into(), times, tracks.collect()).expect("a valid clip")
}
