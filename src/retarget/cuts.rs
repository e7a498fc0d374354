//! Where a clip is cut: from one frame to the next the whole body is elsewhere. (docs/algorithm/cuts.md.)
//!
//! Captures often begin with a rest pose for one frame, and takes are put one behind the other. Stages smooth over time and lead feet to where
//! they will stand; across a cut that draws the figure from one place to the other. So what is between cuts is worked on as a clip of its own.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::{
    mapping::Mapping,
    stages::{
        posing::{Pose, Posing},
        work::CHUNK_FRAMES,
    },
};
use crate::model::{Clip, JointTracks, Skeleton};

/// What moves farther within a frame, in legs, and faster, in legs a second, is cut.
const MOVED_LEGS: f64 = 0.5;
const LEGS_PER_SECOND: f64 = 12.0;
/// So is a body of which so many bones turn by more against their parents, and faster.
const TURNED: usize = 2;
const TURNED_RADIANS: f64 = 0.7;
const RADIANS_PER_SECOND: f64 = 15.0;
/// But for figures whose feet go nowhere, in legs: a blow that is struck within a frame is no cut, and feet that stand go on standing.
const FOOT_LEGS: f64 = 0.06;
/// The steps before and behind a cut are smaller than this share of it: fast motions begin and end over some frames.
const BESIDE: f64 = 0.15;
/// A clip with more cuts than two and this many in a second is one of held poses, and not cut at all.
const PER_SECOND: f64 = 0.5;

/// What a thread works in: where joints are at a frame, and where bones and feet were at the one before.
struct Scratch {
    pose: Pose,
    turned: Vec<DQuat>,
    feet: Vec<DVec3>,
}

/// Finds cuts of the source.
#[derive(Clone, Debug)]
pub(super) struct Cuts {
    posing: Posing,
    pelvis: usize,
    bones: Vec<usize>,
    feet: Vec<usize>,
    /// Length of its legs, plan units.
    leg: f64,
}

impl Cuts {
    /// Nothing for sources whose pelvis or legs are not mapped.
    pub(super) fn new(source: &Skeleton, mapping: &Mapping) -> Option<Self> {
        let pelvis = mapping.pelvis?.source;
        let limbs = mapping.limbs.iter().flat_map(|pair| [pair.source.start, pair.source.middle]);
        let bones: Vec<usize> = limbs.collect();
        let place = |joint: usize| mapping.source_rest.transforms()[joint].translation * mapping.plan_from_source.scale;
        let leg = mapping.limbs.iter().find(|pair| pair.limb.is_leg()).map(|pair| pair.source)?;
        let leg = place(leg.start).distance(place(leg.middle)) + place(leg.middle).distance(place(leg.end));
        if leg <= 0.0 {
            return None;
        }
        let feet = mapping.limbs.iter().filter(|pair| pair.limb.is_leg()).map(|pair| pair.source.end);
        let feet: Vec<usize> = feet.collect();
        let joints = bones.iter().chain(&feet).copied().chain([pelvis]);
        let posing = Posing::new(source, mapping.plan_from_source, joints);
        let [bones, feet] = [bones, feet].map(|joints| joints.iter().map(|joint| posing.slot(*joint)).collect());
        Some(Self { pelvis: posing.slot(pelvis), bones, feet, posing, leg })
    }

    /// The frames with which something else begins, rising; none where the clip is whole.
    pub(super) fn find(&self, clip: &Clip) -> Vec<usize> {
        let (frames, performed) = (clip.frame_count(), clip.performed_seconds());
        // Of each frame the step to it from the one before.
        let mut steps = vec![0.0; frames];
        let scratch = || Scratch {
            pose: self.posing.pose(),
            turned: vec![DQuat::IDENTITY; self.bones.len()],
            feet: vec![DVec3::ZERO; self.feet.len()],
        };
        steps[1..].par_chunks_mut(CHUNK_FRAMES).enumerate().for_each_init(scratch, |scratch, (chunk, steps)| {
            self.fill(scratch, clip.joints(), &performed[chunk * CHUNK_FRAMES..], (chunk * CHUNK_FRAMES, steps));
        });
        let is_small = |frame: usize, beside: f64| steps.get(frame).is_none_or(|step| *step < BESIDE * beside);
        let is_cut = |frame: &usize| {
            steps[*frame] >= 1.0 && is_small(frame - 1, steps[*frame]) && is_small(frame + 1, steps[*frame])
        };
        let cuts: Vec<usize> = (1..frames).filter(is_cut).collect();
        let seconds = performed[frames - 1] - performed[0];
        if cuts.len() as f64 > 2.0 + PER_SECOND * seconds { Vec::new() } else { cuts }
    }

    /// How large the steps are from a frame to the ones behind it: 1 and more where they may be cuts. `seconds` begin with that frame.
    fn fill(
        &self,
        Scratch { pose, turned, feet }: &mut Scratch,
        source: &[JointTracks],
        seconds: &[f64],
        (first, steps): (usize, &mut [f64]),
    ) {
        self.posing.fill(pose, source, first);
        let mut place = pose.model[self.pelvis].translation;
        turned.iter_mut().zip(&self.bones).for_each(|(turned, bone)| *turned = pose.local[*bone].rotation);
        feet.iter_mut().zip(&self.feet).for_each(|(place, foot)| *place = pose.model[*foot].translation);
        for (index, step) in steps.iter_mut().enumerate() {
            self.posing.fill(pose, source, first + index + 1);
            let now = pose.model[self.pelvis].translation;
            let moved = std::mem::replace(&mut place, now).distance(now) / self.leg;
            // Cosines of half the largest angles.
            let mut least = [1.0_f64; TURNED];
            for (before, bone) in turned.iter_mut().zip(&self.bones) {
                let now = pose.local[*bone].rotation;
                let mut cosine = std::mem::replace(before, now).dot(now).abs();
                for kept in &mut least {
                    (*kept, cosine) = (kept.min(cosine), kept.max(cosine));
                }
            }
            let mut strode = 0.0_f64;
            for (before, foot) in feet.iter_mut().zip(&self.feet) {
                let now = pose.model[*foot].translation;
                strode = strode.max(std::mem::replace(before, now).distance(now) / self.leg);
            }
            let turned = 2.0 * least[TURNED - 1].min(1.0).acos();
            let passed = (seconds[index + 1] - seconds[index]).max(f64::MIN_POSITIVE);
            let size = |amount: f64, least: f64, speed: f64| (amount / least).min(amount / passed / speed);
            let turned = size(turned, TURNED_RADIANS, RADIANS_PER_SECOND).min(strode / FOOT_LEGS);
            *step = size(moved, MOVED_LEGS, LEGS_PER_SECOND).max(turned);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        model::{Reporter, Scene, Track},
        retarget::{RetargetSpec, resolve},
        rig::Rig,
        samples,
    };

    /// The cuts of the sample walk after a change of the values of a joint's tracks, by name, at a frame.
    fn cuts(change: impl Fn(&str, usize, &mut DQuat, &mut Vec3)) -> Vec<usize> {
        let scene = samples::walk_scene();
        let mut clip = scene.clips[0].section(0..60);
        let joints = clip.joints().iter().zip(scene.skeleton.joints()).map(|(tracks, joint)| {
            let value = |frame: usize| {
                let mut rotation = tracks.rotation.at(frame, joint.rest.rotation.as_quat()).as_dquat();
                let mut translation = tracks.translation.at(frame, joint.rest.translation.as_vec3());
                change(&joint.name, frame, &mut rotation, &mut translation);
                (rotation.as_quat(), translation)
            };
            let (rotations, translations) = (0..60).map(value).unzip();
            JointTracks {
                rotation: Track::Sampled(rotations),
                translation: Track::Sampled(translations),
                scale: tracks.scale.clone(),
            }
        });
        clip = clip.clone().with_joints(joints.collect()).expect("a clip");
        find(&scene, &clip)
    }

    fn find(scene: &Scene, clip: &Clip) -> Vec<usize> {
        let spec = RetargetSpec::default();
        let rig = |side| Rig::new(side, scene, None, &spec.source, &mut Reporter::new()).expect("a rig");
        let resolved =
            resolve(&spec, &rig("source"), &rig("target"), &scene.clips[0], &mut Reporter::new()).expect("it maps");
        Cuts::new(&scene.skeleton, &resolved.mapping).expect("a body").find(clip)
    }

    const ARMS: [&str; 2] = ["mixamorig:LeftArm", "mixamorig:RightArm"];

    /// Both arms raised by so many degrees.
    fn raise(name: &str, rotation: &mut DQuat, degrees: f64) {
        if ARMS.contains(&name) {
            *rotation *= DQuat::from_rotation_x(degrees.to_radians());
        }
    }

    /// The cuts of a walk whose arms are raised at some frames, and whose pelvis is some centimeters further then.
    fn cuts_raised(is_raised: impl Fn(usize) -> bool) -> Vec<usize> {
        cuts(|name, frame, rotation, place| {
            if is_raised(frame) {
                raise(name, rotation, 60.0);
                place.z += if name == "mixamorig:Hips" { 0.15 } else { 0.0 };
            }
        })
    }

    #[test]
    fn poses_that_jump_are_cut() {
        assert_eq!(cuts(|_, _, _, _| {}), Vec::<usize>::new(), "a walk");
        assert_eq!(cuts_raised(|frame| frame == 0), [1], "its first frame");
        assert_eq!(cuts_raised(|frame| frame == 59), [59], "its last");
        assert_eq!(cuts_raised(|frame| frame >= 30), [30], "two takes");
        let put_elsewhere = |name: &str, frame: usize, _: &mut DQuat, place: &mut Vec3| {
            if name == "mixamorig:Hips" && frame >= 20 {
                place.x += if frame >= 40 { 4.0 } else { 1.0 };
            }
        };
        assert_eq!(cuts(put_elsewhere), [20, 40], "a figure that is put elsewhere");
    }

    #[test]
    fn what_moves_fast_is_not_cut() {
        let swing = |name: &str, frame: usize, rotation: &mut DQuat, _: &mut Vec3| {
            raise(name, rotation, [0.0, 15.0, 70.0, 85.0][frame.saturating_sub(20).min(3)]);
        };
        assert_eq!(cuts(swing), Vec::<usize>::new(), "arms that are thrown up");
        assert_eq!(cuts_raised(|frame| frame == 30), Vec::<usize>::new(), "a frame of noise");
        let one_arm = |name: &str, frame: usize, rotation: &mut DQuat, _: &mut Vec3| {
            if name == ARMS[0] && frame >= 30 {
                raise(name, rotation, 60.0);
            }
        };
        assert_eq!(cuts(one_arm), Vec::<usize>::new(), "one bone");
        assert_eq!(cuts_raised(|frame| frame / 10 % 2 == 1), Vec::<usize>::new(), "poses that are held");
        let strike = |name: &str, frame: usize, rotation: &mut DQuat, _: &mut Vec3| {
            raise(name, rotation, if frame >= 30 { 60.0 } else { 0.0 });
        };
        assert_eq!(cuts(strike), Vec::<usize>::new(), "a blow within a frame, on feet that walk on");
    }

    #[test]
    fn one_frame_has_no_cut() {
        let scene = samples::walk_scene();
        assert_eq!(find(&scene, &scene.clips[0].section(5..6)), Vec::<usize>::new());
    }
}
