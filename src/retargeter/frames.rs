//! Single poses, one after the other.

use crate::{
    engine::{Failure, FailureCode},
    model::{Clip, ClipError, Control, JointTracks, LocalPose, Reporter, Skeleton, Track, Transform},
    retarget::{FkOp, Op, PelvisOp, Plan, RetargetSpec, resolve, run},
    rig::Rig,
};

use super::Error;

/// Retargets poses by what each of them shows alone: pelvis and forward kinematics.
#[derive(Debug)]
pub struct FrameRetargeter<'a> {
    plan: Plan,
    source: &'a Skeleton,
    target: &'a Skeleton,
    control: Control,
}

impl<'a> FrameRetargeter<'a> {
    pub(super) fn new(spec: &RetargetSpec, source: &'a Rig<'a>, target: &'a Rig<'a>) -> Result<Self, Error> {
        let mut spec = spec.clone();
        let ops = spec.ops.get_or_insert_with(|| vec![Op::Pelvis(PelvisOp::default()), Op::Fk(FkOp::default())]);
        if let Some(place) = ops.iter().position(|op| !matches!(op, Op::Pelvis(_) | Op::Fk(_))) {
            let detail = format!("/ops/{place}: only pelvis and fk work on a pose alone");
            return Err(Failure::new(FailureCode::InvalidValue, detail)
                .in_part("config")
                .with_hint("retarget the whole clip, or leave the op out")
                .into());
        }
        let still = vec![JointTracks::default(); source.skeleton().len()];
        let still = Clip::new(String::new(), vec![0.0], still).map_err(unusable)?;
        let resolved = resolve(&spec, source, target, &still, &mut Reporter::new())
            .map_err(|error| Failure::from(error).in_part("config"))?;
        let plan = Plan::new(source.skeleton(), target.skeleton(), &resolved.mapping);
        Ok(Self { plan, source: source.skeleton(), target: target.skeleton(), control: Control::new() })
    }

    /// The target's local pose for a local pose of the source. Joints that nothing drives are as they rest.
    ///
    /// # Errors
    /// When the pose has another number of joints than the source, or a value that is not finite.
    pub fn retarget(&self, pose: &LocalPose) -> Result<LocalPose, Error> {
        let (expected, actual) = (self.source.len(), pose.transforms().len());
        if actual != expected {
            let detail = format!("the pose has {actual} joints and the source {expected}");
            return Err(Failure::new(FailureCode::InvalidValue, detail).in_part("source").into());
        }
        let tracks = |transform: &Transform| JointTracks {
            translation: Track::Sampled(vec![transform.translation.as_vec3()]),
            rotation: Track::Sampled(vec![transform.rotation.as_quat()]),
            scale: Track::Sampled(vec![transform.scale.as_vec3()]),
        };
        let clip = Clip::new(String::new(), vec![0.0], pose.transforms().iter().map(tracks).collect());
        let moved = run(&self.plan, &clip.map_err(unusable)?, &self.control);
        let moved =
            moved.map_err(|error| Failure::new(FailureCode::InvalidValue, error.to_string()).in_part("source"))?;
        Ok(moved.local_pose(self.target, 0))
    }
}

fn unusable(error: ClipError) -> Failure {
    Failure::new(FailureCode::InvalidValue, error.to_string()).in_part("source")
}

#[cfg(test)]
mod tests {
    use crate::{engine::FailureCode, model::LocalPose, retargeter::Retargeter, samples};

    #[test]
    fn poses_are_those_of_the_whole_clip() {
        let (walk, hero) = (samples::walk_scene(), samples::mannequin_scene());
        let config = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
        let pair = Retargeter::new().config(config).scenes(&walk, &hero).expect("two rigs");
        let clip = pair.retarget(&walk.clips[0]).expect("a clip").clip;
        let frames = pair.frames().expect("a plan");
        for frame in [0, 7, 120] {
            let pose = frames.retarget(&walk.clips[0].local_pose(&walk.skeleton, frame)).expect("a pose");
            let whole = clip.local_pose(&hero.skeleton, frame);
            for (one, other) in pose.transforms().iter().zip(whole.transforms()) {
                assert!(one.rotation.dot(other.rotation).abs() > 1.0 - 1e-9, "frame {frame}");
                assert!(one.translation.distance(other.translation) < 1e-6, "frame {frame}");
            }
        }
    }

    #[test]
    fn what_needs_the_whole_clip_and_what_does_not_fit_is_refused() {
        let (walk, hero) = (samples::walk_scene(), samples::mannequin_scene());
        let config = r#"{"ops": [{"op": "fk"}, {"op": "filter"}]}"#;
        let pair = Retargeter::new().config(config).scenes(&walk, &hero).expect("two rigs");
        let error = pair.frames().expect_err("a filter looks at neighbors");
        assert!(error.detail().starts_with("/ops/1: "), "{error:?}");
        let pair = Retargeter::new().scenes(&walk, &hero).expect("two rigs");
        let error = pair.frames().expect("a plan").retarget(&LocalPose::default()).expect_err("no joints");
        assert_eq!((error.code(), error.part()), (FailureCode::InvalidValue, "source"));
    }
}
