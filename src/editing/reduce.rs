//! Leaving out keys that interpolation gives back.
//!
//! The error of a frame is measured where a mesh would be: for every joint, the most that any point within a shell about it moves, with
//! the errors of all joints above. Each track is thinned by the rule of Ramer, Douglas and Peucker with a tolerance of its own; where
//! the errors of a chain add up to more than is allowed, the tolerances of that chain are lowered until they do not.
//! (retargeting.md B26.)

use glam::{DQuat, Quat, Vec3};

use crate::model::{Canceled, Clip, Control, JointKeys, JointTracks, Skeleton, SparseKeys, Track, Transform};

/// A key is kept at least every so many frames, which keeps the search for keys short.
const LONGEST_SPAN: usize = 256;
/// Rounds of lowering tolerances; after them, chains that are still off keep all keys.
const MOST_ROUNDS: usize = 12;
/// Part of what is allowed that a round aims at.
const AIM: f64 = 0.9;
/// A round lowers a tolerance by no more than this factor.
const LEAST_FACTOR: f64 = 0.2;

/// What may be lost, in the clip's own unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The most that a point may move.
    pub distance: f64,
    /// How far from a joint points are looked at.
    pub shell: f64,
}

/// What is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduction {
    /// The frames that each track needs; those between are found by linear interpolation, of rotations on the shortest arc.
    pub keys: SparseKeys,
    /// Keys of the sampled tracks before.
    pub keys_before: usize,
    /// The most that a point moves, and the joint and frame where.
    pub worst: (f64, usize, usize),
}

/// Finds the keys that are needed.
///
/// Tracks that are constant or at rest have none, and are left as they are. The error holds at the clip's own frames.
///
/// # Errors
/// When the work is canceled.
pub fn reduce_keys(
    clip: &Clip,
    skeleton: &Skeleton,
    tolerance: Tolerance,
    control: &Control,
) -> Result<Reduction, Canceled> {
    let reach = reaches(skeleton, tolerance.shell);
    let count = skeleton.len();
    let mut allowed = vec![tolerance.distance; count];
    let mut keys = vec![JointKeys::default(); count];
    let mut changed = vec![true; count];
    let mut measuring = Measuring::new(clip, skeleton, tolerance.shell);
    for round in 0.. {
        for joint in (0..count).filter(|joint| changed[*joint]) {
            control.check()?;
            keys[joint] = thinned(&clip.joints()[joint], clip.times_seconds(), allowed[joint], reach[joint]);
        }
        let errors = measuring.errors(&keys, control)?;
        let worst = (0..count).max_by(|first, second| errors[*first].0.total_cmp(&errors[*second].0));
        let is_good = worst.is_none_or(|joint| errors[joint].0 <= tolerance.distance);
        if is_good {
            let worst = worst.map_or((0.0, 0, 0), |joint| (errors[joint].0, joint, errors[joint].1));
            keep_length(&mut keys, clip.frame_count() - 1);
            let before = clip.joints().iter().map(sample_count).sum();
            return Ok(Reduction { keys: SparseKeys { joints: keys }, keys_before: before, worst });
        }
        let mut factors = vec![1.0_f64; count];
        for (joint, (error, _)) in errors.into_iter().enumerate() {
            if error <= tolerance.distance {
                continue;
            }
            let factor = if round >= MOST_ROUNDS { 0.0 } else { (AIM * tolerance.distance / error).max(LEAST_FACTOR) };
            let mut above = Some(joint);
            while let Some(at) = above {
                factors[at] = factors[at].min(factor);
                above = skeleton.parent(at);
            }
        }
        for joint in 0..count {
            allowed[joint] *= factors[joint];
            changed[joint] = factors[joint] < 1.0;
        }
    }
    unreachable!("without any tolerance, every key is kept and the error is none")
}

/// Keeps the last frame of one track at least, as a clip is as long as its longest track.
fn keep_length(keys: &mut [JointKeys], last: usize) {
    let all = keys.iter_mut().flat_map(|keys| [&mut keys.translation, &mut keys.rotation, &mut keys.scale]);
    let mut first = None;
    for track in all.filter(|track| !track.is_empty()) {
        if track.last() == Some(&last) {
            return;
        }
        first = first.or(Some(track));
    }
    if let Some(track) = first {
        track.push(last);
    }
}

/// For each joint the distance to the farthest point that it carries, at rest.
fn reaches(skeleton: &Skeleton, shell: f64) -> Vec<f64> {
    let rest = skeleton.rest_pose().to_model(skeleton);
    let places = rest.transforms();
    let mut reach = vec![shell; skeleton.len()];
    for joint in 0..skeleton.len() {
        let mut above = skeleton.parent(joint);
        while let Some(at) = above {
            reach[at] = reach[at].max(places[at].translation.distance(places[joint].translation) + shell);
            above = skeleton.parent(at);
        }
    }
    reach
}

fn sample_count(tracks: &JointTracks) -> usize {
    let counts = [tracks.translation.sample_count(), tracks.rotation.sample_count(), tracks.scale.sample_count()];
    counts.into_iter().flatten().sum()
}

fn thinned(tracks: &JointTracks, times: &[f64], allowed: f64, reach: f64) -> JointKeys {
    let moved = |first: Vec3, second: Vec3| f64::from(first.distance(second));
    let turned = |first: Quat, second: Quat| chord(first.as_dquat(), second.as_dquat()) * reach;
    let grown = |first: Vec3, second: Vec3| f64::from(first.distance(second)) * reach;
    JointKeys {
        translation: needed(&tracks.translation, times, allowed, Vec3::lerp, moved),
        rotation: needed(&tracks.rotation, times, allowed, slerp, turned),
        scale: needed(&tracks.scale, times, allowed, Vec3::lerp, grown),
    }
}

/// How far a rotation by the difference of two moves a point at distance 1: the chord of the angle.
fn chord(first: DQuat, second: DQuat) -> f64 {
    // |p − q| of unit quaternions is twice the sine of a quarter of the angle; the chord is twice the sine of half of it.
    let half = (first - second).length().min((first + second).length()) / 2.0;
    let half = half.min(std::f64::consts::FRAC_1_SQRT_2);
    4.0 * half * (1.0 - half * half).sqrt()
}

/// As readers interpolate: the short way.
fn slerp(first: Quat, second: Quat, share: f32) -> Quat {
    first.slerp(second, share)
}

/// The frames of a track that are needed so that no frame is off by more than what is allowed.
fn needed<T: Copy>(
    track: &Track<T>,
    times: &[f64],
    allowed: f64,
    between: impl Fn(T, T, f32) -> T,
    error: impl Fn(T, T) -> f64,
) -> Vec<usize> {
    let Track::Sampled(values) = track else { return Vec::new() };
    if allowed <= 0.0 {
        return (0..values.len()).collect();
    }
    if values.iter().all(|value| error(*value, values[0]) <= allowed) {
        return vec![0];
    }
    let last = values.len() - 1;
    let mut kept: Vec<usize> = (0..last).step_by(LONGEST_SPAN).collect();
    kept.push(last);
    let mut open: Vec<(usize, usize)> = kept.windows(2).map(|pair| (pair[0], pair[1])).collect();
    while let Some((start, end)) = open.pop() {
        let span = times[end] - times[start];
        let off = |frame: usize| {
            let share = ((times[frame] - times[start]) / span) as f32;
            error(values[frame], between(values[start], values[end], share))
        };
        let worst = (start + 1..end).map(|frame| (off(frame), frame)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((worst, frame)) = worst.filter(|(worst, _)| *worst > allowed || worst.is_nan()) {
            debug_assert!(!worst.is_nan(), "values of a clip are finite");
            kept.push(frame);
            open.push((start, frame));
            open.push((frame, end));
        }
    }
    kept.sort_unstable();
    kept
}

/// Looks at what is lost, frame by frame; its buffers are made once.
struct Measuring<'a> {
    clip: &'a Clip,
    skeleton: &'a Skeleton,
    shell: f64,
    exact: Vec<Transform>,
    thin: Vec<Transform>,
}

impl<'a> Measuring<'a> {
    fn new(clip: &'a Clip, skeleton: &'a Skeleton, shell: f64) -> Self {
        let transforms = vec![Transform::IDENTITY; skeleton.len()];
        Self { clip, skeleton, shell, exact: transforms.clone(), thin: transforms }
    }

    /// For each joint the most that a point of its shell moves, and in which frame.
    fn errors(&mut self, keys: &[JointKeys], control: &Control) -> Result<Vec<(f64, usize)>, Canceled> {
        let Self { clip, skeleton, shell, exact, thin } = self;
        let times = clip.times_seconds();
        let mut errors = vec![(0.0, 0); skeleton.len()];
        let mut cursors = vec![[0_usize; 3]; skeleton.len()];
        for frame in 0..clip.frame_count() {
            control.check()?;
            for (index, joint) in skeleton.joints().iter().enumerate() {
                let (tracks, keys, cursors) = (&clip.joints()[index], &keys[index], &mut cursors[index]);
                let rest = joint.rest;
                let place = rest.translation.as_vec3();
                let (turn, size) = (rest.rotation.as_quat(), rest.scale.as_vec3());
                let local = |translation: Vec3, rotation: Quat, scale: Vec3| Transform {
                    translation: translation.as_dvec3(),
                    rotation: rotation.as_dquat().normalize(),
                    scale: scale.as_dvec3(),
                };
                let full = local(
                    tracks.translation.at(frame, place),
                    tracks.rotation.at(frame, turn),
                    tracks.scale.at(frame, size),
                );
                let thinned = local(
                    interpolated(
                        &tracks.translation,
                        &keys.translation,
                        &mut cursors[0],
                        times,
                        frame,
                        place,
                        Vec3::lerp,
                    ),
                    interpolated(&tracks.rotation, &keys.rotation, &mut cursors[1], times, frame, turn, slerp),
                    interpolated(&tracks.scale, &keys.scale, &mut cursors[2], times, frame, size, Vec3::lerp),
                );
                let above = joint.parent;
                exact[index] = above.map_or(full, |parent| exact[parent].then_child(&full));
                thin[index] = above.map_or(thinned, |parent| thin[parent].then_child(&thinned));
                let error = shell_error(&exact[index], &thin[index], *shell);
                if error > errors[index].0 {
                    errors[index] = (error, frame);
                }
            }
        }
        Ok(errors)
    }
}

/// The most that a point at most so far from the joint moves between two placements of it.
fn shell_error(exact: &Transform, thin: &Transform, shell: f64) -> f64 {
    let stretch = (exact.scale - thin.scale).abs().max_element();
    let largest = exact.scale.abs().max_element().max(1.0);
    exact.translation.distance(thin.translation) + shell * (chord(exact.rotation, thin.rotation) * largest + stretch)
}

fn interpolated<T: Copy>(
    track: &Track<T>,
    keys: &[usize],
    cursor: &mut usize,
    times: &[f64],
    frame: usize,
    rest: T,
    between: impl Fn(T, T, f32) -> T,
) -> T {
    let Track::Sampled(values) = track else { return track.at(frame, rest) };
    while keys.get(*cursor + 1).is_some_and(|next| *next <= frame) {
        *cursor += 1;
    }
    let start = keys[*cursor];
    match keys.get(*cursor + 1) {
        Some(end) if start != frame => {
            let share = (times[frame] - times[start]) / (times[*end] - times[start]);
            between(values[start], values[*end], share as f32)
        }
        _ => values[start],
    }
}
