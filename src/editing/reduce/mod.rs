//! Leaving out keys that interpolation gives back.
//!
//! The error of a frame is measured where a mesh would be and in model space: for every joint, the most that any point within a shell
//! about it moves, with the errors of all joints above. Joints are gone through from the top down, and each is fitted not to its own
//! values but to those that bring it back to where it was turned below its parent's curve, so that errors of rotation do not add up
//! along a limb. How much each track may be off is settled in rounds: what is left over anywhere is shared out, what is too much is
//! taken back. Where a joint touches something, it may be off by a quarter as much in those frames. (docs/algorithm/clips.md.)

mod fit;

use std::sync::Arc;

use glam::{DQuat, DVec3, DVec4, Quat, Vec3};

use crate::{
    model::{Canceled, Clip, Control, JointKeys, JointTracks, KeyCurve, Skeleton, SparseKeys, Track, Transform},
    retarget::KeyInterpolation,
};

use crate::model::rotation::near;

use fit::{Allowed, Keys, Kind, fit};

/// Rounds of sharing out what may be lost.
const ROUNDS: usize = 7;
/// Rounds of taking back after them; where even those do not do, every key is kept.
const MORE_ROUNDS: usize = 8;
/// Part of what may be lost that each joint begins with.
const FIRST_SHARE: f64 = 0.4;
/// Part of what may be lost that a round aims at.
const AIM: f64 = 0.95;
/// By so much a round changes a share at most.
const FACTORS: [f64; 2] = [0.25, 1.6];
/// By so much finer joints are fitted in the frames in which they touch something: an eye sees a foot that creeps.
const TOUCHING: f64 = 4.0;

/// What may be lost, in the clip's own unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The most that a point may move.
    pub distance: f64,
    /// How far from a joint points are looked at.
    pub shell: f64,
    /// What may lie between keys.
    pub interpolation: KeyInterpolation,
}

/// What is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduction {
    /// The keys that each track needs.
    pub keys: SparseKeys,
    /// Keys of the sampled tracks before.
    pub keys_before: usize,
    /// Bytes of those keys in a glTF file, whose tracks share their times.
    pub bytes_before: usize,
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
    let levers = levers(clip, skeleton, tolerance.shell);
    let care = Care::of(clip, skeleton);
    let mut shares = vec![FIRST_SHARE; skeleton.len()];
    let mut best: Option<(Vec<JointKeys>, Worst)> = None;
    let mut least = usize::MAX;
    for round in 0..ROUNDS + MORE_ROUNDS {
        let fitted = Pass { clip, skeleton, levers: &levers, care: &care, shares: &shares, tolerance }.run(control)?;
        if fitted.is_within(tolerance.distance) {
            let worst = fitted.worst();
            let keys = SparseKeys { joints: fitted.keys };
            if keys.bytes() < least {
                least = keys.bytes();
                best = Some((keys.joints, worst));
            }
        }
        if best.is_some() && round + 1 >= ROUNDS {
            break;
        }
        let most = if round + 1 < ROUNDS { FACTORS[1] } else { 1.0 };
        for (share, error) in shares.iter_mut().zip(below(skeleton, &fitted.errors)) {
            let factor = AIM * tolerance.distance / error.max(f64::MIN_POSITIVE);
            *share = (*share * factor.clamp(FACTORS[0], most)).min(1.0);
        }
    }
    let (mut keys, worst) = match best {
        Some(best) => best,
        None => {
            let shares = vec![0.0; skeleton.len()];
            let all = Pass { clip, skeleton, levers: &levers, care: &care, shares: &shares, tolerance }.run(control)?;
            let worst = all.worst();
            (all.keys, worst)
        }
    };
    keep_length(&mut keys, clip);
    let (keys_before, bytes_before) = sizes(clip);
    Ok(Reduction { keys: SparseKeys { joints: keys }, keys_before, bytes_before, worst })
}

/// The most that a point moves, and the joint and frame where.
type Worst = (f64, usize, usize);

/// Keys of a clip as it is, and their bytes.
fn sizes(clip: &Clip) -> (usize, usize) {
    let tracks = |joint: &JointTracks| {
        let count = |samples: Option<usize>, width: usize| (samples.unwrap_or(0), samples.unwrap_or(0) * width);
        [
            count(joint.translation.sample_count(), 3),
            count(joint.rotation.sample_count(), 4),
            count(joint.scale.sample_count(), 3),
        ]
    };
    let (keys, numbers) = clip
        .joints()
        .iter()
        .flat_map(tracks)
        .fold((0, 0), |(keys, numbers), (more_keys, more)| (keys + more_keys, numbers + more));
    (keys, (numbers + clip.frame_count()) * size_of::<f32>())
}

/// Keeps the last frame of one track at least, as a clip is as long as its longest track.
fn keep_length(keys: &mut [JointKeys], clip: &Clip) {
    let last = clip.frame_count() - 1;
    let ends = |frames: &[usize]| frames.last() == Some(&last);
    if keys.iter().any(|keys| ends(&keys.translation.frames) || ends(&keys.rotation.frames) || ends(&keys.scale.frames))
    {
        return;
    }
    fn hold<T: Copy>(curve: &mut KeyCurve<T>, last: usize) -> bool {
        let Some(value) = curve.values.last().copied().filter(|_| last > 0) else { return false };
        curve.frames.push(last);
        curve.values.push(value);
        true
    }
    for keys in keys {
        if hold(&mut keys.translation, last) || hold(&mut keys.rotation, last) || hold(&mut keys.scale, last) {
            return;
        }
    }
}

/// For each joint the largest weighed error of it and all below.
fn below(skeleton: &Skeleton, errors: &[Off]) -> Vec<f64> {
    let mut largest: Vec<f64> = errors.iter().map(|off| off.weighed).collect();
    for joint in (0..skeleton.len()).rev() {
        if let Some(parent) = skeleton.parent(joint) {
            largest[parent] = largest[parent].max(largest[joint]);
        }
    }
    largest
}

/// For each joint how far the farthest point is that its rotation moves and that no joint below it takes back.
fn levers(clip: &Clip, skeleton: &Skeleton, shell: f64) -> Vec<f64> {
    let mut levers = vec![shell.max(f64::MIN_POSITIVE); skeleton.len()];
    for (index, joint) in skeleton.joints().iter().enumerate().rev() {
        let Some(parent) = joint.parent else { continue };
        let is_fitted = clip.joints()[index].rotation.sample_count().is_some();
        let beyond = if is_fitted { 0.0 } else { levers[index] };
        levers[parent] = levers[parent].max(joint.rest.translation.length() + beyond);
    }
    levers
}

/// In which frames joints are fitted how much finer.
struct Care {
    /// By the joint's own contacts; empty for one that has none.
    own: Vec<Vec<f64>>,
    /// By its own contacts and those of all joints below it.
    with_below: Vec<Vec<f64>>,
}

impl Care {
    fn of(clip: &Clip, skeleton: &Skeleton) -> Self {
        let mut own = vec![Vec::new(); skeleton.len()];
        for track in clip.contacts().iter().filter(|track| track.touches.contains(&true)) {
            own[track.joint] = track.touches.iter().map(|touches| if *touches { TOUCHING } else { 1.0 }).collect();
        }
        let mut with_below = own.clone();
        for joint in (0..skeleton.len()).rev() {
            let Some(parent) = skeleton.parent(joint) else { continue };
            if with_below[parent].is_empty() {
                with_below[parent] = with_below[joint].clone();
            } else {
                for frame in 0..with_below[joint].len() {
                    with_below[parent][frame] = with_below[parent][frame].max(with_below[joint][frame]);
                }
            }
        }
        Self { own, with_below }
    }

    fn own_at(&self, joint: usize, frame: usize) -> f64 {
        self.own[joint].get(frame).copied().unwrap_or(1.0)
    }
}

/// How far the points of a joint's shell are off.
#[derive(Clone, Copy, Debug, Default)]
struct Off {
    /// The most, and in which frame.
    most: (f64, usize),
    /// The most where frames in which the joint touches something count by as much more as they are fitted finer.
    weighed: f64,
}

/// All joints, fitted once.
struct Pass<'a> {
    clip: &'a Clip,
    skeleton: &'a Skeleton,
    levers: &'a [f64],
    care: &'a Care,
    shares: &'a [f64],
    tolerance: Tolerance,
}

struct Fitted {
    keys: Vec<JointKeys>,
    /// One for each joint.
    errors: Vec<Off>,
}

impl Fitted {
    fn is_within(&self, distance: f64) -> bool {
        self.errors.iter().all(|off| off.weighed <= distance)
    }

    fn worst(&self) -> Worst {
        let joints =
            self.errors.iter().enumerate().map(|(joint, Off { most: (error, frame), .. })| (*error, joint, *frame));
        joints.max_by(|first, second| first.0.total_cmp(&second.0)).unwrap_or_default()
    }
}

/// A joint in model space, frame by frame: as it was, and by its keys.
struct Motion {
    exact: Vec<Transform>,
    thin: Vec<Transform>,
    /// Whether both are the same.
    is_exact: bool,
}

impl Pass<'_> {
    fn run(&self, control: &Control) -> Result<Fitted, Canceled> {
        let count = self.skeleton.len();
        let mut fitted = Fitted { keys: Vec::with_capacity(count), errors: Vec::with_capacity(count) };
        let mut motions: Vec<Option<Arc<Motion>>> = Vec::with_capacity(count);
        let mut children: Vec<usize> = self.skeleton.children().iter().map(Vec::len).collect();
        for joint in 0..count {
            control.check()?;
            let parent = self.skeleton.parent(joint);
            let above = parent.and_then(|parent| motions[parent].clone());
            let (keys, motion) = self.joint(joint, above.as_deref());
            let mut off = Off::default();
            for (frame, (exact, thin)) in motion.exact.iter().zip(&motion.thin).enumerate().filter(|_| !motion.is_exact)
            {
                let error = self.error(exact, thin);
                if error > off.most.0 {
                    off.most = (error, frame);
                }
                off.weighed = off.weighed.max(error * self.care.own_at(joint, frame));
            }
            fitted.errors.push(off);
            fitted.keys.push(keys);
            motions.push((children[joint] > 0).then(|| Arc::new(motion)));
            // What has been handed to the last child is not needed any longer.
            if let Some(parent) = parent {
                children[parent] -= 1;
                if children[parent] == 0 {
                    motions[parent] = None;
                }
            }
        }
        Ok(fitted)
    }

    fn joint(&self, joint: usize, above: Option<&Motion>) -> (JointKeys, Motion) {
        let (tracks, rest) = (&self.clip.joints()[joint], self.skeleton.joints()[joint].rest);
        let times = self.clip.times_seconds();
        let place = |frame| tracks.translation.wide_at(frame, rest.translation);
        let turn = |frame| tracks.rotation.wide_at(frame, rest.rotation).normalize();
        let size = |frame| tracks.scale.wide_at(frame, rest.scale);
        let exact: Vec<Transform> = (0..times.len())
            .map(|frame| {
                let local = Transform { translation: place(frame), rotation: turn(frame), scale: size(frame) };
                above.map_or(local, |above| above.exact[frame].then_child(&local))
            })
            .collect();
        let distance = self.shares[joint] * self.tolerance.distance;
        let allowed = Allowed { distance, finer: &self.care.with_below[joint] };
        let fitted = |samples: Option<Vec<DVec4>>, allowed: Allowed<'_>, kind: Kind| {
            samples.map(|samples| fit(&samples, times, allowed, kind, self.tolerance.interpolation))
        };
        let lever = self.levers[joint];
        let translation = fitted(vectors(&tracks.translation), allowed, Kind::Vector);
        let scale = fitted(vectors(&tracks.scale), allowed.divided(lever), Kind::Vector);
        let rotation = fitted(turned_back(&tracks.rotation, above), allowed.divided(lever), Kind::Rotation);
        let is_exact = above.is_none_or(|above| above.is_exact)
            && [&translation, &scale, &rotation]
                .into_iter()
                .flatten()
                .all(|keys| keys.frames.len() == times.len() && keys.tangents.is_empty());
        let thin = if is_exact {
            exact.clone()
        } else {
            let mut places = translation.as_ref().map(|keys| keys.at_frames(times, Kind::Vector));
            let mut turns = rotation.as_ref().map(|keys| keys.at_frames(times, Kind::Rotation));
            let mut sizes = scale.as_ref().map(|keys| keys.at_frames(times, Kind::Vector));
            let local = |frame| Transform {
                translation: next(&mut places).map_or_else(|| place(frame), DVec4::truncate),
                rotation: next(&mut turns).map_or_else(|| turn(frame), DQuat::from_vec4),
                scale: next(&mut sizes).map_or_else(|| size(frame), DVec4::truncate),
            };
            let locals = (0..times.len()).map(local);
            match above {
                Some(above) => locals.zip(&above.thin).map(|(local, above)| above.then_child(&local)).collect(),
                None => locals.collect(),
            }
        };
        let keys = JointKeys {
            translation: curve(translation, |value| value.truncate().as_vec3()),
            rotation: curve(rotation, |value| DQuat::from_vec4(value).as_quat()),
            scale: curve(scale, |value| value.truncate().as_vec3()),
        };
        (keys, Motion { exact, thin, is_exact })
    }

    /// The most that a point at most so far from the joint moves between two placements of it.
    fn error(&self, exact: &Transform, thin: &Transform) -> f64 {
        let stretch = (exact.scale - thin.scale).abs().max_element();
        let largest = exact.scale.abs().max_element().max(1.0);
        let turned = Kind::Rotation.error(DVec4::from(exact.rotation), DVec4::from(thin.rotation));
        exact.translation.distance(thin.translation) + self.tolerance.shell * (turned * largest + stretch)
    }
}

fn next(values: &mut Option<impl Iterator<Item = DVec4>>) -> Option<DVec4> {
    values.as_mut().and_then(Iterator::next)
}

/// The rotations that turn a joint to where it was, below its parent as it has become.
fn turned_back(track: &Track<Quat>, above: Option<&Motion>) -> Option<Vec<DVec4>> {
    let Track::Sampled(values) = track else { return None };
    let Some(above) = above.filter(|above| !above.is_exact) else {
        return Some(values.iter().map(|value| DVec4::from(value.as_dquat())).collect());
    };
    let mut before: Option<DQuat> = None;
    let turns = above.thin.iter().zip(&above.exact).zip(values).map(|((thin, was), value)| {
        let turn = (thin.rotation.conjugate() * was.rotation * value.as_dquat()).normalize();
        let turn = before.map_or(turn, |before| near(turn, before));
        before = Some(turn);
        DVec4::from(turn)
    });
    Some(turns.collect())
}

fn vectors(track: &Track<Vec3>) -> Option<Vec<DVec4>> {
    let Track::Sampled(values) = track else { return None };
    Some(values.iter().map(|value| DVec3::extend(value.as_dvec3(), 0.0)).collect())
}

fn curve<T>(keys: Option<Keys>, value: impl Fn(DVec4) -> T) -> KeyCurve<T> {
    let Keys { frames, values, tangents } = keys.unwrap_or_default();
    KeyCurve {
        frames,
        values: values.into_iter().map(&value).collect(),
        tangents: tangents.into_iter().map(|pair| pair.map(&value)).collect(),
    }
}
