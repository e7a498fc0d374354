//! One clip over another, on the same rig.
//!
//! With base B, motion M and weight w, joint by joint and local: `replace` gives B at w = 0 and M at w = 1, rotations on the shortest
//! arc; `add` gives B · (R⁻¹ · M)^w for rotations and B + w · (M − R) for translations and scales, R being the reference.
//! (docs/algorithm/clips.md.) At a seam the jump in value and speed is kept as an offset that dies away, so that neither jumps.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::model::rotation::near;

use crate::{
    model::{Canceled, Clip, ClipError, Control, JointContacts, JointTracks, MorphTrack, Skeleton, Track},
    retarget::{LayerMode, LayerReference},
};

use super::{
    sampling::Sampling,
    schedule::Schedule,
    seams::{Seams, frames_inside},
};

/// How a motion goes over a base.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Replacing or adding.
    pub mode: LayerMode,
    /// What an added motion is measured from.
    pub reference: LayerReference,
    /// For each joint how much of the motion is taken, 0 to 1.
    pub weights: Vec<f64>,
    /// The same for morphs.
    pub morph_weight: f64,
    /// The weight of every morph of the scene where nothing animates it.
    pub morph_rests: Vec<f32>,
    /// When the motion begins on the base's clock, counted from the base's first frame; nothing where the motion gives the clock.
    pub at_seconds: Option<f64>,
    /// Over how long a jump at the motion's begin and end dies away.
    pub seam_seconds: f64,
}

/// Why there is no layered clip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayerError {
    /// The values do not fit into tracks.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// Nobody wants it any longer.
    #[error(transparent)]
    Canceled(#[from] Canceled),
}

/// Weights of branches: 1 for each of the joints and all below, rising over the first `feather_joints` + 1 joints of a branch.
#[must_use]
pub fn branch_weights(skeleton: &Skeleton, joints: &[usize], feather_joints: u32, weight: f64) -> Vec<f64> {
    let mut depths: Vec<Option<u32>> = vec![None; skeleton.len()];
    for joint in 0..skeleton.len() {
        let above = skeleton.parent(joint).and_then(|parent| depths[parent]);
        depths[joint] = above.map(|depth| depth.saturating_add(1)).or_else(|| joints.contains(&joint).then_some(0));
    }
    let share =
        |depth: u32| (f64::from(depth.saturating_add(1)) / f64::from(feather_joints.saturating_add(1))).min(1.0);
    depths.into_iter().map(|depth| depth.map_or(0.0, |depth| weight * share(depth))).collect()
}

/// Lays `motion` over `base`; both are clips of `skeleton`.
///
/// The result has the motion's name. Joints whose weight is 0, and those that the motion does not animate, move as in the base; without
/// the motion's clock also all others before and after it.
///
/// # Errors
/// When the result does not fit into the numbers of a track, or the work is canceled.
pub fn layered(
    base: &Clip,
    motion: &Clip,
    skeleton: &Skeleton,
    layer: &Layer,
    control: &Control,
) -> Result<Clip, LayerError> {
    let (base_start, motion_start) = (base.times_seconds()[0], motion.times_seconds()[0]);
    let clock = if layer.at_seconds.is_some() { base } else { motion };
    let times = clock.times_seconds();
    let start = times[0];
    let at = layer.at_seconds.unwrap_or(0.0);
    let base_time = |time: f64| match layer.at_seconds {
        Some(_) => time,
        None => base_start + repeated(time - start, base.duration_seconds()),
    };
    let motion_time = |time: f64| motion_start + (time - start - at).clamp(0.0, motion.duration_seconds());
    let below = Sampling::new(base.times_seconds(), &Schedule::showing(times, base_time), None, false);
    let above = Sampling::new(motion.times_seconds(), &Schedule::showing(times, motion_time), None, false);
    let inside = frames_inside(times, start + at, start + at + motion.duration_seconds());
    let seams = Seams {
        times,
        inside: inside.clone(),
        seconds: if layer.at_seconds.is_some() { layer.seam_seconds } else { 0.0 },
    };
    let mut joints = Vec::with_capacity(skeleton.len());
    for (index, joint) in skeleton.joints().iter().enumerate() {
        control.check()?;
        let (base, own) = (below.joint(index, &base.joints()[index]), &motion.joints()[index]);
        let weight = layer.weights[index];
        let motion = above.joint(index, own);
        let rest = joint.rest;
        let merge = |own: bool| weight > 0.0 && own && !inside.is_empty();
        let vector = |base: &Track<Vec3>, motion: &Track<Vec3>, own: &Track<Vec3>, rest: DVec3| {
            if !merge(own.is_animated()) {
                return base.clone();
            }
            let reference = layer.vector_reference(own, rest);
            let value = |frame: usize| {
                let (under, over) = (base.wide_at(frame, rest), motion.wide_at(frame, rest));
                match layer.mode {
                    LayerMode::Replace => under.lerp(over, weight),
                    LayerMode::Add => under + (over - reference) * weight,
                }
            };
            seams.vectors(|frame| base.wide_at(frame, rest), value)
        };
        let rotation = if merge(own.rotation.is_animated()) {
            let rest = rest.rotation;
            let from_reference = layer.rotation_reference(&own.rotation, rest).conjugate();
            let value = |frame: usize| {
                let under = base.rotation.wide_at(frame, rest);
                let over = motion.rotation.wide_at(frame, rest);
                match layer.mode {
                    LayerMode::Replace => under.slerp(near(over, under), weight),
                    LayerMode::Add => {
                        under * DQuat::IDENTITY.slerp(near(from_reference * over, DQuat::IDENTITY), weight)
                    }
                }
                .normalize()
            };
            seams.rotations(|frame| base.rotation.wide_at(frame, rest), value)
        } else {
            base.rotation.clone()
        };
        joints.push(JointTracks {
            translation: vector(&base.translation, &motion.translation, &own.translation, rest.translation),
            rotation,
            scale: vector(&base.scale, &motion.scale, &own.scale, rest.scale),
        });
    }
    let morphs = layer.morphs(&below.morphs(base.morphs()), &above.morphs(motion.morphs()), motion, &seams);
    let contacts = layer.contacts(&below.contacts(base.contacts()), &above.contacts(motion.contacts()), &seams);
    let layered = Clip::new(motion.name().to_owned(), times.to_vec(), joints)?.with_tempo(motion.tempo());
    Ok(layered.with_morphs(morphs)?.with_contacts(contacts)?)
}

/// The motion with a reference taken out, as changes of the rest pose: what `add` puts on top, as a clip of its own.
///
/// # Errors
/// When the result does not fit into the numbers of a track.
pub fn taken_out(
    motion: &Clip,
    skeleton: &Skeleton,
    morph_rests: Vec<f32>,
    reference: LayerReference,
) -> Result<Clip, ClipError> {
    let layer = Layer {
        mode: LayerMode::Add,
        reference,
        weights: Vec::new(),
        morph_weight: 1.0,
        morph_rests,
        at_seconds: None,
        seam_seconds: 0.0,
    };
    let joints = motion.joints().iter().zip(skeleton.joints()).map(|(tracks, joint)| {
        let rest = joint.rest;
        let vector = |track: &Track<Vec3>, rest: DVec3| {
            let reference = layer.vector_reference(track, rest);
            track.map(|value| (rest + value.as_dvec3() - reference).as_vec3())
        };
        let from_reference = layer.rotation_reference(&tracks.rotation, rest.rotation).conjugate();
        let turn = |value: Quat| (rest.rotation * from_reference * value.as_dquat()).normalize().as_quat();
        JointTracks {
            translation: vector(&tracks.translation, rest.translation),
            rotation: tracks.rotation.map(turn),
            scale: vector(&tracks.scale, rest.scale),
        }
    });
    let morphs = motion.morphs().iter().map(|track| {
        let rest = layer.morph_rests[track.morph];
        let reference = layer.weight_reference(&track.weights, rest);
        let weights = track.weights.map(|weight| (f64::from(rest) + f64::from(weight) - reference) as f32);
        MorphTrack { morph: track.morph, weights }
    });
    let morphs = morphs.collect();
    motion.clone().with_joints(joints.collect())?.with_morphs(morphs)
}

impl Layer {
    /// The weights of all morphs that one of the clips animates; both are sampled at the frames of the result. A morph that the motion
    /// leaves alone stays as in the base.
    fn morphs(&self, base: &[MorphTrack], over: &[MorphTrack], motion: &Clip, seams: &Seams<'_>) -> Vec<MorphTrack> {
        let is_base = self.morph_weight <= 0.0 || seams.inside.is_empty();
        let mut merged: Vec<MorphTrack> = base.to_vec();
        for (over, own) in over.iter().zip(motion.morphs()).filter(|_| !is_base) {
            let rest = self.morph_rests[over.morph];
            let reference = self.weight_reference(&own.weights, rest);
            let found = base.iter().position(|track| track.morph == over.morph);
            let under = |frame: usize| f64::from(found.map_or(rest, |index| base[index].weights.at(frame, rest)));
            let value = |frame: usize| {
                let (under, over) = (under(frame), f64::from(over.weights.at(frame, rest)));
                match self.mode {
                    LayerMode::Replace => under + (over - under) * self.morph_weight,
                    LayerMode::Add => under + (over - reference) * self.morph_weight,
                }
            };
            let track = MorphTrack { morph: over.morph, weights: seams.weights(under, value) };
            match found {
                Some(index) => merged[index] = track,
                None => merged.push(track),
            }
        }
        merged
    }

    /// Contacts: of the motion where it takes a joint's place for more than half, else of the base. What is added moves what touches,
    /// but does not say where it does.
    fn contacts(&self, base: &[JointContacts], over: &[JointContacts], seams: &Seams<'_>) -> Vec<JointContacts> {
        let is_over = |joint: usize| self.mode == LayerMode::Replace && self.weights[joint] > 0.5;
        let added = over.iter().filter(|track| base.iter().all(|known| known.joint != track.joint));
        let joints = base.iter().chain(added).map(|track| track.joint);
        let of = |tracks: &[JointContacts], joint: usize, frame: usize| {
            tracks.iter().find(|track| track.joint == joint).is_some_and(|track| track.touches[frame])
        };
        let touches = |joint: usize, frame: usize| {
            of(if is_over(joint) && seams.inside.contains(&frame) { over } else { base }, joint, frame)
        };
        let frames = seams.times.len();
        let merged = |joint| JointContacts { joint, touches: (0..frames).map(|frame| touches(joint, frame)).collect() };
        joints.map(merged).collect()
    }

    fn weight_reference(&self, track: &Track<f32>, rest: f32) -> f64 {
        match (self.reference, track) {
            (LayerReference::Rest, _) | (_, Track::Rest) => f64::from(rest),
            (LayerReference::FirstFrame, track) => f64::from(track.at(0, rest)),
            (LayerReference::Mean, Track::Constant(weight)) => f64::from(*weight),
            (LayerReference::Mean, Track::Sampled(weights)) => {
                weights.iter().map(|weight| f64::from(*weight)).sum::<f64>() / weights.len().max(1) as f64
            }
        }
    }

    fn vector_reference(&self, track: &Track<Vec3>, rest: DVec3) -> DVec3 {
        match (self.reference, track) {
            (LayerReference::Rest, _) | (_, Track::Rest) => rest,
            (LayerReference::FirstFrame, track) => track.wide_at(0, rest),
            (LayerReference::Mean, Track::Constant(value)) => value.as_dvec3(),
            (LayerReference::Mean, Track::Sampled(values)) => {
                values.iter().map(|value| value.as_dvec3()).sum::<DVec3>() / values.len().max(1) as f64
            }
        }
    }

    fn rotation_reference(&self, track: &Track<Quat>, rest: DQuat) -> DQuat {
        let reference = match (self.reference, track) {
            (LayerReference::Rest, _) | (_, Track::Rest) => rest,
            (LayerReference::FirstFrame, track) => track.wide_at(0, rest),
            (LayerReference::Mean, Track::Constant(value)) => value.as_dquat(),
            (LayerReference::Mean, Track::Sampled(values)) => {
                let first = values.first().map_or(DQuat::IDENTITY, |first| first.as_dquat());
                let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
                let sum = values.iter().fold(zero, |sum, value| sum + near(value.as_dquat(), first));
                if sum.length_squared() > 1e-12 { sum } else { first }
            }
        };
        reference.normalize()
    }
}

/// A time within the clip that is played over and over; its end is its end only once.
fn repeated(time: f64, duration: f64) -> f64 {
    if duration <= 0.0 {
        0.0
    } else if time <= duration {
        time
    } else {
        time.rem_euclid(duration)
    }
}
