//! One clip over another, on the same rig.
//!
//! With base B, motion M and weight w, joint by joint and local: `replace` gives B at w = 0 and M at w = 1, rotations on the shortest
//! arc; `add` gives B · (R⁻¹ · M)^w for rotations and B + w · (M − R) for translations and scales, R being the reference.
//! (retargeting.md B33.) At a seam the jump in value and speed is kept as an offset that dies away, so that neither jumps.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    model::{Canceled, Clip, ClipError, Control, JointTracks, Skeleton, Track},
    rig::{LayerMode, LayerReference},
};

use super::{sampling::Sampling, schedule::Schedule};

/// How a motion goes over a base.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Replacing or adding.
    pub mode: LayerMode,
    /// What an added motion is measured from.
    pub reference: LayerReference,
    /// For each joint how much of the motion is taken, 0 to 1.
    pub weights: Vec<f64>,
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
    let mut joints = Vec::with_capacity(skeleton.len());
    for (index, joint) in skeleton.joints().iter().enumerate() {
        control.check()?;
        let (base, own) = (below.joint(&base.joints()[index]), &motion.joints()[index]);
        let weight = layer.weights[index];
        let motion = above.joint(own);
        let rest = joint.rest;
        let seams = Seams {
            times,
            inside: inside.clone(),
            seconds: if layer.at_seconds.is_some() { layer.seam_seconds } else { 0.0 },
        };
        let merge = |own: bool| weight > 0.0 && own && !inside.is_empty();
        let vector = |base: &Track<Vec3>, motion: &Track<Vec3>, own: &Track<Vec3>, rest: DVec3| {
            if !merge(own.is_animated()) {
                return base.clone();
            }
            let rest = rest.as_vec3();
            let reference = layer.vector_reference(own, rest);
            let value = |frame: usize| {
                let (under, over) = (base.at(frame, rest).as_dvec3(), motion.at(frame, rest).as_dvec3());
                match layer.mode {
                    LayerMode::Replace => under.lerp(over, weight),
                    LayerMode::Add => under + (over - reference) * weight,
                }
            };
            seams.vectors(|frame| base.at(frame, rest).as_dvec3(), value)
        };
        let rotation = if merge(own.rotation.is_animated()) {
            let rest = rest.rotation.as_quat();
            let from_reference = layer.rotation_reference(&own.rotation, rest).conjugate();
            let value = |frame: usize| {
                let under = base.rotation.at(frame, rest).as_dquat();
                let over = motion.rotation.at(frame, rest).as_dquat();
                match layer.mode {
                    LayerMode::Replace => under.slerp(near(over, under), weight),
                    LayerMode::Add => {
                        under * DQuat::IDENTITY.slerp(near(from_reference * over, DQuat::IDENTITY), weight)
                    }
                }
                .normalize()
            };
            seams.rotations(|frame| base.rotation.at(frame, rest).as_dquat(), value)
        } else {
            base.rotation.clone()
        };
        joints.push(JointTracks {
            translation: vector(&base.translation, &motion.translation, &own.translation, rest.translation),
            rotation,
            scale: vector(&base.scale, &motion.scale, &own.scale, rest.scale),
        });
    }
    // Faces are replaced as a whole where the new motion has them.
    let mut morphs = above.morphs(motion.morphs());
    let new: Vec<usize> = morphs.iter().map(|track| track.morph).collect();
    morphs.extend(below.morphs(base.morphs()).into_iter().filter(|track| !new.contains(&track.morph)));
    Ok(Clip::new(motion.name().to_owned(), times.to_vec(), joints)?.with_morphs(morphs)?)
}

/// The motion with a reference taken out, as changes of the rest pose: what `add` puts on top, as a clip of its own.
///
/// # Errors
/// When the result does not fit into the numbers of a track.
pub fn taken_out(motion: &Clip, skeleton: &Skeleton, reference: LayerReference) -> Result<Clip, ClipError> {
    let layer = Layer { mode: LayerMode::Add, reference, weights: Vec::new(), at_seconds: None, seam_seconds: 0.0 };
    let joints = motion.joints().iter().zip(skeleton.joints()).map(|(tracks, joint)| {
        let rest = joint.rest;
        let vector = |track: &Track<Vec3>, rest: DVec3| {
            let reference = layer.vector_reference(track, rest.as_vec3());
            map(track, |value: Vec3| (rest + value.as_dvec3() - reference).as_vec3())
        };
        let from_reference = layer.rotation_reference(&tracks.rotation, rest.rotation.as_quat()).conjugate();
        let turn = |value: Quat| (rest.rotation * from_reference * value.as_dquat()).normalize().as_quat();
        JointTracks {
            translation: vector(&tracks.translation, rest.translation),
            rotation: map(&tracks.rotation, turn),
            scale: vector(&tracks.scale, rest.scale),
        }
    });
    Clip::new(motion.name().to_owned(), motion.times_seconds().to_vec(), joints.collect())?
        .with_morphs(motion.morphs().to_vec())
}

fn map<T: Copy>(track: &Track<T>, change: impl Fn(T) -> T) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(change(*value)),
        Track::Sampled(values) => Track::Sampled(values.iter().map(|value| change(*value)).collect()),
    }
}

impl Layer {
    fn vector_reference(&self, track: &Track<Vec3>, rest: Vec3) -> DVec3 {
        match (self.reference, track) {
            (LayerReference::Rest, _) | (_, Track::Rest) => rest.as_dvec3(),
            (LayerReference::FirstFrame, track) => track.at(0, rest).as_dvec3(),
            (LayerReference::Mean, Track::Constant(value)) => value.as_dvec3(),
            (LayerReference::Mean, Track::Sampled(values)) => {
                values.iter().map(|value| value.as_dvec3()).sum::<DVec3>() / values.len().max(1) as f64
            }
        }
    }

    fn rotation_reference(&self, track: &Track<Quat>, rest: Quat) -> DQuat {
        let reference = match (self.reference, track) {
            (LayerReference::Rest, _) | (_, Track::Rest) => rest.as_dquat(),
            (LayerReference::FirstFrame, track) => track.at(0, rest).as_dquat(),
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

/// The same rotation, written as close to another as it can be.
fn near(rotation: DQuat, other: DQuat) -> DQuat {
    if rotation.dot(other) < 0.0 { -rotation } else { rotation }
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

/// Frames from the first at or after the begin to the last at or before the end.
fn frames_inside(times: &[f64], begin: f64, end: f64) -> std::ops::Range<usize> {
    /// Seconds that are the same time.
    const SAME: f64 = 1e-9;
    let first = times.partition_point(|time| *time < begin - SAME);
    let after = times.partition_point(|time| *time <= end + SAME);
    first..after.max(first)
}

/// Where the layered values begin and end, and how their jumps die away.
struct Seams<'a> {
    times: &'a [f64],
    inside: std::ops::Range<usize>,
    seconds: f64,
}

impl Seams<'_> {
    fn vectors(&self, outside: impl Fn(usize) -> DVec3, inside: impl Fn(usize) -> DVec3) -> Track<Vec3> {
        let difference = |one: DVec3, other: DVec3| one - other;
        let (enter, leave) = self.offsets(&outside, &inside, difference);
        let value = |frame: usize| {
            let is_inside = self.inside.contains(&frame);
            let value = if is_inside { inside(frame) } else { outside(frame) };
            (value + self.left(frame, enter, leave)).as_vec3()
        };
        Track::Sampled((0..self.times.len()).map(value).collect())
    }

    fn rotations(&self, outside: impl Fn(usize) -> DQuat, inside: impl Fn(usize) -> DQuat) -> Track<Quat> {
        // Offsets are rotations on the left, as rotation vectors.
        let difference = |one: DQuat, other: DQuat| near(one * other.conjugate(), DQuat::IDENTITY).to_scaled_axis();
        let (enter, leave) = self.offsets(&outside, &inside, difference);
        let mut before: Option<Quat> = None;
        let value = |frame: usize| {
            let is_inside = self.inside.contains(&frame);
            let value = if is_inside { inside(frame) } else { outside(frame) };
            let value = match self.left(frame, enter, leave) {
                DVec3::ZERO => value.as_quat(),
                left => (DQuat::from_scaled_axis(left) * value).normalize().as_quat(),
            };
            let value = before.map_or(value, |before| if value.dot(before) < 0.0 { -value } else { value });
            before = Some(value);
            value
        };
        Track::Sampled((0..self.times.len()).map(value).collect())
    }

    /// Jump and jump of speed at the seam in, and at the seam out; nothing where there is no seam.
    fn offsets<T: Copy>(
        &self,
        outside: &impl Fn(usize) -> T,
        inside: &impl Fn(usize) -> T,
        difference: impl Fn(T, T) -> DVec3,
    ) -> (Option<[DVec3; 2]>, Option<[DVec3; 2]>) {
        let (first, after) = (self.inside.start, self.inside.end);
        if self.seconds <= 0.0 {
            return (None, None);
        }
        let last_frame = self.times.len() - 1;
        let speed = |value: &dyn Fn(usize) -> T, from: usize, to: usize| {
            if from == to {
                DVec3::ZERO
            } else {
                difference(value(to), value(from)) / (self.times[to] - self.times[from])
            }
        };
        // How the old motion would have gone on, against how the new one does; each is looked at where it is.
        let jump =
            |old: &dyn Fn(usize) -> T, new: &dyn Fn(usize) -> T, frame: usize, old_from: usize, new_to: usize| {
                [difference(old(frame), new(frame)), speed(old, old_from, frame) - speed(new, frame, new_to)]
            };
        let last = after.saturating_sub(1);
        let enter = (first > 0 && first < after).then(|| jump(outside, inside, first, first - 1, last.min(first + 1)));
        let leave = (after > first && last < last_frame)
            .then(|| jump(inside, outside, last, first.max(last.saturating_sub(1)), last + 1));
        (enter, leave)
    }

    /// What is left of the jumps at a frame: a cubic from the jump and its speed to nothing.
    fn left(&self, frame: usize, enter: Option<[DVec3; 2]>, leave: Option<[DVec3; 2]>) -> DVec3 {
        let decay = |begin: usize, [offset, speed]: [DVec3; 2]| {
            let share = ((self.times[frame] - self.times[begin]) / self.seconds).clamp(0.0, 1.0);
            let rest = 1.0 - share;
            (offset * (1.0 + 2.0 * share) + speed * (self.seconds * share)) * (rest * rest)
        };
        if self.inside.contains(&frame) {
            return enter.map_or(DVec3::ZERO, |jump| decay(self.inside.start, jump));
        }
        if frame >= self.inside.end {
            return leave.map_or(DVec3::ZERO, |jump| decay(self.inside.end - 1, jump));
        }
        DVec3::ZERO
    }
}
