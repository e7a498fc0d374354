//! How joints are turned in the rest file as a whole, their roll included, where that can be told in the rig's axes.
//!
//! Directions leave open how a bone is turned about itself. Two things close that: both files give their joints the same axes, or
//! both hold one and the same pose beside the one that is taken over (the pose that the skins were bound in, the nodes, the first
//! frame of a clip), in which the difference of the axes can be seen.

use glam::DQuat;

use crate::model::{Clip, ModelPose, Scene};

use super::{
    super::{
        super::{recognition::Recognizer, rig::Rig},
        bind::{BindPose, bind_pose},
        rest_fit::OrientationFrom,
    },
    limbs::Limbs,
    matching::Matching,
    solve::{Turns, solved},
};
use crate::model::Reporter;

/// A bone points the same way in two poses to this many degrees.
const SAME_DEGREES: f64 = 2.0;
/// So large a share of the bones does in two poses that are the same.
const SAME_SHARE: f64 = 0.85;
/// Axes that turn bones about themselves by more than this, against the shortest way from the rig's own pose, for half of the
/// joints are other axes, in degrees.
const OTHER_ROLL_DEGREES: f64 = 25.0;
/// Two answers that differ by more than this for half of the joints contradict one another, in degrees.
const CONTRADICTION_DEGREES: f64 = 5.0;
/// Clips whose first frame is looked at.
const CLIPS_LOOKED_AT: usize = 4;

/// A rig and a rest file that have been laid on one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laid<'a> {
    pub(super) rig: &'a Rig<'a>,
    pub(super) rest: &'a Rig<'a>,
    pub(super) matching: &'a Matching,
    pub(super) limbs: &'a Limbs,
    pub(super) rig_from_rest: DQuat,
}

impl Laid<'_> {
    /// How joints are turned in the rest file, as far as that can be told.
    pub(super) fn orientations(&self) -> (OrientationFrom, Turns) {
        let by_axes = self.by_axes();
        let by_pose = self.by_common_pose();
        match (by_axes, by_pose) {
            (Some(axes), Some(pose)) if median_degrees(&axes, &pose) > CONTRADICTION_DEGREES => {
                (OrientationFrom::CommonPose, pose)
            }
            (Some(axes), _) => (OrientationFrom::Axes, axes),
            (None, Some(pose)) => (OrientationFrom::CommonPose, pose),
            (None, None) => (OrientationFrom::Directions, vec![None; self.rig.skeleton().len()]),
        }
    }

    fn turns(&self, turn: impl Fn(usize, usize) -> DQuat) -> Turns {
        let anchors = self.matching.anchors.iter().enumerate();
        anchors.map(|(joint, anchor)| Some(turn(joint, anchor.as_ref()?.joint()?).normalize())).collect()
    }

    /// By the joints' own axes, where those are the same in both files: bones then lie alike in them, and need no roll that the
    /// directions do not.
    fn by_axes(&self) -> Option<Turns> {
        let (ours, theirs) = (self.rig.rest.transforms(), self.rest.rest.transforms());
        let mut turns =
            self.turns(|joint, twin| self.rig_from_rest * theirs[twin].rotation * ours[joint].rotation.conjugate());
        let (mut count, mut alike) = (0, 0);
        let mut odd = Vec::new();
        for limb in self.limbs.limbs.iter().filter(|limb| limb.is_pose) {
            let Some(turn) = turns[limb.from] else { continue };
            count += 1;
            let off = limb.off_degrees(turn);
            alike += usize::from(off < SAME_DEGREES);
            if off > CONTRADICTION_DEGREES {
                odd.push(limb.from);
            }
        }
        if count == 0 || (alike as f64) < SAME_SHARE * f64::from(count) {
            return None;
        }
        let by_directions = solved(self.rig, self.matching, self.limbs, &vec![None; turns.len()]);
        let is_open = |joint: usize| self.limbs.of(joint).count() == 1;
        let rolls: Turns = (0..turns.len()).map(|joint| turns[joint].filter(|_| is_open(joint))).collect();
        let shortest: Turns = by_directions.into_iter().map(Some).collect();
        if median_degrees(&rolls, &shortest) > OTHER_ROLL_DEGREES {
            return None;
        }
        odd.into_iter().for_each(|joint| turns[joint] = None);
        Some(turns)
    }

    /// By the change since a pose that both files hold.
    fn by_common_pose(&self) -> Option<Turns> {
        let (own_poses, poses) = (poses_of(self.rig), poses_of(self.rest));
        let mut best: Option<(f64, &ModelPose, &ModelPose)> = None;
        for own in &own_poses {
            for pose in &poses {
                let limbs = Limbs::find(self.rig, own, self.matching, pose, self.rig_from_rest);
                let off = limbs.mean_degrees();
                let is_same = limbs.share_within(SAME_DEGREES) >= SAME_SHARE;
                if is_same && best.is_none_or(|(other, ..)| off < other - 1e-6) {
                    best = Some((off, own, pose));
                }
            }
        }
        let (_, own, pose) = best?;
        let (ours, theirs) = (self.rig.rest.transforms(), self.rest.rest.transforms());
        Some(self.turns(|joint, twin| {
            let since = theirs[twin].rotation * pose.transforms()[twin].rotation.conjugate();
            let own_change = own.transforms()[joint].rotation * ours[joint].rotation.conjugate();
            self.rig_from_rest * since * self.rig_from_rest.conjugate() * own_change
        }))
    }
}

/// The poses that a file holds beside what moves in it, the one that is measured from first.
pub(super) fn poses_of(rig: &Rig<'_>) -> Vec<ModelPose> {
    let (scene, skeleton): (&Scene, _) = (rig.scene, rig.skeleton());
    let mut poses = vec![rig.rest.clone(), skeleton.rest_pose().to_model(skeleton)];
    if let BindPose::Other(bind) = bind_pose(scene, Recognizer::default(), &mut Reporter::new(), rig.name) {
        poses.push(bind.to_model(skeleton));
    }
    let clips = scene.clips.iter().filter(|clip: &&Clip| clip.frame_count() > 0).take(CLIPS_LOOKED_AT);
    poses.extend(clips.map(|clip| clip.local_pose(skeleton, 0).to_model(skeleton)));
    poses
}

/// The median angle between two answers, over the joints that both have one for; 0 where there is none.
fn median_degrees(ours: &Turns, theirs: &Turns) -> f64 {
    let both = ours.iter().zip(theirs).filter_map(|(our, their)| (*our).zip(*their));
    let mut degrees: Vec<f64> = both.map(|(our, their)| our.angle_between(their).to_degrees()).collect();
    degrees.sort_by(f64::total_cmp);
    degrees.get(degrees.len() / 2).copied().unwrap_or(0.0)
}
